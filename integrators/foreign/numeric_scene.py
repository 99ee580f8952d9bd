"""A scene whose Hamiltonian is a function of numbers, in the form that a black box gets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..equations import SceneSymbols
from ..errors import BadInput, shown
from ..numbers import Arithmetic, Matrix, Number, Vector
from ..scene import Scene
from .differences import derivative, noise_of
from .scene_in_numbers import SceneInNumbers, several

#: largest difference of a gradient from the differences of its function, relative to its largest
#: entry: a table in single precision is no better
NEAR = 1e-4


class NumericScene(SceneInNumbers):
    """`SceneInNumbers` for the user's own functions H(q, p) and gradient(q, p)."""

    _double = True

    def __init__(
        self, s: SceneSymbols, scene: Scene, numbers: Arithmetic, kind: type | None = None
    ) -> None:
        self._s, self._numbers, self._kind = s, numbers, kind
        self.name, self.n, self.m = scene.name, s.n, len(s.mu)
        self._scene, self._clocked, self.t = scene, False, 0.0
        with numbers.working():
            self._p = [numbers.number(v) for v in scene.parameter_values]
        self._closed = True
        self._canonical = scene.groupoid.canonical

    def _slopes(self, q: Vector, p: Vector) -> tuple[Vector, Vector]:
        if several(q, p):  # the user's functions are of one state
            both = [
                self._slopes(*one) for one in zip(np.transpose(q), np.transpose(p), strict=True)
            ]
            return np.array([e[0] for e in both]).T, np.array([e[1] for e in both]).T
        given = self._scene.gradient(np.array(q, float), np.array(p, float))  # type: ignore[misc]
        return np.asarray(given[0], float).reshape(self.n), np.asarray(given[1], float).reshape(
            self.m
        )

    def f(self, q: Vector, p: Vector, t: Number | None = None) -> tuple[Vector, Vector]:
        of_q, of_p = self._slopes(q, p)
        if self._canonical:
            return self._given(of_p), self._given(-of_q)
        rates = np.einsum("ij...,j...->i...", self.tensor(q, p), np.concatenate([of_q, of_p]))
        return self._given(rates[: self.n]), self._given(rates[self.n :])

    def H(self, q: Vector, p: Vector, t: Number | None = None) -> Number:
        if several(q, p):
            each = zip(np.transpose(q), np.transpose(p), strict=True)
            return np.array([self.H(*one) for one in each])
        value = self._scene.numeric_hamiltonian(np.array(q, float), np.array(p, float))  # type: ignore[misc]
        return self._given(np.float64(np.asarray(value, float).reshape(())))

    def gradient(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(self._slopes(q, p)[0])

    def velocity(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(self._slopes(q, p)[1])

    def force(self, q: Vector, p: Vector, t: Number | None = None) -> Vector:
        return self._given(np.zeros(np.shape(p)))

    def velocities(self, x: Matrix, mu: Matrix) -> Matrix:
        return np.array([self.velocity(*row) for row in zip(x, mu, strict=True)])

    def momentum(self, q: Vector, v: Vector, t: Number | None = None) -> Vector:
        raise BadInput(
            f"{self.name} is a Hamiltonian in numbers, so the momentum of a velocity is not known: "
            'take state="qp".'
        )


def check_gradient(scene: Scene) -> None:
    """Raise `BadInput` for functions of other shapes, and for a gradient that is not that of H."""
    n, m = scene.groupoid.dim_x, scene.groupoid.dim_u
    z = np.array([float(e) for e in (*scene.x0, *(scene.mu0 or ()))])
    value, slopes = _asked(scene.numeric_hamiltonian, z, n), _asked(scene.gradient, z, n)
    if np.size(value) != 1 or not np.isfinite(np.asarray(value, dtype=float)).all():
        raise BadInput(
            f"{scene.name}: numeric_hamiltonian= gives {shown(value)}, but must give a number."
        )
    sizes = [np.size(e) for e in slopes] if isinstance(slopes, tuple | list) else []
    if sizes != [n, m]:
        raise BadInput(
            f"{scene.name}: gradient= gives {_shape(slopes)}, but must give the pair "
            f"(∂H/∂q, ∂H/∂p) of {n} and {m} numbers."
        )
    given = np.concatenate([np.ravel(np.asarray(e, dtype=float)) for e in slopes])

    def energy(at: Vector) -> Vector:
        return np.asarray(_asked(scene.numeric_hamiltonian, at, n), dtype=float).reshape(1)

    scale = np.maximum(np.abs(z), 0.1 * max(1e-3, np.abs(z).max())) / 16
    of = derivative(lambda y: energy(z + y), 1, scale, noise_of(energy, z, scale, 2.0**-53))
    gap = np.abs(of.value[0] - given) - of.error[0]
    worst = int(gap.argmax())
    if gap[worst] > NEAR * max(np.abs(given).max(), np.abs(of.value).max()):
        name = f"q[{worst}]" if worst < n else f"p[{worst - n}]"
        raise BadInput(
            f"{scene.name}: gradient= is not that of numeric_hamiltonian=: by {name} it gives "
            f"{given[worst]:.6g} at the start, and differences of H give {of.value[0, worst]:.6g}."
        )


def _asked(function: Any, z: Vector, n: int) -> Any:
    try:
        return function(z[:n].copy(), z[n:].copy())
    except Exception as error:
        raise BadInput(
            f"a function of the scene in numbers raises {type(error).__name__} at its start: "
            f"{' '.join(str(error).split())[:160]}"
        ) from error


def _shape(given: ArrayLike) -> str:
    if isinstance(given, tuple | list):
        return f"{len(given)} parts of {', '.join(str(np.size(e)) for e in given)} numbers"
    return f"an array of {np.size(given)} numbers"
