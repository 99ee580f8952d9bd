"""Parameters of the states that satisfy holonomic constraints, for differences on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from discmech.integrators.extensions.foreign import SceneInNumbers
from discmech.integrators.numbers import Vector

CORRECTIONS = 50  # largest number of Newton corrections; each doubles the digits


def constrained_parameters(
    system: SceneInNumbers, z: Vector, scale: Vector
) -> tuple[Callable[[Vector], Vector], Vector]:
    """Return (embedding, reach) of the constrained states near z.

    embedding: y (2(n−k),) ↦ a state z(y) with φ(q) = 0 and φ′(q) q̇ = 0, z(0) near z. y are
    components in the tangent spaces at z; q is brought back along the normals at z, and p by the
    normal part that the constraint on velocities requires. reach: the size of each y.
    """
    n = system.n
    first = system.constraint_jacobian(z[:n])
    k = len(first)
    tangent = np.linalg.svd(first)[2][k:].T  # (n, n−k)
    q0, p0 = z[:n], z[n:]
    size = np.array([scale[:n].max(), scale[n:].max()])

    def on(q: Vector) -> Vector:
        for _ in range(CORRECTIONS):
            slope = system.constraint_jacobian(q)
            change = first.T @ np.linalg.solve(slope @ first.T, system.constraint(q))
            q = q - change
            if np.abs(change).max() <= 2.0**-52 * size[0]:
                break
        return q

    def embedding(y: Vector) -> Vector:
        q = on(q0 + tangent @ y[: n - k])
        p = p0 + tangent @ y[n - k :]
        slope = system.constraint_jacobian(q)
        for _ in range(3):  # linear in p if H is quadratic in it
            rate = slope @ system.velocity(q, p)
            probe = np.array([slope @ (system.velocity(q, p + row) - system.velocity(q, p))
                              for row in slope]).T  # fmt: skip
            p = p - slope.T @ np.linalg.solve(probe, rate)
        return np.concatenate([q, p])

    return embedding, np.repeat(size, n - k) / 4
