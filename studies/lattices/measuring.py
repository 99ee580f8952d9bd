"""Lattices: order in time and in space, long runs, Ω, the multisymplectic law, cost."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from discmech.integrators import BadInput
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.lattices import DualStep, poisson_defect, step_derivative, systems
from discmech.integrators.rules import OneStepMap

from ..core.case import Case, Choice, Progress, Verdict, silent
from ..energy.measuring import WIDE, judge_errors, measured_errors
from ..evidence import verdicts
from ..order.window import TOLERANCE
from ..symplecticity.measuring import limit, limits
from . import DAMPED, FLIPPED, RUNGE_KUTTA, contacts, one_bond
from .cost import costs, slopes
from .faults import CONTROLS, DampedStep, RungeKuttaStep
from .following import LongRun, followed
from .known import Known, built_in, known_of
from .orders import LEVELS, duration, end_of, fitted, in_space, in_time, slope
from .patches import patch_defects
from .quantities import change, entries_of, of_symmetries
from .reference import rates_at
from .residual import step_defects

NAME = "lattices"
NEEDS = (
    "it needs a lattice, in double precision: one that `discmech list` names, or a Lattice(...) in "
    "a file of yours, and a rule of values of L."
)
RULES = ("trapezoidal", "midpoint", "gauss-2")
STAGED = ("gauss-2",)
#: of these lattices fewer, unless rules are chosen: what others show, or takes long to compile.
#: By gauss-2 the energy of Toda's chain wanders so slowly that telling takes 8 million steps
FEWER = {"toda": ("trapezoidal",),
         "breather-box": ("midpoint",),
         **dict.fromkeys(("rotors", "membrane", "bead-chain"), ("trapezoidal", "midpoint")),
         **dict.fromkeys(("kink", "bodies", "beam", "spaghetti", "rods", "links-spherical",
                          "links-revolute"), ("trapezoidal",))}  # fmt: skip
#: lattices that take long to derive, Ω a quarter of a minute: that and cost by --thorough
LATER = ("beam", "spaghetti")
#: a beam as the other, that moves more, and chains as the rods, of bodies
BY_NAME = ("spaghetti", "links-spherical", "links-revolute")
#: times the steps where the energy seems to drift: that of many sites may come and go slowly. Where
#: a run does not tell, one eight times as long is asked, and no other
SLOWER = (1, 8, 64)
SPACE_ORDER = 2  # of central differences
FORMS = ("poisson", "bond", "patch")
DEFECTS = ("residual", "constraint", "hidden")
#: of the terms of dJ/dt: a sum that is 0 but for round-off, of up to 10⁶ sites, is far below
NO_RATE = 2.0**-30
#: what may help where errors show no order
ELSEWHERE = "give another x0, v0 or step, or the system as a Scene, which has more digits"
PAIRS = 2  # by which Ω is tested at a state


def cases(choice: Choice) -> list[Case]:
    """Every lattice by three rules, or those chosen, and the controls on lattices of their own."""
    if choice.digits and 16 not in choice.digits:
        return []
    usual_names = [name for name in systems.NAMES if name not in BY_NAME]
    chosen: Any = choice.scenes or tuple(map(systems.get, usual_names))
    found = []
    for lattice in () if choice.controls else chosen:
        rules = choice.rules or tuple(map(discretisations.get, _usual_rules(lattice)))
        found += [Case(NAME, lattice, rule, 16, choice.steps, thorough=choice.thorough)
                  for rule in rules if not isinstance(rule, OneStepMap)]  # fmt: skip
    if choice.rules:
        if choice.scenes and not found:
            names = ", ".join(rule.name for rule in choice.rules)
            raise BadInput(f"{names}: lattices run by rules, not by one-step maps; take midpoint.")
        return found
    for control in choice.controls or CONTROLS:
        name, rule, _ = CONTROLS[control]
        if any(lattice.name == name for lattice in chosen):
            scene: Any = systems.get(name)
            found.append(Case(NAME, scene, discretisations.get(rule), 16, choice.steps, control))
    if choice.controls and not found:
        names = ", ".join(CONTROLS[control][0] for control in choice.controls)
        raise BadInput(
            f"the control {', '.join(choice.controls)} is run on {names}: name that, or no lattice."
        )
    return found


def _usual_rules(lattice: Any) -> tuple[str, ...]:
    """The rules that are taken where none is chosen: with constraints those without stages."""
    usual = FEWER.get(lattice.name, RULES) if built_in(lattice) else RULES
    staged = STAGED if lattice.constraint is not None else ()
    return tuple(name for name in usual if name not in staged)


def notes(choice: Choice) -> list[str]:
    """A sentence for each lattice of yours whose constraints leave a usual rule out."""
    given: Any = choice.scenes
    return [f"{s.name} has constraints, which rules with stages do not meet: {', '.join(STAGED)} "
            "is left out." for s in given if not choice.rules and not choice.controls
            and getattr(s, "constraint", None) is not None and not built_in(s)]  # fmt: skip


def timed(case: Case) -> bool:
    """Whether the cost against N is measured: of lattices that may have any number of sites."""
    lattice: Any = case.scene
    sized = case.control is None and known_of(lattice).sized is not None
    return sized and not (case.steps or _later(case))


def together(case: Case) -> Case | None:
    """The case itself where cost is measured: its sizes take turns, disturbed alike."""
    return case if timed(case) else None


def _later(case: Case) -> bool:
    """Whether only --thorough asks for Ω and cost."""
    lattice: Any = case.scene
    return built_in(lattice) and lattice.name in LATER and not case.thorough


def depends_on(case: Case) -> str:
    """The momenta of symmetries, which no equation of a step holds."""
    given = of_symmetries(case.scene)
    return str({name: entries_of(case.scheme, part) for name, part in given.items()})


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows of four kinds. time, space: {step, error, used, why_not}, coarse to fine; step is that
    of the grid in space. run: {time, error} of the energy. cost: of `cost.costs`.

    error: of (x, μ) each over its largest, against the closed form (exact), else `solution`, and
    only where that is not to be had the change to the next finer run (held_against, why_not;
    known: below which errors say nothing).
    measured: order and space_order; energy {band, slope, …}; drift {momentum: the most, over the
    sum of its terms}; rate, dJ/dt of a lattice's symmetries by its equations; poisson, the most of
    some states; bond and patch (`patch_defects`), None on other groupoids than pair(n) and with
    constraints; residual, and of constraints constraint and hidden, the most of `step_defects` in
    those states; grows, the powers of N.
    """
    lattice: Any = case.scene
    if case.control is not None:
        return _measured_control(case, lattice)
    known, label = known_of(lattice), f"{lattice.name} {case.label}"
    if lattice.contact is not None:
        return contacts.measure(case, label, progress, timed(case))
    progress(f"{label}: order", 0.0)
    of_lattice = known.exact if known.refined is None else None
    T = duration(case)
    end, least, against = end_of(case, of_lattice, T)
    ladder = partial(in_time, case, of_lattice, end, T, least)
    rows, window = fitted("time", ladder, LEVELS, least)
    measured: dict[str, Any] = {"order": slope(window), "exact": of_lattice is not None,
                                "known": least, **against}  # fmt: skip
    measured["local"] = one_bond.measured(case)
    measured["space_order"] = None
    if known.refined is not None:
        progress(f"{label}: order in space", 0.2)
        spatial, window = fitted("space", partial(in_space, case, known), 4)
        measured["space_order"] = slope(window)
        rows += spatial
    progress(f"{label}: long run", 0.4)
    followed = _followed(case, known)
    measured["energy"] = followed["energy"]["measured"]
    measured["drift"] = {name: drift for name, (drift, _) in followed["momenta"].items()}
    measured["rate"] = _rates(case, followed["states"][-1])
    rows += [{"kind": "run", **row} for row in followed["energy"]["rows"]]
    progress(f"{label}: Ω", 0.6)
    measured |= dict.fromkeys(FORMS) if _later(case) else _forms(case, followed["states"])
    measured |= _defects(case, followed["states"])
    if timed(case) and known.sized is not None:
        progress(f"{label}: cost", 0.8)
        in_turn = costs(known.sized, case.rule, case.thorough)
        measured["grows"] = slopes(in_turn)
        rows += in_turn
    else:
        measured["grows"] = None
    return {"rows": rows, "measured": measured, "followed": followed}


