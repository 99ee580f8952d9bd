"""The equations of a one-step map: its unknowns, the rows they solve, and the growth of z.

An explicit map solves for the slope D in Z = z + hD, which is alone on its row; an implicit one for
the D at which its residual vanishes; one with stages for these. If ξ(x, μ) has no closed form, each
velocity in the map is an unknown too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from ..compiler import Kind, Step
from ..errors import BadInput, CannotMeasure, line_of
from ..numbers import replaced, shown, symbols_of, sympy
from ..numbers.types import Column, Expression, Letter, SymbolicMatrix
from ..rules import Discretisation
from ..scene import Scene
from .checks import singular
from .dual_system import DualSystem
from .step_equations import StepEquations
from .symbols import SceneSymbols, column, vector

#: operations of the result beyond which a step stays implicit: its text would cost more than an
#: iteration
MOST = 20_000


class OneStepEquations(StepEquations):
    """Objects derived from a scene's functions and a one-step map: symbolic, exact, without values.

    Raises `BadInput` if the map cannot be evaluated, gives another shape or contains unknown
    letters, and `CannotMeasure` if the scene has no vector field or the map does not exist on its
    groupoid.
    """

    def __init__(self, s: SceneSymbols, rule: Any) -> None:
        super().__init__(s, rule)
        size = len(self.state)
        main = [vector(f"zd{k}", size) for k in range(max(1, rule.stages))]
        self.view = DualSystem(s, main)
        self.scope = self.view.scope
        with_stages = rule.stages > 0
        self._place = line_of(rule.formula)
        if with_stages:
            answer = self._asked(self.state, self.h, main)
            pair = isinstance(answer, tuple) and len(answer) == 2
            if not pair or not hasattr(answer[1], "__len__") or len(answer[1]) != rule.stages:
                raise self._bad(f"has stages: return Z, [{rule.stages} residuals]")
            rows = column([e for part in answer[1] for e in self._state(part, "a residual")])
            new = self._state(answer[0], "Z")
        else:
            D, new = main[0], self.state + self.h * main[0]
            if rule.implicit:
                rows = self._state(self._asked(self.state, new, self.h), "its residual")
                rows = over(rows, self.h)
            else:
                value = self._state(self._asked(self.state, self.h), "Z")
                rows = D - over(value - self.state, self.h)
        velocities = self.view.velocities
        self.explicit = not (rule.stages or rule.implicit or velocities)
        self.unknowns: list[tuple[Kind, Column]] = [("slope", part) for part in main]
        self.unknowns += [("velocity", part) for part in velocities]
        self.rows = column([e for part in (rows, *self.view.velocity_rows) for e in part])
        if s.degenerate and not self.explicit:
            # unknowns that are x/h: differences of ϑ are known to the round-off of x alone, so
            # slopes are too, and near an equilibrium Newton's method would look for a smaller one
            floor = vector("zx", len(s.x))
            self.unknowns.append(("place", floor))
            self.rows = self.rows.col_join(floor - s.x / s.h)
        if s.degenerate:  # μ is ϑ(x), for any start
            new = column([*new, *self.view.letters(self.view.theta(new))])
        self.increment = new - self.z
        self._new = new
        self._check_letters()

    @cached_property
    def step(self) -> Step:
        """One step as data; it is explicit too where rows give their unknowns one after another."""
        formulas = None
        if not self.explicit and all(kind != "velocity" for kind, _ in self.unknowns):
            known = self.graph.letters_below([*self.rows, *self.increment])
            formulas = explicit_rows(self.rows, self.w, self._new, self.z, self.y, known)
        if formulas is None:
            return super().step
        w, values, increment, gain = formulas
        return self._step(
            w=tuple(w), rows=w - values, slope=sympy.eye(len(w)), increment=increment, gain=gain,
            wanted=tuple(0 * w), explicit=True,
        )  # fmt: skip

    def check_regular(self, scene: Scene, rule: Discretisation) -> None:
        """Raise `BadInput` if the rows do not determine w: ∂rows/∂w singular at two points."""
        slopes = (part for kind, part in self.unknowns if kind == "slope")
        alike = [dict(zip(part, self.state, strict=True)) for part in slopes]
        directions = singular({"": self.slope}, self.s, self.z, self.w, scene, self.graph, alike)
        if not directions:
            return
        unknowns = "its stages" if self.rule.stages else "the new Z"
        raise self._bad(
            f"does not determine {unknowns}: its residual is singular in the direction "
            f"({shown(directions[''])})"
        )

    # -- asking the map --------------------------------------------------------------------------

    def _asked(self, *arguments: Column | Letter | list[Column]) -> Any:
        return self.s.evaluated(self.rule.formula, f"map {self.rule.name}", self.view, *arguments)

    def _state(self, answer: Any, what: str) -> Column:
        """Return a column of n+m expressions; raises `BadInput` for any other shape."""
        shape = getattr(answer, "shape", None)
        # an array without axes has no entries
        several = hasattr(answer, "__iter__") if shape is None else shape
        entries = list(answer) if several else [answer]
        size = len(self.state)
        if len(entries) != size or (shape is not None and 1 not in shape):
            form = f"{'×'.join(map(str, shape))}" if shape else f"{len(entries)}"
            form = "None" if answer is None else f"of shape {form}"
            parts = f"{len(self.x)} of x and {len(self.u)} of μ"
            state = f"(x, μ) has {size} entries, {parts}"
            state = f"x has {size} entries" if self.s.degenerate else state
            raise self._bad(f"gives {what} {form}; a state {state}")
        if any(hasattr(e, "shape") or isinstance(e, list | tuple) for e in entries):
            raise self._bad(f"gives {what} as a list of columns; give one column of {size} numbers")
        scalars = self.s.scalars(entries, f"map {self.rule.name}: {what}", self.rule.formula)
        try:
            return self.view.letters(scalars)
        except BadInput as error:
            raise self._bad(f"cannot be used: {error}") from None

    def _bad(self, what: str) -> BadInput:
        place = f"{self._place}: " if self._place else ""
        return BadInput(f"{place}{self.s.name}: map {self.rule.name} {what.rstrip('.')}.")

    def _check_letters(self) -> None:
        symbols = self.graph.symbols([*self.rows, *self.increment])
        unknown = symbols - {*self.z, *self.w, *self.s.q}
        if unknown:
            raise self._bad(
                f"holds the unknown symbol {min(map(str, unknown))}; write it with z, h and what "
                "s gives"
            )

    def refused(self, name: str) -> CannotMeasure:
        """Return the refusal of `name`, which only a discrete Lagrangian has."""
        words = "is a one-step map without a discrete Lagrangian"
        return CannotMeasure(f"{self.rule.name} {words}: it has no {name}.")


def over(matrix: SymbolicMatrix, h: Expression) -> SymbolicMatrix:
    """Return matrix/h term by term, so that powers of h cancel before they are ever rounded."""
    return matrix.applyfunc(lambda e: sympy.Add(*[t / h for t in sympy.Add.make_args(e)]))


def explicit_rows(
    rows: Column, w: Column, new: Column, z: Column, y: Column, known: Mapping[Letter, Expression]
) -> tuple[Column, Column, Column, Column] | None:
    """Return (w, values of w, increment, gain), or None if some unknown has to be solved for.

    A row w − g(…) = 0 gives w, if g needs only unknowns that other rows give before. If all rows
    are such rows, in some order, as the stages of Störmer–Verlet on a separable scene are, the step
    is explicit: g is written out in the state alone, increment and gain in w, the state and y. A
    function of x alone, such as a force, is no unknown then: a kernel has its costly functions from
    the step before.

    new: the state after the step, z before, y: letters of the first entries of the new one; known:
    the values of other letters.
    """
    values = dict(known)
    definitions: dict[Letter, Expression] = {}
    for letter, row in zip(w, rows, strict=True):
        rest = letter - row
        if letter in symbols_of([rest]):
            return None
        definitions[letter] = rest
    solutions = _written_out(list(w), values | definitions, {})
    if solutions is None:
        return None
    moving = {*z[len(y) :]}
    kept = [e for e, value in zip(w, solutions, strict=True) if symbols_of([value]) & moving]
    if not kept:
        return None
    values |= {e: value for e, value in zip(w, solutions, strict=True) if e not in kept}
    grown = [a - b for a, b in zip(new, z, strict=True)]
    n = len(y)
    increment = _written_out(grown[:n], values, {})
    if increment is None:
        return None
    # the end point of a step is y, whose functions the next step needs again
    ends = {a + e: b for a, e, b in zip(z, increment, y, strict=False)}
    gain = _written_out(grown[n:], values, ends)
    if gain is None:
        return None
    formulas = dict(zip(w, solutions, strict=True))
    return column(kept), column(formulas[e] for e in kept), column(increment), column(gain)


def _written_out(
    wanted: Sequence[Expression], values: dict[Letter, Expression],
    named: dict[Expression, Expression],
) -> list[Expression] | None:  # fmt: skip
    """Return expressions without the letters that have values; None if recursive, or too long.

    named: values that have letters of their own.
    """
    known: dict[Expression, Expression] = {}
    pending: set[Letter] = set()

    def of(letter: Letter) -> Expression | None:
        if letter not in known:
            if letter in pending:  # it needs itself
                return None
            pending.add(letter)
            if not all(of(e) is not None for e in symbols_of([values[letter]]) & values.keys()):
                return None
            value = replaced([values[letter]], known.copy())[0]
            known[letter] = named.get(value, value)
        return known[letter]

    for e in symbols_of(wanted) & values.keys():
        if of(e) is None:
            return None
    expressions = replaced(wanted, known.copy())
    return expressions if sum(sympy.count_ops(e) for e in expressions) <= MOST else None
