"""Momentum maps and Casimirs over long runs, against the random walk of round-off."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.numbers import arithmetic
from discmech.integrators.scene import Conserved

from ..causes.round_off import lost_one_way
from ..core.case import (
    Case,
    Choice,
    Measurement,
    Progress,
    Verdict,
    family_cases,
    lattice_cases,
    plain_cases,
    silent,
)
from ..core.claims import claimed_names
from ..core.family import KEPT
from ..evidence.measuring import single_steps
from ..systems import System, system_of
from ..systems.runs import (
    bins,
    interval,
    long_run,
    recorded_run,
    relative_drifts,
    usual_steps,
    with_terms,
)
from .quantities import forced, formula_of, kept_in, measured_in, round_offs, scheme_for
from .records import Fault, Found, Measured, Row
from .sight import FAULT, laws_of, seen
from .work import less_work, struck

NAME = "momentum"
NEEDS = (
    "it needs a scene that declares symmetries or Casimirs (a first integral belongs to the "
    "motion, and no method is asked to keep it). Under a force, a one-step map or a composition "
    "is judged only by the quantities that the force does not change, since it defines no discrete "
    "work with which the change of the others could be compared; nor does a lattice under contact, "
    "since no row tells where in a step its gaps push."
)
DIGITS = (16, 50)
ROWS = 400
MOST_STRETCHES = 2000
FAMILY_STEPS = 20
#: parts of the step, and the most steps of them, at which the round-off of a program is measured
PARTS, SHORTEST = (16, 256), 4096
SHORT = 32  # steps of a run at which a fault is seeded if there is no long one
#: standard deviations of the walk of round-off, of which a seeded fault is made: no limit, so that
#: another limit measures nothing anew
DEVIATIONS = 5
SUMS_WORKED = 32  # the same of sums over sites, and as many steps beside them
WORKED = 200  # steps at each of which a quantity that a force changes is compared with its work


def cases(choice: Choice) -> list[Case]:
    """Return every scene with a quantity that is kept to round-off, with every rule.

    A quantity that a force changes is compared with its work; a composition does not give the work
    of its substeps, and a one-step map gives none.
    """
    candidates = plain_cases(NAME, choice, DIGITS) + lattice_cases(NAME, choice)
    candidates += family_cases(NAME, choice, FAMILY_STEPS, KEPT)
    return [c for c in candidates if measured_in(c)]


def measure(case: Case, progress: Progress = silent) -> Found:
    """Return the worst drift of each quantity, in stretches of a run and along it.

    A drift is |J_k − J_0| over the sum of the absolute values of J's terms without constants.
    Quantities of the attitude run on the scene with the attitude as base; the others do without it.
    units: {name: (of a step, of the value)}, the effect of round-off, relative to the same sum, in
    ε. lost, if it would fail: the drift if the rule's own formulas lose digits (`lost_one_way`).
    fault: {name: (relative size of a seeded fault of one step, the change by it)} (`sight.seen`).
    local: single steps, with its change in them (`sight.Keeps`). Raises `BadInput` if nothing can
    be measured.
    """
    if not measured_in(case):
        raise BadInput(f"{case.scene.name} with {case.label}: momentum cannot be measured: {NEEDS}")
    if (system := system_of(case)).momenta is not None:
        return replace(_of_sums(case, system, progress), local=single_steps(case))
    steps = case.steps or (usual_steps(case, bool(_claimed(case))) if case.digits == 16 else 100)
    apart, size = interval(steps), case.scene.step
    if (made := recorded_run(case)) is not None:
        steps, apart, size = made.steps, made.steps // (len(made.t) - 1), made.step
    kept, measured, walks = kept_in(case), measured_in(case), walks_of(case, steps)
    flown: Any = None  # a run under contact
    series: dict[str, np.ndarray] = {}
    units: dict[str, tuple[float, float]] = {}
    faults: dict[str, Fault] = {}

    def look(q: Conserved, run: Any, rows_of: Any) -> None:
        noise = round_off(case, walks, units)[q.name]
        faults[q.name] = seen(rows_of, run, noise, case.digits, f"{case.scene.name} {q.name}")

    for attitude in (True, False):  # the energy's run comes last, so that the energy study finds it
        whole = [q for q in kept if q.attitude is attitude and q.stretch is None]
        if whole:
            scheme = scheme_for(case, attitude)
            run = flown = long_run(case, scheme, steps, progress)
            drifts = {}
            for q in whole:
                formula = formula_of(scheme, q, size)
                rows_of = with_terms(scheme, formula, case.digits)
                pair = rows_of(run)
                drifts[q.name] = relative_drifts(pair, case.digits)
                units[q.name] = round_offs(scheme, formula, run, pair[1], case.digits)
                look(q, run, rows_of)
            series = drifts | series  # those of the attitude are shown after the others
    for q in kept:
        if q.stretch is not None:
            series[q.name], units[q.name] = _over_stretches(case, q, steps, progress)
    worked = [q for q in measured if q not in kept]
    for q in worked:
        flow = scheme_for(case, q.attitude).flow(size, case.digits)
        run = flown = flow.trajectory(min(WORKED, steps))
        series[q.name], units[q.name] = less_work(flow, q, run, case.digits)
    for q in (q for q in measured if q.name not in faults):
        scheme = scheme_for(case, q.attitude)
        run = scheme.flow(size, case.digits).trajectory(min(SHORT, steps))
        look(q, run, with_terms(scheme, formula_of(scheme, q, size), case.digits))
    rows = []
    each = {q.name: 1 if q.stretch is None else apart for q in kept}
    each |= {q.name: apart for q in worked}
    for first, last in bins(steps // apart + 1, ROWS):
        step = min((last - 1) * apart, steps)
        drift = {
            name: _worst(values, first * each[name], last * each[name])
            for name, values in series.items()
        }
        rows.append(Row(step, float(step * size), drift))
    worst = {name: float(drift.max()) for name, drift in series.items()}
    told = Measured(worst, {name: fault.change for name, fault in faults.items()})
    moved = [q for q in worked if forced(case, q)]
    alone = [q for q in measured if q not in moved]  # steps of a flight have no impulses
    flown = None if case.scene.contact is None else flown
    local = single_steps(case, *laws_of(alone), *laws_of(moved, True), run=flown)
    record = Found(rows, told, steps, units, faults, _over(case, steps), walks, local=local)
    if flown is None:
        return record
    pushed, by_impacts = struck(flown)
    resting, free = int((pushed & ~by_impacts).sum()), int((~pushed).sum())
    return replace(record, impacts=len(flown.impacts.t), resting=resting, free=free)


def measure_more(case: Case, measurement: Measurement, said: Verdict) -> dict[str, Any]:
    """Return lost: the possible drift of a quantity if the rule's own steps lose digits."""
    contact = case.scene.has_contact
    if said.verdict != "fail" or contact or system_of(case).momenta is not None:
        return {}
    steps = measurement["steps"]
    if case.rule.is_formula or case.rule.is_recorded:
        return {"lost": lost_one_way(case, steps)}
    return {"lost": _lost_in_short_steps(case, steps)}


