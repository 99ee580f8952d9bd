"""Short pieces of exact motion from any state of a scene, and states along its own motion.

One step of a method is compared with the exact motion from the same state. Such a short piece is
one local Taylor polynomial of the continuous equations, which costs a thousandth of a reference;
its error is the difference of two settings (more terms, and more digits).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import gmpy2
import mpmath
from mpmath.libmp import to_rational

from ..equations import Equations, number_to_mpfr, to_mpf
from ..failures import ReferenceFailure
from ..taylor import BITS, SeriesProgram, polynomial
from .certify import motion_of
from .problem import Problem, scene_of
from .states import momentum_function

GUARD = 30  # additional digits of the arithmetic
MORE = 4, 10  # additional terms and digits of the second setting
MOST_TERMS = 96
#: for a rough motion: terms, bits, the relative size of the last term; a value of 1, such as |Γ|²,
#: stays 1
ROUGH, ROUGH_BITS, ROUGH_TERM = 20, 100, 2.0**-60
NUDGE = 2.0**-50  # a relative change of a start, to measure its effect on the motion
MOST_STEPS = 400  # largest number of steps of a rough motion


@dataclass(frozen=True)
class ExactState:
    """A state with error bounds: x (n), v (m) and μ (m), mpf; error_x (n), error_mu (m)."""

    x: list[Any]
    v: list[Any]
    mu: list[Any]
    error_x: list[Any]
    error_mu: list[Any]


class Surroundings:
    """The continuous equations of a scene, evaluated at any state.

    A state is z = (x, v), and the time t (a Fraction) if the scene depends on it. ``key`` is the
    scene's fingerprint. Raises `ReferenceFailure` for a scene that can have no reference.
    """

    def __init__(self, scene: Any) -> None:
        scene = scene_of(scene)
        self.key = Problem.of(scene).key
        self.equations: Equations
        self.program: SeriesProgram
        self.equations, self.program = motion_of(scene, False)
        self._momentum: Callable[..., list[Any]] = momentum_function(self.equations)

    def momentum(self, x: Sequence[Any], v: Sequence[Any], t: Fraction, digits: int) -> list[Any]:
        """Return μ = ∂l/∂v (m) at a state, mpf."""
        with mpmath.workdps(digits + GUARD):
            time = [mpmath.mpf(t.numerator) / t.denominator] if self.equations.timed else []
            return [mpmath.mpf(e) for e in self._momentum(*x, *v, *time)]

    def along(
        self, duration: Fraction, moved: float = 0.0
    ) -> list[tuple[Fraction, list[Any], list[Any]]]:
        """Return (t, x, v) of the scene's own motion, to a few digits, at the steps of a rough run.

        The run goes from 0 to the duration, unless `MOST_STEPS` or a singularity ends it before.
        moved: the relative change of each entry of the start.
        """
        n, m = self.equations.dim_x, self.equations.dim_u
        rows = []
        with gmpy2.context(gmpy2.get_context(), precision=ROUGH_BITS):
            constants = self.program.constants_at(30)
            state = [number_to_mpfr(e, 30) + gmpy2.mpfr(0) for e in self.equations.start]
            size = self.equations.dim_x + self.equations.dim_u
            state = [e * (1 + moved * (-1) ** i) if i < size else e for i, e in enumerate(state)]
            now = Fraction(0)
            for _ in range(MOST_STEPS):
                rows.append((now, _public(state[:n]), _public(state[n : n + m])))
                try:
                    series = self._series(ROUGH, state, constants)
                except (ArithmeticError, ValueError):
                    break
                longest = _length(series)
                if now >= duration:
                    break
                step = duration - now if longest is None else min(longest, duration - now)
                state = [polynomial(c, gmpy2.mpfr(step)) for c in series]
                now += step
        return rows

    def conditioning(self, duration: Fraction) -> float | None:
        """Return the factor by which the motion enlarges a relative change of its start at the end.

        It is ‖δ(x, μ)‖/‖(x, μ)‖ at the duration's end, divided by the relative change of every
        entry of the start, to first order. None if a rough run does not come so far (`MOST_STEPS`).
        """
        ends = []
        for moved in (0, NUDGE):
            way = self.along(duration, moved)
            if way[-1][0] != duration:
                return None
            t, x, v = way[-1]
            ends.append([*x, *self.momentum(x, v, t, 30)])
        with mpmath.workdps(30):
            off = mpmath.norm([a - b for a, b in zip(*ends, strict=True)], 2)
            return float(off / (mpmath.norm(ends[0], 2) or 1) / NUDGE)

    def length(self, x: Sequence[Any], v: Sequence[Any], t: Fraction) -> Fraction | None:
        """Return the time for which `ROUGH` terms describe the motion from a state.

        It does not depend on units: in each component the last term is below `ROUGH_TERM` times the
        largest one. None for a state at rest. Raises `ReferenceFailure` if there is no series.
        """
        with gmpy2.context(gmpy2.get_context(), precision=ROUGH_BITS):
            constants = self.program.constants_at(30)
            try:
                series = self._series(ROUGH, self._state(x, v, t), constants)
                span = _length(series)
            except (ArithmeticError, ValueError, OverflowError):
                span = None
            else:
                if span is None:
                    return None
        if not span:
            raise ReferenceFailure(f"scene {self.equations.name} has no series at such a state")
        return span

    def after(
        self, x: Sequence[Any], v: Sequence[Any], t: Fraction, steps: Sequence[Fraction],
        digits: int,
    ) -> list[ExactState]:  # fmt: skip
        """Return the exact states at t + h for each h of the steps, from (x, v) at t.

        They have `digits` digits of each component's own motion. Raises `ReferenceFailure` if a
        step is too long for one polynomial of `MOST_TERMS` terms, or if there is no series.
        """
        terms, longest = 8, max(map(abs, steps))
        while not self._enough(x, v, t, longest, digits, terms):
            terms += terms // 2
            if terms > MOST_TERMS:
                raise ReferenceFailure(
                    f"scene {self.equations.name}: a step of {float(longest):.3g} is too long for "
                    "one local Taylor polynomial; take a shorter one"
                )
        one, other = (
            self._ends(x, v, t, steps, digits + more, terms + extra)
            for extra, more in ((0, 0), MORE)
        )
        states = []
        with mpmath.workdps(digits + GUARD):
            for (x1, v1, mu1), (x2, _, mu2) in zip(one, other, strict=True):
                off = [[abs(a - b) for a, b in zip(p, q, strict=True)]
                       for p, q in ((x1, x2), (mu1, mu2))]  # fmt: skip
                states.append(ExactState(x1, v1, mu1, *off))
        return states

    def coefficients(
        self, x: Sequence[Any], v: Sequence[Any], t: Fraction, terms: int, digits: int
    ) -> list[list[Any]]:
        """Return the Taylor coefficients 0 to `terms` of each entry of (x, v) at a state, mpf."""
        with gmpy2.context(gmpy2.get_context(), precision=math.ceil((digits + GUARD) * BITS)):
            constants = self.program.constants_at(digits + GUARD)
            series = self._series(terms, self._state(x, v, t), constants)
            size = self.equations.dim_x + self.equations.dim_u
            return [_public(c) for c in series[:size]]

    def _series(self, terms: int, state: list[Any], constants: list[Any]) -> list[list[Any]]:
        series = self.program.nodes(terms, state, constants)[: self.program.size]
        if not all(gmpy2.is_finite(e) for c in series for e in c):
            raise ArithmeticError
        return series

    def _state(self, x: Sequence[Any], v: Sequence[Any], t: Fraction) -> list[Any]:
        """Return a state in the numbers of the current gmpy2 context."""
        time = [gmpy2.mpfr(gmpy2.mpq(t))] if self.equations.timed else []
        return [*map(_mpfr, [*x, *v]), *time]

    def _enough(
        self, x: Sequence[Any], v: Sequence[Any], t: Fraction, step: Fraction, digits: int,
        terms: int,
    ) -> bool:  # fmt: skip
        """True if the last terms of each component are below its round-off, and fall as 2⁻ᵏ."""
        with gmpy2.context(gmpy2.get_context(), precision=ROUGH_BITS):
            try:
                series = self._series(terms, self._state(x, v, t), self.program.constants_at(30))
            except (ArithmeticError, ValueError):
                raise ReferenceFailure(
                    f"scene {self.equations.name} has no series at such a state"
                ) from None
            bits = digits * BITS
            for sizes in _sizes(series):
                moved = [b + k * _log2(step) for k, b in enumerate(sizes)]
                largest = max(moved)
                if largest > -math.inf and max(moved[-2:]) > largest - max(bits, len(moved)):
                    return False
        return True

    def _ends(
        self, x: Sequence[Any], v: Sequence[Any], t: Fraction, steps: Sequence[Fraction],
        digits: int, terms: int,
    ) -> list[tuple[list[Any], list[Any], list[Any]]]:  # fmt: skip
        n, m = self.equations.dim_x, self.equations.dim_u
        ends = []
        with gmpy2.context(gmpy2.get_context(), precision=math.ceil((digits + GUARD) * BITS)):
            constants = self.program.constants_at(digits + GUARD)
            series = self._series(terms, self._state(x, v, t), constants)
            for h in steps:
                offset = gmpy2.mpfr(gmpy2.mpq(h))
                end = _public([polynomial(c, offset) for c in series])
                x1, v1 = end[:n], end[n : n + m]
                ends.append((x1, v1, self.momentum(x1, v1, t + h, digits)))
        return ends


def _mpfr(value: Any) -> Any:
    with mpmath.workprec(gmpy2.get_context().precision):
        return gmpy2.mpfr(gmpy2.mpq(*map(int, to_rational(mpmath.mpf(value)._mpf_))))


def _public(values: Sequence[Any]) -> list[Any]:
    return [to_mpf(value) for value in values]


def _log2(value: Any) -> float:
    number = gmpy2.mpfr(gmpy2.mpq(value))
    return float(gmpy2.log2(abs(number))) if number else -math.inf


def _sizes(series: list[list[Any]]) -> list[list[float]]:
    """Return log₂ of each coefficient of each component."""
    return [[float(gmpy2.log2(abs(e))) if e else -math.inf for e in c] for c in series]


def _length(series: list[list[Any]]) -> Fraction | None:
    """Return the step at which the last two terms of each component are `ROUGH_TERM` of its
    largest.

    None if nothing moves except the time.
    """
    rough, step = math.log2(ROUGH_TERM), math.inf
    for sizes in _sizes(series):
        for k in (len(sizes) - 2, len(sizes) - 1):
            if sizes[k] > -math.inf:  # for some j < k: b_k + k s <= b_j + j s + rough
                step = min(step, max((b + rough - sizes[k]) / (k - j)
                                     for j, b in enumerate(sizes[:k])))  # fmt: skip
    return None if step == math.inf else _fraction(gmpy2.exp2(gmpy2.mpfr(step)))


def _fraction(value: Any) -> Fraction:
    numerator, denominator = value.as_integer_ratio()
    return Fraction(int(numerator), int(denominator))
