"""The vector field on the dual algebroid with its derivative, in numbers."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..numbers import jacobian, newton, numeric, sympy
from .continuous import mass_matrix, momentum, rates
from .symbols import SceneSymbols


def field_parts(s: SceneSymbols) -> list[Any]:
    """At (x, ξ, μ), ξ in the letters `s.u`: f = (ẋ, μ̇), its derivatives by z = (x, μ) and by ξ,
    and ∂ξ/∂z·M = (−∂²l/∂ξ∂x, 1), M the mass matrix: columns of sympy."""
    f, states = rates(s), [*s.x, *s.mu]
    moving = (-jacobian(momentum(s), s.x)).row_join(sympy.eye(len(s.mu)))
    return [list(f), jacobian(f, states), jacobian(f, s.u), moving]


@lru_cache(maxsize=256)
def hamilton_field(s: SceneSymbols, numbers: Any) -> HamiltonField:
    """The field of a scene's equations in an arithmetic."""
    return HamiltonField(s, numbers)


class HamiltonField:
    """Called with x (n,), μ (m,), the parameters and a ξ nearby it gives f (n+m,) and ∂f/∂z.

    They are no numbers where μ = ∂l/∂ξ(x, ξ) has no solution.
    """

    def __init__(self, s: SceneSymbols, numbers: Any) -> None:
        self.numbers = numbers
        letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
        self._legendre = numeric(letters, [list(momentum(s)), mass_matrix(s)], numbers)
        self._parts = numeric(letters, field_parts(s), numbers)

    def __call__(self, x: Any, mu: Any, p: Any, near: Any) -> tuple[Any, Any]:
        solve = self.numbers.solve

        def change(xi: Any) -> Any:
            value, mass = self._legendre(x, xi, mu, p)
            return solve(mass, mu - value)

        xi = newton(change, near, max(map(abs, near), default=0), self.numbers.eps)
        if xi is None:
            xi = near * np.inf * 0
        f, by_z, by_xi, moving = self._parts(x, xi, mu, p)
        return f, by_z + by_xi @ solve(self._legendre(x, xi, mu, p)[1], moving)