def _lost_in_short_steps(case: Case, steps: int) -> float:
    """Return the drift of N steps of a program if each loses what its shortest ones lose.

    It is the largest one of all quantities. The change of a quantity by a method of any order sinks
    with the step; that by operations that round alike does not.
    """
    count, lost = min(steps, SHORTEST), 0.0
    for part in PARTS:
        size = case.scene.step / part
        for q in (q for q in kept_in(case) if q.stretch is None):
            scheme = scheme_for(case, q.attitude)
            rows_of = with_terms(scheme, formula_of(scheme, q, size), case.digits)
            with suppress(StepFailure):
                run = scheme.flow(size, case.digits).trajectory(count, max(1, count // ROWS))
                lost = max(lost, float(relative_drifts(rows_of(run), case.digits).max()))
    return lost * steps / count


def _of_sums(case: Case, system: System, progress: Progress) -> Found:
    """Return `measure` for momenta that are sums over sites, along a run of which few rows are
    kept.

    rate: |dJ/dt| of those that symmetries give, by the equations of motion without forces
    (`System.rates`). What forces change is compared with their work in single steps.
    """
    steps = case.steps or system.usual_steps()
    run = system.long_run(steps, progress)
    kept = {q.name for q in kept_in(case)}
    series = {name: along.drifts for name, along in run.momenta.items()}
    worked = [name for name in series if name not in kept]
    for name in worked:
        series[name] = np.zeros(len(run.t))
    looks = system.less_work(worked, steps, SUMS_WORKED)
    for t, gaps in looks:
        k = min(int(np.searchsorted(run.t, t)), len(run.t) - 1)
        for name, gap in gaps.items():
            series[name][k] = max(series[name][k], gap)
    rows = [Row(min((last - 1) * run.every, steps), float(run.t[last - 1]),
                {name: _worst(values, first, last) for name, values in series.items()})
            for first, last in bins(len(run.t), ROWS)]  # fmt: skip
    _, *state = run.states[-1]
    drifts = {name: float(values.max()) for name, values in series.items()}
    units = {name: along.units for name, along in run.momenta.items()}
    walks = walks_of(case, steps)
    faults = {name: Fault(FAULT * noise, system.moved(name, tuple(state), FAULT * noise))
              for name, noise in round_off(case, walks, units).items()}  # fmt: skip
    return Found(rows, Measured(drifts, rate=system.rates(run)), steps, units, faults,
                 _over(case, steps), walks, compared=len(looks) or None)  # fmt: skip


def _claimed(case: Case) -> list[str]:
    """Return the names of the quantities by which the rule is judged."""
    return claimed_names(case.rule, [q.name for q in measured_in(case)])


def _steps_of(q: Conserved, steps: int) -> int:
    """Return the steps that are made for a quantity: fewer perhaps for one in stretches."""
    return steps if q.stretch is None else min(steps, MOST_STRETCHES * q.stretch)


def _worst(drift: np.ndarray, first: int, last: int) -> float | None:
    """Return the largest of a stretch; None if it has no measurement."""
    part = drift[first:last]
    return float(part.max()) if len(part) else None


def _over_stretches(
    case: Case, q: Conserved, steps: int, progress: Progress
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return per step the drift since the stretch began, with x (the attitude) as at the start
    there.

    And the effect of round-off (`round_offs`), the largest of all stretches.
    """
    assert q.stretch is not None
    scheme = scheme_for(case, q.attitude)
    flow = scheme.flow(case.scene.step, case.digits)
    formula = formula_of(scheme, q, case.scene.step)
    rows_of = with_terms(scheme, formula, case.digits)
    total = _steps_of(q, steps)
    drifts, mu, u = [np.zeros(1)], None, None
    units = [(0.0, 0.0)]
    for done in range(0, total, q.stretch):
        run = flow.trajectory(min(q.stretch, total - done), x0=scheme.scene.x0, mu0=mu, u0=u)
        pair = rows_of(run)
        drifts.append(relative_drifts(pair, case.digits)[1:])
        if done % (16 * q.stretch) == 0:
            units.append(round_offs(scheme, formula, run, pair[1], case.digits))
        mu, u = run.mu[-1], run.u[-1]
        progress(f"{case.scene.name} {case.label}: {q.name}", done / total)
    return np.concatenate(drifts), (max(u[0] for u in units), max(u[1] for u in units))


def _epsilon(case: Case) -> float:
    return case.rule.unit(16) if case.digits == 16 else float(arithmetic(case.digits).eps)


def _over(case: Case, steps: int) -> dict[str, int]:
    """Return the steps over which each quantity was followed."""
    over = {q.name: _steps_of(q, steps) for q in kept_in(case)}
    return over | {q.name: 1 for q in measured_in(case) if q.name not in over}  # step by step


def walks_of(case: Case, steps: int) -> dict[str, int]:
    """Return how many successive roundings each quantity has had: steps, of substeps each."""
    over = _over(case, steps)
    substeps = max(1, len(case.scheme.substeps))
    return {q.name: substeps * min(over[q.name], q.stretch or over[q.name])
            for q in measured_in(case)}  # fmt: skip


def round_off(
    case: Case, walks: Mapping[str, int], units: Mapping[str, Sequence[float]],
    deviations: float = DEVIATIONS,
) -> dict[str, float]:  # fmt: skip
    """Return the effect of round-off on each quantity in so many roundings (`judge`).

    deviations: standard deviations of the walk; by default those that make the size of a fault.
    """
    units = {**dict.fromkeys(walks, (1.0, 1.0)), **units}
    return {name: _epsilon(case) * (deviations / math.sqrt(3) * math.sqrt(n) * units[name][0]
                                    + 2 * units[name][1]) for name, n in walks.items()}  # fmt: skip
