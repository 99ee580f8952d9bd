"""Taylor-series integration at any precision, with order and step from the precision.

At a tolerance eps the cheapest order is about -ln(eps)/2, and the step is the radius of
convergence over e^2 (Jorba and Zou, Experimental Mathematics 14, 2005); the radius is read off the
last two coefficients. The solution between steps is the local polynomial itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import Any, Protocol

import gmpy2

from ..equations import Equations, number_to_mpfr
from ..failures import MotionEnds, ReferenceFailure
from ..progress import tell
from .independence import Independence
from .series import SeriesProgram

BITS = math.log2(10)
STEP_BITS = 30  # short steps add up exactly
PROBE = 300  # number of steps after which their total number is estimated
SINKING = 1000  # a step shorter than the longest one by this factor approaches a pole


@dataclass(frozen=True)
class TaylorSettings:
    """Tolerance 10^-digits per step, arithmetic with ``guard`` more, order = stretch x optimal."""

    digits: int
    guard: int = 8
    stretch: float = 1.0

    @property
    def working(self) -> int:
        """The digits of the arithmetic."""
        return self.digits + self.guard

    @property
    def precision(self) -> int:
        """The bits of the arithmetic."""
        return math.ceil(self.working * BITS)

    @property
    def order(self) -> int:
        """The degree of the local polynomials, about half the precision in nats (Jorba, Zou)."""
        return max(8, math.ceil(self.stretch * (self.digits * math.log(10) / 2 + 1)))

    @property
    def said(self) -> str:
        """The settings in words."""
        return f"of order {self.order} (tolerance 1e-{self.digits}, {self.working} digits)"


@dataclass(frozen=True)
class Sweep:
    """States (mpfr, one list per time) at the requested times, and the work."""

    states: dict[Fraction, list[Any]]
    steps: int
    order: int


@dataclass(frozen=True)
class Step:
    """One finished step: all nodes' series, its signed size, the times with exact offsets."""

    nodes: list[list[Any]]
    size: Any
    times: list[tuple[Fraction, Any]]


class Watch(Protocol):
    """An observer of each step that may ask for a shorter one before."""

    def allowed(self, nodes: list[list[Any]], size: Any) -> Any:
        """Return the longest step along these nodes, at most ``size``."""
        ...

    def __call__(self, step: Step) -> None: ...


def integrate(
    equations: Equations,
    program: SeriesProgram,
    times: Sequence[Fraction],
    settings: TaylorSettings,
    max_steps: int = 1_000_000,
    watch: Watch | None = None,
) -> Sweep:
    """Return the solution at the given times, forward and backward from 0.

    ``watch`` sees each step. Raises `MotionEnds` if the solution is singular or passes a time at
    which the constraints are dependent (`independence`), `ReferenceFailure` if it takes too many
    steps or has no series at 0.
    """
    tied = Independence(equations) if equations.constraints else None
    with gmpy2.context(gmpy2.get_context(), precision=settings.precision):
        constants = program.constants_at(settings.working)
        start = [
            number_to_mpfr(value, settings.working) + gmpy2.mpfr(0) for value in equations.start
        ]
        states = {Fraction(0): start}
        steps = 0
        for direction in (1, -1):
            wanted = sorted((t for t in times if t * direction > 0), key=abs)
            steps += _one_way(
                program, start, constants, wanted, settings, states, max_steps, watch, tied
            )
    return Sweep({t: states[t] for t in times}, steps, settings.order)


