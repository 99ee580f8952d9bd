"""The constant step that reaches a tolerance: a pilot measures the error, the order scales it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from math import ceil, gcd, inf, log2
from typing import Any

import numpy as np

from ..equations import SceneSymbols, field_parts, mass_matrix
from ..errors import BadInput, StepFailure, shown
from ..numbers import Matrix, arithmetic, measure, numeric
from .run import Trajectory

ROWS = 8  # times at which runs are compared: errors pass through zero, but not everywhere at once
MOST, MOST_OF_DIGITS = 2**20, 2**12  # steps of a pilot, in double precision and with more digits
#: a pilot whose fixed point contracts at no step so far turns to Newton's method at this number of
#: steps, or at 1/2⁸ of the most that it may take: what is left then of the ladder is enough for it
CONTRACTS = 2**8
#: a smaller step is taken where it needs so many fewer sweeps in all. A step has costs beside its
#: sweeps, of which smaller ones have more: a tenth of the sweeps has to pay for them
FEWER = 0.9
SMALLER = (Fraction(3, 2), 2, 3, 4, 6, 8)  # times as many steps that are tried for fewer sweeps
#: h|λ| of the finest run, λ the eigenvalues of the linearised field: a step that does not resolve
#: the fastest motion shares its error with one of half the size, which shows nothing of it
RESOLVED = 1.0
SAFETY = 2.0  # the step aims at this part of the tolerance
ROUND_OFF = 16  # units that no tolerance may be below: runs that agree may share their round-off


@dataclass(frozen=True)
class StepChoice:
    """A step that was chosen for a tolerance.

    step: duration/steps, exact. error: from the largest difference to the pilot's finest run, of
    twice as many steps or more, at ROWS equal times of the scene's duration (at the four they share
    if there are 12 steps), of each component of (x, μ) by its own largest value there. order: with
    which the error was scaled, the scheme's (at most 2 with contact), or measured where it states
    none; constant: error/step^order.
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


