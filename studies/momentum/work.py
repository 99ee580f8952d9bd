"""The change of a quantity in a step, less that by the force or by its own equation."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech.integrators.equations import force_points
from discmech.integrators.extensions.contact import Gaps
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import arithmetic, numeric
from discmech.integrators.scene import Conserved

from ..systems.impulses import OTHERS, change_by
from ..systems.runs import with_terms
from . import section
from .quantities import formula_of, round_offs


def less_work(
    flow: Flow, q: Conserved, run: Any, digits: int
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return per step of a run the change of a quantity less the force's part, relative to the
    absolute terms.

    See `_change`, `_change_along_orbit`; a nonholonomic momentum is compared with its equation,
    `section`, and impacts with their impulses (`_of_impacts`): of the steps with impulses these
    alone. And the effect of round-off (`round_offs`).
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
        if scheme.scene.contact is not None:
            gap = _of_impacts(scheme, run, rows_of, digits, gap, scale)
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
    values, terms = rows_of(run)
    s = flow.scheme.s
    if not s.forced:
        return np.diff(values, axis=0), np.maximum(terms[1:], terms[:-1])
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
    return np.diff(values, axis=0) - np.array(done), np.maximum(terms[1:], terms[:-1]) + size


def _change_along_orbit(flow: Flow, run: Any, rows_of: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return (J(y, μ′ − f⁺) − J(x, μ − f⁻), absolute terms) per step; f±: the force's part of F±/h.

    For a Casimir that is no linear function of μ: without the force an arrow has one J at both
    ends. f± come from the displacement of points, not from F± (`discrete_force`).
    """
    if not flow.scheme.s.forced:
        values, terms = rows_of(run)
        return np.diff(values, axis=0), np.maximum(terms[1:], terms[:-1])
    at = flow.context
    forces = [flow.geometry.discrete_force(*at.vectors(x, u))
              for x, u in zip(run.base[:-1], run.u[:-1], strict=True)]  # fmt: skip
    minus, plus = (np.array(part) for part in zip(*forces, strict=True))
    mu = np.vectorize(flow.numbers.number, otypes=[flow.numbers.dtype])(run.mu)
    before, terms = rows_of(replace(run, base=run.base[:-1], mu=mu[:-1] - minus, u=run.u[:-1]))
    after, later = rows_of(replace(run, base=run.base[1:], mu=mu[1:] - plus, u=run.u[1:]))
    return after - before, np.maximum(terms, later)


def struck(run: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps with impulses, and those of them whose impulses are all of impacts, (r,)."""
    of_impacts = np.zeros_like(run.impulses[:-1])
    np.add.at(of_impacts, _steps_of_impacts(run), run.impacts.impulses)
    hardest = abs(run.impulses[:-1]).max(axis=(1, 2))
    others = abs(run.impulses[:-1] - of_impacts).max(axis=(1, 2))
    return hardest > 0, (hardest > 0) & (others <= OTHERS * hardest)


def _steps_of_impacts(run: Any) -> np.ndarray:
    """Return the number of the step in which each impact of a run happens, (i,)."""
    shares = np.asarray((run.impacts.t - run.t[0]) / float(run.step), dtype=float)
    return shares.astype(int).clip(0, len(run.t) - 2)


def _of_impacts(
    scheme: Any, run: Any, rows_of: Any, digits: int, gap: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Return the gaps of steps, where those with impulses have the change beyond these.

    It is the larger one of each impact and of the whole step. Impulses of a gap that stays closed,
    or before an impact at the end of a step, act at no place that a row tells: with these, or with
    a force in the step, only impacts are asked. scale: raised to the terms of impacts.
    """
    pushed, by_impacts = struck(run)
    gap[pushed & ~(by_impacts & (not scheme.s.forced))] = 0
    numbers, each, steps = arithmetic(2 * digits), run.impacts, _steps_of_impacts(run)
    if not len(steps):
        return np.abs(gap)
    gaps, own = Gaps(scheme.s, scheme.scene, numbers), np.vectorize(numbers.number, otypes=[object])
    with numbers.working():
        base = own(np.hstack([each.x, each.t[:, None]])[:, : run.base.shape[1]])
        changed = [own(mu) + change_by(gaps, gaps.at(x), own(P))
                   for x, mu, P in zip(base, each.before, each.impulses, strict=True)]  # fmt: skip
    (before, _), (wanted, others), (after, terms) = (
        rows_of(SimpleNamespace(x=base, mu=np.array(mu)))
        for mu in (each.before, changed, each.after)
    )
    made = np.zeros_like(gap)
    np.add.at(made, steps, wanted - before)
    gap = np.abs(gap - np.where(by_impacts[:, None] & (not scheme.s.forced), made, 0 * made))
    np.maximum.at(gap, steps, abs(after - wanted))
    np.maximum.at(scale, steps, np.maximum(terms, others))
    return gap
