"""Charts: steps of every size on the group, beside the method that is bound to one chart.

An ensemble of first steps g, rotations from 0.01 to 0.99 of a turn about axes spread over a plane,
and some about random axes: the run continues through the translates of a cover (paper, section
4.3).
"""

from __future__ import annotations

import math
import random
import zlib
from collections import Counter
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Bisection, EvolutionOperator, Scheme, StepFailure
from discmech.integrators import rules as discretisations
from discmech.integrators.flows import Flow, Trajectory
from discmech.integrators.geometry import defects, regularity, residual, singular_sign
from discmech.integrators.numbers import LazyModule, mpmath
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import OnGroup, Scene, remembered
from discmech.studies.core.case import Case, Choice, Progress, plain_cases, scheme_of, silent
from discmech.studies.evidence.places import seed_of
from discmech.studies.systems.runs import Rows, relative_drifts, with_terms

from .limits import FORMS, SOLVED

transform: Any = LazyModule("scipy.spatial.transform")
NAME = "charts"
NEEDS = "it needs a discrete Lagrangian given on SO(3), as moser-veselov has."
DIGITS = (16,)
TURNS = (0.01, *(k / 20 for k in range(1, 10)), 0.49, 0.5, 0.51,
         *(k / 20 for k in range(11, 20)), 0.99)  # fmt: skip
AXES = 6
DRAWN = 6  # starts whose turn and axis are drawn from the whole sphere, off PLANE
#: an orthonormal pair, in general position to the body's axes
PLANE = ((0.8, 0.36, 0.48), (-0.6, 0.48, 0.64))
STEP = 1  # unit of time: rotations are per step
STEPS, MILLION = 100, 10**6
LOOKED_AT = 8  # arrows of a run whose defects are computed, beside those at changes of chart
SIDE = 41  # points across the plot of the ball of rotations
WELL = 1e-2  # regularity above which g′ itself is compared, to the same bound
EDGE = 1e-5  # |det(e + g)| below which coordinates in the chart of e are not used


def cases(choice: Choice) -> list[Case]:
    """Return every scene with a discrete Lagrangian given on SO(3)."""
    return [c for c in plain_cases(NAME, choice, DIGITS, choice.thorough) if _fits(c.scene)]


def _fits(scene: Scene) -> bool:
    algebra = getattr(scene.groupoid, "algebra", None)
    given = isinstance(scene.discrete_lagrangian, OnGroup)
    return given and algebra is not None and algebra.name == "so(3)"


def axis_of(number: int) -> np.ndarray:
    """Return the unit vectors of the ensemble, over half a circle: larger turns go round it."""
    angle = math.pi * number / AXES
    p, q = np.array(PLANE)
    return np.asarray(math.cos(angle) * p + math.sin(angle) * q)


def drawn_starts(seed: int) -> list[tuple[float, np.ndarray]]:
    """Return `DRAWN` turns from 0.01 to 0.99 about unit vectors on the sphere, from a seed."""
    drawn = random.Random(seed)
    found = []
    for _ in range(DRAWN):
        axis = np.array([drawn.gauss(0, 1) for _ in range(3)])
        found.append((drawn.uniform(0.01, 0.99), axis / np.linalg.norm(axis)))
    return found


def rotation(vector: Any, digits: int = 16) -> np.ndarray:
    """Return exp of the rotation vector, 3×3; beyond 16 digits in mpmath's numbers."""
    if digits == 16:
        return np.asarray(transform.Rotation.from_rotvec(vector).as_matrix())
    with mpmath.workdps(digits + 10):
        a, b, c = (mpmath.mpf(float(e)) for e in vector)
        return np.array(mpmath.expm([[0, -c, b], [c, 0, -a], [-b, a, 0]]).tolist())


