"""The constant step that reaches a tolerance: a pilot measures the error, the order scales it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from math import ceil, gcd, inf, log2
from typing import Any

import numpy as np

from ..equations import DiscretisedScene, SceneSymbols, field_parts
from ..errors import BadInput, StepFailure, shown
from ..numbers import Matrix, arithmetic, measure, numeric
from ..numbers.types import Given
from ..runs import Trajectory

# number of times at which runs are compared: errors pass through zero, but not at all of them
ROWS = 8
# largest number of steps of a pilot, in double precision and with more digits
MOST, MOST_OF_DIGITS = 2**20, 2**12
#: if a pilot's fixed point has contracted at no step so far, it turns to Newton's method at this
#: number of steps, or at 1/2⁸ of the largest allowed number, which leaves enough of the ladder
CONTRACTS = 2**8
#: a smaller step is taken if it needs fewer sweeps in all by this factor. A step has costs besides
#: its sweeps, and a run with smaller steps has more of them: a tenth of the sweeps pays for them
FEWER = 0.9
# factors of the number of steps that are tried for fewer sweeps
SMALLER = (Fraction(3, 2), 2, 3, 4, 6, 8)
#: largest h|λ| of the finest run, where λ are the eigenvalues of the linearised field: a step that
#: does not resolve the fastest motion shares its error with a step of half the size, so their
#: difference shows nothing of it
RESOLVED = 1.0
SAFETY = 2.0  # the step aims at the tolerance divided by this factor
# the smallest tolerance in units of round-off: runs that agree may share their round-off
ROUND_OFF = 16


@dataclass(frozen=True)
class StepChoice:
    """A step that was chosen for a tolerance.

    step: duration/steps, exact. error: from the largest difference to the pilot's finest run, with
    at least twice as many steps, at ROWS equal times of the scene's duration (at the four common
    ones if there are 12 steps), each component of (x, μ) relative to its own largest value there.
    order: used to scale the error, the scheme's (at most 2 with contact), or a measured one if it
    states none; constant: error/step^order.
    """

    tolerance: float
    step: Fraction
    steps: int
    error: float
    order: float
    constant: float

    def __str__(self) -> str:
        return (
            f"step {float(self.step):.6g}, {self.steps} steps of the scene's duration, for a "
            f"tolerance of {self.tolerance:g}: error {self.error:.1e} at order {self.order:.3g}"
        )


def step_for(
    scheme: DiscretisedScene, tolerance: Given, flow: Callable[[Fraction], Any]
) -> StepChoice:
    """Return the cheapest step found whose error over the scene's duration is within the tolerance.

    Among the steps at which the fixed point of the stages contracts (among all, if there are none)
    it is the largest. A part of it, down to an eighth (`SMALLER`), is taken instead if a run with
    that needs fewer sweeps in all.
    flow: step ↦ flow. The number of steps is doubled until the error, measured by runs with h and
    h/2, is within the tolerance, and the run can be trusted: the finer run resolves the fastest
    motion (`fastest_rate`); the error fell by at least half the order, or was within the tolerance
    twice; and a run with an odd number of steps, in units of `ROWS`, has no larger error than the
    next longer step. The scheme's order then gives the step for the tolerance, and a run with that
    number of steps is compared with the best one. Raises `BadInput` for a tolerance that is not
    positive, and for one that no step of the pilot reaches, with the smallest reachable one.
    """
    scene, stated = scheme.scene, scheme.order or 0
    if scene.contact is not None:
        stated = min(stated, 2)  # the order of contacts that stay closed, with any rule
    wanted = float(measure(tolerance, "tolerance"))
    if not 0 < wanted < 1:
        raise BadInput(f"tolerance is {shown(tolerance)}: give a number between 0 and 1.")
    whole = flow(scene.duration)
    numbers = whole.numbers
    most = MOST if numbers.digits == 16 else MOST_OF_DIGITS
    aim = max(wanted, ROUND_OFF * float(numbers.eps))
    failed: list[StepFailure] = []
    # the fixed point runs alone: nothing is compiled for Newton's method
    alone = scene.contact is None and whole.stages is not None

    @cache
    def pilot(steps: int) -> _Pilot:
        """Return a run's rows, if it finished, its sweeps, if all steps used the fixed point, and
        the fastest rate at its rows."""
        run_with = flow(scene.duration / steps)
        if alone:
            run_with.stages.alone = True
        try:
            run: Trajectory = run_with.trajectory(steps, steps // gcd(steps, ROWS))
        except StepFailure as failure:
            failed.append(failure)
            return _Pilot()
        table = np.concatenate([run.x, run.mu], axis=1)
        if not (abs(table) < inf).all():
            return _Pilot()
        sweeps = run.newton_mean * (steps + 1) if alone else 0.0
        return _Pilot(table, sweeps, fastest_rate(scheme, run))

    def error(steps: int, best: int) -> float:
        one, other = pilot(steps).rows, pilot(best).rows
        if one is None or other is None:
            return inf
        shared = gcd(len(one) - 1, len(other) - 1)  # times of both
        one, other = (rows[:: (len(rows) - 1) // shared] for rows in (one, other))
        sizes = abs(other).max(axis=0)
        off = (abs(one - other) / np.where(sizes == 0, 1, sizes)).max()
        return float(off) / (1 - (steps / best) ** (stated or 1))

    def hlambda(steps: int) -> float:
        """Return h|λ| of a run with so many steps, or 0 if it is unknown."""
        return pilot(steps).rate * float(scene.duration) / steps

    def trusted(steps: int, deviation: float) -> bool:
        """Return True if the error from runs with h and h/2 is that of h, not shared by both."""
        coarse, best = errors.get(steps // 2, inf), 2 * steps
        if hlambda(best) > RESOLVED or coarse == inf:
            return False
        if coarse > aim and deviation > coarse / 2 ** ((stated or 1) / 2):
            return False
        odd = ROWS * (3 * steps // (4 * ROWS) | 1)
        return odd >= steps or error(odd, best) <= max(error(steps // 2, best), aim)

    steps, errors, floor = ROWS, dict[int, float](), 0
    while (deviation := error(steps, 2 * steps)) > aim or not trusted(steps, deviation):
        # round-off: an error that was small and fell with the order stops falling, twice
        before = errors.get(steps // 2, inf)
        floor = floor + 1 if deviation > before / 2 and aim < deviation < before < 1e-6 else 0
        errors[steps] = deviation
        if alone and steps >= max(CONTRACTS, most // CONTRACTS) and min(errors.values()) == inf:
            steps, alone = ROWS, False
            errors.clear()
            pilot.cache_clear()
            continue
        fastest = pilot(2 * steps).rate
        if fastest * float(scene.duration) > RESOLVED * most:
            raise _unresolved(scheme, wanted, fastest, most)
        if floor == 2 or 4 * steps > most:
            ranked = sorted(errors, key=lambda k: errors[k])
            kept = next((k for k in ranked if trusted(k, errors[k])), None)
            if kept is None and min(errors.values()) < inf and hlambda(2 * min(errors)) > RESOLVED:
                raise _unresolved(scheme, wanted, fastest, most)
            raise _unreachable(scheme, wanted, errors, kept, most, failed)
        steps *= 2
    errors[steps] = deviation
    if wanted < aim:
        raise _unreachable(scheme, wanted, {steps: aim}, steps, most, failed)
    best = 2 * steps
    coarse = errors.get(steps // 2, inf)
    order = stated
    if not order and coarse < inf:
        order = max(1.0, log2(coarse / max(deviation, wanted * 1e-3)))
    if coarse < inf and order:
        less = ceil(steps / 2 * (SAFETY * coarse / wanted) ** (1 / order) / ROWS) * ROWS
        if less < steps and (between := error(less, best)) <= wanted:
            steps, deviation = less, between
    fewer = steps
    for more in (int(steps * factor) for factor in SMALLER):
        if not pilot(more).sweeps < FEWER * pilot(fewer).sweeps:
            break
        fewer = more
    if fewer > steps and (between := error(fewer, 2 * fewer)) <= wanted:
        steps, deviation = fewer, between
    step = scene.duration / steps
    return StepChoice(wanted, step, steps, deviation, order, deviation / float(step) ** order)


@dataclass(frozen=True)
class _Pilot:
    """The result of a pilot's run; without rows the run did not finish."""

    rows: Matrix | None = None
    sweeps: float = inf
    rate: float = 0.0


