"""Contact: the laws of a step, energy, times of impacts, and Ω between and across elastic ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import log2
from typing import Any

import numpy as np

from discmech.integrators import BadInput, scenes
from discmech.integrators import rules as discretisations

from ..core.case import Case, Choice, Progress, Verdict, plain_cases, silent
from ..symplecticity.measuring import limit
from .faults import CONTROLS, flow_with
from .laws import defects, energies

NAME = "contact"
NEEDS = "it needs a scene with contact, such as bouncing-ball."
DIGITS = (16,)
RULES = ("midpoint", "trapezoidal")
MODES = ("stepped", "located")
STEPS = 200
#: 1 − cos of the largest angle, 29°, by which a slip may leave those at both ends within a step
TURN = 0.125
#: an order may be less than the rule's by so much: two steps of which the finer is not yet fine,
#: against one that has (1/8)^p of the error itself
SLACK = 0.4
#: a step across an impact is differentiated by central differences: what they leave is DELTA²
FORM_DIGITS, DELTA = 40, "1e-12"
FORM = 1e-20
#: with half the step, what is of order 1 or more falls by this at least
FALLS = 1.5
AWAY = 1e-9  # of the largest coordinate: a gap is open, and stays so where DELTA moves it
WORDS = {
    "penetration": "a gap is negative", "pull": "a contact pulls",
    "complementarity": "an open gap pushes", "cone": "friction leaves its cone",
    "slip": "friction is not against the slip", "impact_energy": "an impact adds energy",
    "jump": "a momentum does not change by its impulses",
    "restitution": "a rebound is not e times the approach",
}  # fmt: skip


def cases(choice: Choice) -> list[Case]:
    """Every scene with contact by two rules, or those chosen, and the controls on their scenes."""
    chosen = choice.scenes or tuple(scenes.with_contact())
    rules = choice.rules or tuple(map(discretisations.get, RULES))
    found = (
        []
        if choice.controls
        else plain_cases(NAME, replace(choice, scenes=chosen, rules=rules), DIGITS)
    )
    if choice.rules and not choice.controls:
        return found
    rule = (choice.rules or tuple(map(discretisations.get, RULES)))[0]
    for control in choice.controls or CONTROLS:
        own = [s for s in chosen if s.name == CONTROLS[control][0]]
        found += [Case(NAME, scene, rule, digits, choice.steps, control)
                  for scene in own for digits in choice.digits or DIGITS]  # fmt: skip
    if choice.controls and not found:
        names = ", ".join(CONTROLS[control][0] for control in choice.controls)
        raise BadInput(
            f"the control {', '.join(choice.controls)} is run on {names}: name that, or no scene."
        )
    return found


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {mode, time, energy}; measured: of each mode, the defects (`laws`), the largest rise of
    the energy with h and h/2, and the impacts; orders of times, and the defects of Ω.

    rises: H − the least H before, over the largest sum of its terms. late: by how many steps the
    first impact is, stepped. order: of the times of the first two impacts (of the last place, where
    there is none) with h and h/2 against h/8, located; None where they are round-off.
    """
    steps = case.steps or min(STEPS, case.scene.steps_for(case.scene.step))
    if case.control is not None:
        values = {"impacts": "located", **CONTROLS[case.control][1]}
        scheme = case.scheme_on(case.scene.with_values(**values))
        faulty: Any = flow_with(case.control, scheme, case.scene.step, case.digits).trajectory(
            steps
        )
        return {"measured": defects(scheme, faulty, case.digits),
                "rows": [{"impacts": len(faulty.impacts.t)}]}  # fmt: skip
    measured: dict[str, Any] = {}
    rows, runs = [], {}
    for part, mode in enumerate(MODES):
        progress(f"{case.scene.name} {case.label}: {mode}", part / 4)
        run: Any = _flow(case, 1, mode).trajectory(steps)
        H, size = energies(case.scheme, run, case.digits)
        rises = [rise(H) / size]
        if rises[0] > limit(case.digits):  # what is no number is told by `judge`
            finer: Any = _flow(case, 2, mode).trajectory(2 * steps)
            rises.append(rise(energies(case.scheme, finer, case.digits)[0]) / size)
        runs[mode] = run
        measured[mode] = {**defects(case.scheme, run, case.digits), "rises": rises,
                          "impacts": len(run.impacts.t)}  # fmt: skip
        rows += [{"mode": mode, "time": float(t), "energy": float(e)}
                 for t, e in zip(run.t, H, strict=True)]  # fmt: skip
    progress(f"{case.scene.name} {case.label}: times of impacts", 0.5)
    located = runs["located"]
    last = float(located.impacts.t[:2][-1]) if len(located.impacts.t) else None
    measured |= {"late": _lateness(runs["stepped"], located), "rests": _rests(located, last)}
    measured |= _times(case, last, steps)
    progress(f"{case.scene.name} {case.label}: Ω", 0.75)
    measured["form"] = _form(case, steps)
    return {"measured": measured, "rows": rows}


