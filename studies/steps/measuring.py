"""Measure rules with varying steps: order at the times reached, way back, form, energy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import BadInput, Scheme, StepFailure, scenes, vary
from discmech.integrators.errors import CannotMeasure, DiscmechError
from discmech.integrators.extensions.steps import ENERGY, Varied
from discmech.integrators.numbers import exact_rational, mpmath
from discmech.integrators.rules import get
from discmech.reference import ReferenceFailure

from ..core.case import Case, Choice, Progress, plain_cases, silent
from ..core.fingerprint import own_name
from ..core.fitting import orders_between
from ..core.records import encoded
from ..core.single_steps import SingleSteps
from ..energy.errors import measured_errors, turns_of
from ..energy.judging_errors import is_wide, verdict_of_run
from ..evidence import evidence_of
from ..evidence.measuring import of_scheme
from ..systems.runs import energy_errors, interval
from .extended import DIGITS as DIGITS_OF_FORM
from .extended import form_defect
from .records import Row

NAME = "steps"
NEEDS = (
    "it needs a rule whose steps vary: vary(rule, sigma) in a file, or reversible:RULE and "
    "poincare:RULE on a scene that names a sigma."
)
CONTROL_NAME = "naive step"
#: rules that the report takes, and the scene of the control
RULES, CONTROL_SCENE = ("trapezoidal", "gauss-2"), "kepler"
DIGITS = 50
#: runs of a ladder, each of twice the steps; the most of them, and the steps of the first
RUNGS, MOST_RUNGS, FIRST = 4, 10, 12
SETTLED = 0.05  # difference of two successive orders below which no further run is made
RESOLVED = 0.01  # largest error of a run whose ε is taken for the energy, the form and the way back
BACK = 24  # steps forth and back
STEPS = 50_000
HALVINGS = 6  # number of sizes of ε that a long run, and one from a place, is tried with
PLACES = 2  # number of places for the way back and the form, beside the start


def cases(choice: Choice) -> list[Case]:
    """Return the cases: every chosen scene by every chosen rule whose steps vary.

    Without a chosen rule, the scenes that name a σ, by two rules in two ways, and the control; with
    a chosen control, the control alone.
    """
    if unknown := [c for c in choice.controls if c != CONTROL_NAME]:
        raise BadInput(f'the study steps has no control {unknown[0]}: there is "{CONTROL_NAME}".')
    if choice.rules:
        return [c for c in plain_cases(NAME, choice, (16,)) if isinstance(c.rule, Varied)]
    if choice.digits and 16 not in choice.digits:
        return []
    named = [s for s in choice.scenes or scenes.all_scenes() if getattr(s, "sigma", None)]
    ways = [vary(get(rule), way=way) for way in ("reversible", "poincare") for rule in RULES]
    sound_cases = [] if choice.controls else [
        Case(NAME, scene, rule, 16, choice.steps)
        for scene in named for rule in ways if rule.applies(scene)
    ]  # fmt: skip
    naive = vary(get(RULES[0]), way="naive")
    return sound_cases + [
        Case(NAME, scene, naive, 16, choice.steps, CONTROL_NAME)
        for scene in named
        if own_name(scene) == CONTROL_SCENE
    ]


def rule_of(case: Case) -> Any:
    """Return the rule of a case, which has a way to vary its steps and a base."""
    return case.rule


def scheme_of(case: Case) -> Any:
    """Return the scheme of a case, whose steps vary."""
    return case.scheme


def first_step(case: Case) -> Fraction:
    """Return the ε whose step is the scene's own at the start, rounded to a short number."""
    return Fraction(f"{float(case.scene.step) * scheme_of(case).density0:.3g}")


