"""From expressions to straight-line Python, run on any kind of number.

One text serves numba (double precision), numpy arrays, gmpy2 and mpmath: integers stay literal,
other constants are coefficients computed once in the arithmetic at hand.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

from ..errors import BadInput
from .elementary import FUNCTIONS
from .lazy import sympy
from .multi_output import is_table, together


class Coefficients:
    """Subexpressions of the step and the parameters alone, each computed once per flow as c[i].

    Sums are not multiplied out: c·(a − c′b) keeps its map volume-preserving in rounded numbers,
    where c·a − (cc′)·b would let energy drift linearly (harmonic midpoint: 3e-19 a step).
    """

    def __init__(self, q: Sequence[Any]) -> None:
        self.q = set(q)
        self.values: list[Any] = []
        self._index: dict[Any, Any] = {}
        self._done: dict[Any, Any] = {}

    def symbol(self, expression: Any) -> Any:
        """The symbol that stands for a coefficient; of ±e, one is kept."""
        if expression.could_extract_minus_sign():
            return -self.symbol(-expression)
        if expression not in self._index:
            self._index[expression] = sympy.Symbol(f"c{len(self.values)}", real=True)
            self.values.append(expression)
        return self._index[expression]

    def hoist(self, e: Any) -> Any:
        """`e` with every largest subexpression in q alone replaced by its coefficient."""
        if e not in self._done:
            self._done[e] = self._hoist(e)
        return self._done[e]

    def _hoist(self, e: Any) -> Any:
        if e.is_Integer:
            return e
        if not e.free_symbols - self.q:
            return self.symbol(e)
        if e.is_Atom:
            return e
        if isinstance(e, (sympy.Add, sympy.Mul)):
            constant = [a for a in e.args if not a.free_symbols - self.q]
            rest = [self.hoist(a) for a in e.args if a.free_symbols - self.q]
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


def _primitive(factor: Any) -> tuple[Any, Any]:
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
    """Expressions whose values are needed together: the text of some lines makes names of them."""

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """The statements that define `names` from the texts of the expressions."""
        raise NotImplementedError


class Parameters(Coefficients):
    """The step and the parameters themselves as c[i], for kernels that compute all else anew."""

    def __init__(self, q: Sequence[Any]) -> None:
        super().__init__(())
        self.values = list(q)
        self._names = {p: sympy.Symbol(f"c{i}", real=True) for i, p in enumerate(q)}

    def hoist(self, e: Any) -> Any:
        """`e` with each parameter replaced by its name in the kernel."""
        return e.xreplace(self._names)


def statements(
    outputs: Sequence[Any], letter: str = "t"
) -> tuple[list[tuple[str, str]], list[str]]:
    """Common subexpressions taken out: ([(name, code)], [code of each output])."""
    found, reduced = sympy.cse(
        together(list(outputs)), symbols=sympy.numbered_symbols(letter, real=True), list=True
    )
    opposite: dict[Any, Any] = {}  # −t costs nothing, and a name for it only lengthens the text
    taken = []
    for name, value in found:
        value = value.xreplace(opposite)
        if (-value).is_Symbol:
            opposite[name] = value
        else:
            taken.append((str(name), code(value)))
    return taken, [code(e.xreplace(opposite)) for e in reduced]


def code(expression: Any) -> str:
    """Python text of one expression, small powers as products."""
    return str(_printer().doprint(expression))


@cache
def _printer() -> Any:
    from sympy.printing.precedence import precedence
    from sympy.printing.pycode import AbstractPythonCodePrinter

    class Printer(AbstractPythonCodePrinter):
        """Plain arithmetic; rationals as R(p)/q, R being the number type of the arithmetic."""

        def _print_Rational(self, e: Any) -> str:
            return f"(R({e.p})/{e.q})"

        def _print_Float(self, e: Any) -> str:
            return self._print_Rational(e) if e.is_Rational else f"R('{e}')"

        def _print_Pi(self, e: Any) -> str:
            return "PI"

        def _print_Exp1(self, e: Any) -> str:
            return "exp(R(1))"

        def _print_Pow(self, e: Any, rational: bool = False) -> str:
            base, exponent = e.base, e.exp
            text = self.parenthesize(base, precedence(e) + 1)
            if exponent.is_Rational and exponent < 0:
                return f"1/{self._factors(base, text, -exponent)}"
            if exponent.is_Rational:
                return self._factors(base, text, exponent)
            return f"{text}**{self.parenthesize(exponent, precedence(e))}"

        def _factors(self, base: Any, text: str, exponent: Any) -> str:
            whole, rest = divmod(exponent, 1)
            root = f"sqrt({self._print(base)})"
            if rest == 0 and whole <= 16:
                return "(" + "*".join([text] * int(whole)) + ")"
            if rest * 2 == 1 and whole <= 16:
                return "(" + "*".join([*[text] * int(whole), root]) + ")"
            return f"({text}**{self._print(exponent)})"

        def _print_Function(self, e: Any) -> str:
            name = type(e).__name__
            if name == "Held":
                return f"({self._print(e.args[0])})"
            if name == "Entry":
                return f"{self._print(e.args[0])}[{e.args[1]}]"
            name = name if is_table(e) else FUNCTIONS.get(name, "")
            if not name:
                called = type(e).__name__
                if called in ("sign", "DiracDelta"):
                    raise BadInput(
                        "the derivative of Abs cannot be put into a kernel: write the Lagrangian "
                        "without Abs (the root of a square is one too)."
                    )
                raise BadInput(
                    f"the function {called} cannot be put into a kernel; "
                    f"there are {', '.join(FUNCTIONS)}, powers and roots."
                )
            return f"{name}({', '.join(self._print(a) for a in e.args)})"

        _print_Abs = _print_exp = _print_log = _print_Function

    return Printer({"fully_qualified_modules": False})


class Call(Together):
    """The results of one call, from its arguments."""

    def __init__(self, function: str, arguments: Sequence[Any]) -> None:
        super().__init__(arguments)
        self.function = function

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """One statement."""
        return [f"{', '.join(names)}, = {self.function}({', '.join(texts)})"]  # always a tuple


def function_text(
    name: str,
    arguments: dict[str, Iterable[Any]],
    results: Sequence[Sequence[Any] | Any],
    before: Sequence[tuple[Sequence[Any], Sequence[Any]]] = (),
    scalars: Sequence[Any] = (),
) -> str:
    """Text of a function of vectors (and scalars) that returns tuples (for a column) and numbers.

    `arguments`: vector name → its symbols, unpacked first. `before`: (symbols, values) computed in
    front, such as the points of a step, which the results may use; values `Together` make all
    their symbols at once.
    """
    head = [f"def {name}({', '.join([*arguments, *map(str, scalars)])}):"]
    for vector, symbols in arguments.items():
        head += [f"    {s} = {vector}[{i}]" for i, s in enumerate(symbols)]
    flat: list[Any] = [v for _, values in before for v in values]
    lengths: list[int | None] = []
    for result in results:
        column = list(result) if hasattr(result, "__iter__") else None
        lengths.append(None if column is None else len(column))
        flat += [result] if column is None else column
    body, texts = _ordered(flat, before)
    parts, at = [], 0
    for length in lengths:
        if length is None:
            parts.append(texts[at])
            at += 1
        else:
            inner = ", ".join(texts[at : at + length])
            parts.append(f"({inner}{',' if length == 1 else ''})")
            at += length
    returned = parts[0] if len(parts) == 1 else f"{', '.join(parts)}"
    return "\n".join([*head, *body, f"    return {returned}"]) + "\n"


def _ordered(
    flat: list[Any], before: Sequence[tuple[Sequence[Any], Sequence[Any]]]
) -> tuple[list[str], list[str]]:
    """Statements in an order in which each name is known before it is used."""
    taken, texts = statements(flat)
    pending: list[tuple[list[str], list[str], str]] = []  # names, lines, what they are made of
    at = 0
    for symbols, values in before:
        names, made = [str(s) for s in symbols], texts[at : at + len(values)]
        at += len(values)
        if isinstance(values, Together):
            pending.append((names, values.lines(names, made), " ".join(made)))
        else:
            pending += [([n], [f"{n} = {t}"], t) for n, t in zip(names, made, strict=True)]
    pending += [([name], [f"{name} = {text}"], text) for name, text in taken]
    waiting = {name for names, _, _ in pending for name in names}
    unmet = [set(re.findall(r"[A-Za-z_]\w*", text)) & waiting for _, _, text in pending]
    lines: list[str] = []
    while pending:
        i = next(i for i, needed in enumerate(unmet) if not needed & waiting)
        names, made, _ = pending.pop(i)
        unmet.pop(i)
        lines += [f"    {line}" for line in made]
        waiting.difference_update(names)
    return lines, texts[at:]
