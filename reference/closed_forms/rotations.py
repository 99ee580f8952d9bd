"""Rotations in space, on mpf numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath


def cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """Return a × b of two vectors of length 3."""
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def rotation(vector: Sequence[Any]) -> Any:
    """Return exp of the hat of the vector (Rodrigues)."""
    angle = mpmath.sqrt(mpmath.fdot(vector, vector))
    if angle == 0:
        return mpmath.eye(3)
    a, b, c = (component / angle for component in vector)
    hat = mpmath.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    return mpmath.eye(3) + mpmath.sin(angle) * hat + (1 - mpmath.cos(angle)) * (hat * hat)


def momentum_frame(momentum: Sequence[Any]) -> Any:
    """Return the rotation of the momentum to axis 3 and the node (momentum x e3) to axis 1."""
    size = mpmath.sqrt(mpmath.fdot(momentum, momentum))
    up = [component / size for component in momentum]
    across = mpmath.sqrt(up[0] ** 2 + up[1] ** 2)
    node = [up[1] / across, -up[0] / across, mpmath.mpf(0)]
    return mpmath.matrix([node, cross(up, node), up])