def measure(case: Case, progress: Progress = silent) -> Mapping[str, Any]:
    """Return rows {step, steps, time, error} of the ladder and the measured numbers.

    measured: order, back, form, band, slope. back: the distance from the start after a run forth
    and back, in all that a step changes, at 60 digits. form: `extended.form_defect` of "poincare",
    else None. Raises `CannotMeasure` for a rule of equal steps.
    """
    if not isinstance(case.rule, Varied):
        raise CannotMeasure(f"{case.rule.name} has equal steps: {NEEDS}")
    label = f"{case.scene.name} {case.label}"
    progress(f"{label}: order", 0.0)
    step = first_step(case)
    rows, orders = _ladder(case, step)
    clear = [row.step for row in rows if row.error <= RESOLVED] or [rows[-1].step]
    step = min(step, Fraction(f"{clear[0]:.3g}"))
    measured: dict[str, Any] = {"order": orders[-1]}
    progress(f"{label}: there and back", 0.4)
    measured["back"], measured["lost"] = _largest(_back, case, step)
    measured["form"] = None
    if rule_of(case).way == "poincare":
        progress(f"{label}: form", 0.5)
        measured["form"], lost = _largest(_form, case, step)
        measured["lost"] = measured["lost"] or lost
    progress(f"{label}: energy", 0.6)
    energy = _energy(case, step)
    measured |= energy.get("measured", {"band": None, "slope": None})
    return {"rows": rows, "measured": measured, "orders": orders, "energy": energy,
            "local": _local(case), "self_adjoint": scheme_of(case).inner.self_adjoint}  # fmt: skip


def _ladder(case: Case, step: Fraction) -> tuple[list[Row], list[float]]:
    """Return (rows, orders from row to row): errors at the times that runs of ε, ε/2, … reach.

    The reference is computed at these times. Runs that fail for their long steps are left out, and
    more are made until the last two orders agree (`SETTLED`).
    """
    wanted = scheme_of(case).order or 1
    step = step * (1 if wanted <= 2 else 2 if wanted <= 4 else 4) * Fraction(913, 1000)
    runs: list[Any] = []
    rows: list[Row] = []
    orders: list[float] = []
    for k in range(MOST_RUNGS):
        n = FIRST * 2**k
        try:
            runs.append(scheme_of(case).flow(step / 2**k, DIGITS).trajectory(n, n))
        except StepFailure:
            if k == MOST_RUNGS - 1:
                raise
            runs.clear()
        if len(runs) < RUNGS or (len(runs) - RUNGS) % 2:
            continue
        rows = _errors(case, runs)
        halved = [2.0**-j for j in range(len(rows))]
        orders = orders_between(halved, [row.error for row in rows])
        if math.isnan(orders[-1]) or abs(orders[-1] - orders[-2]) < SETTLED:
            break
    if len(rows) < RUNGS:
        raise CannotMeasure(
            f"{case.scene.name} with {case.rule.name}: no {RUNGS} runs of ε, ε/2, … go through; "
            "take a smaller step= of the scene."
        )
    return rows, orders


def _errors(case: Case, runs: Sequence[Any]) -> list[Row]:
    """Return the rows of runs: the errors at their ends."""
    times = [exact_rational(run.t[-1], "t") for run in runs]
    exact = reference.solutions(case.scene, times, DIGITS + 5, proof=False)
    rows = []
    for run, at in zip(runs, exact, strict=True):
        with mpmath.workdps(DIGITS + 15):
            off = [a - b for a, b in zip([*run.x[-1], *run.mu[-1]], [*at.x, *at.mu], strict=True)]
            size = mpmath.norm([*at.x, *at.mu], 2) or 1
            error = float(mpmath.norm(off, 2) / size)
        rows.append(Row(float(run.step), run.steps, float(run.t[-1]), error))
    return rows


def _states(case: Case) -> list[tuple[Any, Any]]:
    """Return (x, μ) of the start, as (None, None), and of places beside the motion, if there are
    any."""
    try:
        places = evidence_of(Scheme(case.scene, rule_of(case).base)).places
    except (ReferenceFailure, DiscmechError):
        places = []
    beside = [place for place in places if place.beside][:PLACES]
    return [(None, None), *((place.x, place.mu) for place in beside)]