# -- long runs ----------------------------------------------------------------------------


def _followed(case: Case, known: Known) -> dict[str, Any]:
    """{"energy": as `measured_errors`, "momenta": {name: (drift, limit)}, "states": [(x, μ)]}."""
    lattice: Any = case.scene
    scheme, steps = case.scheme, case.steps or known.steps
    first: list[LongRun] = []

    @cache  # a run eight times as long is the first of those that are so much longer
    def errors_of(length: int) -> tuple[np.ndarray, np.ndarray]:
        parts = {} if first else {**known.momenta, **of_symmetries(lattice)}
        run = followed(scheme, scheme.flow(lattice.step), length * steps, parts)
        first.extend([] if first else [run])
        return run.t, run.errors

    def longer(times: int, more: int) -> tuple[np.ndarray, np.ndarray]:
        return errors_of(times * more)

    of_runs = dict[float, float]()
    for times in SLOWER:
        energy = measured_errors(case, partial(longer, times))
        of_runs[energy["duration"]] = energy["measured"]["slope"]
        verdict = judge_errors(case, energy).verdict
        if verdict == "pass" or (verdict == "inconclusive" and times > 1):
            break
    return {"energy": energy, "slopes": [*of_runs.values()], "momenta": first[0].momenta,
            "states": first[0].states}  # fmt: skip


