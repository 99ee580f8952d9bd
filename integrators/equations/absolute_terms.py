"""Sums of the absolute values of an expression's terms: the scale of its round-off.

The terms are those that multiplying out would give, of which there may be millions; their absolute
values add up without it, since |a b| = |a| |b| and the terms of (a + b)^k add up to (|a| + |b|)^k.
"""

from __future__ import annotations

from ..numbers import jacobian, sympy
from ..numbers.types import Expression, Letter
from .symbols import SceneSymbols

#: degree → sum of the absolute values of the terms of that degree
Degrees = dict[int, Expression]


class _NoPolynomial(Exception):
    """A function, a root or a quotient of letters in which degrees are counted."""


def absolute_terms(e: Expression) -> Expression:
    """Return the sum of the absolute values of an expression's terms, products multiplied out."""
    if e.is_Add or e.is_Mul:
        return e.func(*map(absolute_terms, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return absolute_terms(e.base) ** e.exp
    return sympy.Abs(e, evaluate=bool(e.is_Atom))


def energy_terms(s: SceneSymbols) -> Expression:
    """Return the sum of the absolute values of the terms of H at (x, ξ), ξ in the letters `s.u`.

    A term t of l has the part ξ·∂t/∂ξ − t in H: (k − 1) t, if it is of degree k in ξ. For degree 1
    it is in μ·ξ and in l, and cancels except for its round-off: it counts unchanged. For a given
    Hamiltonian, the terms are its own.
    """
    if s.hamiltonian is not None:
        return absolute_terms(s.hamiltonian)
    return sympy.Add(*[_in_energy(t, s) for t in sympy.Add.make_args(s.lagrangian)])


def _in_energy(t: Expression, s: SceneSymbols) -> Expression:
    if not t.free_symbols & set(s.u):
        return absolute_terms(t)
    try:
        degrees = _degrees(t, frozenset(s.u))
    except _NoPolynomial:
        parts = sympy.Add.make_args(sympy.expand_mul(t))
        if len(parts) > 1:
            return sympy.Add(*[_in_energy(part, s) for part in parts])
        return sympy.Abs((jacobian([t], s.u) * s.u)[0] - t, evaluate=False)
    return sympy.Add(*[max(1, abs(k - 1)) * size for k, size in degrees.items()])


def _degrees(e: Expression, letters: frozenset[Letter]) -> Degrees:
    """Return {k: sum of the absolute terms of degree k in the letters}; raises `_NoPolynomial`."""
    if e in letters:
        return {1: sympy.Abs(e)}
    if e.is_Add:
        terms: dict[int, list[Expression]] = {}
        for part in e.args:
            for k, size in _degrees(part, letters).items():
                terms.setdefault(k, []).append(size)
        return {k: sympy.Add(*sizes) for k, sizes in terms.items()}
    if e.is_Mul:
        product: Degrees = {0: sympy.S.One}
        for part in e.args:
            product = _product(product, _degrees(part, letters))
        return product
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        base = _degrees(e.base, letters)
        if len(base) == 1:
            return {k * int(e.exp): size**e.exp for k, size in base.items()}
        power = base
        for _ in range(int(e.exp) - 1):
            power = _product(power, base)
        return power
    if letters & e.free_symbols:
        raise _NoPolynomial
    return {0: sympy.Abs(e, evaluate=bool(e.is_Atom))}


def _product(one: Degrees, other: Degrees) -> Degrees:
    terms: dict[int, list[Expression]] = {}
    for j, a in one.items():
        for k, b in other.items():
            terms.setdefault(j + k, []).append(a * b)
    return {k: sympy.Add(*sizes) for k, sizes in terms.items()}
