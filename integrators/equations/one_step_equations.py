"""The equations of a one-step map: its unknowns, the rows they solve, and the growth of z.

An explicit map solves for the slope D in Z = z + hD, which is alone on its row; an implicit one for
the D at which its residual vanishes; one with stages for these. If ξ(x, μ) has no closed form, each
velocity in the map is an unknown too.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..compiler import Kind, Step, kinds_of
from ..errors import BadInput, CannotMeasure, line_of
from ..numbers import Definition, needed, shown, symbols_of, sympy
from ..numbers.types import Column, Expression, Expressions, SymbolicMatrix
from ..rules import OneStepMap
from .checks import singular
from .dual_system import DualSystem
from .explicit_rows import ExplicitRows, explicit_rows
from .symbols import SceneSymbols, column, vector


class OneStepEquations:
    """Objects derived from a scene's functions and a one-step map: symbolic, exact, without values.

    Attributes: x, u, y, h and `s` with the parameters' letters, as in `DiscreteEquations`; w, the
    unknowns; rows, which vanish at them; increment, Z − z ((n+m)×1). Raises `BadInput` if the map
    cannot be evaluated, gives another shape or contains unknown letters, and `CannotMeasure` if the
    scene has no vector field or the map does not exist on its groupoid.
    """

    element = None
    #: unknowns behind u in a run's rows
    multipliers: Any = ()
    #: a mark of these equations on disk (`DiscreteEquations.altered`)
    mark = ""

    def __init__(self, s: SceneSymbols, rule: OneStepMap) -> None:
        self.s, self.rule, self.groupoid = s, rule, s.groupoid
        self.x, self.u, self.y, self.h = s.x, s.u, s.y, s.h
        self.z = column([*s.x, *s.mu])
        #: the state of the map: only x for a degenerate Lagrangian
        self.state = s.x if s.degenerate else self.z
        size = len(self.state)
        main = [vector(f"zd{k}", size) for k in range(max(1, rule.stages))]
        self.view = DualSystem(s, main)
        with_stages = rule.stages > 0
        self._place = line_of(rule.formula)
        if with_stages:
            given = self._asked(self.state, self.h, main)
            pair = isinstance(given, tuple) and len(given) == 2
            if not pair or not hasattr(given[1], "__len__") or len(given[1]) != rule.stages:
                raise self._bad(f"has stages: return Z, [{rule.stages} residuals]")
            rows = column([e for part in given[1] for e in self._state(part, "a residual")])
            new = self._state(given[0], "Z")
        else:
            D, new = main[0], self.state + self.h * main[0]
            if rule.implicit:
                rows = self._state(self._asked(self.state, new, self.h), "its residual")
                rows = over(rows, self.h)
            else:
                value = self._state(self._asked(self.state, self.h), "Z")
                rows = D - over(value - self.state, self.h)
        #: columns of unknowns, each of which starts at f(z), then those that start at ξ(z)
        self.slopes, self.velocities = main, self.view.velocities
        self.w = column([e for part in (*main, *self.velocities) for e in part])
        self.rows = column([e for part in (rows, *self.view.velocity_rows) for e in part])
        #: unknowns that are x/h: differences of ϑ are known to the round-off of x alone, so slopes
        #: are too, and near an equilibrium Newton's method would look for a smaller one
        self.floor = column(())
        if s.degenerate and not self.explicit:
            self.floor = vector("zx", len(s.x))
            self.w = self.w.col_join(self.floor)
            self.rows = self.rows.col_join(self.floor - s.x / s.h)
        if s.degenerate:  # μ is ϑ(x), for any start
            new = column([*new, *self.view.letters(self.view.theta(new))])
        #: blocks of w with their kinds
        self.unknowns: list[tuple[Kind, Column]] = [
            *[("slope", part) for part in main],
            *[("velocity", part) for part in self.velocities],
            ("place", self.floor),
        ]
        self.increment = new - self.z
        self._new = new
        self._check_letters()

    # -- derivatives -----------------------------------------------------------------------------

    @property
    def explicit(self) -> bool:
        """True if a step solves no equation."""
        return not (self.rule.stages or self.rule.implicit or self.velocities)

    @cached_property
    def slope(self) -> SymbolicMatrix:
        """∂(rows)/∂w, square."""
        return self.total(self.rows, self.w)

    def total(self, entries: Column, variable: Column) -> SymbolicMatrix:
        """Return d(entries)/d(variable) through all letters; the variable is w or z."""
        return self.view.scope.total(entries, variable)

    def definitions(self, *uses: Expressions) -> list[Definition]:
        """Return the definitions of the letters in the expressions, in order."""
        return needed(self.view.scope.definitions(), [e for use in uses for e in use])

    @cached_property
    def fields(self) -> tuple[Any, ...]:
        """The parts of the Poisson tensor."""
        return self.groupoid.rho(self.x, self.h), *self.groupoid.structure_functions(self.x, self.h)

    @cached_property
    def _explicit_rows(self) -> ExplicitRows | None:
        """Rows that give their unknowns one after another; None if a step solves an equation."""
        # equations with multipliers have no velocities
        if self.multipliers or self.explicit or self.velocities:
            return None
        known = self.definitions(self.rows, self.increment)
        return explicit_rows(self.rows, self.w, self._new, self.z, self.y, known)

    @cached_property
    def system(self) -> Step:
        """One step as data for the compiler."""
        n, s = len(self.x), self.s
        if (found := self._explicit_rows) is not None:
            return Step(
                name=s.name,
                q=tuple(s.q),
                x=tuple(s.x),
                u=tuple(s.u),
                w=tuple(found.w),
                mu=tuple(s.mu),
                y=tuple(s.y),
                rows=found.w - found.values,
                slope=sympy.eye(len(found.w)),
                increment=found.increment,
                gain=found.gain,
                wanted=tuple(sympy.zeros(len(found.w), 1)),
                explicit=True,
                constants=dict(s.constants),
            )
        return Step(
            name=s.name,
            q=tuple(s.q),
            x=tuple(s.x),
            u=tuple(s.u),
            w=tuple(self.w),
            mu=tuple(s.mu),
            y=tuple(s.y),
            rows=self.rows,
            slope=self.slope,
            increment=self.increment[:n, :],
            gain=self.increment[n:, :],
            definitions=tuple(self.definitions(self.rows, self.slope, self.increment)),
            wanted=tuple(sympy.zeros(len(self.w), 1)),
            explicit=self.explicit,
            kinds=kinds_of(*self.unknowns),
            constants=dict(s.constants),
        )

    def check_regular(self, scene: Any) -> None:
        """Raise `BadInput` if the rows do not determine w: ∂rows/∂w singular at two points."""
        known = self.definitions(self.slope)
        alike = [dict(zip(part, self.state, strict=True)) for part in self.slopes]
        found = singular({"": self.slope}, self.s, self.z, self.w, scene, known, alike)
        if not found:
            return
        unknowns = "its stages" if self.rule.stages else "the new Z"
        raise self._bad(
            f"does not determine {unknowns}: its residual is singular in the direction "
            f"({shown(found[''])})"
        )

    # -- asking the map --------------------------------------------------------------------------

    def _asked(self, *arguments: Any) -> Any:
        return self.s.evaluated(self.rule.formula, f"map {self.rule.name}", self.view, *arguments)

    def _state(self, given: Any, what: str) -> Column:
        """Return a column of n+m expressions; raises `BadInput` for any other shape."""
        shape = getattr(given, "shape", None)
        # an array without axes has no entries
        several = hasattr(given, "__iter__") if shape is None else shape
        entries = list(given) if several else [given]
        size = len(self.state)
        if len(entries) != size or (shape is not None and 1 not in shape):
            found = f"{'×'.join(map(str, shape))}" if shape else f"{len(entries)}"
            found = "None" if given is None else f"of shape {found}"
            parts = f"{len(self.x)} of x and {len(self.u)} of μ"
            state = f"(x, μ) has {size} entries, {parts}"
            state = f"x has {size} entries" if self.s.degenerate else state
            raise self._bad(f"gives {what} {found}; a state {state}")
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
        used = self.definitions(self.rows, self.increment)
        symbols = symbols_of([*self.rows, *self.increment]) | {e for d in used for e in d.holds}
        letters = {letter for d in used for letter in d.letters}
        unknown = symbols - letters - {*self.z, *self.w, *self.s.q}
        if unknown:
            raise self._bad(
                f"holds the unknown symbol {min(map(str, unknown))}; write it with z, h and what "
                "s gives"
            )

    def __getattr__(self, name: str) -> Any:
        """Raise `CannotMeasure` for an attribute that only a discrete Lagrangian has."""
        if name.startswith("_") or "rule" not in self.__dict__:
            raise AttributeError(name)
        raise CannotMeasure(self._without(name))

    def _without(self, name: str) -> str:
        return (
            f"{self.rule.name} is a one-step map without a discrete Lagrangian: it has no {name}."
        )


def over(matrix: SymbolicMatrix, h: Expression) -> SymbolicMatrix:
    """Return matrix/h term by term, so that powers of h cancel before they are ever rounded."""
    return matrix.applyfunc(lambda e: sympy.Add(*[t / h for t in sympy.Add.make_args(e)]))
