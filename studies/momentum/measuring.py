"""Momentum maps and Casimirs over long runs, against the random walk of round-off."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech.integrators import BadInput, Scheme
from discmech.integrators.equations import force_points
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import (
    arithmetic,
    errors_of,
    exact_rational,
    first_violation,
    numeric,
    numeric_text,
    rounded,
    sympy,
    to_sympy,
    with_running_errors,
)
from discmech.integrators.rules import Composition, OneStepMap
from discmech.integrators.scene import Conserved, Scene

from ..core.case import Case, Choice, Progress, Verdict, plain_cases, silent
from ..core.runs import bins, interval, long_run, relative_drifts, with_terms
from . import section

NAME = "momentum"
NEEDS = (
    "it needs a scene that declares symmetries or Casimirs; and of a one-step map or composition, "
    "quantities on which no force does work, for they have no discrete work to hold them against."
)
DIGITS = (16, 50)
ROWS = 400
MOST_STRETCHES = 2000
WORKED = 200  # steps at each of which a quantity that a force changes is held against its work
SAMPLES = 16  # rows whose round-off is analysed
FARTHEST = 5  # standard deviations that the farthest point of a walk stays within


def cases(choice: Choice) -> list[Case]:
    """Every scene with a quantity that is kept to round-off, by every rule.

    What a force changes is measured against its work; a composition does not say the work of its
    substeps, and a one-step map none.
    """
    return [c for c in plain_cases(NAME, choice, DIGITS) if _measured(c)]


def _measured(case: Case) -> list[Conserved]:
    composed = isinstance(case.rule, Composition | OneStepMap)
    return [
        q for q in case.scene.symmetries if q.to_roundoff and not (composed and _worked(case, q))
    ]


def _kept(case: Case) -> list[Conserved]:
    return [q for q in _measured(case) if not _worked(case, q)]


def _worked(case: Case, q: Conserved) -> bool:
    """Whether a quantity has a change to be held against: its own equation, or a force's work, so
    that ∂J/∂μ·f is not zero everywhere."""
    if q.kind == section.KIND:
        return True
    return case.scene.force is not None and _moved(_scheme(case, q.attitude), q)


@cache
def _moved(scheme: Scheme, q: Conserved) -> bool:
    s = scheme.s
    values = list(formula_of(scheme, q, scheme.scene.step))
    letters = {mu: u for mu, u in zip(s.mu, s.u, strict=True)}  # any μ will do
    work = [sum(e.diff(mu).xreplace(letters) * f for mu, f in zip(s.mu, s.force, strict=True))
            for e in values]  # fmt: skip
    return first_violation(work, [*s.u]) is not None


@cache
def _with_attitude(scene: Scene) -> Scene:
    return scene.with_attitude()


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {step, time, drift: {name: worst so far in its stretch}}; measured: the worst of each.

    A drift is |J_k − J_0| over the sum of the absolute values of J's terms, but for constants.
    Quantities of the attitude run on the scene with the attitude as base; the others do without it.
    units: {name: (of a step, of the value)}, what round-off does, relative to the same sum, in ε.
    Raises `BadInput` where nothing can be measured.
    """
    if not _measured(case):
        raise BadInput(f"{case.scene.name} with {case.label}: momentum cannot be measured: {NEEDS}")
    steps = case.steps or (10**6 if case.digits == 16 else 100)
    kept, measured = _kept(case), _measured(case)
    series: dict[str, np.ndarray] = {}
    units: dict[str, tuple[float, float]] = {}
    for attitude in (False, True):
        whole = [q for q in kept if q.attitude is attitude and q.stretch is None]
        if whole:
            scheme = _scheme(case, attitude)
            run = long_run(case, scheme, steps, progress)
            for q in whole:
                formula = formula_of(scheme, q, case.scene.step)
                found = with_terms(scheme, formula, case.digits)(run)
                series[q.name] = relative_drifts(found, case.digits)
                units[q.name] = round_offs(scheme, formula, run, found[1], case.digits)
    for q in kept:
        if q.stretch is not None:
            series[q.name], units[q.name] = _over_stretches(case, q, steps, progress)
    worked = [q for q in measured if q not in kept]
    for q in worked:
        series[q.name], units[q.name] = _less_work(case, q, min(WORKED, steps))
    rows = []
    each = {q.name: 1 if q.stretch is None else interval(steps) for q in kept}
    each |= {q.name: interval(steps) for q in worked}
    for first, last in bins(steps // interval(steps) + 1, ROWS):
        step = min((last - 1) * interval(steps), steps)
        drift = {
            name: _worst(values, first * each[name], last * each[name])
            for name, values in series.items()
        }
        rows.append({"step": step, "time": float(step * case.scene.step), "drift": drift})
    worst = {name: float(drift.max()) for name, drift in series.items()}
    return {"rows": rows, "measured": {"drift": worst}, "steps": steps, "units": units}


def _less_work(case: Case, q: Conserved, steps: int) -> tuple[np.ndarray, tuple[float, float]]:
    """Per step: how far a quantity's change is from what the force does to it, relative to the
    absolute terms (`_change`, `_change_along_orbit`; of a nonholonomic momentum from its equation,
    `section`). And what round-off does (`round_offs`).
    """
    scheme = _scheme(case, q.attitude)
    flow = scheme.flow(case.scene.step, case.digits)
    run = flow.trajectory(steps)
    formula = formula_of(scheme, q, case.scene.step)
    rows_of = with_terms(scheme, formula, case.digits)
    units = round_offs(scheme, formula, run, rows_of(run)[1], case.digits)
    slope = formula.jacobian(list(scheme.s.mu))
    linear = not slope.free_symbols & {*scheme.s.mu}
    if by_equation := q.kind == section.KIND:
        section.check(scheme, q, slope)
    with flow.numbers.working():
        if by_equation:
            gap, scale = section.change(flow, run, rows_of, slope)
        elif linear:
            gap, scale = _change(flow, run, rows_of, slope)
        else:
            gap, scale = _change_along_orbit(flow, run, rows_of)
        gaps, scales = np.abs(gap).max(axis=1), scale.max(axis=1)
        found = (float(g / s) if g else 0.0 for g, s in zip(gaps, scales, strict=True))
        return np.array([0.0, *found]), units


def _change(flow: Flow, run: Any, rows_of: Any, slope: Any) -> tuple[np.ndarray, np.ndarray]:
    """(J(y, μ′) − J(x, μ) less the work Σ ω_i ∂J/∂μ(x_i) f(x_i, ξ_i), absolute terms) per step.

    For a momentum map: its symmetry moves every point x_i where the rule asks for L, with the
    weight ω_i, as it moves the ends (discrete Noether theorem with forces, Marsden, West 2001,
    3.2.5). slope: ∂J/∂μ, without μ. Nothing of F± is used.
    """
    s, equations = flow.scheme.s, flow.scheme.equations
    parts = [slope.xreplace(dict(zip(s.x, at.point, strict=True))) * at.force
             for at in force_points(equations.of)]  # fmt: skip
    letters = {"x": s.x, "u": s.u, "s": s.stages, "q": s.q}
    work = numeric(letters, [[list(part) for part in parts]], flow.numbers)
    at, done, size = flow.context, [], []
    for x, u in zip(run.base[:-1], run.u[:-1], strict=True):
        x, u = at.vectors(x, u)
        each = np.array(work(x, u, flow.geometry.stages(x, u), flow.geometry.q))
        done.append(each.sum(axis=0))
        size.append(abs(each).sum(axis=0))
    values, terms = rows_of(run)
    return np.diff(values, axis=0) - np.array(done), np.maximum(terms[1:], terms[:-1]) + size


def _change_along_orbit(flow: Flow, run: Any, rows_of: Any) -> tuple[np.ndarray, np.ndarray]:
    """(J(y, μ′ − f⁺) − J(x, μ − f⁻), absolute terms) per step, f± what the force adds to F±/h.

    For a Casimir that is no linear function of μ: without the force an arrow has one J at both
    ends. f± come from the displacement of points, not from F± (`discrete_force`).
    """
    at = flow.context
    forces = [flow.geometry.discrete_force(*at.vectors(x, u))
              for x, u in zip(run.base[:-1], run.u[:-1], strict=True)]  # fmt: skip
    minus, plus = (np.array(part) for part in zip(*forces, strict=True))
    mu = np.vectorize(flow.numbers.number, otypes=[flow.numbers.dtype])(run.mu)
    before, terms = rows_of(replace(run, base=run.base[:-1], mu=mu[:-1] - minus, u=run.u[:-1]))
    after, later = rows_of(replace(run, base=run.base[1:], mu=mu[1:] - plus, u=run.u[1:]))
    return after - before, np.maximum(terms, later)


def _steps_of(q: Conserved, steps: int) -> int:
    """The steps that are made for a quantity: of one in stretches perhaps fewer."""
    return steps if q.stretch is None else min(steps, MOST_STRETCHES * q.stretch)


def _worst(drift: np.ndarray, first: int, last: int) -> float | None:
    """The largest of a stretch; None where nothing was measured in it."""
    part = drift[first:last]
    return float(part.max()) if len(part) else None


def _scheme(case: Case, attitude: bool) -> Scheme:
    return case.scheme_on(_with_attitude(case.scene) if attitude else case.scene)


def formula_of(scheme: Scheme, q: Conserved, step: Any) -> Any:
    """The quantity in the scheme's symbols; an attitude is handed on as a matrix.

    Without its constant terms: they change nothing, and would hide what changes.
    """
    x: Any = scheme.s.position
    if q.attitude:
        size = scheme.scene.groupoid.algebra.size  # type: ignore[attr-defined]
        x = x.reshape(size, size)
    h = to_sympy(exact_rational(step, "step"))
    given = scheme.s.evaluated(q.at, q.name, x, scheme.s.mu, scheme.s.parameters, h)
    entries = [scheme.s.scalar(e, q.name, q.formula) for e in
               (list(given) if hasattr(given, "shape") else [given])]  # fmt: skip
    return sympy.Matrix([_varying(e, [*scheme.x, *scheme.s.mu]) for e in entries])


def _varying(e: Any, letters: list[Any]) -> Any:
    """The expression without the terms that hold none of the letters."""
    multiplied = sympy.expand(e) if e.is_polynomial(*letters) else e
    constant = multiplied.as_independent(*letters, as_Add=True)[0]
    return e - constant if constant != 0 else e


def round_offs(
    scheme: Scheme, formula: Any, run: Any, terms: np.ndarray, digits: int
) -> tuple[float, float]:
    """What round-off does to a quantity: (where x and μ are rounded once, in its own evaluation).

    In units ε of the sum of absolute terms; the most at SAMPLES rows (`running_error`).
    """
    numbers, s = arithmetic(digits), scheme.s
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    text = numeric_text(letters, [list(formula)])
    worst = [0.0, 0.0]
    with numbers.working():
        p = [numbers.number(v) for v in scheme.scene.parameter_values]
        f = with_running_errors(text, numbers)
        for row in np.unique(np.linspace(0, len(run.mu) - 1, SAMPLES).astype(int)):
            x, mu = (np.array([numbers.number(e) for e in part[row]], numbers.dtype)
                     for part in (run.base, run.mu))  # fmt: skip
            own = max(errors_of(f(rounded(x, 0 * abs(x)), rounded(mu, 0 * abs(mu)), p)))
            whole = max(errors_of(f(rounded(x), rounded(mu), p)))
            scale = max(terms[row].max(), terms[0].max())
            for place, value in enumerate((whole - own, own)):
                worst[place] = max(worst[place], float(value / scale) if scale else 0.0)
    return worst[0], worst[1]


def _over_stretches(
    case: Case, q: Conserved, steps: int, progress: Progress
) -> tuple[np.ndarray, tuple[float, float]]:
    """Per step: the drift since the stretch began, with x (the attitude) as at the start there.

    And what round-off does (`round_offs`), the most of all stretches.
    """
    assert q.stretch is not None
    scheme = _scheme(case, q.attitude)
    flow = scheme.flow(case.scene.step, case.digits)
    formula = formula_of(scheme, q, case.scene.step)
    rows_of = with_terms(scheme, formula, case.digits)
    total = _steps_of(q, steps)
    drifts, mu, u = [np.zeros(1)], None, None
    units = [(0.0, 0.0)]
    for done in range(0, total, q.stretch):
        run = flow.trajectory(min(q.stretch, total - done), x0=scheme.scene.x0, mu0=mu, u0=u)
        found = rows_of(run)
        drifts.append(relative_drifts(found, case.digits)[1:])
        if done % (16 * q.stretch) == 0:
            units.append(round_offs(scheme, formula, run, found[1], case.digits))
        mu, u = run.mu[-1], run.u[-1]
        progress(f"{case.scene.name} {case.label}: {q.name}", done / total)
    return np.concatenate(drifts), (max(u[0] for u in units), max(u[1] for u in units))


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Round-off: the walk of c·ε·√N that one rounding of x and μ a step makes, and J's own.

    A rounding of relative size ε at most is ε/√3 in the mean square, and N of them leave a walk
    whose farthest point is beyond FARTHEST standard deviations once in a million runs (Feller,
    XIV). ``limits`` and ``over`` say what each quantity was allowed, over how many steps; ``limit``
    is the largest. The bare walk ε√N stands beside it, N the most steps that one was followed.
    """
    eps = float(arithmetic(case.digits).eps)
    over = {q.name: _steps_of(q, measurement["steps"]) for q in _kept(case)}
    over |= {q.name: 1 for q in _measured(case) if q.name not in over}  # step by step
    walked = {q.name: min(over[q.name], q.stretch or over[q.name]) for q in _measured(case)}
    units = {name: (1.0, 1.0) for name in over} | measurement.get("units", {})
    substeps = max(1, len(case.scheme.substeps))
    limits = {name: eps * (FARTHEST / math.sqrt(3) * math.sqrt(steps * substeps) * units[name][0]
                           + 2 * units[name][1]) for name, steps in walked.items()}  # fmt: skip
    walk = eps * math.sqrt(max(over.values()))
    expected = {"limit": max(limits.values(), default=0.0), "limits": limits,
                "random_walk": walk, "over": over}  # fmt: skip
    drift = measurement["measured"]["drift"]
    drifting = [k for k, v in drift.items() if not v <= limits.get(k, expected["limit"])]
    if not drifting:
        return Verdict("pass", "", expected)
    name = max(drifting, key=lambda k: drift[k])
    steps = f" in {over[name]} steps" if name in over else ""
    allowed = limits.get(name, expected["limit"])
    said = f"{name} drifts by {drift[name]:.2g}, more than {allowed:.1e}{steps}."
    return Verdict("fail", said, expected)


def diagnose(case: Case, measurement: dict[str, Any]) -> dict[str, Any] | None:
    """Whether the scene, its coordinates, L_d or the run is to blame; None where that needs the
    attitude.

    First the certified motion is asked whether it keeps the quantity: else the scene is wrong.
    A step from (x, F⁻/h) leads to (b, F⁺/h), so a quantity that the method keeps has one value at
    both ends of every arrow (discrete Noether theorem). That is asked with 30 digits, at arrows of
    a run.
    """
    from ..causes.diagnosis import ROWS as COUNT
    from ..causes.diagnosis import named

    drift = measurement["measured"]["drift"]
    if case.scene.force is not None:
        return None
    plain = [q for q in _kept(case) if q.name in drift and not q.attitude and q.stretch is None]
    if not plain or case.scheme.element is not None or case.scheme.one_step:
        return None
    worst = max(plain, key=lambda q: drift[q.name])
    scheme = _scheme(case, False).base
    flow = Flow(scheme, case.scene.step, 30)
    formula = formula_of(scheme, worst, case.scene.step)
    rows_of = with_terms(scheme, formula, 30)
    if not worst.of_step and (moved := _of_motion(scheme, rows_of)) > 1e-20:
        return named(
            "scene",
            f"the motion itself does not keep {worst.name}: along the certified solution it "
            f"changes by {moved:.1e}; no rule can keep it, so mend its formula, or the Lagrangian.",
            {"quantity": worst.name, "motion": moved},
        )
    run = flow.trajectory(COUNT)
    with flow.numbers.working():
        at, h = flow.context, flow.context.h
        arrows = [at.maps_at(*at.vectors(x, u)) for x, u in zip(run.base, run.u, strict=True)]
        before = np.array([here["minus"] / h for here in arrows])
        after = np.array([here["plus"] / h for here in arrows])
        ends = np.array([here["target"] for here in arrows]).reshape(run.base.shape)
    start, terms = rows_of(replace(run, mu=before))
    end, later = rows_of(replace(run, base=ends, mu=after))
    scale = max(float(abs(t)) for part in (terms, later) for t in part.ravel()) or 1.0
    gap = max(float(abs(e)) for e in (end - start).ravel()) / scale
    evidence = {"quantity": worst.name, "gap": gap}
    if gap > 1e-20 and _is_bent(scheme, formula):
        return named(
            "coordinates",
            f"the symmetry of {worst.name} is not affine in these coordinates, ξ(x) = ∂J/∂μ is "
            "bent: it does not take the points between the ends of a step to such points, so a "
            "rule that asks for L there cannot keep it; take coordinates in which it is affine, or "
            'declare it as kind="first integral".',
            evidence,
        )
    if gap > 1e-20:
        return named(
            "invariance",
            f"L_d is not invariant under the symmetry of {worst.name}: at the two ends of an "
            f"arrow, (x, F⁻/h) and (b, F⁺/h), its values differ by {gap:.1e}; write the rule with "
            "L and G, not with single components.",
            evidence,
        )
    return named(
        "run",
        f"L_d keeps {worst.name}: at the two ends of an arrow its values differ by {gap:.1e} only; "
        "it is the solver or the update, which discmech symplecticity tells apart.",
        evidence,
    )


def _of_motion(scheme: Scheme, rows_of: Any) -> float:
    """How far a quantity moves along the certified solution in some steps, relative to its terms;
    0 where there is no solution."""
    from discmech.reference import ReferenceFailure, solutions

    from ..causes.diagnosis import ROWS as COUNT

    scene, s = scheme.scene, scheme.s
    times = [k * scene.step for k in (0, 1, COUNT)]
    try:
        found = solutions(scene, times, 35)
    except ReferenceFailure:
        return 0.0
    x, mu = ([list(getattr(e, part)) for e in found] for part in ("x", "mu"))
    base = [s.with_time(row, t) for row, t in zip(x, times, strict=True)] if s.clocked else x
    rows = np.array(base, dtype=object).reshape(len(times), -1)
    states = SimpleNamespace(x=rows, base=rows, mu=np.array(mu, dtype=object))
    with arithmetic(30).working():
        return float(relative_drifts(rows_of(states), 30).max())


def _is_bent(scheme: Scheme, formula: Any) -> bool:
    """Whether ξ(x) = ∂J/∂μ of pairs is no affine function of x."""
    s = scheme.s
    if s.groupoid.kind != "pair":
        return False
    slope = formula.jacobian(list(s.mu))
    second = [e.diff(a, b) for e in slope for a in s.position for b in s.position]
    return first_violation(second, [*s.u]) is not None
