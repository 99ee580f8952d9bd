"""A scene whose Hamiltonian is a function of numbers, in the form that a black box gets."""

from __future__ import annotations

import numpy as np

from ...equations import SceneSymbols
from ...errors import BadInput
from ...numbers import Arithmetic, Matrix, Number, Vector
from ...scene import Scene
from .scene_in_numbers import SceneInNumbers, several


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
        slopes = self._scene.gradient(np.array(q, float), np.array(p, float))  # type: ignore[misc]
        return np.asarray(slopes[0], float).reshape(self.n), np.asarray(slopes[1], float).reshape(
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
