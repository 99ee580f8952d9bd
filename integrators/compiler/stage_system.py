"""A rule with stages on quadrature nodes as a collocation method: plain data for the compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..numbers import Graph, Node, NodeMatrix, Nodes
from ..numbers.types import Letters


@dataclass(frozen=True, eq=False)
class StageSystem:
    """The vector field in canonical coordinates (w, π) of the chart at x, and the ends of a step.

    Derived in `equations.stage_equations`, which explains the letters. q: h first, then the
    parameters; x, w, p, xi, m: letters of the base point, of w, π, ξ and μ; dp, turn: letters of
    the sums Σ h b_i π̇_i and Σ h b_i f_i. nodes: called with a number of digits it returns its
    `count` pairs (node, weight) in order, on [0, 1].

    All else is nodes of one graph: target: the point b(x, w; 1); momentum: Lᵀπ; mass, right: the
    equations mass·ξ = right; rates: (ẇ, π̇) and turned: f, with ξ as letters. moved: L(x, w) ξ and
    pulled: L(x, w)⁻ᵀ μ, in letters of ξ and μ; both are None if L = 1. right_field: R(x, w); gain:
    μ′ − μ less Σ h b_i f_i, from w, p at the end of a step; increment: x′ − x. extents: see `Step`.
    """

    name: str
    nodes: Any
    q: Letters
    x: Letters
    w: Letters
    p: Letters
    xi: Letters
    m: Letters
    dp: Letters
    turn: Letters
    target: Nodes
    momentum: Nodes
    mass: NodeMatrix
    right: Nodes
    rates: tuple[Nodes, Nodes]
    turned: Nodes
    moved: Nodes | None
    pulled: Nodes | None
    right_field: NodeMatrix
    gain: Nodes
    increment: Nodes
    extents: tuple[tuple[str, Node], ...] = ()

    @property
    def count(self) -> int:
        """The number of stages."""
        return int(self.nodes.count)

    @property
    def graph(self) -> Graph:
        """The graph of all nodes."""
        return self.momentum[0].graph


@dataclass(frozen=True, eq=False)
class StageSource:
    """A stage system that is derived only if the cache does not hold its kernels.

    given: the expressions from which it is derived; they are its key in the cache.
    """

    name: str
    nodes: Any
    given: tuple[object, ...]
    derived: Callable[[], StageSystem]


@dataclass(frozen=True, eq=False)
class LatticeStages:
    """One collocation step of a lattice, whose bonds act as forces on its sites at the nodes.

    q: h, then parameters that all sites share. source: the collocation of one site, with its own
    letters `own` and the force `pull` on it. force: ρ̂ᵀ∂L/∂x of a bond, at both its ends x, with
    its letters `bond_own`. most: number of sweeps of the first step beyond which another way is
    faster, or None if it is unknown.
    """

    source: StageSource
    q: Letters
    own: Letters
    pull: Letters
    x: Letters
    bond_own: Letters
    force: Nodes
    most: int | None = None

    @property
    def site(self) -> StageSystem:
        """The collocation of one site, with the lattice's parameters, and without an edge."""
        return replace(self.source.derived(), q=self.q, extents=())

    @property
    def key(self) -> tuple[object, ...]:
        """Everything from which the text is made."""
        source = self.source
        return (source.nodes, source.given, self.q, self.own, self.pull, self.x, self.bond_own,
                self.force, self.most)  # fmt: skip
