"""Symplecticity: the pullback of Ω under the prolongation of Ψ, and the Poisson form on the dual.

Both are exact statements about one step, so they are tested at many points of trajectories, at the
scene's step and at the largest stable one: at small steps even Runge–Kutta methods pass. They are
statements about the maps that L_d defines, so a third one belongs to them: the steps of the run are
steps of these maps (the residual).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from discmech.integrators import StepFailure, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import form_change_defects, restricted_form_defect, volume_defect

from ..core import controls
from ..core.case import Case, Choice, Progress, family_cases, lattice_cases, plain_cases, silent
from ..core.claims import keeps_volume
from ..core.family import KEPT
from ..evidence.laws import FORM, VOLUME, Law
from ..evidence.measuring import single_steps
from ..systems import system_of
from ..systems.runs import follow, largest_stable_step
from . import along_run
from .constraints import constraint_defect
from .limits import CHANGES, FORMS
from .records import Defects, Found, FoundOfNumbers, Row

NAME = "symplecticity"
NEEDS = (
    "recorded runs make no further steps, and under a force a one-step map has no form to keep; "
    "all else can be tested."
)
DIGITS = (16, 50)
#: points per step size: forms are evaluated to many digits at each, in doubles too
POINTS = 8
STEPS = {True: 192, False: 64}  # of a run, in double precision or not
FAMILY_STEPS = 8
#: scenes of the controls: one without a group, one without a base, two with both
CONTROL_SCENES = ("pendulum", "rigid-body", "heavy-top", "rotor-body")


def cases(choice: Choice) -> list[Case]:
    """Return every scene with every rule, and the controls on four scenes unless rules were chosen.

    With controls chosen, only these. Raises `BadInput` if none of them can run.
    """
    on_scenes = [] if choice.controls else plain_cases(NAME, choice, DIGITS)
    on_lattices = [] if choice.controls else lattice_cases(NAME, choice)
    # under a force no form is kept, and for a one-step map this study asks nothing else
    on_scenes = [c for c in on_scenes if c.scene.force is None or c.rule.kind != "one-step map"]
    on_scenes += [] if choice.controls else family_cases(NAME, choice, FAMILY_STEPS, KEPT)
    by_control = [
        Case(NAME, scene, discretisations.trapezoidal, digits, choice.steps, control)
        for digits in choice.digits or DIGITS
        for scene in map(scenes.get, CONTROL_SCENES)
        for control in controls.NAMES
        # the sign of a bracket matters only beside an anchor
        if control != controls.FLIPPED or scene.groupoid.kind in ("action", "product")
    ]  # fmt: skip
    return on_scenes + on_lattices + controls.chosen_controls(choice, by_control)


def _kinds(case: Case) -> tuple[str, ...]:
    if (own := system_of(case).form_kinds) is not None:
        return own
    scene, kinds = case.scene, [*FORMS]
    if scene.force is not None and not scene.no_form:
        kinds += CHANGES[:1] if scene.all_constraints else CHANGES
    if keeps_volume(case.rule) and not VOLUME.refusal(case.scheme):
        kinds += CHANGES[1:]
    return (*kinds, "residual", *(["constraint"] if scene.all_constraints else []))


def measure(case: Case, progress: Progress = silent) -> Found | FoundOfNumbers:
    """Return the defects of maps and run (`_measure`), and those of single steps."""
    record = _measure(case, progress)
    progress(f"{case.scene.name} {case.label}: steps from drawn places", 1.0)
    # a lattice's form is measured in states of its run
    laws: list[Law] = [FORM] if system_of(case).form_kinds is None else []
    laws += [VOLUME] if "volume" in _kinds(case) and case.scene.force is None else []
    return replace(record, local=single_steps(case, *laws))


def _measure(case: Case, progress: Progress) -> Found | FoundOfNumbers:
    """Return rows of pullback, poisson, residual, and the worst of each.

    On constrained scenes also constraint (`constraint_defect`); under a force also change and
    volume (`form_change_defects`) and contraction, the rate at which volume shrinks: measured is
    its mean at the scene's step.
    """
    if not case.rule.is_formula and not case.control:
        return along_run.measure(case, progress)
    if (of_run := _in_states(case, progress)) is not None:
        return of_run
    label = f"{case.scene.name} {case.label}"
    progress(f"{label}: largest stable step", 0.0)
    try:
        tried = largest = largest_stable_step(case.scheme)
    except CannotMeasure:  # no energy to judge stability by: the scene's own step has to do
        tried = largest = Fraction(case.scene.step)
    if case.control:
        rows = _control_rows(case, largest)
    else:
        rows, largest = _rows(case, largest)
    measured = _worst_of(rows, _kinds(case))
    if "contraction" in rows[0].defects:
        own = [row.defects["contraction"] for row in rows if row.step == float(case.scene.step)]
        measured["contraction"] = sum(e for e in own if e is not None) / len(own)
    # a step this long could not be followed; the last rows are those of a part
    left_out = float(tried) if largest != tried else None
    return Found(rows, measured, left_out_step=left_out)


def _in_states(case: Case, progress: Progress) -> Found | None:
    """Return `_measure` in some states of a long run, at the usual step; None without any."""
    system = system_of(case)
    if (states := system.states(progress)) is None:
        return None
    flow, rows = system.flow(case.scene.step), list[Row]()
    for k, (t, x, mu) in enumerate(states):
        form = {"pullback": None, "poisson": system.form_defect(flow, x, mu, seed=k)}
        rows.append(Row(float(flow.step), k, t, form | system.step_defects(flow, x, mu)))
    return Found(rows, {"pullback": None, **_worst_of(rows, _kinds(case))})


def _rows(case: Case, largest: Fraction) -> tuple[list[Row], Fraction]:
    """Return the rows at the scene's step and at the largest one, and the latter step."""
    own = Fraction(case.scene.step)
    rows = _rows_at(case, own)
    while largest != own:
        try:
            return rows + _rows_at(case, largest), largest
        except StepFailure:
            if not _several(case) or largest < own:
                raise
            largest /= 2  # so long a step has several solutions: maps and run differ
    return rows, largest


