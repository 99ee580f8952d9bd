"""One step and the exact flow as power series in the step, for a random scene of a class, in F_p.

The coefficients of (one step − flow) are rational functions of the derivatives of the Lagrangian at
the state; here they are evaluated without rounding. One that is not 0 disproves an order for the
whole class.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from discmech.integrators import Discretisation, Scene, Scheme
from discmech.integrators.equations import (
    answers_of,
    closed_velocity,
    mass_matrix,
    momentum,
    rates,
)
from discmech.integrators.extensions.expansions import (
    NotConsistent,
    NotExpanded,
    NotKnown,
    Series,
    StepSeries,
    series_function,
)
from discmech.integrators.numbers import (
    NotRational,
    PrimeField,
    Residue,
    numeric_text,
)
from discmech.integrators.numbers.types import Function

from .constants import Numbers
from .letters import Told

MOST_LOST = 4  # powers of h that quotients 0/0 may take away
MOST_STATES = 99  # more than polynomials of any degree here are for
Row = list[Residue]


@dataclass(frozen=True)
class Gaps:
    """What a step and the flow differ by: rows[k] are the components of h^k; names: theirs."""

    names: tuple[str, ...]
    rows: list[Row]

    @property
    def order(self) -> int:
        """The last power of h up to which all components are 0."""
        return (
            next((k for k, row in enumerate(self.rows) if any(e != 0 for e in row)), len(self.rows))
            - 1
        )

    @classmethod
    def of(cls, names: Sequence[str], gaps: Sequence[Any], field: PrimeField, power: int) -> Gaps:
        """Return the gaps of series, up to a power."""
        return cls(
            tuple(names), [[field.number(_at(e, k)) for e in gaps] for k in range(power + 1)]
        )

    @property
    def missed(self) -> tuple[str, ...]:
        """The names of the components that differ at the first power with a difference."""
        k = self.order + 1
        row = self.rows[k] if k < len(self.rows) else []
        return tuple(name for name, e in zip(self.names, row, strict=False) if e != 0)


_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def from_one(name: str) -> str:
    """Return the letter of a formula for a symbol whose index counts from 0: x₁ for x_0."""
    letter, _, index = name.rpartition("_")
    letter = {"mu": "μ"}.get(letter, letter)
    return f"{letter}{int(index) + 1}".translate(_SUBSCRIPTS) if index.isdigit() else name


class Comparison:
    """A rule's steps on the scenes of a class, derived once, and compared with the flow often.

    scene: with letters for all coefficients, its parameters. Raises `BadInput` like `Scheme`.
    """

    def __init__(self, scene: Scene, rule: Discretisation) -> None:
        scheme = Scheme(scene, rule)
        self.scheme, self.parts = scheme, scheme.flow(scene.step).parts
        self.substeps = scheme.substeps
        self.s = self.parts[0].equations.s
        #: the callables of all constants of the rule, part by part
        self.constants = [
            [c.value for c in part.equations.s.constants.values()] for part in self.parts
        ]
        self.told: Told = getattr(rule.of_step.formula, "told", Told())
        #: of the last step: powers of h that quotients took away, and where L or H was asked for
        self.lost = 0
        self.states = set[tuple[float, ...]]()
        #: the entries of (∂rows/∂unknowns)⁻¹ at h = 0
        self.inverses = list[Any]()

    def reach(self, still: bool) -> tuple[float, int]:
        """Return the derivatives of L beyond the power of h, and at how many states they are taken.

        still: True where only the places of the states matter, as L is a polynomial in v anyway.
        """
        taken = self.lost + self.told.taken
        places = {e[: len(self.s.x)] for e in self.states} if still else self.states
        return taken + 1 if taken else 0, len(places)

    @property
    def is_tree_sum(self) -> bool:
        """True if L_d is h Σ b_i L(x + h w_i, ξ_i), w_i and ξ_i − u linear in u and the stages.

        Then errors are contractions of trees (docs/proofs.md).
        """
        of = getattr(self.parts[0].equations.discrete, "of", None)
        if of is None or not of.weighted or not self.s.groupoid.canonical or self.s.clocked:
            return False
        n, u, stages = len(self.s.x), list(self.s.u), list(self.s.stages)
        columns = self.s.stage_columns

        def linear(entries: Sequence[Any], share: Any) -> bool:
            """Return whether entry i is c u_i + Σ_j q_j s_j,i with numbers c (share) and q_j."""
            first = [entries[0].diff(e[0]) for e in (self.s.u, *columns)]
            numbers = not any(e.free_symbols & {*self.s.x, *u, *stages, self.s.h} for e in first)
            parts = list(zip(first, (self.s.u, *columns), strict=True))
            left = [e - sum(c * part[i] for c, part in parts) for i, e in enumerate(entries)]
            return numbers and share in (None, first[0]) and all(e.expand() == 0 for e in left)

        for weight, call in of.asked:
            point, rest = call.args[:n], answers_of(call.args[:n], of.G.Target)
            straight = tuple(point) == tuple(self.s.x)
            if rest is not None and tuple(rest[:n]) == tuple(self.s.x):
                straight = linear([e * rest[-1] / self.s.h for e in rest[n:-1]], None)
            only_h = not (weight / self.s.h).has(self.s.h, *self.s.x, *u, *stages)
            if not (straight and only_h and linear(call.args[n:], 1)):
                return False
        return True

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the components of a state, counted from 1 as in formulas."""
        return tuple(from_one(str(e)) for e in (*self.s.x, *self.s.mu))

    def gaps(
        self, numbers: Numbers, draw: random.Random, power: int, kept: Sequence[bool] | None = None
    ) -> Gaps:
        """Return what a step and the flow differ by, for random coefficients at a random state.

        kept: the coefficients of the class that are not 0. Raises `NotExpanded` where a step of
        length 0 is not found, `NotRational` for what is not in the field.
        """
        p, exact, at = self.drawn(numbers, draw, power, kept)
        z, _ = self.stepped(numbers, p, at, power)
        flow = [Series(e, 0, power + 1) for e in exact]
        gaps = [a - b for a, b in zip(z, flow, strict=True)]
        return Gaps.of(self.names, gaps, numbers.field, power)

    def drawn(
        self, numbers: Numbers, draw: random.Random, power: int, kept: Sequence[bool] | None = None
    ) -> tuple[Row, list[Row], list[Row]]:
        """Return random coefficients, the flow from a random state, and (state, ξ, rates)."""
        field, s = numbers.field, self.s
        p = field.random(len(s.parameter_list), draw)
        p = [e if e_kept else field.number(0) for e, e_kept in zip(p, kept or [True] * len(p),
                                                                   strict=True)]  # fmt: skip
        x, other = field.random(len(s.x), draw), field.random(len(s.u), draw)
        exact, xi = Flow.of(s, field)(x, other, p, power)
        return p, exact, [[e[0] for e in exact], xi, [e[1] for e in exact]]

    def stepped(
        self, numbers: Numbers, p: Row, at: Sequence[Row], power: int,
        signs: Sequence[int] = (1,), slopes: bool = False,
    ) -> tuple[list[Series | Residue], Any]:  # fmt: skip
        """Return the state after steps ±h as series, and, with slopes, its derivative by the start.

        at: the state, its velocity, its rates.
        """
        for self.lost in range(MOST_LOST):
            try:
                return self._with(numbers, p, at, power, self.lost, signs, slopes)
            except NotKnown:
                continue
        self.lost = MOST_LOST
        return self._with(numbers, p, at, power, MOST_LOST, signs, slopes)

    def _with(
        self, numbers: Numbers, p: Row, at: Sequence[Row], power: int, lost: int,
        signs: Sequence[int], slopes: bool,
    ) -> Any:  # fmt: skip
        z, n, derivative = list(at[0]), len(self.s.x), None
        xi = [] if self.parts[0].equations.discrete is None else at[1]
        start = [*z[: n if xi else None], *xi]
        self.states, self.inverses = {tuple(e.v for e in start)}, []
        h = Series.variable(power + lost + 1, numbers.field.number(1))
        sizes = numbers.sizes(self.scheme, self.substeps)
        every = [*zip(self.parts, self.constants, sizes, strict=True)]
        for sign, (part, constants, size) in itertools.product(signs, every):
            q, steps = (
                [h * (size * sign), *p, *map(numbers, constants)],
                StepSeries(part, numbers.field),
            )
            x, mu, w = self._part(steps, z[:n], z[n:], q, at, power, lost)
            self.states |= self._states(steps, z, w, q)
            self.inverses += map(numbers.field.number, steps.inverse.flat)
            if slopes:
                own = steps.derivative(z[:n], z[n:], w, q, power)
                derivative = own if derivative is None else own @ derivative
            z = [*x, *mu]
        return z, derivative

    def _part(
        self, steps: StepSeries, x: Row, mu: Row, q: Any, at: Sequence[Row], power: int, lost: int
    ) -> Any:
        """Return a substep from the start that solves a step of length 0: stages 0, ξ, or μ."""
        (z, xi, rate), s = at, steps.equations.s
        m, count = len(s.u), len(s.stages)
        momenta = z[len(z) - m :]
        for stage in ([steps.numbers.number(0)] * m, xi, momenta):
            starts = {"velocity": xi, "slope": rate, "stage": stage * (count // max(m, 1))}
            w = list[Residue]()
            for kind, letters in steps.equations.unknowns:
                w += (starts[kind] * len(letters))[: len(letters)]
            try:
                return steps(x, mu, q, w, power, lost)
            except NotConsistent:
                raise
            except NotExpanded as error:
                refused = error
        kinds = {kind for kind, letters in steps.equations.unknowns if len(letters)}
        if len(s.x) and kinds == {"velocity"}:
            # then x′ = x + hu + … does not begin with the motion's own velocity
            raise NotConsistent("the velocity at h = 0 is not that of the motion.")
        raise refused

    def _states(self, steps: StepSeries, z: Any, w: Any, q: Any) -> set[tuple[float, ...]]:
        """Return the states (x, v) or (x, μ) at which a step of length 0 asks for L or H."""
        equations, field = steps.equations, steps.numbers
        asked = self.told.places if equations.discrete else equations.view.places
        if not asked:
            return set()
        of = _at_states(equations, tuple(map(tuple, asked)), field)
        n = len(self.s.x)
        try:
            *states, _ = of(z[:n], z[n:], w, q)
            return {tuple(field.number(_finite(e)).v for e in state) for state in states}
        except (ZeroDivisionError, NotKnown, NotRational):  # not known, and so any number of them
            return {(math.nan, float(k)) for k in range(MOST_STATES)}


@lru_cache(maxsize=64)
def _at_states(equations: Any, asked: tuple[Any, ...], field: PrimeField) -> Function:
    s = equations.s
    letters = {"x": s.x, "mu": s.mu, "w": equations.w, "q": s.q}
    text = numeric_text(letters, [*map(list, asked), []], equations.graph)
    return series_function(text, field)


def _finite(e: Any) -> Any:
    """Return the constant term of a series; raises `ZeroDivisionError` for a pole."""
    return e.constant() if isinstance(e, Series) and any(c != 0 for c in e.c) else _at(e, 0)


class Flow:
    """The motion of a scene's symbols as power series in time, by the continuous equations."""

    def __init__(self, s: Any, field: PrimeField) -> None:
        self.s, self.field = s, field
        self.closed = closed_velocity(s) if s.hamiltonian is not None else None
        letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
        results: list[Any] = [list(rates(s))]
        if self.closed is None:
            results += [list(momentum(s)), mass_matrix(s)]
        else:
            results += [list(self.closed)]
        self.function = series_function(numeric_text(letters, results), field)

    @staticmethod
    @lru_cache(maxsize=64)
    def of(s: Any, field: PrimeField) -> Flow:
        """Return the flow, made once."""
        return Flow(s, field)

    def __call__(self, x: Row, other: Row, p: Row, power: int) -> tuple[list[Row], Row]:
        """Return the coefficients of each entry of (x, μ) up to a power, and ξ at the start.

        other: the velocity at the start, or the momentum where the scene has a Hamiltonian.
        """
        if self.closed is not None:
            return self._of_hamiltonian(x, other, p, power)
        of, none, number = self.function, [0] * len(other), self.field.number
        inverse = _inverse(of(x, other, none, p)[2], self.field)
        n, xi = len(x), [[e] for e in other]
        z = [[number(e)] for e in (*x, *of(x, other, none, p)[1])]
        for k in range(power):
            zs, us = ([Series(e, 0, k + 1) for e in part] for part in (z, xi))
            rate = of(zs[:n], us, zs[n:], p)[0]
            for e, slope in zip(z, rate, strict=True):
                e.append(number(_at(slope, k)) / (k + 1))
            zs, us = ([Series(e, 0, k + 2) for e in part] for part in (z, xi))
            known = of(zs[:n], us, zs[n:], p)[1]  # μ without the next power of the velocity
            left = [a[k + 1] - _at(b, k + 1) for a, b in zip(z[n:], known, strict=True)]
            for e, row in zip(xi, inverse, strict=True):
                e.append(sum((a * b for a, b in zip(row, left, strict=True)), start=number(0)))
        return z, list(other)

    def _of_hamiltonian(self, x: Row, mu: Row, p: Row, power: int) -> tuple[list[Row], Row]:
        of, n, number = self.function, len(x), self.field.number
        z = [[number(e)] for e in (*x, *mu)]
        xi = [number(e) for e in of(x, [0] * len(mu), mu, p)[1]]
        for k in range(power):
            zs = [Series(e, 0, k + 1) for e in z]
            speed = of(zs[:n], [0] * len(mu), zs[n:], p)[1]
            for e, slope in zip(z, of(zs[:n], list(speed), zs[n:], p)[0], strict=True):
                e.append(number(_at(slope, k)) / (k + 1))
        return z, xi


def _inverse(rows: Any, field: PrimeField) -> list[Row]:
    """Return the inverse of a matrix; raises `ZeroDivisionError` if it is singular."""
    from flint import nmod_mat

    size = len(rows)
    entries = [field.number(e).v for row in rows for e in row]
    inverse = nmod_mat(size, size, entries, field.p).inv()
    return [[field.number(int(e)) for e in row] for row in inverse.table()]


def _at(e: Any, k: int) -> Any:
    """Return the coefficient of h^k of a series or a constant."""
    return e.coefficient(k) if isinstance(e, Series) else e if k == 0 else 0