def _one_way(
    program: SeriesProgram,
    state: list[Any],
    constants: list[Any],
    wanted: list[Fraction],
    settings: TaylorSettings,
    states: dict[Fraction, list[Any]],
    max_steps: int,
    watch: Watch | None,
    tied: Independence | None,
) -> int:
    order = settings.order
    away = gmpy2.context(gmpy2.get_context(), round=gmpy2.RoundAwayZero)
    tolerance = gmpy2.mpfr(10) ** -settings.digits
    now, steps, pending = gmpy2.mpq(0), 0, list(wanted)  # the time is exact
    longest = [gmpy2.mpfr(0)] * 3  # longest steps in each half up to `PROBE`
    while pending:
        nodes = program.nodes(order, state, constants)
        series = nodes[: program.size]
        with away:  # so that no time lies beyond the last step
            last = gmpy2.mpfr(gmpy2.mpq(pending[-1]) - now)
        size = safe_step(series, order, tolerance)
        if size is None or not size > abs(now) * tolerance:
            if not steps:  # which says nothing of a motion
                raise ReferenceFailure(
                    f"the reference of scene {program.name} has no series at t = 0: a coefficient "
                    "is no number there (a pole of the equations, 0/0, or an overflow); "
                    "start elsewhere"
                )
            raise MotionEnds(
                f"the reference of scene {program.name} stops at t = {gmpy2.mpfr(now):.6g}: the "
                "solution is singular there (a collision, or a pole of the equations); "
                "ask for an earlier time or start elsewhere",
                float(now),
            )
        if steps <= PROBE:
            longest[2 * steps // PROBE] = max(longest[2 * steps // PROBE], size)
        # towards a pole each step covers the same share of the remaining time
        sinking = SINKING * size < longest[1]
        endless = longest[1] < 2 * longest[0] and abs(last) > max_steps * longest[1]
        endless = endless and not sinking
        if steps >= max_steps or (steps == PROBE and endless):
            raise ReferenceFailure(
                f"the reference of scene {program.name} would take more than {max_steps} steps: "
                f"{steps} lead to t = {gmpy2.mpfr(now):.6g}; ask for an earlier time"
            )
        size = gmpy2.mpfr(size, STEP_BITS)
        step = gmpy2.copy_sign(size, last) if size < abs(last) else last
        if watch is not None:
            step = watch.allowed(nodes, step)
        if tied is not None:
            tied.check(series, step, now)
        reached = []
        while pending:
            t = pending[0]
            exact = gmpy2.mpq(t) - now
            offset = gmpy2.mpfr(exact)
            if abs(offset) > abs(step):
                break
            states[t] = [polynomial(coefficients, offset) for coefficients in series]
            reached.append((pending.pop(0), exact))
        if watch is not None:
            watch(Step(nodes, step, reached))
        state = [polynomial(coefficients, step) for coefficients in series]
        now += gmpy2.mpq(step)
        steps += 1
        tell(f"{program.name}: series of order {order}", now, gmpy2.mpq(wanted[-1]))
    return steps


def safe_step(series: list[list[Any]], order: int, tolerance: Any) -> Any:
    """Return radius of convergence x tolerance^(1/order); None if a coefficient is not finite.

    In an entire solution no term may grow far beyond the state, or digits cancel: all terms up to
    half the order stay below about twice its size.
    """
    scale = max(abs(coefficients[0]) for coefficients in series)
    if scale == 0:
        scale = gmpy2.mpfr(1)
    best = gmpy2.inf()
    for j in (order - 1, order):
        size = max(abs(coefficients[j]) for coefficients in series)
        if not all(gmpy2.is_finite(coefficients[j]) for coefficients in series):
            return None
        if size:
            best = min(best, gmpy2.exp(gmpy2.log(tolerance * scale / size) / j))
    twice, columns = gmpy2.get_exp(scale) + 1, zip(*series, strict=False)
    powers = [
        (twice - max(map(gmpy2.get_exp, filter(None, column)))) / j
        for j, column in enumerate(islice(columns, 1, order // 2), 1)
        if any(column)
    ]
    return min(best, 2 ** gmpy2.mpfr(min(powers))) if powers else best


def polynomial(coefficients: list[Any], offset: Any) -> Any:
    """Return the value of a polynomial by Horner's rule."""
    result = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = result * offset + coefficient
    return result
