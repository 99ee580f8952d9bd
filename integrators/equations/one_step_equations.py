"""The equations of a one-step map: its unknowns, the rows they solve, and the growth of z.

An explicit map solves for the slope D in Z = z + hD, which is alone on its row; an implicit one for
the D at which its residual vanishes; one with stages for these. If ξ(x, μ) has no closed form, each
velocity in the map is an unknown too.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..compiler import Kind, Step
from ..errors import BadInput, CannotMeasure, line_of
from ..numbers import Node, shown, sympy
from ..numbers.types import Column, Letter
from ..rules import Discretisation
from ..scene import Scene
from .checks import singular
from .dual_system import DualSystem
from .step_equations import StepEquations
from .symbols import SceneSymbols, vector

#: expressions of the result beyond which a step stays implicit: its text would cost more than an
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
        self._place = line_of(rule.formula)
        graph, h = self.graph, self.graph.read(s.h)
        D = graph.letters(main[0])
        end = self.state + self.h * main[0]
        if rule.stages:
            answer = self._asked(self.state, self.h, main)
            pair = isinstance(answer, tuple) and len(answer) == 2
            if not pair or not hasattr(answer[1], "__len__") or len(answer[1]) != rule.stages:
                raise self._bad(f"has stages: return Z, [{rule.stages} residuals]")
            rows = [e for part in answer[1] for e in self._state(part, "a residual")]
            new = self._state(answer[0], "Z")
        elif rule.implicit:
            rows = self._state(self._asked(self.state, end, self.h), "its residual", over=self.h)
        else:
            value = self._state(self._asked(self.state, self.h), "Z")
            grown = graph.minus(value, graph.letters(self.state))
            rows = graph.minus(D, [graph.divided(e, h) for e in grown])
        if not rule.stages:
            new = graph.column(end)
        velocities = self.view.velocities
        self.explicit = not (rule.stages or rule.implicit or velocities)
        self.unknowns: list[tuple[Kind, Column]] = [("slope", part) for part in main]
        self.unknowns += [("velocity", part) for part in velocities]
        self.rows = [*rows, *graph.column(e for part in self.view.velocity_rows for e in part)]
        if s.degenerate and not self.explicit:
            # unknowns that are x/h: differences of ϑ are known to the round-off of x alone, so
            # slopes are too, and near an equilibrium Newton's method would look for a smaller one
            floor = vector("zx", len(s.x))
            self.unknowns.append(("place", floor))
            self.rows += graph.column(floor - s.x / s.h)
        if s.degenerate:  # μ is ϑ(x), for any start
            end = graph.shown_column(new)
            new += graph.column(self.view.letters(self.view.theta(end)))
        self.increment = graph.minus(new, graph.letters(self.z))
        self._check_letters()

    @cached_property
    def step(self) -> Step:
        """One step as data; it is explicit too where rows give their unknowns one after another."""
        formulas = None
        if not self.explicit and all(kind != "velocity" for kind, _ in self.unknowns):
            formulas = self._formulas()
        if formulas is None:
            return super().step
        w, values, increment, gain = formulas
        return self._step(
            w=tuple(map(self.graph.shown, w)), rows=self.graph.minus(w, values),
            slope=sympy.eye(len(w)).tolist(), increment=increment, gain=gain,
            wanted=(0,) * len(w), explicit=True,
        )  # fmt: skip

    def _formulas(self) -> tuple[list[Node], list[Node], list[Node], list[Node]] | None:
        """Return (w, values of w, increment, gain), or None if some unknown has to be solved for.

        A row w − g(…) = 0 gives w, if g needs only unknowns that other rows give before. If all
        rows are such rows, in some order, as the stages of Störmer–Verlet on a separable scene are,
        the step is explicit: g is written out in the state alone, increment and gain in w, the
        state and y. A function of x alone, such as a force, is no unknown then: a kernel has its
        costly functions from the step before.
        """
        graph, x, y = self.graph, *map(self.graph.letters, (self.x, self.s.y))
        w = graph.letters(self.w)
        left = dict(zip(w, graph.unheld(graph.minus(w, self.rows)), strict=True))
        solutions: dict[int, Node] = {}
        while left:
            unknown = {e.args for e in left}
            ready = [e for e, g in left.items() if not graph.symbols([g]) & unknown]
            values = graph.rebuilt([left.pop(e) for e in ready], solutions)
            if not ready or len(graph.order(values)) > MOST:
                return None
            solutions |= {e.index: g for e, g in zip(ready, values, strict=True)}
        moving = {*self.z[len(x) :]}
        kept = [e for e in w if graph.symbols([solutions[e.index]]) & moving]
        if not kept:
            return None
        others = {i: g for i, g in solutions.items() if graph.nodes[i] not in kept}
        increment = graph.unheld(self.increment[: len(x)], others)
        # the end point of a step is y, whose functions the next step needs again
        ends = dict(zip(graph.plus(x, increment), y, strict=True))
        gain = graph.unheld(self.increment[len(x) :], others, ends)
        return kept, [solutions[e.index] for e in kept], increment, gain

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

    def _asked(self, *arguments: Column | Letter | list[Column]) -> Any:
        return self.s.evaluated(self.rule.formula, f"map {self.rule.name}", self.view, *arguments)

    def _state(self, answer: Any, what: str, over: Letter = 1) -> list[Node]:
        """Return n+m expressions, divided term by term; raises `BadInput` for any other shape."""
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
            sums = map(sympy.Add.make_args, self.view.letters(scalars))
            return [self.graph.read(sympy.Add(*[e / over for e in terms])) for terms in sums]
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