def _rates(case: Case, state: tuple[np.ndarray, np.ndarray]) -> dict[str, float]:
    """|dJ/dt| of the momenta of a lattice's symmetries, by the equations of motion (`change`)."""
    parts = of_symmetries(case.scene)
    rates = rates_at(case.scheme, *state) if parts else state
    return {name: change(case.scheme, part, state, rates) for name, part in parts.items()}


# -- Ω ------------------------------------------------------------------------------------


def _forms(case: Case, states: list[tuple[np.ndarray, np.ndarray]]) -> dict[str, Any]:
    """{"poisson", "bond", "patch"}; None of compositions, whose substeps are the base's."""
    found: dict[str, Any] = dict.fromkeys(FORMS)
    lattice: Any = case.scene
    flow = case.scheme.flow(lattice.step)
    make = partial(step_derivative, flow)
    try:
        found["poisson"] = float(
            np.max([poisson_defect(make(*at), PAIRS, k) for k, at in enumerate(states)])
        )
    except CannotMeasure:
        return found
    if lattice.groupoid.kind == "pair" and lattice.constraint is None:
        found |= patch_defects(make, lattice, *states[-1])
    return found


def _defects(case: Case, states: list[tuple[np.ndarray, np.ndarray]]) -> dict[str, float | None]:
    """{"residual", "constraint", "hidden"}, None where there is none."""
    flow, none = case.scheme.flow(case.scene.step), dict.fromkeys(DEFECTS)
    try:
        found = [step_defects(flow, *at) for at in states]
    except CannotMeasure:
        return none
    return {**none, **{key: float(np.max([e[key] for e in found])) for key in found[0]}}


def _measured_control(case: Case, lattice: Any) -> dict[str, Any]:
    """{"poisson", "bond", "patch", "drift"} of a control, as far as it has them."""
    flow = case.scheme.flow(CONTROLS[str(case.control)][2])
    start = flow.trajectory(4, 4)
    x, mu = start.x[-1], start.mu[-1]
    found: dict[str, Any] = {}
    if case.control == FLIPPED:
        found["poisson"] = poisson_defect(DualStep(flow, x, mu), PAIRS, 0, bracket_sign=-1)
    if case.control == DAMPED:
        found["poisson"] = poisson_defect(DampedStep(flow, x, mu), PAIRS, 0)
        found |= patch_defects(partial(DampedStep, flow), lattice, x, mu)
        total, size = mu.sum(), abs(mu).sum()
        for _ in range(8):
            x, mu = DampedStep(flow, x, mu).after
        found["drift"] = float(abs(mu.sum() - total) / size)
    if case.control == RUNGE_KUTTA:
        found |= patch_defects(partial(RungeKuttaStep, flow), lattice, x, mu)
    return {"rows": [{"kind": "control", **found}], "measured": found}


# -- verdict ------------------------------------------------------------------------------