def _several(case: Case) -> bool:
    """True if a long step may have several solutions in its substeps or stages.

    A run does not record the one that it took; it records only u.
    """
    return not case.scheme.has_arrows or len(case.scheme.s.stages) > 0


def _rows_at(case: Case, step: Fraction) -> list[Row]:
    steps = case.steps or STEPS[case.digits == 16]
    followed = step <= case.scene.step or not _several(case)
    system = system_of(case)
    flow = system.flow(step)
    run = follow(case, flow, steps)
    rows = []
    for i, k in enumerate(range(0, steps, max(1, steps // POINTS))):
        x, u, mu = run.base[k], run.u[k], run.mu[k]
        taken = run.base[k + 1], run.mu[k + 1]
        defects: Defects = {
            # None if a step is no arrow; otherwise the run's next one, for Newton may find another
            "pullback": float(flow.pullback_defect(x, u, v0=run.u[k + 1]))
            if case.scheme.has_arrows else None,
            "poisson": system.form_defect(flow, x, mu, u),
            **(system.step_defects(flow, x, mu, taken, u) if followed else {"residual": None}),
            **_change(case, flow, x, mu, u),
            **({"constraint": constraint_defect(flow, run, k)} if "constraint" in _kinds(case)
               else {}),
        }  # fmt: skip
        rows.append(Row(float(step), i, float(run.t[k]), defects))
    return rows


def _change(case: Case, flow: Any, x: Any, mu: Any, u: Any) -> dict[str, float | None]:
    """Return the change of Ω and of phase-space volume by a force; without one what is claimed."""
    if "change" not in (kinds := _kinds(case)):
        return {"volume": float(volume_defect(flow, x, mu, u))} if "volume" in kinds else {}
    if case.scene.all_constraints:
        if flow.scheme.substeps:
            return {"change": None}
        return {"change": float(restricted_form_defect(flow, x, mu, u, forced=True))}
    change, volume, grown = form_change_defects(flow, x, mu, u)
    rate = -math.log(abs(grown)) / float(flow.step)
    return {"change": float(change), "volume": float(volume), "contraction": rate}


def _control_rows(case: Case, largest: Fraction) -> list[Row]:
    """Return rows at the largest stable step and, for Runge–Kutta methods, at ever smaller ones."""
    rows = []
    smaller = 8 if case.control in controls.RUNGE_KUTTA and case.digits == 16 else 1
    for k in range(smaller):
        flow = case.scheme.flow(largest / 8**k, case.digits)
        for i, (pullback, poisson) in enumerate(_control_defects(case, flow)):
            defects = {"pullback": pullback, "poisson": poisson, "residual": None}
            rows.append(Row(float(flow.step), i, float(flow.step * i), defects))
    return rows


def _control_defects(case: Case, flow: Any) -> list[tuple[float | None, float | None]]:
    name, points = str(case.control), 4
    if name in controls.RUNGE_KUTTA:
        return [(None, d) for d in controls.runge_kutta_defects(flow, name, points)]
    run = flow.trajectory(points)
    if name == controls.DAMPED:
        return [(controls.damped_defect(flow, x, u), None)
                for x, u in zip(run.base, run.u, strict=True)]  # fmt: skip
    return [(None, float(flow.poisson_defect(x, mu, u0=u, bracket_sign=-1)))
            for x, u, mu in zip(run.base, run.u, run.mu, strict=True)]  # fmt: skip


def _worst_of(rows: Sequence[Row], kinds: Sequence[str]) -> dict[str, float | None]:
    """Return the largest defect of each kind; None for one that is measured nowhere."""
    worst = {kind: worst_row(rows, kind) for kind in kinds}
    return {kind: None if row is None else row.defects[kind] for kind, row in worst.items()}


def worst_row(rows: Sequence[Row], kind: str) -> Row | None:
    """Return the row of the largest defect; one that is not a number is worse than any."""
    seen = [(badness(value), row) for row in rows if (value := row.defects[kind]) is not None]
    return max(seen, key=lambda pair: pair[0], default=(0.0, None))[1]


def badness(value: float) -> float:
    """Return the value by which defects are compared: one that is not a number is the largest."""
    return math.inf if math.isnan(value) else value