def step_for(scheme: Any, tolerance: Any, flow: Callable[[Fraction], Any]) -> StepChoice:
    """The cheapest step found whose error over the scene's duration is within the tolerance.

    Of the steps at which the fixed point of the stages contracts (of all, if it contracts at none)
    it is the largest. A part of it, down to an eighth (`SMALLER`), is taken instead where a run
    with that needs fewer sweeps in all.
    flow: step ↦ flow. Numbers of steps are doubled until the error, which runs with h and h/2
    show, is within the tolerance, and the run is one that this can be believed of: the finer one
    resolves the fastest motion (`fastest_rate`); the error fell by half the order or more, or was
    within the tolerance twice; and a run whose number of steps is odd, in units of `ROWS`, has no
    larger one than that of the next longer step. The scheme's order then says what the tolerance
    needs, and a run with that many steps is compared with the best one. Raises `BadInput` for a
    tolerance that is not positive, and for one that no step of the pilot reaches, with the smallest
    that one does.
    """
    scene, stated = scheme.scene, scheme.order or 0
    if scene.contact is not None:
        stated = min(stated, 2)  # of what stays closed, whatever the rule
    wanted = float(measure(tolerance, "tolerance"))
    if not 0 < wanted < 1:
        raise BadInput(f"tolerance is {shown(tolerance)}: give a number between 0 and 1.")
    whole = flow(scene.duration)
    numbers = whole.numbers
    most = MOST if numbers.digits == 16 else MOST_OF_DIGITS
    aim = max(wanted, ROUND_OFF * float(numbers.eps))
    failed: list[StepFailure] = []
    # the fixed point goes without Newton's method, for which nothing is compiled
    alone = scene.contact is None and whole.stages is not None

    @cache
    def pilot(steps: int) -> _Pilot:
        """A run's rows, if it has an end; the sweeps of all its steps by fixed point, if so they
        were made; the fastest rate at its rows."""
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

    def turns(steps: int) -> float:
        """h|λ| of a run of so many steps; 0 where it is not known."""
        return pilot(steps).rate * float(scene.duration) / steps

    def believed(steps: int, found: float) -> bool:
        """Whether the error of runs with h and h/2 is that of h, and not shared by both."""
        coarse, best = errors.get(steps // 2, inf), 2 * steps
        if turns(best) > RESOLVED or coarse == inf:
            return False
        if coarse > aim and found > coarse / 2 ** ((stated or 1) / 2):
            return False
        odd = ROWS * (3 * steps // (4 * ROWS) | 1)
        return odd >= steps or error(odd, best) <= max(error(steps // 2, best), aim)

    steps, errors, floor = ROWS, dict[int, float](), 0
    while (found := error(steps, 2 * steps)) > aim or not believed(steps, found):
        # round-off: what was small and fell with the order does not fall any more, twice
        before = errors.get(steps // 2, inf)
        floor = floor + 1 if found > before / 2 and aim < found < before < 1e-6 else 0
        errors[steps] = found
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
            kept = next((k for k in ranked if believed(k, errors[k])), None)
            if kept is None and min(errors.values()) < inf and turns(2 * min(errors)) > RESOLVED:
                raise _unresolved(scheme, wanted, fastest, most)
            raise _unreachable(scheme, wanted, errors, kept, most, failed)
        steps *= 2
    errors[steps] = found
    if wanted < aim:
        raise _unreachable(scheme, wanted, {steps: aim}, steps, most, failed)
    best = 2 * steps
    coarse = errors.get(steps // 2, inf)
    order = stated
    if not order and coarse < inf:
        order = max(1.0, log2(coarse / max(found, wanted * 1e-3)))
    if coarse < inf and order:
        less = ceil(steps / 2 * (SAFETY * coarse / wanted) ** (1 / order) / ROWS) * ROWS
        if less < steps and (between := error(less, best)) <= wanted:
            steps, found = less, between
    fewer = steps
    for more in (int(steps * factor) for factor in SMALLER):
        if not pilot(more).sweeps < FEWER * pilot(fewer).sweeps:
            break
        fewer = more
    if fewer > steps and (between := error(fewer, 2 * fewer)) <= wanted:
        steps, found = fewer, between
    step = scene.duration / steps
    return StepChoice(wanted, step, steps, found, order, found / float(step) ** order)


@dataclass(frozen=True)
class _Pilot:
    """What is left of a pilot's run; without rows it has no end."""

    rows: Matrix | None = None
    sweeps: float = inf
    rate: float = 0.0


def fastest_rate(scheme: Any, run: Trajectory) -> float:
    """The largest |λ| at the rows of a run, λ the eigenvalues of the field's derivative there.

    d(ẋ, μ̇)/d(x, μ) along μ = ∂l/∂ξ(x, ξ), in double precision and in one over the unit of time:
    an angular frequency where a motion oscillates. 0 where there is no continuous field, and under
    constraints, where it is not that of the motion.
    """
    scene, s = scheme.scene, scheme.s
    if scene.lagrangian is None or scene.constrained:
        return 0.0
    function, found = _linearised(s), [0.0]
    with np.errstate(all="ignore"):
        p = [float(e) for e in scene.parameter_values]
        for x, u, mu in zip(
            *(np.asarray(e, float) for e in (run.base, run.u, run.mu)), strict=True
        ):
            try:
                by_z, by_xi, moving, mass = function(x, u, mu, p)
                rates = np.linalg.eigvals(by_z + by_xi @ np.linalg.solve(mass, moving))
            except (ArithmeticError, ValueError, np.linalg.LinAlgError):
                continue  # no field there, as the run's own numbers say
            found.append(float(abs(rates).max(initial=0)))
    return max(rate for rate in found if rate < inf)


@lru_cache(maxsize=64)
def _linearised(s: SceneSymbols) -> Any:
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    _, *parts = field_parts(s)
    return numeric(letters, [*parts, mass_matrix(s)], arithmetic(16))


def _unresolved(scheme: Any, wanted: float, fastest: float, most: int) -> BadInput:
    """The error for a motion that is too fast for the steps of the pilot."""
    return BadInput(
        f"{scheme.scene.name} with {scheme.rule.name}: a tolerance of {wanted:g} cannot be "
        f"checked: the fastest motion there, of the rate {fastest:.3g}, is not resolved well "
        f"enough by {most} steps or fewer. A step of {RESOLVED / fastest:.2g} begins to resolve it "
        "(step times rate is 1): give one below that, or a shorter duration."
    )


def _unreachable(
    scheme: Any, wanted: float, errors: dict[int, float], steps: int | None, most: int,
    failed: list[StepFailure],
) -> BadInput:  # fmt: skip
    """The error for a tolerance that no step of the pilot reaches; of so many steps the error is
    the least that is believed."""
    what = f"{scheme.scene.name} with {scheme.rule.name}: a tolerance of {wanted:g}"
    if min(errors.values()) == inf:
        why = f"; the last failure: {failed[-1]}" if failed else ""
        return BadInput(f"{what} is not reached: no pilot of up to {most} steps has an end{why}.")
    found = "no run of the pilot has an error that is believed"
    if steps is not None:
        found = f"the smallest that is reached: {errors[steps] * 1.03:.1e}, with {steps} steps"
    return BadInput(f"{what} is below round-off, or takes more than {most // 2} steps; {found}.")
