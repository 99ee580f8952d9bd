"""The vector field on the dual algebroid with its derivative, as expressions in (x, ξ, μ)."""

from __future__ import annotations

from typing import Any

from ..numbers import jacobian, sympy
from .continuous import momentum, rates
from .symbols import SceneSymbols


def field_parts(s: SceneSymbols) -> list[Any]:
    """At (x, ξ, μ), ξ in the letters `s.u`: f = (ẋ, μ̇), its derivatives by z = (x, μ) and by ξ,
    and ∂ξ/∂z·M = (−∂²l/∂ξ∂x, 1), M the mass matrix: columns of sympy."""
    f, states = rates(s), [*s.x, *s.mu]
    moving = (-jacobian(momentum(s), s.x)).row_join(sympy.eye(len(s.mu)))
    return [list(f), jacobian(f, states), jacobian(f, s.u), moving]
