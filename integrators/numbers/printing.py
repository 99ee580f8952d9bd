"""From expressions to straight-line Python, run on any kind of number.

One text serves numba (double precision), numpy arrays, gmpy2 and mpmath: integers stay literal,
other constants are coefficients computed once in the arithmetic at hand.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TypeAlias

from .arithmetic import FUNCTIONS, refused
from .definitions import symbols_of
from .lazy import sympy
from .multi_output import is_table, together
from .types import Assignment, Expression, Expressions, Letter, Letters, Replacement


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


class Together(list[Expression], ABC):
    """Expressions whose values one statement or several define at once."""

    @abstractmethod
    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """The statements that define `names` from the texts of the expressions."""


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


#: how tightly a text holds together: what does so less than is needed stands in parentheses
_SUM, _PRODUCT, _FACTOR, _POWER, _ATOM = range(5)
_CONSTANTS = {"pi": "PI", "E": "exp(R(1))", "I": "1j"}


def code(expression: Expression) -> str:
    """Python text of one expression: plain arithmetic, small powers as products.

    Rationals are R(p)/q, R being the number type of the arithmetic. Raises `BadInput` for what no
    arithmetic has.
    """
    return _text(expression, _SUM)


def _text(e: Expression, needed: int) -> str:
    text, holds = _printed(e)
    return text if holds >= needed else f"({text})"


def _printed(e: Expression) -> tuple[str, int]:
    """The text of an expression, and how tightly it holds together."""
    if e.is_Symbol:
        return str(e), _ATOM
    if e.is_Integer:
        return str(e), _ATOM if e >= 0 else _SUM
    if e.is_Rational:
        return f"(R({e.p})/{e.q})", _ATOM
    if e.is_Add:
        return _sum(e), _SUM
    if e.is_Mul:
        return _product(e)
    if e.is_Pow:
        return _power(e.base, e.exp)
    if e.is_Float:
        return f"R('{e}')", _ATOM
    if e.is_NumberSymbol or e is sympy.I:
        return _CONSTANTS.get(str(e), f"constant('{e}')"), _ATOM
    if hasattr(e, "written"):
        return e.written(code), _ATOM
    name = type(e).__name__
    if name not in FUNCTIONS and not is_table(e):
        raise refused(e)
    return f"{FUNCTIONS.get(name, name)}({', '.join(map(code, e.args))})", _ATOM


def _sum(e: Expression) -> str:
    signed = []
    for term in e.as_ordered_terms():
        text = _text(term, _PRODUCT if term.is_Add else _SUM)
        signed += ["-", text[1:]] if text.startswith("-") else ["+", text]
    return signed[0].strip("+") + " ".join(signed[1:])


def _product(e: Expression) -> tuple[str, int]:
    """Factors over factors, the sign in front."""
    coefficient, rest = e.as_coeff_Mul()
    factors = rest.as_ordered_factors() if rest.is_Mul else [rest]
    if abs(coefficient) != 1:
        factors = [abs(coefficient), *factors]
    below = [f for f in factors if f.is_Pow and f.exp.is_Rational and f.exp.is_negative]
    above = [f for f in factors if f not in below]
    minus = coefficient < 0
    texts = [_text(f, _FACTOR if minus and len(above) == 1 else _PRODUCT) for f in above]
    text = "*".join(texts) or "1"
    if below:
        texts = [
            _text(f.base, _FACTOR) if f.exp == -1 else _power(f.base, -f.exp)[0] for f in below
        ]
        text += f"/{texts[0]}" if len(texts) == 1 else f"/({'*'.join(texts)})"
    return (f"-{text}", _SUM) if minus else (text, _PRODUCT)


def _power(base: Expression, exponent: Expression) -> tuple[str, int]:
    text = _text(base, _ATOM)
    if not exponent.is_Rational:
        return f"{text}**{_text(exponent, _POWER)}", _POWER
    whole, rest = divmod(abs(exponent), 1)
    if whole <= 16 and rest in (0, sympy.S.Half):  # larger ones by the library's power
        root = [f"sqrt({code(base)})"] if rest else []
        product = f"({'*'.join([text] * int(whole) + root)})"
    else:
        product = f"({text}**{code(abs(exponent))})"
    return (f"1/{product}", _FACTOR) if exponent < 0 else (product, _ATOM)


#: from the names of letters and the texts of their values to statements
Writer: TypeAlias = Callable[[list[str], list[str]], list[str]]


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
    pending: list[tuple[Letters, list[Expression], Writer]] = []
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
