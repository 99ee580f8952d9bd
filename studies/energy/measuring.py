"""Energy over long runs: its band and its secular slope."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.flows import Trajectory

from ..causes.round_off import lost_one_way
from ..core.case import (
    Case,
    Choice,
    Measurement,
    Progress,
    Verdict,
    lattice_cases,
    plain_cases,
    silent,
)
from ..core.claims import keeps_energy, not_claimed
from ..core.ended import refuse_ended
from ..evidence.laws import ENERGY, Law
from ..evidence.measuring import single_steps
from ..symplecticity.in_numbers import certain_losses
from ..systems import System, system_of
from ..systems.modified_change import Change
from ..systems.moving_energy import may_end
from ..systems.runs import FAR, energy_errors, usual_steps
from . import balance, modified
from .errors import LONGER, measured_errors, turns_of
from .judging_errors import comes_late, is_wide, verdict_of_run
from .judging_modified import drift_of, drifts_beside, is_told
from .records import NOT_BACK, Beside, Found

NAME = "energy"
NEEDS = (
    "it needs a Lagrangian, and recorded runs a scene whose energy nothing changes: energy is held "
    "against the work of each step, and they have no further steps."
)
DIGITS = (16,)
OF_ENERGY = 4  # a quarter of the states at which the study of symplecticity looks at the form
ALONE = 20_000  # steps of a forced scene without its force


def cases(choice: Choice) -> list[Case]:
    """Return every scene with a Lagrangian with every rule, in double precision by default."""
    on_scenes = [
        c
        for c in plain_cases(NAME, choice, DIGITS)
        if c.scene.is_continuous and not (c.rule.is_recorded and _work_is_done(c))
    ]
    return [*on_scenes, *lattice_cases(NAME, choice)]


def _work_is_done(case: Case) -> bool:
    """True if a force, the time or a constraint changes the energy during the case."""
    return balance.applies(case) and balance.acts(case.scene, _steps(case) * float(case.scene.step))


def measure(case: Case, progress: Progress = silent) -> Found:
    """Return the result of the run (`_measure`), and of single steps."""
    _ = case.scheme  # errors of scene or rule are reported before parts of it are derived
    return replace(_measure(case, progress), local=single_steps(case, *laws_of(case)))


def laws_of(case: Case) -> list[Law]:
    """Return the law of a step that is said to keep the energy, where nothing else changes it."""
    exact = keeps_energy(case.rule) and not system_of(case).energy_changes
    return [ENERGY[case.digits == 16]] if exact else []


def _measure(case: Case, progress: Progress) -> Found:
    """Return rows {time, error}: (H − H₀) over the energy that moves (`moving_energy`), signed.

    In each stretch of the run the rows keep the smallest and the largest error, in order, so the
    band of all steps shows. band: largest minus smallest; slope: per unit of time through all
    steps, with its 95 % interval from batch means. edge_slopes: those of the lines through the
    minima and the maxima of the run's parts; None for a run too short to have parts, or not finite.

    In a chaotic scene the mean of the band wanders, slowly and to a side that depends on round-off.
    If its edges seem to move as well, and not steadily, the case runs eight times as long, and 32
    times: wandering shrinks against the band. If a drift is certain (`certain_drift`) but less than
    a share of the band, the case runs eight times as long too: a drift continues. drifts: the
    certain ones, as [duration, slope, low, high], one per run.

    If a force, the time or a constraint changes the energy, it is compared with their work
    (`balance`).
    """
    system = system_of(case)
    if "modified_energy" in system.lacks:
        return _by_long_runs(case, system, progress)
    if balance.applies(case):
        alone = _alone(case)
        if not _work_is_done(case):
            return _measure(alone, progress)
        record = balance.measure(case, progress)
        # alone it is only measured, or constraints with other reactions still work
        if case.scene.no_energy or balance.applies(alone):
            return record
        with suppress(CannotMeasure, StepFailure):  # another motion, which may be unknown
            alone = replace(alone, steps=case.steps or ALONE)
            record = replace(record, alone=_measure(alone, progress))
        return record

    steps = _steps(case)
    still, turns, along = False, 0, list[Change]()
    beside = (modified.beside if case.rule.is_formula else _where_form_is_lost)(case)
    at_places = drifts_beside(beside)

    def errors_of(more: int) -> tuple[np.ndarray, np.ndarray]:
        nonlocal still, turns, along
        run = system.long_run(more * steps, progress)
        times, errors = np.asarray(run.t, dtype=float), system.energy_errors(run)
        # beyond a collision it is wide, or the scale is that of the collision
        if is_wide(float(np.ptp(errors))) or may_end(case.scene):
            refuse_ended(case, float(times[-1]))
        still, turns = _comes_to_rest(run), turns_of(run)
        if more == LONGER[0]:
            along = modified.measured(case, run, more * steps)
        return times, errors

    def is_enough(band: float, duration: float) -> bool:
        return at_places or is_told(along, band, duration)

    record = measured_errors(case, errors_of, is_enough)
    if comes_late(record.band, record.quarters or []) and not case.rule.is_recorded:
        half = round(record.duration / float(case.scene.step)) // 2
        record = replace(record, before=_measure(replace(case, steps=half), progress))
    return _with_drift(replace(record, still=still, turns=turns, modified=along, beside=beside))


def _where_form_is_lost(case: Case) -> list[Beside]:
    """Return the errors along runs of a program from where its steps certainly lose the form.

    They are none of a symplectic one, so only what is claimed to be one is asked. One that cannot
    make a long run soon is not looked at so often either.
    """
    claims, scheme = case.rule.claims, case.scheme
    able = not case.rule.is_recorded and usual_steps(case) >= modified.QUICK
    if not (able and claims and claims.symplectic):
        return []
    runs = list[Beside]()
    for look in certain_losses(case, OF_ENERGY):
        x, mu = np.split(look.z, [len(scheme.s.x)])
        flow: Any = scheme.flow(look.step)

        def errors_of(more: int, flow: Any = flow, start: Any = (x, mu)) -> Any:
            x, mu = start
            run = flow.trajectory(more * modified.STEPS, x0=x if len(x) else None, mu0=mu)
            return np.asarray(run.t, dtype=float), energy_errors(scheme, run)

        with suppress(StepFailure):
            record = measured_errors(case, errors_of)
            runs.append(Beside(look.z.tolist(), float(look.step), record.band, (), record))
    return runs


def measure_more(case: Case, measurement: Measurement, said: Verdict) -> dict[str, Any]:
    """Return lost: the possible drift of the energy if the rule's own formulas lose digits.

    Under a force it is that of the run without it, if there was one.
    """
    if "modified_energy" in system_of(case).lacks:
        return {}
    if "balance_order" in measurement.measured:
        if "alone" not in measurement:
            return {}
        alone = replace(_alone(case), steps=case.steps or ALONE)
        return {"alone": {**measurement["alone"], "lost": _lost(alone)}}
    if said.verdict != "fail" and said.reason != NOT_BACK:
        return {}
    return {"lost": _lost(_alone(case) if balance.applies(case) else case)}


def _alone(case: Case) -> Case:
    """Return the case without its force, and with its time and constraints held."""
    return replace(case, scene=balance.left_alone(case.scene))


def _lost(case: Case) -> float:
    return lost_one_way(case, _steps(case))


def _steps(case: Case) -> int:
    claimed = not not_claimed(case.rule, "energy")
    return case.steps or (system_of(case).usual_steps(claimed) if case.digits == 16 else 1000)


def _by_long_runs(case: Case, system: System, progress: Progress) -> Found:
    """Return `_measure` of a system without a modified energy: runs get longer until they decide.

    slopes: those of each run.
    """
    steps, slopes = case.steps or system.usual_steps(), dict[float, float]()
    for times in system.slower:

        def errors_of(more: int, times: int = times) -> tuple[np.ndarray, np.ndarray]:
            run = system.long_run(times * more * steps, progress)
            return run.t, system.energy_errors(run)

        record = measured_errors(case, errors_of)
        slopes[record.duration] = record.slope
        unit = case.rule.unit(case.digits)
        said = verdict_of_run(unit, replace(record, rows=()))
        if said != "pass":  # a slow part may come and go, which the modified energy leaves out
            taken = math.ceil(record.duration / float(case.scene.step))
            record = replace(record, modified=system.modified_changes(taken))
            said = verdict_of_run(unit, replace(record, rows=()))
        if said == "pass" or (said == "inconclusive" and times > 1):
            break
    measured = replace(record.measured, drift=record.slope * record.duration)
    return replace(record, measured=measured, slopes=[*slopes.values()])


def _comes_to_rest(run: Trajectory) -> bool:
    """True if the second half of a run moves less than a quarter as far as the first, x and μ.

    A motion that preserves volume and stays in a bounded region comes back (Poincaré), and a free
    flight moves on. Without a base μ alone may end in a point, as on a group that is not
    unimodular, so it is False there.
    """
    x, mu = (np.asarray(part, dtype=float) for part in (run.x, run.mu))
    half = len(x) // 2
    return x.shape[1] > 0 and all(
        FAR * np.ptp(part[half:], axis=0).max() < np.ptp(part[:half], axis=0).max()
        for part in (x, mu)
    )


def _with_drift(record: Found) -> Found:
    """Return the result with the drift over the run: of the modified energy, or along the slope."""
    drift = drift_of(record.modified or [], record.band)
    drift = record.slope * record.duration if drift is None else drift
    return replace(record, measured=replace(record.measured, drift=drift))
