"""Functions that return several numbers at once, inside symbolic expressions.

`entry(f(z), k)` is number k of the results of f. As common subexpressions are computed once,
generated text calls f once and reads its numbers by index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

from .arithmetic import Arithmetic
from .evaluation import number
from .lazy import sympy
from .nodes import CALL, Node
from .types import Expression, Function, Letter, Number


def entry(table: Expression, index: int) -> Expression:
    """Return number `index` of the tuple or array that the sympy function `table` stands for.

    A table that is to be differentiated or evaluated has methods slope(index, s) and
    in_arithmetic(numbers, values of its arguments).
    """
    return _classes()[0](table, index)


def as_one_number(expression: Expression) -> Expression:
    """Return the expression as one number, rounded once: products with it are not merged."""
    if expression.is_Rational:
        return expression
    sign = -1 if expression.could_extract_minus_sign() else 1
    return sign * _classes()[1](sign * expression)


class InArithmetic:
    """A base of sympy functions whose decimals are computed by in_arithmetic(numbers, values)."""

    is_number: bool

    def _eval_is_real(self) -> bool | None:
        return True

    def _eval_evalf(self, prec: int) -> Expression | None:
        return sympy.Float._new(number(self, prec)._mpf_, prec) if self.is_number else None


@cache
def _classes() -> tuple[Function, Function]:
    class Entry(InArithmetic, sympy.Function):
        nargs = 2

        def _eval_derivative(self, s: Letter) -> Expression:
            return self.args[0].slope(int(self.args[1]), s)

        def in_arithmetic(self, numbers: Arithmetic, values: Sequence[Any]) -> Number:
            """Return the number itself, once the table is known."""
            return values[0][int(self.args[1])]

        def written(self, code: Callable[[Expression], str]) -> str:
            """Return the text of the number; `code` gives that of a part."""
            return f"{code(self.args[0])}[{self.args[1]}]"

    class Held(InArithmetic, sympy.Function):
        nargs = 1

        @classmethod
        def eval(cls, value: Expression) -> Expression | None:
            return value if value.is_Rational else None

        def _eval_is_real(self) -> bool | None:
            return not self.args[0].has(sympy.I) or None  # sympy knows no quotient for real

        def _eval_derivative(self, s: Letter) -> Expression:
            return self.args[0].diff(s)

        def in_arithmetic(self, numbers: Arithmetic, values: Sequence[Any]) -> Number:
            """Return the number itself."""
            return values[0]

        def written(self, code: Callable[[Expression], str]) -> str:
            """Return the text of the number; `code` gives that of a part."""
            return f"({code(self.args[0])})"

    return Entry, Held


def opaque(nodes: Iterable[Node]) -> bool:
    """True if one of the nodes is a function of ours, whose factors are better not expanded."""
    return any(e.kind == CALL and e.args[0].atoms(InArithmetic) for e in nodes)
