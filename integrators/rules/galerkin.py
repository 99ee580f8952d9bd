"""Galerkin variational integrators of any order, on any groupoid (Marsden, West 2001, 2.2.6).

The curve from 0 to u in the chart is a polynomial, w(θ) = θu + Σ_j s_j Q_j(θ), and L_d the
stationary value in s of h Σ_i b_i L(b(x, w(c_i)), ξ(c_i)) with ξ = L(x, w)⁻¹ dw/dθ. Its order is
the smaller of twice the degree and the order of the quadrature (Ober-Blöbaum, Saake 2015; on
groups in any chart, Hall, Leok 2015): the chart changes the coordinates of all curves of a step
alike. On pairs gauss is the symplectic Runge–Kutta method of its nodes (Hairer, Lubich, Wanner,
VI.6.2). lobatto has one velocity less than nodes: with a constant mass matrix it is the partitioned
method Lobatto IIIA–IIIB, with one that depends on x it is no Runge–Kutta method.

In the basis of Legendre polynomials s_j is of size h^j and a constant mass matrix is diagonal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, wraps
from typing import TypeVar

from ..errors import BadInput, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, Letter
from .discretisation import Discretisation, GroupoidForRule, LagrangianForRule
from .one_step import DualSystem
from .quadrature import Nodes, NodeValue

_Method = TypeVar("_Method", bound=Discretisation)

MOST_NODES = 20


def by_nodes(
    family: str, least: int = 1
) -> Callable[[Callable[..., _Method]], Callable[..., _Method]]:
    """Decorator of a function of the number of nodes and more, which makes a method.

    Each method is made once, with the docstring of its family. Raises `BadInput` unless the number
    is a whole one from `least` to `MOST_NODES`.
    """

    def decorate(make: Callable[..., _Method]) -> Callable[..., _Method]:
        made = cache(make)

        @wraps(make)
        def method(nodes: int, *more: str) -> _Method:
            if type(nodes) is not int or not least <= nodes <= MOST_NODES:
                raise BadInput(
                    f"{family} with {shown(nodes)} nodes: give a whole number from {least} to "
                    f"{MOST_NODES}."
                )
            rule = made(nodes, *more)
            rule.formula.__doc__ = rule.formula.__doc__ or make.__doc__
            return rule

        return method

    return decorate


@by_nodes("gauss")
def gauss(nodes: int) -> Discretisation:
    """Return the rule of Gauss quadrature with `nodes` nodes and a polynomial of that degree.

    Its order is 2·nodes. One node is the midpoint rule, with the velocity of the curve at the
    middle of the chart.
    """
    return _galerkin("gauss", nodes)


@by_nodes("lobatto", 2)
def lobatto(nodes: int) -> Discretisation:
    """Return the rule of Lobatto quadrature with a polynomial of degree nodes − 1.

    Its order is 2·nodes − 2. Two nodes are the trapezoidal rule, with the velocities of the curve
    at its ends.
    """
    return _galerkin("lobatto", nodes)


#: family name → (rule with so many nodes, least number of nodes)
FAMILIES: dict[str, tuple[Callable[[int], Discretisation], int]] = {
    "gauss": (gauss, 1),
    "lobatto": (lobatto, 2),
}


def _galerkin(family: str, nodes: int) -> Discretisation:
    degree = nodes if family == "gauss" else nodes - 1
    order = 2 * degree

    def formula(
        L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter,
        s: Sequence[Column] = (),
    ) -> Expression:  # fmt: skip
        total = 0
        for i in range(nodes):
            w, dw = node_value(G, family, nodes, i, "c") * u, u
            for j, s_j in enumerate(s, 1):
                w += node_value(G, family, nodes, i, "Q", j) * s_j
                dw += node_value(G, family, nodes, i, "P", j) * s_j
            weight = node_value(G, family, nodes, i, "b")
            total += h * weight * L(G.target(x, w, h), G.velocity(x, w, dw, h))
        return total

    return Discretisation(
        f"{family}-{nodes}",
        formula,
        order,
        "Marsden, West, Discrete mechanics and variational integrators, Acta Numerica 2001, 2.2.6; "
        "Hairer, Lubich, Wanner, Geometric Numerical Integration, VI.6.2",
        degree - 1,
        nodes=Nodes(family, nodes) if degree > 1 else None,
    )


def collocation_weight(G: GroupoidForRule | DualSystem, nodes: int, i: int, j: int) -> Expression:
    """a_ij = ∫₀^{c_i} of node j's polynomial, on Gauss nodes, in Legendre's basis."""

    def value(k: int, what: str, degree: int = 0) -> Expression:
        return node_value(G, "gauss", nodes, k, what, degree)

    higher = ((2 * d + 1) * value(j, "P", d) * value(i, "Q", d) for d in range(1, nodes))
    return value(j, "b") * (value(i, "c") + sum(higher))


def node_value(
    G: GroupoidForRule | DualSystem, family: str, nodes: int, i: int, what: str, degree: int = 0
) -> Expression:
    """Return a number at node i: exact at the ends and the middle, mirrored in the right half.

    `quadrature.NodeValue` explains `what`; G.constant gives letters for irrational numbers.
    """
    mirror = nodes - 1 - i
    middle, end = i == mirror, family == "lobatto" and i == 0
    if i > mirror:
        value = node_value(G, family, nodes, mirror, what, degree)
        return {"c": 1 - value, "b": value, "P": (-1) ** degree * value,
                "Q": -((-1) ** degree) * value}[what]  # fmt: skip
    if middle or end:
        at, P = sympy.Integer(0 if middle else -1), sympy.legendre
        if what == "c":
            return (1 + at) / 2
        if what == "P":
            return P(degree, at)
        if what == "Q":
            return (P(degree + 1, at) - P(degree - 1, at)) / (4 * degree + 2)
        n = nodes - 1 if family == "lobatto" else nodes
        return 1 / (n * nodes * P(nodes - 1, at) ** 2)
    if (family, nodes, what) == ("gauss", 2, "b"):
        return sympy.Rational(1, 2)
    return G.constant(NodeValue(family, nodes, i, what, degree))
