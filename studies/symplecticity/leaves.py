"""Closed curves on symplectic leaves, and the area that they enclose.

A Poisson map takes leaves to leaves and preserves the symplectic form ω on them, so a closed curve
on a leaf encloses the same area as its image. From a point z₀ the leaf is reached by the motions of
linear functions, ∂Z/∂t = B(Z) a, Z(0; a) = z₀, with a covector a. On it ω(B a, v) = ⟨a, v⟩, so the
cone of these motions over a closed curve s ↦ Z(1; a(s)) has the area ∫₀¹ ∮ ⟨a, ∂Z/∂s⟩ ds dt. In
canonical coordinates this is ∮ p·dq, on a coadjoint orbit ∮ ⟨μ, g⁻¹dg⟩ with the lift g = exp a,
which is closed if a is. Only B is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

import numpy as np

from discmech.integrators.extensions.foreign.differences import EPS, Map, Noise, images
from discmech.integrators.numbers import Matrix, Vector

from .form_in_numbers import UNRESOLVED, noise_along, slopes_and_tail
from .records import Defect

#: B of r states at once, columns (l, r) ↦ (l, l, r)
Tensor: TypeAlias = Callable[[Matrix], np.ndarray]

NODES = 6  # Gauss nodes of a motion, of order 12; with one less, of order 10, they give the error
MOST = 60  # largest number of corrections; each reduces the error by a factor as small as the curve
#: directions in which B is smaller than this, in natural units, leave the leaf
RANK = 1e-9
SETTLED = 8  # corrections below so many round-offs of a state, in natural units, count as 0


class Leaf:
    """The leaf through z (l,) of a tensor (l, r) ↦ (l, l, r); scale: the size of each entry."""

    def __init__(self, tensor: Tensor, z: Vector, scale: Vector) -> None:
        self.tensor, self.z, self.scale = tensor, z, scale
        here = tensor(z[:, None])[:, :, 0] / np.outer(scale, scale)
        self.back = np.linalg.pinv(here, rcond=RANK) / np.outer(scale, scale)

    def covectors(self, ways: Matrix) -> Matrix:
        """Return a (r, l) whose motions begin along the part of the ways (r, l) in the leaf."""
        return ways @ self.back.T

    def motions(
        self, a: Matrix, ends: Matrix | None = None, nodes: int = NODES
    ) -> tuple[Matrix, np.ndarray, Matrix]:
        """Return (a, Z at the Gauss nodes (nodes, r, l), Z(1; a) (r, l)).

        With `ends`, a is chosen so that Z(1; a) is nearest to them. All are nan if the iteration
        does not converge because the curve is too large.
        """
        weights, integrals = _gauss(nodes)
        least = SETTLED * EPS * (1 + float((np.abs(self.z) / self.scale).max()))
        stages = np.broadcast_to(self.z, (nodes, *a.shape))
        last = np.inf
        for _ in range(MOST):
            columns = stages.reshape(-1, a.shape[1]).T
            B = self.tensor(columns).reshape(*[a.shape[1]] * 2, nodes, len(a))
            rates = (B * a.T[None, :, None, :]).sum(axis=1).transpose(1, 2, 0)
            moved = self.z + np.tensordot(integrals, rates, 1)
            end = self.z + np.tensordot(weights, rates, 1)
            more = 0.0 if ends is None else self.covectors(ends - end)
            change = float((np.abs(moved - stages) / self.scale).max(initial=0.0))
            change = max(change, float(np.abs(more * self.scale).max(initial=0.0)))
            a, stages = a + more, moved
            if change <= least or not change < 4 * last:
                break
            last = change
        if not change <= 8 * least:
            return np.full_like(a, np.nan), np.full_like(stages, np.nan), np.full_like(end, np.nan)
        return a, stages, end

    def curve(self, ways: Matrix) -> tuple[Matrix, Matrix]:
        """Return (a, points), each (r, l): a closed curve on the leaf, about along the ways."""
        a, _, end = self.motions(self.covectors(ways))
        return a, end

    def area(
        self, a: Matrix, ends: Matrix | None = None, nodes: int = NODES
    ) -> tuple[float, float, float, Matrix]:
        """Return the area of the cone over the curve and its accuracy.

        The result is (the area, its absolute terms, the share of the curve at the highest
        frequencies, the curve itself (r, l)).
        """
        a, stages, end = self.motions(a, ends, nodes)
        mean = np.tensordot(_gauss(nodes)[0], stages, 1)
        slopes, tail = slopes_and_tail(mean, np.abs(a).max(axis=0))
        terms = a * slopes * (2 * np.pi / len(a))
        return float(terms.sum()), float(np.abs(terms).sum()), tail, end


@cache
def _gauss(nodes: int) -> tuple[Vector, Matrix]:
    """Return (weights (s,), A (s, s)) of Gauss's method with s nodes in [0, 1]."""
    c, weights = np.polynomial.legendre.leggauss(nodes)
    c, powers = (c + 1) / 2, np.arange(1, nodes + 1)
    # A_ij = ∫₀^{c_i} ℓ_j, by the polynomials that are 1 at one node
    integrals = (c[:, None] ** powers / powers) @ np.linalg.inv(c[:, None] ** (powers - 1))
    return weights / 2, integrals


def leaf_defect(
    f: Map, tensor: Tensor, z: Vector, scale: Vector, ways: Matrix, noise: Noise | None = None
) -> Defect:
    """Return how far the area of a closed curve about z on its leaf is from that of its image by f.

    ways (r, l): the curve relative to z, of which the part along the leaf is taken. If the image
    lies on no leaf, the defect is its distance from one, relative to its extent. Without the noise
    of f that of the image is taken.
    """
    leaf = Leaf(tensor, z, scale)
    a, curve = leaf.curve(ways)
    image, centre = images(f, curve), f(z)
    if not (np.isfinite(curve).all() and np.isfinite(image).all() and np.isfinite(centre).all()):
        return Defect(0.0, 0.0, float("inf"))
    there = Leaf(tensor, centre, scale)
    before = there.covectors(image - centre)
    areas = [leaf.area(a), there.area(before, image)]
    coarse = [leaf.area(a[::2], None, NODES - 1),
              there.area(before[::2], image[::2], NODES - 1)]  # fmt: skip
    tails = max(e[2] for e in areas)
    if not np.isfinite([e[:3] for e in (*areas, *coarse)]).all() or tails > UNRESOLVED:
        return Defect(0.0, 0.0, float("inf"))
    rough = (noise or noise_along(image)).rough(image)
    along = np.abs(there.covectors(np.diff(image, axis=0, append=image[:1]))).max(axis=0)
    beyond = sum(abs(e[0] - c[0]) for e, c in zip(areas, coarse, strict=True))
    size = max(areas[0][1], areas[1][1]) or 1.0
    # noise of 64 points is independent, and a point's noise moves the area by ω(noise, the curve's
    # way)
    unsure = float(rough @ along) * len(curve) ** 0.5 + beyond + size * tails
    gap = abs(areas[1][0] - areas[0][0])
    off = np.abs(image - areas[1][3]).max(axis=0)
    cut = sum(np.abs(e[3][::2] - c[3]).max(axis=0) for e, c in zip(areas, coarse, strict=True))
    extent = float((np.ptp(image, axis=0) / scale).max()) or 1.0
    left = float((np.maximum(off - 2 * (rough + cut), 0) / scale).max()) / extent
    certain = max(max(0.0, gap - unsure) / size, left)
    return Defect(certain, max(gap / size, left), unsure / size)
