"""The Lagrangian ϑ(x)·v − H(x) of a one-form and a Hamiltonian on phase space."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from types import CodeType, SimpleNamespace

from ..numbers import LazyModule
from ..numbers.types import Exact, Expression, Function, Letter, Parameters, Point, Scalar, Velocity
from .legendre import Scene, nested

sympy = LazyModule("sympy")


@dataclass(frozen=True)
class AffineLagrangian:
    """l(x, v, p) = ϑ(x)·v − H(x) of one_form(x, p), a list as long as x, and hamiltonian(x, p).

    Its equations are of first order: dϑ(·, ẋ) = dH.
    """

    one_form: Function
    hamiltonian: Function

    @property
    def __code__(self) -> CodeType | None:
        """The code of the Hamiltonian, whose line messages name."""
        return getattr(self.hamiltonian, "__code__", None)

    @property
    def formula(self) -> Function:
        """The function that it is made of, to pickle it."""
        return self.hamiltonian

    def __call__(self, x: Point, v: Velocity, p: Parameters) -> Expression:
        value, theta = self.hamiltonian(x, p), self.one_form(x, p)
        if getattr(value, "shape", None) == (1, 1):
            value = value[0, 0]
        return sum(a * b for a, b in zip(theta, v, strict=True)) - value

    def halved(self, scene: Scene) -> bool:
        """Return True if half of the components of ϑ vanish, or if ϑ cannot be evaluated."""

        def letter(_: Exact) -> Letter:
            return sympy.Dummy(real=True)

        x = nested((0,) * scene.groupoid.dim_x, letter)
        p = SimpleNamespace(**{k: nested(e, letter) for k, e in scene.parameters.items()})
        try:
            return len(halves(self.one_form(x, p))[1]) == len(x) // 2
        except Exception:
            return True


def halves(theta: Iterable[Scalar]) -> tuple[list[int], list[int]]:
    """Return the places of the components of a one-form that do not vanish, and of the others."""
    components = [sympy.sympify(e) for e in theta]
    vanishing = [i for i, e in enumerate(components) if e == 0 or e.equals(0)]
    return [i for i in range(len(components)) if i not in vanishing], vanishing