def rules_beside(case: Case) -> list[Discretisation]:
    """Return the chart-bound method."""
    return [discretisations.rectangle]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return one row per start.

    A row has {turn, axis, steps, outcome, margin, newton_mean, newton_max, changes, translates,
    residual, pullback, poisson, momentum, factorisation, operator, regularity, chart_turn,
    chart_margin, cause}; axis is None if it was drawn. measured: the worst of each, the number of
    stopped runs, the seed.

    pullback, poisson: the worst at every change of chart and at arrows spread over the run;
    factorisation: ‖g′ − ĝ′‖ with ĝ′ of `reference.moser_veselov`, times the regularity, by which
    round-off of μ is divided; distance: ‖g′ − ĝ′‖ itself, if the regularity is at least WELL;
    operator: ‖g′ − ĝ′‖ of the first step with the evolution operator through bisections near its
    arrows, times the regularity; solutions: where it stopped, how many the search through the cover
    finds at that μ; chart_turn: the rotation that the chart-bound method makes of the same spin.
    """
    starts: list[tuple[float, int | None, np.ndarray]]
    starts = [(turn, k, axis_of(k)) for k in range(AXES) for turn in TURNS]
    seed = _seed(case.scene)
    starts += [(turn, None, axis) for turn, axis in drawn_starts(seed)]
    steps = case.steps or (-(-MILLION // len(starts)) if case.thorough else STEPS)
    rows = []
    for i, (turn, k, axis) in enumerate(starts):
        progress(f"{case.scene.name}: {turn:.2g} of a turn a step", i / len(starts))
        vector = 2 * math.pi * turn * axis
        row = {"turn": turn, "axis": k, **_run(case, rotation(vector, case.digits), steps)}
        rows.append({**row, **_chart_bound(case, vector)})
    return {"rows": rows, "measured": {**_worst(rows), "seed": seed}, "slice": _slice(case)}


@remembered(maxsize=8)
def _scheme(scene: Scene) -> Scheme:
    """Return the scheme with the attitude as base on a group: the spatial momentum needs it."""
    whole = scene.with_attitude() if scene.groupoid.kind == "group" else scene
    return Scheme(whole, discretisations.own)


def _seed(scene: Scene) -> int:
    """Return the seed of the drawn starts; a scene of L_d alone has no motion that tells it."""
    if scene.lagrangian is not None:
        return seed_of(_scheme(scene))
    words = repr((scene.name, scene.parameters, scene.x0, scene.v0))
    return zlib.crc32(words.encode())


def _run(case: Case, g: np.ndarray, steps: int) -> dict[str, Any]:
    scheme = _scheme(case.scene)
    flow = scheme.flow(STEP, case.digits, on_edge="bisect")
    row: dict[str, Any] = dict.fromkeys(
        ("margin", "newton_mean", "newton_max", "changes", "residual", "pullback", "poisson",
         "momentum", "factorisation", "distance", "operator", "regularity", "solutions")
    )  # fmt: skip
    row |= {"steps": 0, "outcome": "ran", "cause": "", "translates": {}}
    try:
        run = flow.trajectory(steps, element0=g)
    except StepFailure as failure:
        others = flow.solutions(failure.state["x"], failure.state["mu"])
        row |= {"outcome": "stopped", "cause": failure.cause, "solutions": len(others)}
        run = failure.trajectory
    if run is None or len(run.t) < 2:
        return row
    row |= {"steps": len(run.t) - 1, "margin": run.margin, "newton_mean": run.newton_mean,
            "newton_max": run.newton_max, "changes": int(np.count_nonzero(np.diff(run.translates))),
            "translates": {str(k): v for k, v in sorted(Counter(run.translates.tolist()).items())},
            "momentum": _drift(case, scheme, run)}  # fmt: skip
    last = len(run.t) - 1
    at = {*range(0, last, max(1, last // LOOKED_AT)), *np.flatnonzero(np.diff(run.translates))}
    elements = flow.elements(run)
    worst: dict[str, float] = {}
    gap = _through_bisections(flow, run, elements)
    if gap is not None:
        worst["operator"] = gap
    for k in sorted(at):
        here, there = flow.arrow(run, k), flow.arrow(run, k + 1)
        pullback, poisson = defects(here, there)
        regular = regularity(there)
        found = {"residual": residual(here, there), "pullback": pullback, "poisson": poisson}
        gap = _factorised(case, elements[k], elements[k + 1])
        if gap is not None:
            found["factorisation"] = gap * regular
            if regular >= WELL:
                found["distance"] = gap
        for name, value in found.items():
            worst[name] = max(worst.get(name, 0.0), float(value))
        worst["regularity"] = min(worst.get("regularity", 1.0), regular)
    return row | worst


def _through_bisections(flow: Flow, run: Trajectory, elements: np.ndarray) -> float | None:
    """Return ‖g′ − ĝ′‖ × regularity, ĝ′ by the evolution operator through bisections near g and g′.

    Its arrows are written in the chart of e: None if that represents one of them badly. Near the
    singular set of FL two solutions are as near as the regularity, so the bisections are nearer.
    """
    context, chart = flow.context, flow.context.chart
    regular = regularity(flow.arrow(run, 1))
    with context.numbers.working():
        g, after = (chart.array(e) for e in elements[:2])
        if min(chart.openness(g), chart.openness(after)) < EDGE:
            return None
        u, v = (chart.coordinates(e) / context.h for e in (g, after))
        away = context.numbers.number(regular) / 20
        sigma, upsilon = (
            Bisection(context.scene.groupoid, x, near, flow.step, flow.digits)
            for x, near in zip(run.x[:2], (u + away, v - away), strict=True)
        )
        w = EvolutionOperator(context, sigma, upsilon).evolve(run.x[0], u)[1]
        reached = chart.element(context.h * context.vector(w, len(w)))
        return float(np.max(abs(reached - after))) * regular


@lru_cache(maxsize=8)
def _kept(scheme: Scheme, digits: int) -> list[Rows]:
    """Return the quantities that are kept to round-off, as functions of a run."""
    from discmech.studies.momentum.quantities import formula_of

    kept = [q for q in scheme.scene.symmetries if q.to_roundoff and q.stretch is None]
    return [with_terms(scheme, formula_of(scheme, q, STEP), digits) for q in kept]


def _drift(case: Case, scheme: Scheme, run: Any) -> float | None:
    """Return the worst relative drift of the quantities that are kept to round-off."""
    drifts = [relative_drifts(rows(run), case.digits) for rows in _kept(scheme, case.digits)]
    return max((float(d.max()) for d in drifts), default=None)


def _factorised(case: Case, g: Any, after: Any) -> float | None:
    """Return a step's distance from the factorisation's; None for other scenes, or on its edge."""
    if case.scene.name != "moser-veselov":
        return None
    from discmech.reference.closed_forms.moser_veselov import step
    from discmech.reference.failures import ReferenceFailure

    with mpmath.workdps(case.digits + 15):
        inertia = [mpmath.mpf(e.numerator) / e.denominator
                   for e in case.scene.parameters["inertia"]]  # fmt: skip
        try:
            wanted = step(g, [sum(inertia) / 2 - e for e in inertia], case.digits)
        except ReferenceFailure:
            return None
        return float(np.max(abs(np.array(wanted.tolist()) - np.asarray(after))))


def _chart_bound(case: Case, vector: np.ndarray) -> dict[str, Any]:
    """Return the rotation that h·l(τ⁻¹(g)/h) makes of the spin Ω with hΩ = vector, in turns."""
    nothing = {"chart_turn": None, "chart_margin": None}
    if case.scene.lagrangian is None:
        return nothing
    scheme = scheme_of(_in_chart(case.scene), discretisations.rectangle)
    flow = scheme.at(v0=[float(e) for e in vector]).flow(STEP, case.digits)
    try:
        run = flow.trajectory(0)
    except StepFailure:
        return nothing
    element = transform.Rotation.from_matrix(np.asarray(flow.elements(run)[0], float))
    turn = float(element.magnitude()) / (2 * math.pi)
    return {"chart_turn": turn, "chart_margin": run.margin}


@lru_cache(maxsize=8)
def _in_chart(scene: Scene) -> Scene:
    return scene.with_values(discrete_lagrangian=None)


def _worst(rows: list[dict[str, Any]]) -> dict[str, Any]:
    def of(name: str, choose: Any = max) -> Any:
        return choose((r[name] for r in rows if r[name] is not None), default=None)

    names = (*SOLVED, *FORMS, "momentum", "newton_max", "chart_turn")
    measured = {name: of(name) for name in names}
    translates = sum((Counter(row["translates"]) for row in rows), Counter())
    return {**measured, "margin": of("margin", min), "starts": len(rows),
            "steps": sum(r["steps"] for r in rows), "changes": sum(r["changes"] or 0 for r in rows),
            "translates": dict(sorted(translates.items())),
            "stopped": sum(r["outcome"] == "stopped" for r in rows)}  # fmt: skip


def _slice(case: Case) -> dict[str, Any]:
    """Return the disc of rotations in PLANE, in turns: det FL and the best translate on a grid."""
    flow = _scheme(case.scene).flow(STEP, 16, on_edge="bisect")
    across = np.linspace(-0.5, 0.5, SIDE)
    p, q = np.array(PLANE)
    x0 = flow.scheme.scene.x0
    det: list[list[float | None]] = []
    best: list[list[int | None]] = []
    for b in across:
        found = [_sign(flow, rotation(2 * math.pi * (a * p + b * q)), x0)
                 if math.hypot(a, b) <= 0.51 else (None, None) for a in across]  # fmt: skip
        det.append([None if d is None else round(d, 6) for d, _ in found])
        best.append([k for _, k in found])
    return {"across": across.tolist(), "det": det, "best": best}


def _sign(flow: Flow, g: np.ndarray, x: Any) -> tuple[float, int]:
    """Return (`singular_sign` at an element g, the translate that represents it best)."""
    translate, u = flow.edge.place(g)
    return singular_sign(flow.context.arrow(x, 0 * u, u, translate)), translate
