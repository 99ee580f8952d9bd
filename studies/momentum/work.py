"""The change of a quantity in a step, less that by the force or by its own equation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators.equations import force_points
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import numeric
from discmech.integrators.scene import Conserved

from ..systems.runs import with_terms
from . import section
from .quantities import formula_of, round_offs


def less_work(
    flow: Flow, q: Conserved, run: Any, digits: int
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return per step of a run the change of a quantity less the force's part, relative to the
    absolute terms.

    See `_change`, `_change_along_orbit`; a nonholonomic momentum is compared with its equation,
    `section`. And the effect of round-off (`round_offs`).
    """
    scheme = flow.scheme
    formula = formula_of(scheme, q, run.step)
    rows_of = with_terms(scheme, formula, digits)
    units = round_offs(scheme, formula, run, rows_of(run)[1], digits)
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
        changes = (float(g / s) if g else 0.0 for g, s in zip(gaps, scales, strict=True))
        return np.array([0.0, *changes]), units


def _change(flow: Flow, run: Any, rows_of: Any, slope: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return (J(y, μ′) − J(x, μ) less the work Σ ω_i ∂J/∂μ(x_i) f(x_i, ξ_i), absolute terms) per
    step.

    For a momentum map: its symmetry moves every point x_i where the rule evaluates L, with the
    weight ω_i, as it moves the ends (discrete Noether theorem with forces, Marsden, West 2001,
    3.2.5). slope: ∂J/∂μ, without μ. Nothing of F± is used.
    """
    s = flow.scheme.s
    parts = [slope.xreplace(dict(zip(s.x, at.point, strict=True))) * at.force
             for at in force_points(flow.scheme.discrete.of)]  # fmt: skip
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
    """Return (J(y, μ′ − f⁺) − J(x, μ − f⁻), absolute terms) per step; f±: the force's part of F±/h.

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
