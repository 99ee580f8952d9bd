"""A rule with stages on quadrature nodes as a collocation method: plain data for the compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..numbers.types import Assignment, Column, Expression, Expressions, Letters, SymbolicMatrix


@dataclass(frozen=True, eq=False)
class StageSystem:
    """The vector field in canonical coordinates (w, π) of the chart at x, and the ends of a step.

    Derived in `equations.stage_equations`, which explains the letters. q: h first, then the
    parameters; x, w, p, xi, m: letters of the base point, of w, π, ξ and of μ = Lᵀπ; dp, turn:
    letters of the sums Σ h b_i π̇_i and Σ h b_i f_i. nodes: called with a number of digits it
    returns its `count` pairs (node, weight) in order, on [0, 1].

    before: definitions that ξ needs; after: definitions that need ξ; mass, right: the equations
    mass·ξ = right; rates: (ẇ, π̇); turned: f in these letters. moved: L(x, w) ξ and pulled: L(x,
    w)⁻ᵀ m; both are None if L = 1. right_field: R(x, w); gain: μ′ − μ and increment: x′ − x, from
    w, p, dp, turn at the end of a step. extents: see `Step`.
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
    before: tuple[Assignment, ...]
    mass: SymbolicMatrix
    right: Column
    after: tuple[Assignment, ...]
    rates: tuple[Column, Column]
    turned: Column
    moved: Column | None
    pulled: Column | None
    right_field: SymbolicMatrix
    gain: Column
    increment: Column
    extents: tuple[tuple[str, Expression], ...] = ()

    @property
    def count(self) -> int:
        """The number of stages."""
        return int(self.nodes.count)

    @property
    def target(self) -> Expressions:
        """The point b(x, w; 1)."""
        (_, values), *_ = self.before
        return values


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
    force: Column
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
