"""Residual, defects and regularity of the step between two arrows.

Two arrows g, g′ = Ψ(g) may lie in the charts of different translates: the Legendre maps at both
are compared across charts (paper, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numbers.types import Matrix, Number, Vector
from .local_geometry import LocalGeometry, Maps, frobenius, relative_defect

#: (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′)
Step = tuple[Vector, Vector, Matrix]


@dataclass(frozen=True)
class Arrow:
    """An arrow g with its (x, μ), its translate's geometry, and the maps at g (`geometry.at`)."""

    x: Vector
    mu: Vector
    geometry: LocalGeometry
    at: Maps


def residual(here: Arrow, there: Arrow) -> Number:
    """‖F⁺(g) − F⁻(g′)‖/h relative to ‖μ′‖ + 1."""
    geometry = here.geometry
    with geometry.numbers.working():
        gap = (here.at["plus"] - there.at["minus"]) / geometry.q[0]
        return _public(geometry, frobenius(gap) / (1 + frobenius(there.mu)))


def defects(here: Arrow, there: Arrow) -> tuple[Number, Number]:
    """The defects (pullback, Poisson) of the step from g to g′, as in `Flow`."""
    geometry = here.geometry
    with geometry.numbers.working():
        tangent = geometry.tangent(here.at, there.at)
        step = there.x, there.mu, geometry.dual_step(here.at, geometry.q[0])
        pullback = pullback_defect(geometry, here.at, there.at, tangent)
        return pullback, poisson_defect(geometry, here.x, here.mu, step)


def pullback_defect(geometry: LocalGeometry, here: Maps, there: Maps, tangent: Matrix) -> Number:
    """‖PΨᵀ Ω PΨ − Ω‖ / (‖PΨ‖²‖Ω‖) of TΨ = tangent, (n+m)×(n+m), between two arrows' maps."""
    p = geometry.prolongation(here, there, tangent)
    before, after = geometry.omega(here), geometry.omega(there)
    return _public(geometry, relative_defect(p.T @ after @ p, before, p))


def poisson_defect(
    geometry: LocalGeometry, x: Vector, mu: Vector, step: Step, bracket_sign: int = 1
) -> Number:
    """‖M Π Mᵀ − Π′‖ / (‖M‖²‖Π′‖) of a step (x′, μ′, M) from (x, μ), M its derivative."""
    after_x, after_mu, m = step
    before = geometry.poisson_tensor(x, mu, bracket_sign)
    after = geometry.poisson_tensor(after_x, after_mu, bracket_sign)
    return _public(geometry, relative_defect(m @ before @ m.T, after, m))


def regularity(arrow: Arrow) -> float:
    """Smallest over largest singular value of e→_μ(F⁻_γ) at a fixed x, in double precision.

    0 on the set where FL is singular; no chart enters it.
    """
    sizes = np.linalg.svd(_along(arrow))[1]
    return float(sizes[-1] / sizes[0])


def singular_sign(arrow: Arrow) -> float:
    """det of e→(F⁻) over ‖e→(F⁻)‖ᵐ: its sign changes where FL is singular."""
    along = _along(arrow)
    return float(np.linalg.det(along) / np.linalg.norm(along, 2) ** len(along))


def _along(arrow: Arrow) -> Matrix:
    """e→_μ(F⁻_γ), m×m, in double precision."""
    with arrow.geometry.numbers.working():
        return np.asarray(arrow.at["minus_u"] @ arrow.at["R"], dtype=float)


def _public(geometry: LocalGeometry, value: Number) -> Number:
    return geometry.numbers.public([value])[0]
