"""Residual, defects and regularity of the step between two arrows.

Two arrows g, g′ = Ψ(g) may lie in the charts of different translates: the Legendre maps at both
are compared across charts (paper, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numbers.types import Matrix, Number, Vector
from .defects import poisson_defect, pullback_defect
from .step_map import Maps, StepMap


@dataclass(frozen=True)
class Arrow:
    """An arrow g with its (x, μ), its translate's geometry, and the maps at g (`geometry.at`)."""

    x: Vector
    u: Vector
    mu: Vector
    geometry: StepMap
    at: Maps


def residual(here: Arrow, there: Arrow) -> Number:
    """Return the largest |F⁺(g) − F⁻(g′)| relative to the largest of |F⁺(g)| and |F⁻(g′)|."""
    geometry = here.geometry
    with geometry.numbers.working():
        ends = here.at["plus"], there.at["minus"]
        size = max(abs(e) for end in ends for e in end)
        gap = max(abs(ends[0] - ends[1]))
        return geometry.numbers.public([gap / size if gap else gap])[0]


def defects(here: Arrow, there: Arrow) -> tuple[Number, Number]:
    """Return the defects (pullback, Poisson) of the step from g to g′, as in `Flow`."""
    geometry = here.geometry
    with geometry.numbers.working():
        at, after = (arrow.geometry.tracked(arrow.x, arrow.u) for arrow in (here, there))
        step = there.x, there.mu, geometry.dual_step(at, geometry.q[0])
        pair = [pullback_defect(geometry, at, after, geometry.tangent(at, after)),
                poisson_defect(geometry, here.x, here.mu, step)]  # fmt: skip
        pullback, poisson = geometry.numbers.public(pair)
        return pullback, poisson


def regularity(arrow: Arrow) -> float:
    """Return smallest over largest singular value of e→_μ(F⁻_γ) at fixed x, in double precision.

    It is 0 where FL is singular, and does not depend on a chart.
    """
    sizes = np.linalg.svd(_along(arrow))[1]
    return float(sizes[-1] / sizes[0])


def singular_sign(arrow: Arrow) -> float:
    """Return det of e→(F⁻) over ‖e→(F⁻)‖ᵐ: its sign changes where FL is singular."""
    along = _along(arrow)
    return float(np.linalg.det(along) / np.linalg.norm(along, 2) ** len(along))


def _along(arrow: Arrow) -> Matrix:
    """Return e→_μ(F⁻_γ), m×m, in double precision."""
    with arrow.geometry.numbers.working():
        return np.asarray(arrow.at["minus_u"] @ arrow.at["R"], dtype=float)
