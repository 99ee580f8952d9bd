"""The cause of a quantity's drift: scene, coordinates, discrete Lagrangian, or the run."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import Scheme
from discmech.integrators.equations import momentum, rates
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import arithmetic, first_violation, jacobian, to_sympy
from discmech.integrators.scene import Conserved

from ..causes.round_off import ROWS, size
from ..core.case import Case, silent
from ..core.outcome import named
from ..systems.runs import long_run, relative_drifts, with_terms
from .quantities import formula_of, kept_in, scheme_for

KEPT = 1e-20  # a larger change by the certified motion itself is none of round-off


def cause_of_drift(case: Case, drift: dict[str, float], steps: int) -> dict[str, Any] | None:
    """Return which is to blame for the largest drift: the scene, its coordinates, L_d or the run.

    drift: of quantities that drift although no force changes them. First it is checked that the
    certified motion keeps the quantity: otherwise the scene is wrong, for any method. A step from
    (x, F⁻/h) leads to (b, F⁺/h), so a quantity that the method keeps has one value at both ends of
    every arrow (discrete Noether theorem). That is checked with 30 digits, at arrows from the start
    and at those of the `ROWS` steps in which the run of so many steps changes it most: a fault may
    be in a part of the motion alone. None if neither the arrows nor the run explain these, if it
    needs the attitude, or if there is no L_d(x, u).
    """
    kept = [q for q in kept_in(case) if q.name in drift]
    if not kept:
        return None
    worst = max(kept, key=lambda q: drift[q.name])
    scheme = scheme_for(case, worst.attitude).base
    if case.scene.contact is not None:  # no exact motion and no arrows are known across impacts
        return of_scene(scheme, worst)
    formula = formula_of(scheme, worst, case.scene.step)
    rows_of = with_terms(scheme, formula, 30)
    if not worst.of_step and (moved := change_of_motion(scheme, rows_of)) > KEPT:
        return named(
            "scene",
            f"the motion itself does not keep {worst.name}: along the certified solution it "
            f"changes by {moved:.1e}; no rule can keep it, so mend its formula, or the Lagrangian.",
            {"quantity": worst.name, "motion": moved},
        )
    if worst.attitude or worst.stretch is not None:
        return None
    if fault := of_scene(scheme, worst):
        return fault
    if scheme.equations.element is not None or scheme.arrows is None:
        return None
    flow = Flow(scheme, case.scene.step, 30)
    gap = float(abs(_gaps(flow, rows_of)).max())
    place, time, change, made = "", 0.0, 0.0, 0.0
    if gap <= KEPT:
        own = scheme_for(case, worst.attitude)
        run = long_run(case, own, steps, silent)
        values, terms = with_terms(own, formula, case.digits)(run)
        moved = np.abs(values[ROWS:] - values[:-ROWS]).max(axis=1).astype(float) / size(terms)
        k = int(moved.argmax())
        time, change = float(run.t[k]), float(moved[k])
        gaps = _gaps(flow, rows_of, x0=run.base[k], mu0=run.mu[k], u0=run.u[k])
        made = float(abs(gaps.sum(axis=0)).max())
        if made > 0.5 * change:
            gap, place = float(abs(gaps).max()), f" from t = {time:.4g}"
        elif made > 0.1 * change:
            return None
    evidence = {"quantity": worst.name, "gap": gap, "time": time, "change": change, "made": made}
    if gap > KEPT and _is_bent(scheme, formula):
        return named(
            "coordinates",
            f"the symmetry of {worst.name} is not affine in these coordinates, ξ(x) = ∂J/∂μ is "
            "bent: it does not take the points between the ends of a step to such points, so a "
            "rule that asks for L there cannot keep it; take coordinates in which it is affine, or "
            'declare it as kind="first integral".',
            evidence,
        )
    if gap > KEPT and worst.of_step:
        return named(
            "quantity",
            f"a step does not keep {worst.name}, whose formula has the step in it: at the two ends "
            f"of an arrow{place}, (x, F⁻/h) and (b, F⁺/h), its values differ by {gap:.1e}; mend "
            "the formula, or take the rule that it belongs to.",
            evidence,
        )
    if gap > KEPT:
        return named(
            "invariance",
            f"L_d is not invariant under the symmetry of {worst.name}: at the two ends of an "
            f"arrow{place}, (x, F⁻/h) and (b, F⁺/h), its values differ by {gap:.1e}; write the "
            "rule with L and G, not with single components.",
            evidence,
        )
    return named(
        "run",
        f"L_d keeps {worst.name}, at the start and where the run loses it: {ROWS} steps from t = "
        f"{time:.4g} change it by {change:.1e}, and their arrows, solved with 30 digits, by "
        f"{made:.1e}; it is the solver or the update, which discmech symplecticity tells apart.",
        evidence,
    )


def of_scene(scheme: Scheme, quantity: Conserved) -> dict[str, Any] | None:
    """Return the scene as the cause if dJ/dt is not zero everywhere by its equations of motion.

    The motion from the start may keep J all the same: in a plane, or before a pulse in the time.
    It is asked on pairs without constraints; on an orbit of an action J may be kept there alone.
    """
    s, scene = scheme.s, scheme.scene
    known = s.groupoid.canonical and not s.degenerate and scene.hamiltonian is None
    if not known or scene.all_constraints or scene.in_numbers or quantity.of_step:
        return None
    formula = formula_of(scheme, quantity, scene.step)
    rate = jacobian(list(formula), [*s.x, *s.mu]) * rates(s)
    values = map(to_sympy, scene.parameter_values)  # masses may have to be equal
    rate = rate.xreplace(dict(zip(s.mu, momentum(s), strict=True)))
    if first_violation(rate.xreplace(dict(zip(s.parameter_list, values, strict=True)))) is None:
        return None
    name = quantity.name
    return named(
        "scene",
        f"{name} is no constant of the motion: by the scene's equations d({name})/dt is not 0 at "
        "all states and times; no rule can keep it there, so mend its formula, or the Lagrangian.",
        {"quantity": name},
    )


def _gaps(flow: Flow, rows_of: Any, **start: Any) -> np.ndarray:
    """Return J at (b, F⁺/h) less J at (x, F⁻/h), over its terms, of `ROWS` arrows in a row."""
    run = flow.trajectory(ROWS, **start)
    with flow.numbers.working():
        at, h = flow.context, flow.context.h
        arrows = [at.maps_at(*at.vectors(x, u)) for x, u in zip(run.base, run.u, strict=True)]
        before = np.array([here["minus"] / h for here in arrows])
        after = np.array([here["plus"] / h for here in arrows])
        ends = np.array([here["target"] for here in arrows]).reshape(run.base.shape)
    first, terms = rows_of(replace(run, mu=before))
    last, later = rows_of(replace(run, base=ends, mu=after))
    gaps: np.ndarray = (last - first) / size(np.concatenate([terms, later]))
    return gaps


def change_of_motion(scheme: Scheme, rows_of: Any) -> float:
    """Return the change of a quantity along the certified solution in some steps, over its terms.

    It is 0 without a solution.
    """
    scene, s = scheme.scene, scheme.s
    times = [k * scene.step for k in (0, 1, ROWS)]
    try:
        solutions = reference.solutions(scene, times, 35)
    except reference.ReferenceFailure:
        return 0.0
    x, mu = ([list(getattr(e, part)) for e in solutions] for part in ("x", "mu"))
    base = [s.with_time(row, t) for row, t in zip(x, times, strict=True)] if s.clocked else x
    rows = np.array(base, dtype=object).reshape(len(times), -1)
    states = SimpleNamespace(x=rows, base=rows, mu=np.array(mu, dtype=object))
    with arithmetic(30).working():
        return float(relative_drifts(rows_of(states), 30).max())


def _is_bent(scheme: Scheme, formula: Any) -> bool:
    """True if ξ(x) = ∂J/∂μ on pairs is not an affine function of x."""
    s = scheme.s
    if not s.groupoid.canonical:
        return False
    slope = formula.jacobian(list(s.mu))
    second = [e.diff(a, b) for e in slope for a in s.position for b in s.position]
    return first_violation(second, [*s.u]) is not None
