"""Stability: linear intervals of hω, and maps of stiff scenes over step and stiffness."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from typing import Any

from discmech.integrators import midpoint, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation

from ..core import controls
from ..core.case import Case, Choice, Progress, Verdict, scheme_of, silent
from ..core.claims import not_claimed
from . import EULER, RUNGE_KUTTA, exchange, linear_stability, own_scene
from .exchange import adiabatic, exchange_errors, exchange_when_stiffer
from .linear_stability import FARTHEST, Oscillator
from .nonlinear_stability import HIGHEST, LOWEST, limits, stability_map
from .own_scene import Linearised, equilibrium, family_of, fastest_along, judged_here
from .stiff import FAMILIES

NAME = "stability"
LINEAR = "harmonic"  # the scene of the linear part
DIGITS = (16,)
CONTROLS = {
    LINEAR: (EULER, RUNGE_KUTTA),
    "spring-pendulum": (EULER,),
}
NEEDS = (
    f"of the bench's own scenes it needs one of {LINEAR} (linear), {', '.join(FAMILIES)}, and of "
    "others, where it is asked for by name, one whose energy is kept, without constraints and "
    "contact; controls run on "
    + " and ".join(f"{scene} ({', '.join(names)})" for scene, names in CONTROLS.items())
    + "."
)
CONTROL_STEPS = 2000
#: of a rule that splits: the share of the oscillator's force that is slow, by a frequency that is a
#: thirtieth of the fast one
SLOW = Fraction(1, 1000)
_FAST_PART = math.sqrt(1 - SLOW)  # the fast frequency, of the whole one
OWN_STEPS = 10_000  # of each cell's run on a scene of one's own
PROGRAM_STEPS = 500  # of each cell's run of a program, a call of Python's each
#: hω up to which a rule must be bounded on every stiff scene, two radians of the fastest motion in
#: four steps: 10^(−3/10), which is a cell of both grids
RESOLVED = 10.0**-0.3
LOOSE = ("escaped", "resonant")  # what an error as large as the energy itself makes of an orbit


def cases(choice: Choice) -> list[Case]:
    """Every rule on the oscillator and on each stiff family, and methods that must be caught."""
    if choice.digits and 16 not in choice.digits:
        return []
    rules = choice.rules or tuple(discretisations.BUILT_IN.values())
    found = []
    for scene in choice.scenes or scenes.all_scenes():
        by_name = choice.asked("by_name", True)  # not among all that `verify` asks
        asked = by_name and scene in choice.scenes and scene.name not in scenes.names()
        for rule in rules if not choice.controls else ():
            # the oscillator of a rule that splits is all fast
            own = scene.name in FAMILIES or (asked and judged_here(scene))
            if scene.name == LINEAR or (own and rule.applies(scene)):
                found.append(Case(NAME, scene, rule, 16, choice.steps, None, choice.thorough))
        for control in CONTROLS.get(scene.name, ()):
            if control in choice.controls or not (choice.controls or choice.rules):
                words = (16, choice.steps, control, choice.thorough)
                found.append(Case(NAME, scene, midpoint, *words))
    return found


def rules_beside(case: Case) -> list[Discretisation]:
    """What the exchange of energy is held against."""
    family = FAMILIES.get(case.scene.name)
    return [exchange.reference_rule()] if family is not None and family.adiabatic else []


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """The linear part on the oscillator, a map on a stiff family; see below for the rows.

    On a scene of one's own both (`measure_own`).
    """
    if case.scene.name == LINEAR:
        return measure_linear(case, progress)
    return (measure_map if case.scene.name in FAMILIES else measure_own)(case, progress)


def measure_own(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows of `nonlinear_stability.stability_map`, of runs from the scene's own start.

    measured: classes and limits as of `measure_map`; equilibrium (x and μ), given (whether it is
    the scene's start), frequency ω of its fastest oscillation, fastest (the largest rate along the
    scene's own motion), and what `Linearised.measured` says of a step there.
    """
    at = equilibrium(case.scene)
    family, label = family_of(case.scene, at), f"{case.scene.name} {case.label}"
    progress(f"{label}: linear stability", 0.0)
    found = Linearised(case.scheme, at).measured()
    rows = stability_map(
        family, case.scheme, case.thorough, steps=case.steps or OWN_STEPS,
        progress=lambda share: progress(f"{label}: stability map", share),
    )  # fmt: skip
    return {
        "kind": "map", "label": family.label, "title": family.title, "rows": rows,
        "measured": {
            "classes": dict(Counter(row["class"] for row in rows)), "limits": limits(rows),
            "equilibrium": [float(e) for e in at.z], "given": at.given,
            "frequency": at.frequency, "fastest": fastest_along(case.scene), **found,
        },
    }  # fmt: skip


