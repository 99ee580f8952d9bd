"""The multisymplectic law: the gain of ω in a patch is the flux through the bonds at its rim."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

STEPS = 8


def patch_defects(
    makes: Sequence[Callable[[np.ndarray, np.ndarray], Any]],
    lattice: Any,
    x: np.ndarray,
    mu: np.ndarray,
    seed: int = 0,
) -> dict[str, float]:
    """Return {"bond", "patch"} of two random variations over STEPS steps from (x, μ).

    makes: for each substep a function of (x, μ), the step from there, with `after`, `applied` and
    `fluxes` (`DualStep`). bond: the largest Φ_i + Φ_j, over the largest Φ. patch: |the gain of Σ
    ω_i − Σ Φ_i through the rim|, the largest of three patches, over the sum of all |Φ| in the steps
    and all |ω_i|.
    """
    random, free = np.random.default_rng(seed), lattice.free[:, None]
    pair = [tuple(random.normal(size=e.shape) * free for e in (x, mu)) for _ in range(2)]
    patches = [_patch(lattice, share) for share in (0.1, 0.3, 0.6)]
    start = _wedges(*pair)
    through, size, off = np.zeros(len(patches)), abs(start).sum(), 0.0
    for make in [*makes] * STEPS:
        step = make(x, mu)
        flux = step.fluxes(*pair)
        size += abs(flux).sum()
        off = float(np.maximum(off, abs(flux.sum(axis=1)).max() / (abs(flux).max() or 1)))
        for k, inside in enumerate(patches):
            ends = inside[lattice.pairs]
            rim = ends[:, :1] != ends[:, 1:]
            through[k] += flux[ends & rim].sum()
        pair = [step.applied(v)[:2] for v in pair]
        x, mu = step.after
    gained = _wedges(*pair) - start
    missed = [abs(gained[inside].sum() - t) for inside, t in zip(patches, through, strict=True)]
    return {"bond": off, "patch": float(np.max(missed) / size)}


def _wedges(one: Any, other: Any) -> np.ndarray:
    """Return ω_i of two variations, (N,)."""
    return np.asarray((one[0] * other[1] - other[0] * one[1]).sum(axis=1))


def _patch(lattice: Any, share: float) -> np.ndarray:
    """Return a share of the sites, (N,), in the middle of the list: some rows of a net."""
    inside = np.zeros(lattice.sites, dtype=bool)
    half = max(1, int(share * lattice.sites / 2))
    inside[lattice.sites // 2 - half : lattice.sites // 2 + half] = True
    return inside
