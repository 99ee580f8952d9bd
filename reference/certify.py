"""How many digits are certain, and why: a proof where one is affordable, agreement elsewhere.

    enclosure      the error is proven to stay below a bound (`enclosure`)
    defect bound   the defect is proven, its growth estimated to first order
    agreement      two settings agree, and a second method where it is cheap

Whatever the certainty, the closed form has to agree where there is one; elsewhere an independent
method is run beside a cheap integration. Energy and the scene's conserved quantities are compared
with their values at the start, to the same digits.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath

from .agreement import Blocks, agreement, said
from .bounded import bounded_integration
from .closed_forms import ClosedForm
from .equations import Equations, equations_of
from .exact import parameter_values
from .extrapolation import extrapolate
from .failures import ReferenceFailure, Unproven
from .invariants import Invariants, invariants_of
from .result import Finding, Solution
from .series import SeriesProgram, compile_series
from .states import all_blocks, blocks_of
from .taylor import Sweep, TaylorSettings, integrate

ATTEMPTS = 4
PATIENCE = 50  # steps of the second method for each of the first
CHEAP = 4e6  # products of coefficients; a few tenths of a second


def certified_integration(
    scene: Any,
    times: list[Fraction],
    digits: int,
    attitude: bool,
    thorough: bool = False,
    proof: bool = True,
    form: ClosedForm | None = None,
) -> dict[Fraction, Solution]:
    """All times in one sweep with a bound; where none is affordable or asked for, two that agree.

    ``form`` is a closed form of the motion, which has to agree. ``thorough`` runs the second
    method where it is dear, and beside a closed form.
    """
    derive = derived if isinstance(scene, Hashable) else derived.__wrapped__
    equations, program, invariants = derive(scene, attitude)
    try:
        if not proof:
            raise Unproven("none was asked for")
        findings, sweep, settings = bounded_integration(equations, program, times, digits)
    except Unproven as failure:
        if form is None or (attitude and not form.attitude):
            findings, sweep, settings = _two_settings(
                equations, program, times, digits, str(failure)
            )
        else:
            findings, sweep, settings = _one_setting(scene, equations, program, times, digits, form)
    start = findings[Fraction(0)]
    cheap = sweep.steps * sweep.order**2 * max(1, program.products) < CHEAP
    alone = form is None or (attitude and not form.attitude)
    if thorough or (cheap and alone):
        trusted = {t: finding.blocks for t, finding in findings.items()}
        most = PATIENCE * (sweep.steps + 10)
        other = _second_method(equations, times, digits, settings.digits, trusted, most)
        findings = {
            t: finding.remarked("extrapolation could not be run")
            if other is None
            else finding.limited(
                other[t], f"Gragg-Bulirsch-Stoer extrapolation agrees {said(other[t])}", digits
            )
            for t, finding in findings.items()
            if t in times
        }
    parameters = parameter_values(scene)
    found = {}
    for t in times:
        working = settings.digits + settings.guard
        finding = _kept(equations.name, findings[t], invariants, start.blocks, working)
        if form is not None:
            finding = _beside(form, finding, equations, parameters, digits, start.blocks)
        found[t] = finding.solution(digits, attitude)
    return found


@lru_cache(maxsize=8)
def derived(scene: Any, attitude: bool) -> tuple[Equations, SeriesProgram, Invariants]:
    """What needs no time and no digits: one scene is asked for several of either."""
    equations = equations_of(scene, attitude)
    return equations, compile_series(equations), invariants_of(scene, equations)


def _beside(
    form: ClosedForm,
    finding: Finding,
    equations: Equations,
    parameters: Any,
    digits: int,
    start: Blocks,
) -> Finding:
    """The finding, no more certain than the digits to which the closed form agrees with it.

    The form's own round-off is seen as a disagreement: more working digits are tried.
    """
    working, agreed = digits + 15, 0
    for _ in range(ATTEMPTS):
        other = form_at(equations, parameters, form, finding.t, working)
        agreed = agreement(finding.blocks, other, start)
        if agreed >= digits:
            break
        working += working + digits - agreed
    return finding.limited(agreed, f"closed form: {form.formula} agrees {said(agreed)}", digits)


def form_at(
    equations: Equations, parameters: Any, form: ClosedForm, t: Fraction, working: int
) -> Blocks:
    """What the closed form says at t, in ``working`` digits; with the attitude if both have it."""
    n, m = equations.dim_x, equations.dim_u
    with mpmath.workdps(working):
        time = mpmath.mpf(t.numerator) / t.denominator
        moved = form.motion(parameters, equations.start[:n], equations.start[n : n + m], time)
        turned = list(moved.attitude) if equations.attitude_size and form.attitude else []
        return blocks_of(equations, [*moved.x, *moved.v, *turned], working)


def _kept(
    name: str, finding: Finding, invariants: Invariants, start: Blocks, working: int
) -> Finding:
    """The finding with its invariants compared.

    Raises `ReferenceFailure` where the equations have no value, between steps that have passed it.
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


