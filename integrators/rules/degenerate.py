"""Methods for Lagrangians ϑ(x)·v − H(x), linear in the velocity: maps of phase space, x ↦ x′.

A variational rule takes such a Lagrangian too, but its discrete Euler–Lagrange equations have two
steps where the motion has one: μ leaves ϑ(x), and parasitic modes alternate. The maps here begin
and end at μ = ϑ(x).

Degenerate variational integrators (`degenerate_euler`, `degenerate_gauss`) discretise L so that it
stays degenerate. They need half of the components of ϑ to vanish: with x = (q, y) and
ϑ = (ϑ_q(q, y), 0) the momentum p = ϑ_q is canonical to q, and y is an internal stage.

Projected variational Runge–Kutta methods (`projected_gauss`) take any ϑ: the step of the rule on
T*Q is put back to φ = μ − ϑ(x) = 0 along the Hamiltonian fields of φ, (λ, ϑ′ᵀλ).
"""

from __future__ import annotations

from ..errors import BadInput, shown
from ..numbers.types import Column, Expression, Letter
from .galerkin import by_nodes, collocation_weight, node_value
from .one_step import DualSystem, OneStepMap, Staged, one_step

_ELLISON = "Ellison, Finn, Burby, Kraus, Qin, Tang, Phys. Plasmas 25 (2018), 052502"
_KRAUS = "Kraus, Projected Variational Integrators for Degenerate Lagrangian Systems, "
_KRAUS += "arXiv:1708.07356 (2017)"


def _slope(s: DualSystem, at: Column, v: Column) -> Column:
    """∂L/∂x = ϑ′ᵀv − ∂H at (x, v)."""
    return s.dtheta(at).T * v - s.dH(at)


@one_step(
    order=1, stages=2, name="degenerate-euler", one_form="half", symplectic=True, source=_ELLISON
)
def degenerate_euler(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
    """L_d = ϑ(q′, y)·(q′ − q) − h H(q′, y), in position-momentum form from p = ϑ(q, y).

    The published (q′, y) is the internal stage; the state has the y′ with ϑ(q′, y′) = p′, so that
    dϑ itself is kept, and no form that depends on h.
    """
    (q, y), (end, stage) = s.halves, K
    new, at = z + h * end, z + h * stage
    slope = _slope(s, at, stage)
    momentum, half, ended = s.theta(z), s.theta(at), s.theta(new)
    rows = 0 * z
    moved = 0 * z
    for i, j in zip(q, y, strict=True):
        rows[i], rows[j] = (half[i] - momentum[i]) / h, slope[j]
        moved[i], moved[j] = end[i] - stage[i], (ended[i] - momentum[i]) / h - slope[i]
    return new, [moved, rows]


@by_nodes("degenerate-gauss")
def degenerate_gauss(nodes: int) -> OneStepMap:
    """Gauss collocation of (q, p), p = ϑ_q(q, y), of order 2·nodes; one node is the midpoint rule.

    The y at the nodes are internal stages, at which ∂L/∂y = 0. It keeps dϑ. Raises `BadInput` for
    other than 1 to 20 nodes.
    """

    @one_step(
        order=2 * nodes, stages=nodes + 1, name=f"degenerate-gauss-{nodes}", one_form="half",
        symplectic=True, reversible=True, source=f"{_ELLISON}; with one node: {_KRAUS}",
    )  # fmt: skip
    def method(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
        (q, y), (*stages, end) = s.halves, K
        at, new = _nodes(s, nodes, z, h, stages), z + h * end
        slopes = [_slope(s, point, v) for point, v in zip(at, stages, strict=True)]
        momentum, ended, b = s.theta(z), s.theta(new), _weights(s, nodes)
        rows = []
        for i, point in enumerate(at):
            row, theta = slopes[i].copy(), s.theta(point)
            for k in q:
                along = sum(collocation_weight(s, nodes, i, j) * slopes[j][k] for j in range(nodes))
                row[k] = (theta[k] - momentum[k]) / h - along
            rows.append(row)
        last = end - sum((b[j] * stages[j] for j in range(nodes)), 0 * z)
        for k, free in zip(q, y, strict=True):
            last[free] = (ended[k] - momentum[k]) / h
            last[free] -= sum(b[j] * slopes[j][k] for j in range(nodes))
        return new, [*rows, last]

    return method


def projected_gauss(nodes: int, projection: str = "symmetric") -> OneStepMap:
    """The variational Runge–Kutta method on Gauss nodes, of order 2·nodes, projected to μ = ϑ(x).

    projection: "symmetric", by the same λ before and after the step, or "midpoint", by ϑ′ at the
    mean of both ends; both are reversible; "standard", after the step alone. Raises `BadInput` for
    other words, and for other than 1 to 20 nodes.
    """
    if projection not in ("symmetric", "midpoint", "standard"):
        raise BadInput(
            f'projected_gauss: projection={shown(projection)}; say "symmetric", "midpoint" or '
            '"standard".'
        )
    return _projected_gauss(nodes, projection)


@by_nodes("projected-gauss")
def _projected_gauss(nodes: int, projection: str) -> OneStepMap:
    both = projection != "standard"
    name = f"projected-gauss-{nodes}" + ("" if projection == "symmetric" else f"-{projection}")

    @one_step(
        order=2 * nodes, stages=nodes + 2, name=name, one_form="any", reversible=both,
        source=f"{_KRAUS}: the {projection} projection",
    )  # fmt: skip
    def method(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
        *stages, multiplier, end = K
        lam, new = multiplier - s.f(z), z + h * end  # Newton begins at λ = 0
        ends = (z, new) if projection != "midpoint" else ((z + new) / 2,) * 2
        # μ − ϑ(x) at the start over h, and what the end adds: R(∞) = (−1)^nodes
        before = s.dtheta(ends[0]).T * lam if both else 0 * z
        after = s.dtheta(ends[1]).T * lam * (-1) ** nodes if both else s.dtheta(new).T * lam
        shift = lam if both else 0 * z
        at = _nodes(s, nodes, z + h * shift, h, stages)
        slopes = [_slope(s, point, v) for point, v in zip(at, stages, strict=True)]
        momentum, b = s.theta(z), _weights(s, nodes)
        rows = []
        for i, point in enumerate(at):
            row = (s.theta(point) - momentum) / h - before
            for j in range(nodes):
                row -= collocation_weight(s, nodes, i, j) * slopes[j]
            rows.append(row)
        moved = end - shift - (lam * (-1) ** nodes if both else lam)
        kept = (s.theta(new) - momentum) / h - before - after
        for j in range(nodes):
            moved -= b[j] * stages[j]
            kept -= b[j] * slopes[j]
        return new, [*rows, kept, moved]

    method.formula.__doc__ = projected_gauss.__doc__
    return method


def _weights(s: DualSystem, nodes: int) -> list[Expression]:
    return [node_value(s, "gauss", nodes, j, "b") for j in range(nodes)]


def _nodes(s: DualSystem, nodes: int, z: Column, h: Letter, slopes: list[Column]) -> list[Column]:
    """The states at the nodes of the collocation with these slopes."""

    def moved(i: int) -> Column:
        return sum((collocation_weight(s, nodes, i, j) * slopes[j] for j in range(nodes)), 0 * z)

    return [z + h * moved(i) for i in range(nodes)]
