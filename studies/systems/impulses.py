"""Impulses of gaps: what they change of μ, and which of a step belong to its impacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.extensions.contact import Gaps

#: share of the hardest impulse of a step: above it, there are impulses that belong to no impact
OTHERS = 1e-12


def change_by(gaps: Gaps, place: Any, P: np.ndarray) -> np.ndarray:
    """Return the change of μ by the impulses P (K, 1 + D) of the gaps at a place."""
    made = P[:, 0] @ place.normal
    for i, (_, *along) in enumerate(P):
        if gaps.friction[i] > 0:
            push = np.array(along[: len(place.where[i])]) @ place.bases[i]
            made = made + push @ place.slip[i]
    changed: np.ndarray = made
    return changed