def _one_setting(
    scene: Any,
    equations: Equations,
    program: SeriesProgram,
    times: list[Fraction],
    digits: int,
    form: ClosedForm,
) -> tuple[dict[Fraction, Finding], Sweep, TaylorSettings]:
    """One integration, its tolerance lowered until the closed form agrees: no bound."""
    settings = TaylorSettings(digits + 4)
    parameters, working = parameter_values(scene), digits + 30
    wanted = {t: form_at(equations, parameters, form, t, working) for t in times}
    for attempt in range(ATTEMPTS):
        sweep = integrate(equations, program, [*times, Fraction(0)], settings)
        found = all_blocks(equations, sweep, settings.digits + settings.guard)
        worst = min(agreement(found[t], wanted[t], found[Fraction(0)]) for t in times)
        if worst >= digits or attempt == ATTEMPTS - 1:
            break
        settings = TaylorSettings(settings.digits + digits - worst + 4)
    evidence = (
        f"one Taylor integration, of order {sweep.order} (tolerance 1e-{settings.digits}, "
        f"{settings.digits + settings.guard} digits) and a closed form; no bound"
    )
    return (
        {
            t: Finding(t, found[t], settings.digits, "agreement", "Taylor series", evidence)
            for t in found
        },
        sweep,
        settings,
    )


def _two_settings(
    equations: Equations,
    program: SeriesProgram,
    times: list[Fraction],
    digits: int,
    why: str,
) -> tuple[dict[Fraction, Finding], Sweep, TaylorSettings]:
    """Two orders, tolerances and precisions, raised until they agree."""
    sweeps: dict[TaylorSettings, Sweep] = {}

    def run(settings: TaylorSettings) -> dict[Fraction, Blocks]:
        sweeps[settings] = integrate(equations, program, [*times, Fraction(0)], settings)
        return all_blocks(equations, sweeps[settings], settings.digits + settings.guard)

    first = TaylorSettings(digits + 4)
    second = TaylorSettings(digits + 12, guard=12, stretch=1.2)
    rough, fine = run(first), run(second)
    agreed = {t: agreement(rough[t], fine[t], fine[Fraction(0)]) for t in fine}
    for attempt in range(ATTEMPTS):
        worst = min(agreed.values())
        if worst >= digits:
            break
        more = second.digits + math.ceil(digits - worst) + 4 + 10 * attempt
        first = second
        second = TaylorSettings(more, guard=12 + attempt, stretch=2.2 - first.stretch)
        rough, fine = fine, run(second)
        agreed = {t: agreement(rough[t], fine[t], fine[Fraction(0)]) for t in fine}
    evidence = (
        f"two Taylor integrations, of order {first.order} (tolerance 1e-{first.digits}, "
        f"{first.digits + first.guard} digits) and of order {second.order} (tolerance "
        f"1e-{second.digits}, {second.digits + second.guard} digits), agree {{}}; no bound: {why}"
    )
    return (
        {
            t: Finding(
                t,
                fine[t],
                agreed[t],
                "agreement",
                "Taylor series",
                evidence.format(said(agreed[t])),
            )
            for t in fine
        },
        sweeps[second],
        second,
    )


def _second_method(
    equations: Equations,
    times: list[Fraction],
    digits: int,
    tolerance: int,
    trusted: dict[Fraction, Blocks],
    most: int,
) -> dict[Fraction, int] | None:
    """The digits to which extrapolation agrees; once more with a smaller tolerance if need be."""
    agreed: dict[Fraction, int] = {}
    for more in (0, 10):
        try:
            sweep = extrapolate(equations, [*times, Fraction(0)], tolerance + more, max_steps=most)
        except (ReferenceFailure, NameError):  # NameError: a function the second printer lacks
            return None
        found = all_blocks(equations, sweep, tolerance + more + 14)
        agreed = {t: agreement(found[t], trusted[t], trusted[Fraction(0)]) for t in times}
        if min(agreed.values()) >= digits:
            break
    return agreed
