"""Values that depend on the step and the parameters alone: computed once per flow, by letters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy

from .arithmetic import refused
from .expression_graph import AsWritten
from .lazy import sympy
from .statements import function_text
from .types import Expression, Expressions, Letter, Letters, Replacement


class Coefficients(AsWritten):
    """Subexpressions of the step and the parameters alone, each computed once per flow as c[i].

    Sums are not multiplied out: c·(a − c′b) keeps its map volume-preserving in rounded numbers,
    where c·a − (cc′)·b would let energy drift linearly (harmonic midpoint: 3e-19 a step).
    """

    def __init__(self, q: Letters) -> None:
        self.q, self.h = set(q), next(iter(q), None)
        self.values: list[Expression] = []
        self._parameters = list(q)
        self._index: Replacement = {}
        self._of_q: dict[Expression, bool] = {}
        self._scaled: Replacement = {}

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the coefficients that have been asked for so far."""
        return (f"c{i}" for i in range(len(self.values)))

    def with_increments(self, scaled: Replacement) -> Coefficients:
        """Return these coefficients with each u of `scaled` read as ξ/h, where ξ is its value."""
        other = copy(self)
        other._scaled = scaled
        return other

    def symbol(self, expression: Expression) -> Letter:
        """Return the symbol of a coefficient; −e is minus the symbol of e.

        Raises `BadInput` for a complex coefficient.
        """
        if expression.could_extract_minus_sign():
            return -self.symbol(-expression)
        if expression not in self._index:
            if expression.has(sympy.I):
                raise refused(sympy.I)
            self._index[expression] = sympy.Symbol(f"c{len(self.values)}", real=True)
            self.values.append(expression)
        return self._index[expression]

    def constant(self, e: Expression) -> bool:
        """Return True if all symbols of an expression are of q."""
        if e not in self._of_q:
            self._of_q[e] = all(map(self.constant, e.args)) and (not e.is_Symbol or e in self.q)
        return self._of_q[e]

    def letter(self, e: Expression) -> Expression | None:
        """Return the symbol of a coefficient, or None for an integer or another expression."""
        return self.symbol(e) if not e.is_Integer and self.constant(e) else None

    def terms(self, e: Expression) -> Expressions:
        """Return the terms of a sum, with its coefficients added up."""
        constant = [a for a in e.args if self.constant(a)]
        return e.args if len(constant) < 2 else [
            sympy.Add(*constant), *(a for a in e.args if not self.constant(a))
        ]  # fmt: skip

    def factors(self, e: Expression) -> Expressions:
        """Return the factors of a product, with its coefficients multiplied.

        3a − 3b and b − a become the a − b that is computed anyway.
        """
        constant, rest = list[Expression](), list[Expression]()
        for factor in e.args if e.is_Mul else [e]:
            if self.constant(factor):
                constant.append(factor)
                continue
            base, power = factor.as_base_exp()
            if base in self._scaled and power.is_Integer:
                constant.append(self.h**-power)
                factor = self._scaled[base] ** power
            elif base.is_Add and power.is_Integer and (content := _content(base)) != 1:
                constant.append(content**power)
                factor = (base / content) ** power
            rest.append(factor)
        if not e.is_Mul and not constant:
            return ()
        part = sympy.Mul(*constant)
        return rest if part == 1 else [part, *rest]

    def text(self, name: str) -> str:
        """Return the text of the function of step and parameters that computes the coefficients."""
        q = {s: sympy.Symbol(f"q{i}", real=True) for i, s in enumerate(self._parameters)}
        return function_text(name, {"q": q.values()}, [[e.xreplace(q) for e in self.values]])


def _content(terms: Expression) -> Expression:
    """Return the largest integer that divides all terms of a sum."""
    content = 0
    for term in terms.args:
        number = term.as_coeff_Mul()[0]
        if not number.is_Integer or (content := math.gcd(content, int(number))) == 1:
            return sympy.S.One
    return sympy.Integer(content)


class Parameters(Coefficients):
    """The step and the parameters themselves as c[i], for kernels that compute the rest anew."""

    def __init__(self, q: Letters) -> None:
        super().__init__(q)
        self.q, self.values = set(), list(q)
        self._names = {p: sympy.Symbol(f"c{i}", real=True) for i, p in enumerate(q)}

    def letter(self, e: Expression) -> Expression | None:
        """Return the name of a parameter in the kernel, or None for another expression."""
        return self._names.get(e)