def fastest_rate(scheme: DiscretisedScene, run: Trajectory) -> float:
    """Return the largest |λ| at the rows of a run, where λ are eigenvalues of the field's
    derivative.

    The derivative is d(ẋ, μ̇)/d(x, μ) along μ = ∂l/∂ξ(x, ξ), in double precision; |λ| has the unit
    1/time, an angular frequency if a motion oscillates. It is 0 if there is no continuous field,
    and with constraints, where it is not that of the motion.
    """
    scene, s = scheme.scene, scheme.s
    if scene.lagrangian is None or scene.all_constraints:
        return 0.0
    function, radii = _linearised(s), [0.0]
    with np.errstate(all="ignore"):
        p = [float(e) for e in scene.parameter_values]
        for x, u, mu in zip(
            *(np.asarray(e, float) for e in (run.base, run.u, run.mu)), strict=True
        ):
            try:
                by_z, by_xi, moving, mass = function(x, u, mu, p)
                rates = np.linalg.eigvals(by_z + by_xi @ np.linalg.solve(mass, moving))
            except (ArithmeticError, ValueError, np.linalg.LinAlgError):
                continue  # no field there, as the run's own numbers show
            radii.append(float(abs(rates).max(initial=0)))
    return max(rate for rate in radii if rate < inf)


@lru_cache(maxsize=64)
def _linearised(s: SceneSymbols) -> Callable[..., list[Matrix]]:
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    _, *parts = field_parts(s)
    return numeric(letters, parts, arithmetic(16))


def _unresolved(scheme: DiscretisedScene, wanted: float, fastest: float, most: int) -> BadInput:
    """Return the error for a motion that is too fast for the steps of the pilot."""
    return BadInput(
        f"{scheme.scene.name} with {scheme.rule.name}: a tolerance of {wanted:g} cannot be "
        f"checked: the fastest motion there, of the rate {fastest:.3g}, is not resolved well "
        f"enough by {most} steps or fewer. A step of {RESOLVED / fastest:.2g} begins to resolve it "
        "(step times rate is 1): give one below that, or a shorter duration."
    )


def _unreachable(
    scheme: DiscretisedScene, wanted: float, errors: dict[int, float], steps: int | None, most: int,
    failed: list[StepFailure],
) -> BadInput:  # fmt: skip
    """Return the error for a tolerance that no step of the pilot reaches.

    steps: number of steps with the least error that can be trusted, or None.
    """
    what = f"{scheme.scene.name} with {scheme.rule.name}: a tolerance of {wanted:g}"
    if min(errors.values()) == inf:
        why = f"; the last failure: {failed[-1]}" if failed else ""
        return BadInput(f"{what} is not reached: no pilot run of up to {most} steps finishes{why}.")
    limit = "no pilot run has an error that can be trusted"
    if steps is not None:
        limit = f"the smallest that is reached: {errors[steps] * 1.03:.1e}, with {steps} steps"
    return BadInput(f"{what} is below round-off, or takes more than {most // 2} steps; {limit}.")
