"""Lattices: the multisymplectic law on patches, order in space, and cost against N."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from discmech.integrators import rules as discretisations
from discmech.integrators.extensions.lattices import DualStep, poisson_defect, step_derivative
from discmech.integrators.extensions.lattices import scenes as systems

from ..core.case import Case, Choice, Progress, lattice_cases, silent
from ..core.controls import chosen_controls
from ..core.parts import RULES, is_built_in, usual_lattices, usual_rules
from ..evidence.measuring import single_steps
from ..systems import system_of
from ..systems.known import known_of
from ..systems.lattice_system import LATER
from . import DAMPED, FLIPPED, RUNGE_KUTTA, contacts
from .cost import costs, slopes
from .faults import CONTROLS, DampedStep, RungeKuttaStep
from .patches import patch_defects
from .space import in_space

NAME = "lattices"
NEEDS = (
    "it needs a lattice, in double precision: one that `discmech list` names, or a Lattice(...) in "
    "a file of yours, and a rule of values of L."
)
SPACE_ORDER = 2  # the order of central differences
LAWS = ("bond", "patch")
PAIRS = 2  # pairs by which Ω is tested at a state


def cases(choice: Choice) -> list[Case]:
    """Return every lattice with three rules, or the chosen ones, and the controls."""
    if choice.digits and 16 not in choice.digits:
        return lattice_cases(NAME, choice)  # none, or it says why
    if choice.rules and not choice.scenes:  # without a chosen scene all lattices are tried
        choice = replace(choice, scenes=usual_lattices())  # type: ignore[arg-type]
    all_cases = [] if choice.controls else lattice_cases(NAME, choice)
    if choice.rules:
        return all_cases
    of_name: Any = systems.get
    by_control = [Case(NAME, of_name(name), discretisations.get(rule), 16, choice.steps, control)
                  for control, (name, rule, _) in CONTROLS.items()]  # fmt: skip
    return all_cases + chosen_controls(choice, by_control)


def _on_patches(lattice: Any) -> bool:
    """True if variations go through its bonds, so that there is a law on patches."""
    free = not (lattice.has_contact or lattice.forced) and lattice.constraint is None
    return bool(free and lattice.groupoid.canonical)


def notes(choice: Choice) -> list[str]:
    """Return a sentence for each user's lattice whose constraints leave a usual rule out."""
    lattices: Any = choice.scenes
    left = {s.name: [name for name in RULES if name not in usual_rules(s)] for s in lattices
            if not (choice.rules or choice.controls or is_built_in(s))}  # fmt: skip
    return [f"{name} has constraints, which rules with stages do not meet: {', '.join(rules)} "
            "is left out." for name, rules in left.items() if rules]  # fmt: skip


def timed(case: Case) -> bool:
    """True if the cost against N is measured: for lattices that may have any number of sites."""
    lattice: Any = case.scene
    sized = case.control is None and known_of(lattice).sized is not None
    later = is_built_in(lattice) and lattice.name in LATER and not case.thorough
    return sized and not (case.steps or later)


def together(case: Case) -> Case | None:
    """Return the case itself if cost is measured: its sizes take turns, disturbed alike."""
    return case if timed(case) else None


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return rows of four kinds.

    local, laws: the numbers of `measured`. space: {step, error, used, why_not}, coarse to fine;
    step is that of the grid. cost: that of `cost.costs`. measured: local, the order of single
    steps; space_order, of fields; the defects of a step from the end of a long run, which ties the
    derivatives of the law to what runs; bond and patch (`patch_defects`), None on other groupoids
    than pair(n) and with constraints; grows, the powers of N.
    """
    lattice: Any = case.scene
    if case.control is not None:
        return _measured_control(case, lattice)
    known, label = known_of(lattice), f"{lattice.name} {case.label}"
    if lattice.has_contact:
        return contacts.measure(case, label, progress, timed(case))
    measured: dict[str, Any] = {"space_order": None, "grows": None}
    rows: list[dict[str, Any]] = []
    _ = case.scheme
    progress(f"{label}: single steps", 0.0)
    measured["local"] = local = single_steps(case, least=case.order or 1)
    if local is not None:
        rows.append({"kind": "local", "step": local.step or None, "order": local.order})
    if known.refined is not None:
        progress(f"{label}: order in space", 0.2)
        spatial, measured["space_order"] = in_space(case.rule, known)
        rows += spatial
    progress(f"{label}: the law on patches", 0.4)
    measured |= (laws := _laws(case, lattice, progress))
    rows.append({"kind": "laws", "step": float(lattice.step), **laws})
    if timed(case) and known.sized is not None:
        progress(f"{label}: cost", 0.8)
        in_turn = costs(known.sized, case.rule, case.thorough)
        measured["grows"] = slopes(in_turn)
        rows += in_turn
    return {"rows": rows, "measured": measured}


def _laws(case: Case, lattice: Any, progress: Progress) -> dict[str, float | None]:
    """Return the defects of a step, and {"bond", "patch"}, from the end of a long run."""
    system: Any = system_of(case)
    states = system.states(progress)
    assert states is not None
    t, *state = states[-1]
    flow = system.flow(lattice.step)
    defects: dict[str, float | None] = {
        **dict.fromkeys(LAWS),
        **system.step_defects(flow, *state, t=t),
    }
    if _on_patches(lattice):
        makes = [partial(step_derivative, part, t=t) for part in flow.parts]
        defects |= patch_defects(makes, lattice, *state)
    return defects


def _measured_control(case: Case, lattice: Any) -> dict[str, Any]:
    """Return {"poisson", "bond", "patch", "drift"} of a control, as far as it has them."""
    flow: Any = case.scheme.flow(CONTROLS[str(case.control)][2])
    start = flow.trajectory(4, 4)
    x, mu = start.x[-1], start.mu[-1]
    figures: dict[str, Any] = {}
    if case.control == FLIPPED:
        figures["poisson"] = poisson_defect(DualStep(flow, x, mu), PAIRS, 0, bracket_sign=-1)
    if case.control == DAMPED:
        figures["poisson"] = poisson_defect(DampedStep(flow, x, mu), PAIRS, 0)
        figures |= patch_defects([partial(DampedStep, flow)], lattice, x, mu)
        total, size = mu.sum(), abs(mu).sum()
        for _ in range(8):
            x, mu = DampedStep(flow, x, mu).after
        figures["drift"] = float(abs(mu.sum() - total) / size)
    if case.control == RUNGE_KUTTA:
        figures |= patch_defects([partial(RungeKuttaStep, flow)], lattice, x, mu)
    return {"rows": [{"kind": "control", **figures}], "measured": figures}
