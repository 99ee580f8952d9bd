"""The phase space of a degenerate Lagrangian ϑ(x)·v − H(x): its two-form, inverted in closed form.

The Euler–Lagrange equations A ẋ = ∂H, A_ij = ∂_i ϑ_j − ∂_j ϑ_i, are of first order, so ẋ = B ∂H
with the Poisson tensor B = A⁻¹, {xⁱ, xʲ} = Bⁱʲ. In (x, μ) the bracket is Dirac's, of the
constraint μ = ϑ(x).
"""

from __future__ import annotations

from functools import lru_cache

from ..errors import BadInput
from ..numbers import jacobian, sympy
from ..numbers.types import Expression, SymbolicMatrix
from .symbols import SceneSymbols

#: coordinates that the two-form couples, whose inverse is written out: the Pfaffian has 1·3·5·7
#: terms
MOST_TIED = 8


def two_form(s: SceneSymbols) -> SymbolicMatrix:
    """Return A = ϑ′ᵀ − ϑ′ at x, n×n, with ϑ′_ij = ∂_j ϑ_i."""
    slope = jacobian(s.one_form, s.x)
    return slope.T - slope


@lru_cache(maxsize=256)
def inverse_two_form(s: SceneSymbols) -> SymbolicMatrix:
    """Return B = A⁻¹ at x, n×n; raises `BadInput` if A is singular everywhere, or large."""
    A, B = two_form(s), sympy.zeros(len(s.x))
    for block in A.connected_components():
        if len(block) > MOST_TIED:
            raise BadInput(
                f"{s.name}: dϑ ties {len(block)} coordinates together, and its inverse is written "
                f"out for up to {MOST_TIED}: take coordinates in which it has smaller blocks."
            )
        tied = A.extract(block, block)
        whole = pfaffian(tied)
        if len(block) % 2 or whole == 0 or whole.simplify() == 0:
            names = ", ".join(f"x[{i}]" for i in block)
            raise BadInput(
                f"{s.name}: dϑ is singular everywhere, in {names}, so no motion follows from "
                "dϑ(·, ẋ) = dH: give a one-form whose dϑ is regular."
            )
        for i in range(len(block)):
            for j in range(i):
                rest = [k for k in range(len(block)) if k not in (i, j)]
                entry = (-1) ** (i + j) * pfaffian(tied.extract(rest, rest)) / whole
                B[block[i], block[j]], B[block[j], block[i]] = -entry, entry
    return B


def pfaffian(A: SymbolicMatrix) -> Expression:
    """Return the Pfaffian of an antisymmetric matrix, with square det A; 1 if empty."""
    if not A.rows:
        return sympy.S.One
    total = sympy.S.Zero
    for j in range(1, A.rows):
        if A[0, j] != 0:
            rest = [k for k in range(1, A.rows) if k != j]
            total += (-1) ** (j + 1) * A[0, j] * pfaffian(A.extract(rest, rest))
    return total


def orientation(s: SceneSymbols) -> Expression:
    """Return the Pfaffian of A at x: where it changes its sign dϑ is singular."""
    A = two_form(s)
    found = [pfaffian(A.extract(block, block)) for block in A.connected_components()]
    return sympy.Mul(*found)


def dirac_tensor(s: SceneSymbols) -> SymbolicMatrix:
    """Return the bracket of (x, μ) at μ = ϑ(x), 2n×2n: B, and along the constraint ϑ′B, ϑ′Bϑ′ᵀ."""
    along = sympy.eye(len(s.x)).col_join(jacobian(s.one_form, s.x))
    return along * inverse_two_form(s) * along.T
