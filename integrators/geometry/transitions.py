"""What a run's own arrows say: residual, defects, regularity, in whatever translate each lies.

Rows k and k+1 of a run that keeps every step are two arrows g, g′ = Ψ(g), each in the chart of its
translate. Residual and defects hold them against one another across charts (paper, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .local_geometry import LocalGeometry, frobenius, relative_defect

if TYPE_CHECKING:
    from ..flows.flow import Flow, Trajectory


@dataclass(frozen=True)
class Arrow:
    """A row of a run: (x, μ), its translate's maps at this point, and what they give there."""

    x: np.ndarray
    mu: np.ndarray
    geometry: LocalGeometry
    at: dict[str, np.ndarray]


def arrow(flow: Flow, run: Trajectory, row: int) -> Arrow:
    """The arrow of a row."""
    with flow.numbers.working():
        x, mu = flow._vectors(run.x[row], run.mu[row])
        _, u = flow._vectors(run.x[row], run.u[row])
        geometry = flow.geometry_in(int(run.translates[row]))
        return Arrow(x, mu, geometry, geometry.at(x, u))


def residual(flow: Flow, here: Arrow, there: Arrow) -> Any:
    """‖F⁺(g) − F⁻(g′)‖/h relative to ‖μ′‖ + 1."""
    with flow.numbers.working():
        gap = (here.at["plus"] - there.at["minus"]) / flow._h
        return flow._number(frobenius(gap) / (1 + frobenius(there.mu)))


def defects(flow: Flow, here: Arrow, there: Arrow) -> tuple[Any, Any]:
    """(pullback, Poisson) of the step from g to g′, as in `Flow.pullback_defect`."""
    with flow.numbers.working():
        geometry = here.geometry
        tangent = geometry.tangent(here.at, there.at)
        pullback = flow._pullback(here.at, there.at, tangent)
        m = geometry.dual_step(here.at, flow._h)
        before, after = (geometry.poisson_tensor(a.x, a.mu) for a in (here, there))
        return pullback, flow._number(relative_defect(m @ before @ m.T, after, m))


def regularity(flow: Flow, here: Arrow) -> float:
    """Smallest over largest singular value of e→_μ(F⁻_γ) at a fixed x, in double precision.

    0 on the set where FL is singular; no chart enters it.
    """
    with flow.numbers.working():
        along = here.at["minus_u"] @ here.at["R"]
    sizes = np.linalg.svd(np.asarray(along, dtype=float))[1]
    return float(sizes[-1] / sizes[0])


def singular_sign(flow: Flow, g: Any, x: Any) -> tuple[float, int]:
    """(det of e→(F⁻) over ‖e→(F⁻)‖ᵐ, the translate that holds it best) at an element g, N×N.

    The sign changes where FL is singular.
    """
    with flow.numbers.working():
        translate, u = flow.edge.place(flow.edge.chart.array(g))
        x, u = flow._vectors(x, u)
        at = flow.geometry_in(translate).at(x, u)
        along = np.asarray(at["minus_u"] @ at["R"], dtype=float)
    return float(np.linalg.det(along) / np.linalg.norm(along, 2) ** len(along)), translate
