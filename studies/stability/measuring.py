"""Stability: linear intervals of hω, and maps of stiff scenes over step and stiffness."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.integrators.rules import Discretisation

from ..core import controls
from ..core.case import Case, Choice, Progress, silent
from ..core.fingerprint import own_name
from . import EULER, RUNGE_KUTTA, linear_stability
from .exchange import adiabatic, exchange_errors, exchange_when_stiffer
from .linear_stability import Oscillator
from .nonlinear_stability import HIGHEST, LOWEST, limits, stability_map
from .own_scene import Linearised, equilibrium, family_of, fastest_along, judged_here
from .records import FARTHEST, Cell
from .stiff import FAMILIES, Family

NAME = "stability"
LINEAR = "harmonic"  # the scene of the linear part
DIGITS = (16,)
CONTROLS = {LINEAR: (EULER, RUNGE_KUTTA), "spring-pendulum": (EULER,)}
NEEDS = (
    f"it needs one of {LINEAR} (linear), {', '.join(FAMILIES)}, or, asked for by name, a scene "
    "whose energy is kept, without constraints and contact; controls run on "
    + " and ".join(f"{scene} ({', '.join(names)})" for scene, names in CONTROLS.items())
    + "."
)
CONTROL_STEPS = 2000
#: for a rule that splits: the share of the oscillator's force that is slow, with a frequency that
#: is a thirtieth of the fast one
SLOW = Fraction(1, 1000)
_FAST_PART = math.sqrt(1 - SLOW)  # the fast frequency over the whole one
OWN_STEPS = 10_000  # steps of each cell's run on a user's own scene
PROGRAM_STEPS = 500  # steps of each cell's run of a program; each is a call in Python


def cases(choice: Choice) -> list[Case]:
    """Return every rule on the oscillator and each stiff family, and methods to be caught."""
    if choice.digits and 16 not in choice.digits:
        return []
    rules = choice.rules or tuple(discretisations.BUILT_IN.values())
    all_cases = []
    for scene in choice.scenes or scenes.all_scenes():
        by_name = choice.asked("by_name", True)  # True unless `verify` asks for all studies
        asked, name = by_name and scene in choice.scenes, own_name(scene)
        for rule in rules if not choice.controls else ():
            # the oscillator of a rule that splits is only fast
            own = name in FAMILIES or (asked and judged_here(scene))
            if name == LINEAR or (own and rule.applies(scene)):
                all_cases.append(Case(NAME, scene, rule, 16, choice.steps, None, choice.thorough))
        for control in CONTROLS.get(name, ()):
            if control in choice.controls or not (choice.controls or choice.rules):
                rule = controls.RUNGE_KUTTA[control]
                all_cases.append(
                    Case(NAME, scene, rule, 16, choice.steps, control, choice.thorough)
                )
    return all_cases


def measure(case: Case, progress: Progress = silent) -> Mapping[str, Any]:
    """Return the linear part on the oscillator, or a map on a stiff family; see below for the rows.

    On a user's own scene it returns both (`measure_own`).
    """
    if (name := own_name(case.scene)) == LINEAR:
        return measure_linear(case, progress)
    return (measure_map if name in FAMILIES else measure_own)(case, progress)


def measure_own(case: Case, progress: Progress = silent) -> Mapping[str, Any]:
    """Return rows of `nonlinear_stability.stability_map`, of runs from the scene's own start.

    measured: classes and limits as in `measure_map`; equilibrium (x and μ), given (true if it is
    the scene's start), turns (true if the body turns there), frequency ω of its fastest
    oscillation, fastest (the largest rate along the scene's own motion), and the entries of
    `Linearised.measured` for a step there.
    """
    at = equilibrium(case.scene)
    family, label = family_of(case.scene, at), f"{case.scene.name} {case.label}"
    progress(f"{label}: linear stability", 0.0)
    figures = Linearised(case.scheme, at).measured()
    rows = stability_map(
        family, case.scheme, case.thorough, steps=case.steps or OWN_STEPS,
        progress=lambda share: progress(f"{label}: stability map", share),
    )  # fmt: skip
    return _of_map(
        family, rows, equilibrium=[float(e) for e in at.z], given=at.given, turns=at.turns,
        frequency=at.frequency, fastest=fastest_along(case.scene), **figures,
    )  # fmt: skip


def _of_map(family: Family, rows: Sequence[Cell], **more: Any) -> dict[str, Any]:
    """Return the measurement of a map: its classes, its limits and more."""
    classes = dict(Counter(row.outcome for row in rows if not row.between))
    return {
        "kind": "map", "label": family.label, "title": family.title, "rows": rows,
        "measured": {"classes": classes, "limits": limits(rows), **more},
    }  # fmt: skip


def measure_linear(case: Case, progress: Progress = silent) -> Mapping[str, Any]:
    """Return rows {z, radius, phase, krein, determinant}, z = hω.

    measured: stable_to (the start of the first unstable interval, None if there is none up to z =
    1000), intervals (unstable ones), proved (true if they hold for every z, by the trace as a
    rational function, and not only on a grid), touched (where |tr M| = 2 without a change), gaps
    (`gaps_of`), resonances, off_circle (a z below stable_to at which the step is not symplectic),
    runs (true if 10⁵ steps on both sides of the ends agree).
    """
    problem = Oscillator(case.rule)
    progress(f"{case.label}: linear stability", 0.0)
    rows = linear_stability.spectra(problem.matrix)
    proved = problem.proved() if case.rule.is_formula else None
    intervals = proved.unstable if proved else linear_stability.unstable_intervals(problem.matrix)
    progress(f"{case.label}: runs on both sides", 0.5)
    first = intervals[0][0] if intervals else None
    stable = [0.999 * first] if first else [10.0, 100.0, FARTHEST] if first is None else []
    unstable = [1.001 * first] if first else []
    agree = not any(map(problem.grows, stable)) and all(map(problem.grows, unstable))
    return {
        "kind": "linear",
        "rows": rows,
        "measured": {
            "stable_to": first,
            "intervals": {str(i + 1): [a, b] for i, (a, b) in enumerate(intervals)},
            "proved": proved is not None,
            "touched": proved.touched if proved else None,
            "gaps": gaps_of(case.rule),
            "resonances": linear_stability.resonances(problem.matrix),
            "off_circle": problem.off_circle(first or FARTHEST, proved is not None),
            "runs": agree,
        },
    }


def measure_map(case: Case, progress: Progress = silent) -> Mapping[str, Any]:
    """Return rows of `nonlinear_stability.stability_map`.

    measured: classes (the number of cells of each), limits {stiffness: the largest hω up to which
    all runs are bounded}; between {hω: class} of cells that are not bounded in the gaps that a slow
    force opens (`gaps_of`); on fpu also exchange {hω: error at ω = 50}, stiffer {ω: error at hω =
    5} and, for a rule that splits, adiabatic {ω: change over T = 10⁵ at hω = 10}.
    """
    family = FAMILIES[case.scene.name]
    label = f"{case.scene.name} {case.label}"

    def show(fraction: float) -> None:
        progress(f"{label}: stability map", fraction)

    if case.control:  # a part of the map is enough
        part = replace(family, stiffness=family.stiffness[:2])
        rows = stability_map(part, case.scheme, steps=CONTROL_STEPS, progress=show)
    else:
        steps = case.steps or (None if case.rule.is_formula else PROGRAM_STEPS)
        ends = [(a * _FAST_PART, b * _FAST_PART) for a, b in gaps_of(case.rule)]
        low, high = (10.0**e for e in (LOWEST, HIGHEST))
        more = tuple(math.sqrt(a * b) for a, b in ends if low < a and b < high)
        rows = stability_map(
            family, case.scheme, case.thorough, steps=steps, progress=show, more=more
        )
    measured: dict[str, Any] = {}
    lost = {
        f"{cell.z:.4g}": cell.outcome for cell in rows if cell.between and cell.outcome != "bounded"
    }
    if lost:
        measured["between"] = lost
    if family.adiabatic and not case.control and case.rule.is_formula:
        progress(f"{label}: exchange of energy", 0.9)
        measured["exchange"] = {f"{z:.3g}": e for z, e in exchange_errors(case.scheme).items()}
        figures = {"stiffer": exchange_when_stiffer(case.scheme, case.thorough)}
        if case.rule.splits or case.thorough:  # other rules are far slower, or unable
            figures["adiabatic"] = adiabatic(case.scheme)
        measured |= {k: {f"{w:g}": e for w, e in each.items()} for k, each in figures.items()}
    return _of_map(family, rows, **measured)


def gaps_of(rule: Discretisation) -> list[tuple[float, float]]:
    """Return intervals of instability that a slow force opens in a rule that splits, below its own
    first.

    Where a step of the fast motion is a half or a whole turn any slow force opens one, narrower
    than a grid shows: proved for the share `SLOW` of the oscillator's force.
    """
    if not rule.splits:
        return []
    alone, beside = Oscillator(rule).proved(), Oscillator(rule, SLOW).proved()
    if alone is None or beside is None:
        return []
    first = alone.unstable[0][0] if alone.unstable else FARTHEST
    # an interval that reaches the end is no gap: there the slow force is not resolved itself
    return [(a, b) for a, b in beside.unstable if b < 0.99 * first]
