"""The number of certain digits and their evidence: a proof if one is affordable, else agreement.

    enclosure      the error is proven to stay below a bound (`enclosure`)
    defect bound   the defect is proven, its growth estimated to first order
    agreement      two settings agree, and a second method if it is cheap

In every case the closed form has to agree if there is one; otherwise an independent method is run
beside a cheap integration. Energy and the scene's conserved quantities are compared with their
values at the start, to the same digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath

from discmech.integrators.scene import remembered

from ..closed_forms import ClosedForm
from ..equations import Equations, equations_of, parameter_values
from ..failures import ReferenceFailure, Unproven
from ..taylor import SeriesProgram, Sweep, TaylorSettings, compile_series, integrate
from .agreement import Blocks, agreement, said
from .bounded import bounded_integration
from .extrapolation import extrapolate
from .invariants import Invariants, invariants_of
from .result import Finding, Solution
from .states import all_blocks, blocks_of

ATTEMPTS = 4
PATIENCE = 50  # largest number of steps of the second method per step of the first
CHEAP = 4e6  # number of products of coefficients, a few tenths of a second


@dataclass(frozen=True)
class Question:
    """A request for states at the times, to so many digits; ``form``: the closed form or None."""

    equations: Equations
    program: SeriesProgram
    times: list[Fraction]
    digits: int
    parameters: Any = None
    form: ClosedForm | None = None

    def run(self, settings: TaylorSettings) -> tuple[Sweep, dict[Fraction, Blocks]]:
        """Return a Taylor integration, and its states at the times and at 0."""
        sweep = integrate(self.equations, self.program, [*self.times, Fraction(0)], settings)
        return sweep, all_blocks(self.equations, sweep, settings.working)


def certified_integration(
    scene: Any,
    times: list[Fraction],
    digits: int,
    attitude: bool,
    thorough: bool = False,
    proof: bool = True,
    form: ClosedForm | None = None,
) -> dict[Fraction, Solution]:
    """Return all times from one sweep with a bound, or from two sweeps that agree.

    Two sweeps are used if no bound is affordable or requested. ``form`` is a closed form of the
    motion, which has to agree. ``thorough`` runs the second method even if it is expensive, and
    also beside a closed form.
    """
    equations, program, invariants = derived(scene, attitude)
    asked = Question(equations, program, times, digits, parameter_values(scene), form)
    alone = form is None or (attitude and not form.attitude)
    try:
        if not proof:
            raise Unproven("none was asked for")
        findings, sweep, settings = bounded_integration(equations, program, times, digits)
    except Unproven as failure:
        findings, sweep, settings = _two_settings(asked, str(failure))
    start = findings[Fraction(0)].blocks
    cheap = sweep.steps * sweep.order**2 * max(1, program.products) < CHEAP
    if thorough or (cheap and alone):
        trusted = {t: finding.blocks for t, finding in findings.items()}
        most = PATIENCE * (sweep.steps + 10)
        other = _second_method(asked, settings.digits, trusted, most)
        for t in times:
            if other is None:
                findings[t] = findings[t].remarked("extrapolation could not be run")
            else:
                remark = f"Gragg-Bulirsch-Stoer extrapolation agrees {said(other[t])}"
                findings[t] = findings[t].limited(other[t], remark, digits)
    solutions = {}
    for t in times:
        finding = _kept(equations.name, findings[t], invariants, start, settings.working)
        if form is not None:
            finding = _beside(asked, finding, start)
        solutions[t] = finding.solution(digits, attitude)
    return solutions


@remembered(maxsize=64)
def motion_of(scene: Any, attitude: bool) -> tuple[Equations, SeriesProgram]:
    """Return the equations of a scene and their series, for any time and number of digits."""
    equations = equations_of(scene, attitude)
    return equations, compile_series(equations)


@remembered(maxsize=64)
def derived(scene: Any, attitude: bool) -> tuple[Equations, SeriesProgram, Invariants]:
    """Return `motion_of` and the invariants: one scene is asked at several times."""
    equations, program = motion_of(scene, attitude)
    return equations, program, invariants_of(scene, equations)


def _beside(asked: Question, finding: Finding, start: Blocks) -> Finding:
    """Return the finding, with at most the digits to which the closed form agrees with it.

    The form's own round-off would look like a disagreement, so more working digits are tried.
    """
    assert asked.form is not None
    working, agreed = asked.digits + 15, 0
    for _ in range(ATTEMPTS):
        by_form = form_at(asked.equations, asked.parameters, asked.form, finding.t, working)
        agreed = agreement(finding.blocks, by_form, start)
        if agreed >= asked.digits:
            break
        working += working + asked.digits - agreed
    remark = f"closed form: {asked.form.formula} agrees {said(agreed)}"
    return finding.limited(agreed, remark, asked.digits)


def form_at(equations: Equations, parameters: Any, form: Any, t: Fraction, working: int) -> Blocks:
    """Return the state at t by the closed form, in ``working`` digits.

    It has the attitude if both the form and the equations have one.
    """
    n, m = equations.dim_x, equations.dim_u
    with mpmath.workdps(working):
        time = mpmath.mpf(t.numerator) / t.denominator
        moved = form.motion(parameters, equations.start[:n], equations.start[n : n + m], time)
        turned = list(moved.attitude) if equations.attitude_size and form.attitude else []
        return blocks_of(equations, [*moved.x, *moved.v[:m], *turned], working)


def _kept(
    name: str, finding: Finding, invariants: Invariants, start: Blocks, working: int
) -> Finding:
    """Return the finding after comparing its invariants.

    Raises `ReferenceFailure` if the equations are singular at a time that the steps have passed
    over.
    """
    try:
        kept, words = invariants.digits(finding.blocks, start, working)
    except ZeroDivisionError:
        raise ReferenceFailure(
            f"the reference of scene {name} has no rates at t = {finding.t}: the equations are "
            "singular there (a pole, or constraints of which one vanishes or follows from the "
            "others); ask for an earlier time or start elsewhere"
        ) from None
    return finding.limited(kept, words, kept)


def _two_settings(
    asked: Question, why: str
) -> tuple[dict[Fraction, Finding], Sweep, TaylorSettings]:
    """Return the finer of two settings (order, tolerance, precision), raised until they agree."""
    first = TaylorSettings(asked.digits + 4)
    second = TaylorSettings(asked.digits + 12, guard=12, stretch=1.2)
    rough = asked.run(first)[1]
    for attempt in range(ATTEMPTS + 1):
        sweep, fine = asked.run(second)
        agreed = {t: agreement(rough[t], fine[t], fine[Fraction(0)]) for t in fine}
        worst = min(agreed.values())
        if worst >= asked.digits or attempt == ATTEMPTS:
            break
        more = second.digits + math.ceil(asked.digits - worst) + 4 + 10 * attempt
        first, rough = second, fine
        second = TaylorSettings(more, guard=12 + attempt, stretch=2.2 - first.stretch)
    settings = f"two Taylor integrations, {first.said} and {second.said}"
    findings = {}
    for t in fine:
        evidence = f"{settings}, agree {said(agreed[t])}; no bound: {why}"
        findings[t] = Finding(t, fine[t], agreed[t], "agreement", "Taylor series", evidence)
    return findings, sweep, second


def _second_method(
    asked: Question, tolerance: int, trusted: dict[Fraction, Blocks], most: int
) -> dict[Fraction, int] | None:
    """Return the digits to which extrapolation agrees, if need be with a smaller tolerance."""
    equations, times = asked.equations, asked.times
    agreed: dict[Fraction, int] = {}
    for more in (0, 10):
        try:
            sweep = extrapolate(equations, [*times, Fraction(0)], tolerance + more, max_steps=most)
        except (ReferenceFailure, NameError):  # NameError: a function the second printer lacks
            return None
        blocks = all_blocks(equations, sweep, tolerance + more + 14)
        agreed = {t: agreement(blocks[t], trusted[t], trusted[Fraction(0)]) for t in times}
        if min(agreed.values()) >= asked.digits:
            break
    return agreed