def measure_linear(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {z, radius, phase, krein, determinant}, z = hω.

    measured: stable_to (where the first unstable interval begins, None if there is none up to
    z = 1000), intervals (unstable ones), proved (whether they are those of every z, by the trace as
    a rational function, and not of a grid), touched (where |tr M| = 2 without a change),
    gaps (`gaps_of`), resonances, off_circle (a z below stable_to at which the
    step is not symplectic), runs (whether 10⁵ steps on both sides of the ends say the same).
    """
    problem = Oscillator(controls.RUNGE_KUTTA[case.control] if case.control else case.rule)
    progress(f"{case.label}: linear stability", 0.0)
    rows = linear_stability.spectra(problem.matrix)
    proved = problem.proved() if case.rule.is_formula and not case.control else None
    intervals = proved.unstable if proved else linear_stability.unstable_intervals(problem.matrix)
    progress(f"{case.label}: runs on both sides", 0.5)
    first = intervals[0][0] if intervals else None
    stable = [0.999 * first] if first else [10.0, 100.0, FARTHEST] if first is None else []
    unstable = [1.001 * first] if first else []
    agree = not any(map(problem.grows, stable)) and all(map(problem.grows, unstable))
    return {
        "kind": "linear",
        "rows": [vars(row) for row in rows],
        "measured": {
            "stable_to": first,
            "intervals": {str(i + 1): [a, b] for i, (a, b) in enumerate(intervals)},
            "proved": proved is not None,
            "touched": proved.touched if proved else None,
            "gaps": gaps_of(case.rule) if not case.control else [],
            "resonances": linear_stability.resonances(problem.matrix),
            "off_circle": problem.off_circle(first or FARTHEST, proved is not None),
            "runs": agree,
        },
    }


def measure_map(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows of `nonlinear_stability.stability_map`.

    measured: classes (how many cells of each), limits {stiffness: the largest hω up to which all
    that was tried is bounded}; between {hω: class} of cells that are not bounded in the gaps
    that a slow force opens (`gaps_of`);
    on fpu also exchange {hω: error at ω = 50}, stiffer {ω: error at hω = 5} and, for
    a rule that splits, adiabatic {ω: change over T = 10⁵ at hω = 10}.
    """
    family = FAMILIES[case.scene.name]
    label = f"{case.scene.name} {case.label}"

    def show(fraction: float) -> None:
        progress(f"{label}: stability map", fraction)

    if case.control:  # a part of the map will do
        scheme = scheme_of(case.scene, controls.RUNGE_KUTTA[case.control])
        part = replace(family, stiffness=family.stiffness[:2])
        rows = stability_map(part, scheme, steps=CONTROL_STEPS, progress=show)
    else:
        steps = case.steps or (None if case.rule.is_formula else PROGRAM_STEPS)
        ends = [(a * _FAST_PART, b * _FAST_PART) for a, b in gaps_of(case.rule)]
        low, high = (10.0**e for e in (LOWEST, HIGHEST))
        more = tuple(math.sqrt(a * b) for a, b in ends if low < a and b < high)
        rows = stability_map(
            family, case.scheme, case.thorough, steps=steps, progress=show, more=more
        )
    measured: dict[str, Any] = {
        "classes": dict(Counter(row["class"] for row in rows if not row.get("between"))),
        "limits": limits(rows),
    }
    lost = {
        f"{r['z']:.4g}": r["class"] for r in rows if r.get("between") and r["class"] != "bounded"
    }
    if lost:
        measured["between"] = lost
    if family.adiabatic and not case.control and case.rule.is_formula:
        progress(f"{label}: exchange of energy", 0.9)
        measured["exchange"] = {f"{z:.3g}": e for z, e in exchange_errors(case.scheme).items()}
        found = {"stiffer": exchange_when_stiffer(case.scheme, case.thorough)}
        if case.rule.splits or case.thorough:  # the others are far slower, or cannot
            found["adiabatic"] = adiabatic(case.scheme)
        measured |= {k: {f"{w:g}": e for w, e in each.items()} for k, each in found.items()}
    return {
        "kind": "map",
        "label": family.label,
        "title": family.title,
        "rows": rows,
        "measured": measured,
    }


def gaps_of(rule: Discretisation) -> list[tuple[float, float]]:
    """Intervals of instability that a slow force opens in a rule that splits, below its own first.

    Where a step of the fast motion is a half or a whole turn any slow force opens one, narrower
    than a grid sees: proved for the share `SLOW` of the oscillator's force.
    """
    if not (rule.splits and rule.is_formula):
        return []
    alone, beside = Oscillator(rule).proved(), Oscillator(rule, SLOW).proved()
    if alone is None or beside is None:
        return []
    first = alone.unstable[0][0] if alone.unstable else FARTHEST
    # one that goes on to the end is no gap: there the slow force is not resolved itself
    return [(a, b) for a, b in beside.unstable if b < 0.99 * first]


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Linear: the interval is what runs on both sides of its ends say, and the step symplectic.

    Maps: bounded wherever hω ≤ 10^(−3/10) = 0.501; an escape, or an energy that wanders as far at
    one step alone, counts where the family says that the energy's error cannot make it; on fpu the
    exchange of energy at hω = 1/10 is right to a tenth.
    Controls: no interval at all, no bounded cell at all.
    """
    measured = measurement["measured"]
    if measurement["kind"] == "linear":
        return _judge_linear(case, measured)
    if reason := not case.control and not_claimed(case.rule, "symplectic"):
        return Verdict("pass", "", {"not_demanded": reason})
    own = case.scene.name not in FAMILIES
    if own and (told := _judge_own(measured)) is not None:
        return told
    held = None if own else FAMILIES[case.scene.name].held
    # a run of the scene's own motion is held to the fastest rate of that motion
    slower = measured["frequency"] / measured["fastest"] if own else 1.0
    inside = [r for r in measurement["rows"] if r["z"] <= RESOLVED * (1 + 1e-9) * min(1.0, slower)]
    loose = [row for row in inside if held and row["z"] > held(Fraction(row["stiffness"]))]
    expected = {"bounded_up_to": RESOLVED, "of": len(inside), "escapes_not_judged": len(loose)}
    if case.control:
        caught = not {"bounded", "resonant"} & set(measured["classes"])  # a peak is bounded too
        reason = "" if caught else "the control was not caught: some of its runs are bounded."
        return Verdict("pass" if caught else "fail", reason, {"bounded": 0})
    bad = [
        row for row in inside
        if row["class"] != "bounded" and not (row["class"] in LOOSE and row in loose)
    ]  # fmt: skip
    if not bad:
        return _judge_exchange(measured, expected)
    row = bad[0]
    said = f"{row['class']} at hω = {row['z']:.3g} and {measurement['label']} = "
    said += f"{row['stiffness']:g}, where the step resolves the motion."
    return Verdict("fail", said, expected)


def _judge_own(measured: dict[str, Any]) -> Verdict | None:
    """What is wrong with a step at the equilibrium; None if nothing is."""
    off, end = measured["off_circle"], measured["stable_to"]
    expected = {"bounded_up_to": RESOLVED}
    if off is not None:
        said = f"at the equilibrium the eigenvalues of a step at hω = {off:.3g} have another "
        said += "product than 1, so it damps or drives what should go on oscillating."
        return Verdict("fail", said, expected)
    if end is not None and end <= RESOLVED:
        said = f"at the equilibrium an eigenvalue leaves the unit circle at hω = {end:.3g}, where "
        return Verdict("fail", said + "the step resolves the motion.", expected)
    if not measured["runs"]:
        where = f"near hω = {end:.4f}" if end else f"up to hω = {own_scene.FARTHEST:g}"
        said = f"runs beside the equilibrium {where} contradict the interval that was found."
        return Verdict("fail", said, expected)
    return None


def _judge_exchange(measured: dict[str, Any], expected: dict[str, Any]) -> Verdict:
    """Bounded is not right: springs that the step resolves hand their energy on as they should."""
    key = f"{float(exchange.RESOLVED):.3g}"
    if key not in measured.get("exchange", {}):
        return Verdict("pass", "", expected)
    error = measured["exchange"][key]
    expected = {**expected, "exchange": exchange.RIGHT}
    if error is not None and error <= exchange.RIGHT:
        return Verdict("pass", "", expected)
    how = (
        "was not followed to its end" if error is None else f"is wrong by {exchange.percent(error)}"
    )
    reason = f"the exchange of energy at hω = {key} {how}, where the step resolves the springs."
    return Verdict("fail", reason, expected)


def _judge_linear(case: Case, measured: dict[str, Any]) -> Verdict:
    off, first = measured["off_circle"], measured["stable_to"]
    if case.control:
        caught = off is not None or first == 0
        reason = "" if caught else "the control was not caught: it passes for symplectic."
        return Verdict("pass" if caught else "fail", reason, {"off_circle": True})
    if reason := not_claimed(case.rule, "symplectic"):
        return Verdict("pass", "", {"not_demanded": reason})
    expected = {"runs": True, "off_circle": None}
    if off is not None:
        return Verdict("fail", f"an eigenvalue leaves the unit circle at hω = {off:.3g}.", expected)
    if not measured["runs"]:
        where = f"near hω = {first:.6f}" if first else "up to hω = 1000"
        return Verdict("fail", f"runs {where} contradict the interval that was found.", expected)
    return Verdict("pass", "", expected)
