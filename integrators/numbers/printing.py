"""From expressions to straight-line Python, run on any kind of number.

One text serves numba (double precision), numpy arrays, gmpy2 and mpmath: integers stay literal,
other constants are coefficients computed once in the arithmetic at hand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import Any

from ..errors import BadInput
from .arithmetic import FUNCTIONS
from .definitions import symbols_of
from .lazy import sympy
from .multi_output import is_table, together
from .types import Expression, Expressions, Letter, Letters, Replacement

#: letters and what they stand for: values, or a `Together` that makes all of them at once
Assignment = tuple[Letters, Expressions]


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
        """The symbol that stands for a coefficient; −e is minus the symbol of e."""
        if expression.could_extract_minus_sign():
            return -self.symbol(-expression)
        if expression not in self._index:
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
                return e.func(*rest)
            part = e.func(*constant)
            return e.func(part if part.is_Integer else self.symbol(part), *rest)
        if isinstance(e, sympy.Pow) and isinstance(2 * e.exp, sympy.Integer):
            return sympy.Pow(self.hoist(e.base), e.exp)
        return e.func(*[self.hoist(a) for a in e.args])


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


class Together(list[Any]):
    """Expressions whose values one statement or several define at once."""

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """The statements that define `names` from the texts of the expressions."""
        raise NotImplementedError


class Parameters(Coefficients):
    """The step and the parameters themselves as c[i], for kernels that compute all else anew."""

    def __init__(self, q: Letters) -> None:
        super().__init__(())
        self.values = list(q)
        self._names = {p: sympy.Symbol(f"c{i}", real=True) for i, p in enumerate(q)}

    def hoist(self, e: Expression) -> Expression:
        """`e` with each parameter replaced by its name in the kernel."""
        return e.xreplace(self._names)


def _shared(outputs: Expressions) -> tuple[list[tuple[Letter, Expression]], list[Expression]]:
    """Common subexpressions taken out: ([(letter, value)], [each output])."""
    letters = sympy.numbered_symbols("t", real=True)
    shared, reduced = sympy.cse(together(list(outputs)), symbols=letters, list=True)
    opposite: Replacement = {}  # −t costs nothing, and a name for it lengthens the text
    taken = []
    for name, value in shared:
        value = value.xreplace(opposite)
        if (-value).is_Symbol:
            opposite[name] = value
        else:
            taken.append((name, value))
    return taken, [e.xreplace(opposite) for e in reduced]


def code(expression: Expression) -> str:
    """Python text of one expression, small powers as products."""
    return str(_printer().doprint(expression))


@cache
def _printer() -> Any:
    from sympy.printing.precedence import precedence
    from sympy.printing.pycode import AbstractPythonCodePrinter

    class Printer(AbstractPythonCodePrinter):
        """Plain arithmetic; rationals as R(p)/q, R being the number type of the arithmetic."""

        def _print_Rational(self, e: Expression) -> str:
            return f"(R({e.p})/{e.q})"

        def _print_Float(self, e: Expression) -> str:
            return f"R('{e}')"

        def _print_Pi(self, e: Expression) -> str:
            return "PI"

        def _print_Exp1(self, e: Expression) -> str:
            return "exp(R(1))"

        def _print_Pow(self, e: Expression, rational: bool = False) -> str:
            base, exponent = e.base, e.exp
            text = self.parenthesize(base, precedence(e) + 1)
            if not exponent.is_Rational:
                return f"{text}**{self.parenthesize(exponent, precedence(e))}"
            whole, rest = divmod(abs(exponent), 1)
            if whole <= 16 and rest in (0, sympy.S.Half):  # larger ones by the library's power
                root = [f"sqrt({self._print(base)})"] if rest else []
                product = f"({'*'.join([text] * int(whole) + root)})"
            else:
                product = f"({text}**{self._print(abs(exponent))})"
            return f"1/{product}" if exponent < 0 else product

        def _print_Function(self, e: Expression) -> str:
            called = type(e).__name__
            if isinstance(e, (sympy.sign, sympy.DiracDelta)):
                raise BadInput(
                    "the derivative of Abs cannot be put into a kernel: write the Lagrangian "
                    "without Abs (the root of a square is one too)."
                )
            if not is_table(e) and called not in FUNCTIONS:
                raise BadInput(
                    f"the function {called} cannot be put into a kernel; "
                    f"there are {', '.join(FUNCTIONS)}, powers and roots."
                )
            return f"{FUNCTIONS.get(called, called)}({', '.join(map(self._print, e.args))})"

        _print_Abs = _print_exp = _print_log = _print_Piecewise = _print_Function

    return Printer({"fully_qualified_modules": False})


class Call(Together):
    """The results of one call, from its arguments."""

    def __init__(self, function: str, arguments: Expressions) -> None:
        super().__init__(arguments)
        self.function = function

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """One statement."""
        return [f"{', '.join(names)}, = {self.function}({', '.join(texts)})"]  # always a tuple


def function_text(
    name: str,
    arguments: dict[str, Iterable[Letter]],
    results: Sequence[Expressions | Expression],
    before: Sequence[Assignment] = (),
    scalars: Letters = (),
) -> str:
    """Text of a function of vectors (and scalars) that returns tuples (for a column) and numbers.

    `arguments`: vector name → its symbols, unpacked first. `before`: (symbols, values) computed in
    front, such as the points of a step, which the results may use; values `Together` make all
    their symbols at once.
    """
    columns = [list(r) if hasattr(r, "__iter__") else [r] for r in results]
    lines, texts = body(arguments, [e for column in columns for e in column], before)
    parts = []
    for result, column in zip(results, columns, strict=True):
        inner = ", ".join(next(texts) for _ in column)
        comma = "," if len(column) == 1 else ""
        parts.append(f"({inner}{comma})" if hasattr(result, "__iter__") else inner)
    head = f"def {name}({', '.join([*arguments, *map(str, scalars)])}):"
    return "\n".join([head, *lines, f"    return {', '.join(parts)}"]) + "\n"


def body(
    arguments: dict[str, Iterable[Letter]], results: Expressions, before: Sequence[Assignment]
) -> tuple[list[str], Iterator[str]]:
    """The statements of a function of vectors, and the texts of its results.

    Each letter is defined before it is used; the order is that of `before`, then of the common
    subexpressions, as far as it can be.
    """
    lines = [f"{s} = {vector}[{i}]" for vector, letters in arguments.items()
             for i, s in enumerate(letters)]  # fmt: skip
    taken, reduced = _shared([*(v for _, values in before for v in values), *results])
    rest = iter(reduced)
    pending: list[tuple[Letters, Expressions, Any]] = []  # letters, values, what writes them
    for letters, values in before:
        made = [next(rest) for _ in values]
        if isinstance(values, Together):
            pending.append((letters, made, values.lines))
        else:
            pending += [([s], [e], _assign) for s, e in zip(letters, made, strict=True)]
    pending += [([s], [e], _assign) for s, e in taken]
    unknown = {s for letters, _, _ in pending for s in letters}
    needed = [symbols_of(values) for _, values, _ in pending]
    while pending:
        i = next(i for i, symbols in enumerate(needed) if not symbols & unknown)
        letters, values, write = pending.pop(i)
        needed.pop(i)
        lines += write([str(s) for s in letters], [code(e) for e in values])
        unknown.difference_update(letters)
    return [f"    {line}" for line in lines], (code(e) for e in rest)


def _assign(names: list[str], texts: list[str]) -> list[str]:
    return [f"{name} = {text}" for name, text in zip(names, texts, strict=True)]