#: what must see each control
SEEN = {DAMPED: ("poisson", "patch", "drift"), FLIPPED: ("poisson",), RUNGE_KUTTA: ("patch",)}


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """What the runs say, and single steps of one bond (`one_bond`): a pass needs both."""
    told = _judge_runs(case, measurement)
    if case.control is not None:
        return told
    local, what = measurement["measured"].get("local"), "two neighbours and their bond"
    return verdicts.judge(local, told, case.scheme.order, what)


def _judge_runs(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Orders as in the study of order, energy and momenta as in theirs, forms to round-off.

    A control has to be seen a thousandfold by all that should see it. Times are not judged.
    """
    found, allowed = measurement["measured"], limit(16)
    if case.control is not None:
        missed = [k for k in SEEN[case.control] if not found[k] >= 1e3 * allowed]
        said = f"the control was not caught: its {', '.join(missed)} is round-off."
        return Verdict("fail" if missed else "pass", said if missed else "",
                       {"at_least": 1e3 * allowed})  # fmt: skip
    if "contact" in found:
        return contacts.judge(found)
    followed, tolerance = measurement["followed"], TOLERANCE[True]
    most_of = {name: most for name, (_, most) in followed["momenta"].items()}
    residual = limits(16)["residual"]
    expected = {"order": case.scheme.order, "tolerance": tolerance, "limit": allowed,
                "residual": residual, "drift": most_of}  # fmt: skip
    if found["space_order"] is not None:
        expected["space_order"] = SPACE_ORDER
    unclear = []
    for key, wanted, words in (("order", case.scheme.order, "in time"),
                               ("space_order", SPACE_ORDER, "in space")):  # fmt: skip
        order = found[key]
        if key == "space_order" and known_of(case.scene).refined is None:  # type: ignore[arg-type]
            continue
        if order is None:
            unclear.append(f"fewer than four errors {words} lie on a straight line above round-off")
        elif wanted is not None and abs(order - wanted) > tolerance:
            side = "below" if order < wanted else "above"
            return Verdict("fail", f"the order {words} is {order:.3f}, {side} the expected "
                           f"{wanted} by more than {tolerance}.", expected)  # fmt: skip
    for name, words, most in (
        ("residual", "the step that runs is not that of the equations", residual),
        ("constraint", "a step does not end on the constraints", residual),
        ("hidden", "a row's velocity does not meet the constraints", residual),
        ("poisson", "the step is no Poisson map", allowed),
        ("bond", "one end of a bond gains what the other does not lose", allowed),
        ("patch", "what enters a patch neither stays nor leaves", allowed),
    ):
        if found.get(name) is not None and not found[name] <= most:
            return Verdict("fail", f"{words}: {name} is {found[name]:.2g}, where {most:.0e} is "
                           "allowed.", expected)  # fmt: skip
    for name, (drift, most) in followed["momenta"].items():
        if not drift <= most:
            rate = (found.get("rate") or {}).get(name, 0.0)
            cause = "" if rate <= NO_RATE else (
                " It is no symmetry of L: by the equations of motion its momentum changes, by "
                f"{rate:.1g} of the terms of dJ/dt.")  # fmt: skip
            said = f"{name} drifts by {drift:.2g}, more than {most:.1e}.{cause}"
            return Verdict("fail", said, expected)
    energy = judge_errors(case, followed["energy"])
    expected |= energy.expected
    wide = followed["energy"]["measured"]["band"] > WIDE
    if energy.verdict == "fail" and (wide or _goes_on(followed["slopes"])):
        return Verdict("fail", energy.reason, expected)
    if energy.verdict == "fail":
        energy.reason += " Its rate changes with the length of the run; take more --steps."
    if unclear or energy.verdict != "pass":
        reason = f"{'; '.join(unclear)}: {ELSEWHERE}." if unclear else energy.reason
        return Verdict("inconclusive", reason, expected)
    return Verdict("pass", "", expected)


def _goes_on(slopes_of_runs: list[float]) -> bool:
    """Whether the last two runs drift alike: within a factor of two, and the same way.

    What comes and goes changes its slope as runs get eight times as long.
    """
    *_, before, last = [np.nan, *slopes_of_runs]
    return not np.isfinite(last) or (len(slopes_of_runs) > 1 and 0.5 <= last / before <= 2)