def _flow(case: Case, part: int, mode: str) -> Any:
    """The flow at a part of the scene's step."""
    return case.scheme.flow(case.scene.step / part, case.digits, impacts=mode)


def rise(H: np.ndarray) -> float:
    """The most that the energy of rows is above the least before."""
    return float((H - np.minimum.accumulate(H)).max())


def _lateness(stepped: Any, located: Any) -> float | None:
    """By how many steps the first impact is late, stepped; None where it is not the same one.

    A gap that closes and opens again inside a step is not seen by steps that end on either side.
    """
    if not len(stepped.impacts.t) or not len(located.impacts.t):
        return None
    i, j = (int(run.impacts.impulses[0, :, 0].argmax()) for run in (stepped, located))
    size = float(located.step)
    end = min(int((located.impacts.t[0] - located.t[0]) // size) + 1, len(stepped.t) - 1)
    if i != j or stepped.gaps[end, i] > AWAY * abs(stepped.x).max():
        return None
    return float(stepped.impacts.t[0] - located.impacts.t[0]) / size


def _rests(run: Any, last: float | None) -> bool:
    """Whether a gap stays closed for a step without an impact before that time."""
    struck = {int((t - run.t[0]) // float(run.step)) + e for t in run.impacts.t for e in (-1, 0, 1)}
    pushed = (run.impulses[:-1, :, 0] > 0).any(axis=1)
    return any(p and k not in struck and (last is None or run.t[k] < last)
               for k, p in enumerate(pushed))  # fmt: skip


def _times(case: Case, last: float | None, steps: int) -> dict[str, Any]:
    """{"order", "time_error"}: of the times of the first impacts, or of the last place."""
    size = float(case.scene.step)
    steps = steps if last is None else min(steps, int(last / size) + 2)

    def asked(part: int) -> np.ndarray:
        run = _flow(case, part, "located").trajectory(part * steps, part * steps)
        first = run.x[-1] if last is None else run.impacts.t[:2]
        return np.array([float(e) for e in first])

    best, errors = asked(8), list[float]()
    for part in (1, 2):
        found = asked(part)
        if len(found) != len(best):
            return {"order": None, "time_error": None}
        errors.append(float(abs(found - best).max()))
    if errors[-1] <= 10 * limit(case.digits) * float(abs(best).max()):
        return {"order": None, "time_error": errors[-1]}
    return {"order": log2(errors[0] / errors[-1]), "time_error": errors[-1]}


def _form(case: Case, steps: int) -> dict[str, Any]:
    """{"free": of a step between impacts, "across": of one with an elastic impact, at h and h/2}.

    None where it is not demanded: friction, a force, e < 1, or no impact from an open gap.
    """
    scene = case.scene
    free = case.scheme_on(scene.with_values(contact=None))
    start = free.flow(scene.step, case.digits).trajectory(0)
    found: dict[str, Any] = {"free": None, "across": None}
    if scene.force is None:
        flow = free.flow(scene.step, case.digits)
        found["free"] = float(flow.poisson_defect(start.base[0], start.mu[0]))
    elastic = scene.restitution == 1 and not any(np.atleast_1d(np.array(scene.friction) > 0))
    if elastic and scene.force is None:
        found["across"] = [_across(case, steps * part, part) for part in (1, 2)]
    return found


def _across(case: Case, steps: int, part: int) -> float | None:
    """The defect of M Π Mᵀ = Π′ of the step with the first impact, by differences at 40 digits."""
    scheme, size = case.scheme, case.scene.step / part
    run = _flow(case, part, "located").trajectory(steps)
    if not len(run.impacts.t):
        return None
    k = int(run.impacts.t[0] // float(size))
    if not run.gaps[k].min() > AWAY * abs(run.x[k]).max(initial=1e-300):
        return None  # a start on a gap cannot be moved to its other side
    flow = scheme.flow(size, FORM_DIGITS, impacts="located")
    numbers = flow.numbers
    with numbers.working():
        z = numbers.array([numbers.number(float(e)) for row in (run.base[k], run.mu[k])
                           for e in row], -1)  # fmt: skip
        n, delta = run.base.shape[1], numbers.number(DELTA)

        def after(z: np.ndarray) -> np.ndarray:
            moved = np.concatenate(flow.dual_step(z[:n], z[n:]))
            return numbers.array([numbers.number(e) for e in moved], -1)

        ways = delta * numbers.identity(len(z))
        M = np.array([(after(z + way) - after(z - way)) / (2 * delta) for way in ways]).T
        first, last = (flow.geometry.poisson_tensor(at[:n], at[n:]).value for at in (z, after(z)))
        off = abs(M @ first @ M.T - last).max() / abs(M).max() ** 2
        return float(off)


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Laws to round-off; energies that rise fall with the rule's order; times by the order.

    A control has to break one of the laws a thousandfold.
    """
    found, allowed = measurement["measured"], limit(case.digits)
    if case.control is not None:
        broken = [k for k, v in found.items() if not v <= (TURN if k == "slip" else 1e3 * allowed)]
        reason = "" if broken else "the control was not caught: it breaks no law of contact."
        return Verdict("fail" if reason else "pass", reason, {"at_least": 1e3 * allowed})
    order = case.scheme.order
    expected = {"limit": allowed, "slip": TURN, "late": 1.0}
    if order is not None:
        # while a gap stays closed the motion is of order 2, whatever the rule's order
        expected["order"] = (min(order, 2) if found["rests"] else order) - SLACK
    if reason := next(_broken(case, found, expected), ""):
        return Verdict("fail", reason, expected)
    if found["time_error"] is None:
        return Verdict(
            "inconclusive",
            "with half or an eighth of the step there are others among the first two impacts: "
            "their times have no order to be judged; take a smaller step.",
            expected,
        )
    return Verdict("pass", "", expected)


def _broken(case: Case, found: dict[str, Any], expected: dict[str, Any]) -> Iterator[str]:
    """A sentence for whatever does not hold."""
    allowed = expected["limit"]
    still = case.scene.force is None and not case.scene.timed
    for mode in MODES:
        for name, words in WORDS.items():
            bound, value = TURN if name == "slip" else allowed, found[mode][name]
            if not value <= bound:
                yield f"{mode}, {words}: {name} is {value:.2g}, where {bound:.0e} is allowed."
        first, *finer = found[mode]["rises"]
        if not (finer or first <= allowed):
            yield f"{mode}, the energy is no number."
        if finer and still and not finer[0] <= first / FALLS:
            yield (
                f"{mode}, the energy rises by {first:.2g} of its terms, with half the step by "
                f"{finer[0]:.2g}: that does not vanish with the step."
            )
    if found["late"] is not None and not -1e-6 <= found["late"] <= 1 + 1e-6:
        yield (
            f"the first impact, stepped, is late by {found['late']:.2g} steps; an impact at the "
            "end of its step is late by 0 to 1."
        )
    order, wanted = found["order"], expected.get("order")
    if None not in (order, wanted) and not order >= wanted:
        yield f"located impacts are of order {order:.2f}, where {wanted:g} is the least."
    form = found["form"]
    if form["free"] is not None and not form["free"] <= allowed:
        yield f"between impacts the Poisson defect is {form['free']:.2g}."
    across = form["across"]
    if across and None not in across and across[0] > FORM and across[1] > across[0] / FALLS:
        yield (
            f"across an elastic impact the defect of Ω is {across[0]:.2g}, with half the step "
            f"{across[1]:.2g}: that does not vanish with the step."
        )
