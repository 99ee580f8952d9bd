"""Letters for rational functions and their derivatives, which stay small by the quotients."""

from __future__ import annotations

from ..numbers import jacobian, sympy
from ..numbers.types import Column, Expression, Letter, SymbolicMatrix
from .chain_rule import Block, ChainRule
from .symbols import column, vector


def quotients(
    chain: ChainRule, value: Column, columns: dict[str, Column]
) -> tuple[Column, dict[str, SymbolicMatrix]]:
    """(letters for a column N/D, its first derivatives by the columns as letters).

    Also the 1/D get letters, so that rational derivatives stay small. With q = N/D and
    S_a = ∂_a q = (∂_a N − q ∂_a D)/D the derivatives of S_a are
    ∂_b S_a = (∂_ab N − S_b ∂_a D − S_a ∂_b D − q ∂_ab D)/D.
    """
    z = vector("vv0", len(value))
    used = {k: c for k, c in columns.items() if set(c) & value.free_symbols}
    parts = [_fraction(e) for e in value]
    if not any(bottom.free_symbols for _, bottom in parts):
        first = {k: jacobian(value, c) for k, c in used.items()}
        chain.add(Block(z, value, [(used[k], first[k]) for k in used]))
        return z, first
    N, D = (sympy.Matrix(part) for part in zip(*parts, strict=True))
    over: dict[Expression, Letter] = {}
    for bottom in D:
        if bottom not in over:
            o = vector(f"o{len(over)}", 1)
            slopes = [(c, -(o[0] ** 2) * jacobian([bottom], c)) for c in used.values()]
            over[bottom] = chain.add(Block(o, sympy.Matrix([1 / bottom]), slopes))[0]
    o = [over[e] for e in D]
    rows = range(len(z))
    first = {
        k: vector(f"v{'abc'[i]}0", len(z) * len(c)).reshape(len(z), len(c))
        for i, (k, c) in enumerate(used.items())
    }
    of_value = column(n * e for n, e in zip(N, o, strict=True))
    chain.add(Block(z, of_value, [(used[k], first[k]) for k in used]))
    d = {k: jacobian(D, c) for k, c in used.items()}
    for a, by in used.items():
        n_a, inner = jacobian(N, by), [(k, i) for k in rows for i in range(len(by))]
        values = [(n_a[k, i] - z[k] * d[a][k, i]) * o[k] for k, i in inner]
        slopes = []
        for b, other in used.items():
            n_ab, d_ab = jacobian(list(n_a), other), jacobian(list(d[a]), other)
            slopes.append((other, sympy.Matrix(len(inner), len(other), [
                (n_ab[row, j] - first[b][k, j] * d[a][k, i]
                 - first[a][k, i] * d[b][k, j] - z[k] * d_ab[row, j]) * o[k]
                for row, (k, i) in enumerate(inner) for j in range(len(other))
            ])))  # fmt: skip
        letters = first[a].reshape(len(inner), 1)
        chain.add(Block(letters, sympy.Matrix(values), slopes))
    return z, first


def _fraction(e: Expression) -> tuple[Expression, Expression]:
    """(N, D) with e = N/D, where D holds the sums that e divides by, but within a power of a sum.

    Sympy's `together` takes out common factors too, for which it needs a hundred times as long.
    """
    above, below = _over_powers(e)
    return above, sympy.Mul(*(b**n for b, n in below.items()))


def _over_powers(e: Expression) -> tuple[Expression, dict[Expression, Expression]]:
    """(N, {sum: its power below}) of e."""
    if e.is_Pow and e.exp.is_Integer and e.exp.is_negative and not e.base.is_Number:
        return sympy.Integer(1), {e.base: -e.exp}
    if not e.is_Add and not e.is_Mul:
        return e, {}
    parts = [_over_powers(a) for a in e.args]
    powers = dict[Expression, Expression]()
    for _, below in parts:
        for b, n in below.items():
            powers[b] = powers.get(b, 0) + n if e.is_Mul else max(powers.get(b, 0), n)
    if e.is_Mul:
        return sympy.Mul(*(above for above, _ in parts)), powers
    terms = (
        above * sympy.Mul(*(b ** (n - below.get(b, 0)) for b, n in powers.items()))
        for above, below in parts
    )
    return sympy.Add(*terms), powers
