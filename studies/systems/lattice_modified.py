"""The modified energy of a lattice along a run, so that no run has to be long."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from .modified_energy import STATES, Changes, changes
from .quantities import energies
from .reference import field_of


class LatticeDual:
    """H, its round-off, f and dH of a lattice in rows of z, all x and then all μ.

    As `modified_energy.Dual` of a scene on a pair groupoid.
    """

    canonical = True

    def __init__(self, scheme: Any) -> None:
        self.scheme = scheme
        self.shapes = [part.shape for part in scheme.lattice.start]
        self.n, self.m = (int(np.prod(shape)) for shape in self.shapes)
        self._field = field_of(scheme, self.shapes[0], scheme.lattice.start[1])

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return H (r,), the largest sum of its absolute terms (r,), f and dH (r, n+m)."""
        x, mu = self.split(z)
        near = np.broadcast_to(self.scheme.lattice.start[1], mu.shape)
        H, terms = energies(self.scheme, SimpleNamespace(x=x, mu=mu, u=near))
        f = np.array([self._field(0.0, row) for row in z])
        return H, np.full(len(z), terms), f, np.hstack([-f[:, self.n :], f[:, : self.n]])

    def split(self, z: np.ndarray) -> list[np.ndarray]:
        """Return x (r, N, n) and μ (r, N, m) of rows of z."""
        parts = z[:, : self.n], z[:, self.n :]
        return [e.reshape(len(z), *shape) for e, shape in zip(parts, self.shapes, strict=True)]

    def covector(self, z: np.ndarray, v: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Return the α with B α = v, of each row."""
        return np.hstack([-v[:, self.n :], v[:, : self.n]])

    def unit(self, size: np.ndarray) -> np.ndarray:
        """Return the largest size of x, and of μ: sites have one unit, and tails may be tiny."""
        parts = size[: self.n], size[self.n :]
        return np.concatenate([np.full(len(e), e.max(initial=0.0)) for e in parts])

    def flow(self, scheme: Any, step: Any) -> Any:
        """Return the flow as one of scenes, with flat states."""
        return _Flat(scheme.flow(step), self)


class _Flat:
    """A lattice's flow with states as flat vectors."""

    def __init__(self, flow: Any, dual: LatticeDual) -> None:
        self._flow, self._dual, self.step, self.scheme = flow, dual, flow.step, flow.scheme

    def trajectory(self, steps: int, *, x0: Any, mu0: Any) -> Any:
        """Return the rows of a run, flat."""
        x, mu = (part[0] for part in self._dual.split(np.concatenate([x0, mu0])[None]))
        run = self._flow.trajectory(steps, x0=x, mu0=mu)
        return SimpleNamespace(x=run.x.reshape(steps + 1, -1), mu=run.mu.reshape(steps + 1, -1))


def has_modified_energy(lattice: Any) -> bool:
    """Return whether states of a lattice are free, on pairs, and its energy is to stay."""
    return bool(
        lattice.groupoid.canonical and lattice.constraint is None and not lattice.has_contact
    )


def lattice_changes(scheme: Any, steps: int) -> Changes | None:
    """Return the changes of the modified energy along a run of so many steps of the lattice's."""
    step = scheme.lattice.step
    run = scheme.flow(step).trajectory(steps, max(1, steps // (2 * STATES)))
    rows = [part.reshape(len(run.t), -1) for part in (run.x, run.mu)]
    flat = SimpleNamespace(t=run.t, x=rows[0], mu=rows[1])
    return changes(scheme, step, flat, steps, dual=LatticeDual(scheme))
