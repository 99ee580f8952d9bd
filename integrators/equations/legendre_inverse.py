"""ξ(x, μ), the inverse of the Legendre map μ = ∂l/∂ξ(x, ξ), solved in numbers.

A closed form needs the inverse of the mass matrix ∂²l/∂ξ², whose expressions grow with the
factorial of its size, and exists for a Lagrangian that is quadratic in the velocity alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ..numbers import Arithmetic, Double, newton, numeric
from ..numbers.types import Matrix, Number, Vector
from .continuous import closed_velocity, mass_matrix, momentum
from .symbols import SceneSymbols

MOST = 100  # largest number of corrections, and of halvings of each
#: relative size of the last correction: the next would be its square, and H, which is stationary in
#: ξ, does not depend on that
LAST = 2.0**-30
ENTRIES = 2**20  # entries of all the mass matrices in memory at once


class LegendreInverse:
    """A function of rows x (r, n), μ (r, m) and the parameters that gives ξ (r, m).

    start: ξ nearby, (r, m). A row without a solution is not a number.
    """

    def __init__(self, s: SceneSymbols, numbers: Arithmetic) -> None:
        self.numbers, self.double = numbers, isinstance(numbers, Double)
        #: True if ξ is given by a Hamiltonian, as ∂H/∂μ, or B ∂H for a degenerate Lagrangian
        self.closed = s.hamiltonian is not None
        if self.closed:
            own = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
            speed = list(closed_velocity(s))  # type: ignore[arg-type]
            self._maps = numeric(own, [speed], numbers, columns=self.double)
            return
        mass = mass_matrix(s)
        #: True if one correction solves, from any start
        self.quadratic = not set(s.u) & mass.free_symbols
        letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
        self._maps = numeric(letters, [list(momentum(s)), mass], numbers, columns=self.double)

    def __call__(
        self, x: Matrix, mu: Matrix, p: Sequence[Number | Vector], start: Matrix
    ) -> np.ndarray:
        if self.closed and self.double:
            velocities = np.asarray(self._maps(x.T, mu.T, p), dtype=float)
            return np.broadcast_to(velocities.T, mu.shape)
        if self.closed:
            return np.array([self._maps(*at, p) for at in zip(x, mu, strict=True)])
        if self.quadratic:
            start = 0 * mu
        if not self.double:
            return np.array([self._row(*at, p) for at in zip(x, mu, start, strict=True)])
        velocities, size = np.empty(mu.shape), max(1, ENTRIES // mu.shape[1] ** 2)
        for first in range(0, len(mu), size):
            part = slice(first, first + size)
            velocities[part] = self._rows(x[part], mu[part], _of(p, part), start[part])
        return velocities

    def _row(self, x: Vector, mu: Vector, start: Vector, p: Sequence[Number | Vector]) -> Vector:
        """Solve one row, in any arithmetic."""

        def change(xi: Vector) -> Vector:
            value, mass = self._maps(x, xi, p)
            return self.numbers.solve(mass, mu - value)

        eps = self.numbers.eps
        velocity = newton(change, start, max(map(abs, start), default=0), eps)
        return start * np.inf * 0 if velocity is None else velocity

    def _rows(
        self, x: Matrix, mu: Matrix, p: Sequence[Number | Vector], start: Matrix
    ) -> np.ndarray:
        """Solve many rows in doubles: corrections are halved until the remainder shrinks."""
        left, mass = self._left(x, start, mu, p)
        if self.quadratic:
            return start + _solved(mass, left)
        velocities = np.full(mu.shape, np.nan)
        rows = np.arange(len(mu))
        xi, size = start, np.abs(start).sum(axis=1)
        for _ in range(MOST):
            step = _solved(mass, left)
            done = np.abs(step).sum(axis=1) <= LAST * size
            velocities[rows[done]] = (xi + step)[done]
            kept = ~done & np.isfinite(step).all(axis=1)
            if not kept.any():
                break
            state = (rows, x, mu, xi, step, size, left)
            rows, x, mu, xi, step, size, left = (e[kept] for e in state)
            p = _of(p, kept)
            part = np.ones(len(rows))  # each row's share of its correction
            for _ in range(MOST):
                new, mass = self._left(x, xi + part[:, None] * step, mu, p)
                worse = ~(np.linalg.norm(new, axis=1) < np.linalg.norm(left, axis=1))
                if not worse.any():
                    break
                part[worse] /= 2
            new[worse] = np.nan
            xi, left = xi + part[:, None] * step, new
            size = np.maximum(size, np.abs(xi).sum(axis=1))
        return velocities

    def _left(
        self, x: Matrix, xi: Matrix, mu: Matrix, p: Sequence[Number | Vector]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return μ − ∂l/∂ξ (r, m) and the mass matrix, (r, m, m), or (m, m) if it is constant."""
        # constant entries are integers, which beyond 2⁶³ numpy takes for objects
        value, mass = (np.asarray(e, dtype=float) for e in self._maps(x.T, xi.T, p))
        return mu - np.broadcast_to(value.T, mu.shape), np.moveaxis(mass, (0, 1), (-2, -1))


def _of(p: Sequence[Number | Vector], rows: np.ndarray | slice) -> Sequence[Number | Vector]:
    """Return the parameters of some rows: those of a lattice may differ by row."""
    return [e[rows] if np.ndim(e) else e for e in p]


#: the inverse for a scene's symbols in an arithmetic
legendre_inverse = lru_cache(maxsize=256)(LegendreInverse)


def _solved(mass: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return mass⁻¹ right in each row; NaN where it is singular."""
    try:
        if mass.ndim == 2:
            return np.asarray(right @ np.linalg.inv(mass).T)
        return np.asarray(np.linalg.solve(mass, right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if mass.ndim == 2:
            return np.full(right.shape, np.nan)
        return np.vstack([_solved(m, r[None]) for m, r in zip(mass, right, strict=True)])
