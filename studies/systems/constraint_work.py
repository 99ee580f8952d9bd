"""The power of constraints: of those that move, and of those that push along other rows.

λ follows from the state: A ξ′ + d(A ξ − a)/dx·ẋ = 0 with M ξ′ = μ̇ − ∂p/∂x·ẋ + Bᵀλ, where ẋ and μ̇
are the rates without constraints. The power is λᵀB ξ, which is λᵀa where B = A.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from discmech.integrators.equations import (
    SceneSymbols,
    constraint_matrix,
    constraint_shift,
    mass_matrix,
    momentum,
    rates,
    reaction_matrix,
)
from discmech.integrators.numbers import Arithmetic, jacobian, numeric
from discmech.integrators.numbers.types import Number, Numbers, Vector


def constraints_work(s: SceneSymbols) -> bool:
    """True if the constraints may change the energy: if a ≠ 0 or B ≠ A."""
    if not s.constraints:
        return False
    moving = not constraint_shift(s, s.x).is_zero_matrix
    return moving or reaction_matrix(s, s.x) != constraint_matrix(s, s.x)


@lru_cache(maxsize=64)
def constraint_power(s: SceneSymbols, numbers: Arithmetic) -> Callable[..., Number]:
    """Return the power of the constraints as a function of (x, ξ, μ, parameters), one state."""
    A, B, along = constraint_matrix(s, s.x), reaction_matrix(s, s.x), rates(s)
    x_dot, mu_dot = along[: len(s.x), :], along[len(s.x) :, :]
    free = mu_dot - jacobian(momentum(s), s.x) * x_dot
    turning = jacobian(A * s.u - constraint_shift(s, s.x), s.x) * x_dot
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "h": s.h, "p": s.parameter_list}
    f = numeric(letters, [A, B, mass_matrix(s), list(free), list(turning)], numbers)

    def power(x: Vector, xi: Vector, mu: Vector, p: Numbers) -> Number:
        rows, reactions, mass, force, turned = f(x, xi, mu, 1, p)
        left = rows @ numbers.solve(mass, reactions.T)
        multipliers = numbers.solve(left, -rows @ numbers.solve(mass, force) - turned)
        return multipliers @ (reactions @ xi)

    return power
