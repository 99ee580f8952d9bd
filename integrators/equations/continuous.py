"""The continuous system on the dual algebroid: momentum, velocity, energy, vector field.

ẋ = ρ̂(x) ξ,   μ̇_γ = ρ̂^i_γ ∂l/∂x^i − Ĉ^ν_{γμ} ξ^μ μ_ν,   μ = ∂l/∂ξ
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..errors import BadInput, CannotMeasure
from ..numbers import Arithmetic, jacobian, numeric
from ..numbers.types import Column, Expression, Number, SymbolicMatrix
from ..scene import Scene
from .symbols import SceneSymbols, column


def momentum(s: SceneSymbols) -> Column:
    """∂l/∂ξ at (x, u), m×1."""
    return jacobian([s.lagrangian], s.u).T


def mass_matrix(s: SceneSymbols) -> SymbolicMatrix:
    """∂²l/∂ξ² at (x, u), m×m."""
    return jacobian(momentum(s), s.u)


def velocity(s: SceneSymbols) -> Column:
    """ξ(x, μ), m×1, for a Lagrangian that is quadratic in the velocity.

    Raises `CannotMeasure` if it is not, `BadInput` if its mass matrix is singular.
    """
    mu = momentum(s)
    mass = mass_matrix(s).applyfunc(lambda e: e.simplify())
    if mass.free_symbols & set(s.u):
        raise CannotMeasure(
            f"{s.name}: the Lagrangian is not quadratic in the velocity, so no closed form "
            "of ξ(x, μ) exists; this study cannot be run on it."
        )
    if mass.det().simplify() == 0:
        raise BadInput(
            f"{s.name}: the mass matrix ∂²l/∂ξ² is singular: {mass.tolist()}; every velocity "
            "needs its kinetic energy."
        )
    return mass.LUsolve(s.mu - mu.xreplace(dict.fromkeys(s.u, 0)))


def energy(s: SceneSymbols) -> Expression:
    """H = μ·ξ − l at (x, ξ, μ), ξ in the letters `s.u`: stationary in ξ where μ = ∂l/∂ξ."""
    return s.mu.dot(s.u) - s.lagrangian


def vector_field(s: SceneSymbols) -> Column:
    """(ẋ, μ̇) at (x, μ), (n+m)×1."""
    groupoid = s.groupoid
    xi = velocity(s)
    at = dict(zip(s.u, xi, strict=True))
    rho = groupoid.rho(s.x, s.h) / s.h
    force = column(s.lagrangian.diff(w).xreplace(at) for w in s.x)
    mu_dot = rho.T * force
    for nu, c in enumerate(groupoid.structure_functions(s.x, s.h)):
        mu_dot -= (c / s.h) * xi * s.mu[nu]
    return (rho * xi).col_join(mu_dot)


def state_function(s: SceneSymbols, parts: list[Any], numbers: Arithmetic) -> Callable[..., Any]:
    """f(x, mu, parameters) → the parts, given in (x, μ) and the parameters (`numeric`)."""
    return numeric({"x": s.x, "mu": s.mu, "p": s.parameter_list}, parts, numbers)


def initial_momentum(s: SceneSymbols, scene: Scene, numbers: Arithmetic) -> list[Number]:
    """μ₀ = ∂l/∂ξ(x₀, v₀), in an arithmetic.

    Raises `CannotMeasure` where the scene has only a discrete Lagrangian.
    """
    if scene.lagrangian is None:
        raise CannotMeasure(
            f"{scene.name} has only a discrete Lagrangian, so its start needs the momentum: "
            "trajectory(..., mu0=...)."
        )
    f = _momentum_function(s, numbers)
    with numbers.working():
        x = [numbers.number(v) for v in scene.x0]
        v = [numbers.number(v) for v in scene.v0]
        return list(f(x, v, [numbers.number(p) for p in scene.parameter_values]))


@lru_cache(maxsize=512)
def _momentum_function(s: SceneSymbols, numbers: Arithmetic) -> Callable[..., list[Number]]:
    """∂l/∂ξ as f(x, v, parameters), the velocity in the place of the momentum."""
    swap = dict(zip(s.u, s.mu, strict=True))
    return state_function(s, [[e.xreplace(swap) for e in momentum(s)]], numbers)