def _largest(
    number: Callable[..., float], case: Case, step: Fraction
) -> tuple[float | None, str | None]:
    """Return the largest number at the start and beside it, and why it has none at some place.

    A place beside the motion may be too far for steps of the scene's own size: they are halved
    there until a run goes through. A way back is right, and a form kept, with steps of any size.
    """
    numbers, lost = [], None
    for x, mu in _states(case):
        for halvings in range(HALVINGS):
            try:
                value = number(case, step / 2**halvings, x, mu)
            except StepFailure as failure:
                why = str(failure)
            else:
                numbers.append(math.inf if math.isnan(value) else value)
                break
        else:
            lost = why
    return max(numbers, default=None), lost


def _back(case: Case, step: Fraction, x: Any, mu: Any) -> float:
    """Return the distance of the end of a run and back from its start: the largest entry of the
    error in (x, μ, t) over its size."""
    forth, back = (scheme_of(case).flow(sign * step, DIGITS_OF_FORM) for sign in (1, -1))
    run = forth.trajectory(BACK, x0=x, mu0=mu)
    also = {}
    if rule_of(case).way == "reversible":
        also = {"density0": run.density[-1]}
    elif rule_of(case).way == "poincare":
        also = {"energy0": run.scheme.inner.scene.parameters[ENERGY]}
    t0 = exact_rational(run.t[-1], "t")
    again = back.trajectory(BACK, x0=run.x[-1], mu0=run.mu[-1], t0=t0, **also)
    gap = 0.0
    with mpmath.workdps(DIGITS_OF_FORM + 15):
        for one, other in ((run.x, again.x), (run.mu, again.mu), (run.t, again.t)):
            a, b = ([mpmath.mpf(e) for e in np.ravel(part)] for part in (one[0], other[-1]))
            size = max(map(abs, np.ravel(one)), default=0) or 1
            gap = max([gap, *(float(abs(p - q) / size) for p, q in zip(a, b, strict=True))])
    return gap


def _form(case: Case, step: Fraction, x: Any, mu: Any) -> float:
    """Return the larger `form_defect` from a start with its energy and with another one."""
    run = scheme_of(case).flow(step, DIGITS_OF_FORM).trajectory(0, x0=x, mu0=mu)
    energy = run.scheme.inner.scene.parameters[ENERGY]
    at = run.x[0], run.mu[0]
    return max(form_defect(case.scheme, step, *at, e) for e in (energy, energy * Fraction(9, 8)))


def _energy(case: Case, step: Fraction) -> Mapping[str, Any]:
    """Measure the energy of a long run as the study of energy does; {} where it is not constant.

    ε is halved until a run goes through with a band that is not wide, since σ may be far too large
    at one place of the motion; by Poincaré also until the energy stays: in a chaotic motion the
    drift of a symplectic step at a large ε is exponentially small at a smaller one.
    """
    scene, steps, energy = case.scene, case.steps or STEPS, dict[str, Any]()
    if scene.force is not None or scene.timed:
        return energy
    plain = Scheme(scene, rule_of(case).base)
    for _ in range(HALVINGS):
        flow = scheme_of(case).flow(step)

        turns = 0

        def errors_of(more: int, flow: Any = flow) -> tuple[np.ndarray, np.ndarray]:
            nonlocal turns
            run = flow.trajectory(more * steps, interval(more * steps))
            turns = turns_of(run)
            return np.asarray(run.t, dtype=float), energy_errors(plain, run, 16)

        try:
            run_found = measured_errors(case, errors_of)
        except StepFailure as failure:
            energy = {"measured": {"band": None, "slope": None}, "failed": str(failure)}
            step /= 2
            continue
        energy = encoded(replace(run_found, turns=turns))
        if not is_wide(run_found.band):
            bare, unit = replace(run_found, turns=turns, rows=()), case.rule.unit(case.digits)
            if rule_of(case).way != "poincare" or verdict_of_run(unit, bare) != "fail":
                break
        step /= 2
    return energy


def _local(case: Case) -> SingleSteps:
    """Return the order that single steps of the rule show, in its own time."""
    try:
        return of_scheme(scheme_of(case).inner)
    except (ReferenceFailure, DiscmechError) as failure:
        return SingleSteps(unknown=" ".join(str(failure).split()))
