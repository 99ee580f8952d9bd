"""The rules of one or two points: rectangle, midpoint, trapezoidal, implicit-explicit."""

from __future__ import annotations

from typing import Any

from ..numbers.types import Column, Expression, Letter
from .discretisation import discretisation


@discretisation(order=1, source="paper, section 3.7 (heavy top): L_d = h L(x, u)")
def rectangle(L: Any, G: Any, x: Column, u: Column, h: Letter) -> Expression:
    """The Lagrangian at the start of the step; symplectic Euler on the pair groupoid."""
    return h * L(x, u)


@discretisation(order=2, source="paper, section 3.6.1: the implicit midpoint rule")
def midpoint(L: Any, G: Any, x: Column, u: Column, h: Letter) -> Expression:
    """The Lagrangian at the middle of the step."""
    return h * L(G.target(x, u, h / 2), u)


@discretisation(order=2, source="paper, section 3.6.1: Störmer–Verlet")
def trapezoidal(L: Any, G: Any, x: Column, u: Column, h: Letter) -> Expression:
    """The mean of the Lagrangian at both ends of the step."""
    return h * (L(x, u) + L(G.target(x, u, h), u)) / 2


@discretisation(
    order=2,
    splits=True,
    source="Stern, Grinspun, Multiscale Model. Simul. 7 (2009), 3: implicit-explicit, variational; "
    "McLachlan, Stern, SIAM J. Numer. Anal. 52 (2014): a modified trigonometric integrator",
)
def imex(L: Any, G: Any, x: Column, u: Column, h: Letter) -> Expression:
    """The fast part of the potential at the middle of the step, all else by the trapezoidal rule.

    Linearly implicit where the fast part is quadratic: its step is never bound by the fast
    frequency alone.
    """
    y = G.target(x, u, h)
    slow = L(x, u) + L.fast(x) + L(y, u) + L.fast(y)
    return h * slow / 2 - h * L.fast(G.target(x, u, h / 2))
