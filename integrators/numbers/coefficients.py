"""What depends on the step and the parameters alone: computed once per flow, by letters."""

from __future__ import annotations

from functools import lru_cache

from .arithmetic import refused
from .lazy import sympy
from .types import Expression, Letter, Letters, Replacement


class Coefficients:
    """Subexpressions of the step and the parameters alone, each computed once per flow as c[i].

    Sums are not multiplied out: c·(a − c′b) keeps its map volume-preserving in rounded numbers,
    where c·a − (cc′)·b would let energy drift linearly (harmonic midpoint: 3e-19 a step).
    """

    def __init__(self, q: Letters) -> None:
        self.q = set(q)
        self.values: list[Expression] = []
        self._index: Replacement = {}
        self._done: Replacement = {}
        self._of_q: dict[Expression, bool] = {}

    def symbol(self, expression: Expression) -> Letter:
        """The symbol that stands for a coefficient; −e is minus the symbol of e.

        Raises `BadInput` for complex ones.
        """
        if expression.could_extract_minus_sign():
            return -self.symbol(-expression)
        if expression not in self._index:
            if expression.has(sympy.I):
                raise refused(sympy.I)
            self._index[expression] = sympy.Symbol(f"c{len(self.values)}", real=True)
            self.values.append(expression)
        return self._index[expression]

    def _constant(self, e: Expression) -> bool:
        """Whether an expression has symbols of q only."""
        if e not in self._of_q:
            self._of_q[e] = all(map(self._constant, e.args)) and (not e.is_Symbol or e in self.q)
        return self._of_q[e]

    def hoist(self, e: Expression) -> Expression:
        """`e` with every largest subexpression in q alone replaced by its coefficient."""
        if e not in self._done:
            self._done[e] = self._hoist(e)
        return self._done[e]

    def _hoist(self, e: Expression) -> Expression:
        if e.is_Integer:
            return e
        if self._constant(e):
            return self.symbol(e)
        if e.is_Atom:
            return e
        if isinstance(e, (sympy.Add, sympy.Mul)):
            constant = [a for a in e.args if self._constant(a)]
            rest = [self.hoist(a) for a in e.args if not self._constant(a)]
            if isinstance(e, sympy.Mul):
                contents, rest = map(list, zip(*map(_primitive, rest), strict=True))
                constant = [c for c in (*constant, *contents) if c != 1]
            if not constant:
                return e.func(*rest) if rest != list(e.args) else e
            part = e.func(*constant)
            return e.func(part if part.is_Integer else self.symbol(part), *rest)
        if isinstance(e, sympy.Pow) and isinstance(2 * e.exp, sympy.Integer):
            return sympy.Pow(self.hoist(e.base), e.exp)
        if not all(isinstance(a, sympy.Expr) for a in e.args):  # a condition, say
            raise refused(e)
        return e.func(*[self.hoist(a) for a in e.args])


@lru_cache(maxsize=4096)  # few sums are factors of many terms
def _primitive(factor: Expression) -> tuple[Expression, Expression]:
    """(c, f) with factor = c·f: 3a − 3b and b − a become the a − b that is computed anyway."""
    base, exponent = factor.as_base_exp()
    if not base.is_Add or not exponent.is_Integer:
        return 1, factor
    content, primitive = base.primitive()
    if not content.is_Integer:
        return 1, factor
    if primitive.could_extract_minus_sign():
        content, primitive = -content, -primitive
    return content**exponent, primitive**exponent


class Parameters(Coefficients):
    """The step and the parameters themselves as c[i], for kernels that compute all else anew."""

    def __init__(self, q: Letters) -> None:
        super().__init__(())
        self.values = list(q)
        self._names = {p: sympy.Symbol(f"c{i}", real=True) for i, p in enumerate(q)}

    def hoist(self, e: Expression) -> Expression:
        """`e` with each parameter replaced by its name in the kernel."""
        return e.xreplace(self._names)
