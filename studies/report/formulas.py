"""Formulas in readable form: ascending powers of the step, common factors outside."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from html import escape, unescape
from itertools import product
from typing import Any

LARGEST = 3000  # larger expressions, in operations, are only freed of common factors
#: largest product of the number of terms when written out and of present operations, which
#: estimates the microseconds of writing it out; wong by midpoint, the largest of the built-in
#: scenes, has 1.5e5
DEAREST = 200_000
LINE = 105  # length of a line of an equation in letters
_TAG = re.compile("<[^>]*>|\u2062")


def ascending(
    expression: Any, h: Any, base: Collection[Any], named: dict[Any, Any] | None = None
) -> list[Any]:
    """Return terms that add up to the expression exactly, by ascending powers of h, each factored.

    Of sin²a + cos²a with equal factors only the factors stay.
    Terms that depend on the symbols in `base` (potentials) are separate from the others. Terms
    whose denominators contain h are gathered over one denominator and come last. With `named`, a
    denominator becomes a letter, and this dictionary gets (letter → denominator). Sums under roots
    that do not depend on h stay unchanged: written out they would only be longer.
    """
    from sympy import Add, Function, Symbol, cancel, count_ops, factor_terms, fraction, together

    opaque = any(type(f).__name__ == "stumpff" for f in expression.atoms(Function))
    operations = count_ops(expression)
    if opaque or operations > LARGEST or operations * _terms_of(expression) > DEAREST:
        return [factor_terms(expression)]
    roots = _under_roots(expression, h)
    expression = expression.xreplace({root: letter for letter, root in roots.items()})
    base = {*base, *(e for e, root in roots.items() if root.free_symbols & set(base))}
    plain: list[Any] = []
    broken: list[Any] = []
    for term in Add.make_args(_expanded(expression)):
        above, below = fraction(term)
        simple = above.is_polynomial(h) and not below.has(h)
        (plain if simple else broken).append(term)
    summands = _powers(Add(*plain), h, base)
    if broken:
        above, below = fraction(cancel(together(Add(*broken))))
        number, below = below.as_content_primitive()
        above /= number
        below = Add(*_powers(below, h, ())).xreplace(roots)
        if named is None:
            return [e.xreplace(roots) for e in (*summands, Add(*_powers(above, h, base)) / below)]
        known = {value: letter for letter, value in named.items()}
        letter = known.get(below) or Symbol("Δ" + "′" * len(named), real=True)
        named[letter] = below
        summands += [term / letter for term in _powers(above, h, base)]
    return [term.xreplace(roots) for term in summands]


def _terms_of(e: Any) -> int:
    """Return the number of terms after products and powers of sums are written out."""
    if e.is_Add:
        return sum(map(_terms_of, e.args))
    inside = max(map(_terms_of, e.args), default=1)
    if e.is_Mul:
        return max(inside, math.prod(map(_terms_of, e.args)))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        terms = _terms_of(e.base)
        return math.comb(int(e.exp) + terms - 1, int(e.exp))
    if e.is_Pow or e.is_Function:
        return 1 if inside < LARGEST else inside
    return 1


def _under_roots(expression: Any, h: Any) -> dict[Any, Any]:
    """Return the sums under roots that are free of h, each with a letter that can stand for it."""
    from sympy import Pow, Symbol

    roots = {p.base for p in expression.atoms(Pow) if p.base.is_Add and not p.exp.is_Integer}
    free = sorted((root for root in roots if not root.has(h)), key=str)
    return {Symbol(f"root {k}", positive=True): root for k, root in enumerate(free)}


def _powers(expression: Any, h: Any, base: Collection[Any]) -> list[Any]:
    """Return c₀ + c₁h + …, as the terms of c₀, of c₁h and so on."""
    from sympy import Add, collect, fraction

    powers = collect(_expanded(expression), h, evaluate=False) if expression != 0 else {}
    summands = []
    for power in sorted(powers, key=lambda p: p.as_base_exp()[1] if p.has(h) else 0):
        kin: dict[Any, list[Any]] = {}
        for term in Add.make_args(_expanded(powers[power])):
            kind = bool(term.free_symbols & set(base))
            kin.setdefault((kind, str(fraction(term)[1].as_coeff_Mul()[1])), []).append(term)
        for _, terms in sorted(kin.items()):
            summands.append(power * _factored(Add(*terms)))
    return summands


@cache  # rules of a scene, and both ends of a step, have most terms in common
def _factored(part: Any) -> Any:
    """Return a sum with one denominator as a product, like sympy's `factor`, but by flint."""
    from flint import fmpz_mpoly_ctx
    from sympy import Add, Mul, Poly, Rational, count_ops, factor, factor_terms, fraction

    if not part.is_Add:
        return part
    if count_ops(part) >= LARGEST // 10:
        return factor_terms(part)
    below = fraction(part.args[0])[1].as_coeff_Mul()[1]
    above = Poly(Add(*(term * below for term in part.args)))
    if not (above.domain.is_ZZ or above.domain.is_QQ):  # decimals
        return factor(part)
    number, above = above.clear_denoms(convert=True)
    ring = fmpz_mpoly_ctx.get([f"x{k}" for k, _ in enumerate(above.gens)], "lex")
    whole = ring.from_dict({m: int(c) for m, c in above.rep.to_dict().items()})
    content, factors = whole.factor()
    again = [Poly.from_dict(f.to_dict(), *above.gens).as_expr() ** k for f, k in factors]
    size, product = Rational(int(content), number), Mul(*again)
    outside = product.is_Add and size != 1  # otherwise it would be multiplied into the sum
    return Mul(size, product, evaluate=not outside) / factor(below)


@cache
def _expanded(expression: Any) -> Any:
    from sympy import expand

    return _without_circles(expand(expression, power_base=False, power_exp=False, log=False))


def _without_circles(expression: Any) -> Any:
    """Return a sum with c·r in place of c·r·sin²a + c·r·cos²a, as often as there are such terms."""
    from sympy import Add, cos, sin

    sines = [s for s in expression.atoms(sin) if expression.has(cos(*s.args))]
    terms, before = dict(expression.as_coefficients_dict()) if sines else {}, 0
    while len(terms) != before:
        before = len(terms)
        for s, term in product(sines, [*terms]):
            rest = term / s**2 if term.as_powers_dict()[s] >= 2 else None
            other = None if rest is None else rest * cos(*s.args) ** 2
            if term in terms and other in terms and terms[term] == terms[other]:
                del terms[other]
                terms[rest] = terms.get(rest, 0) + terms.pop(term)
    return Add(*(c * term for term, c in terms.items())) if sines else expression


def display(formula: str) -> str:
    """Return a formula as a block element of a page or of a file."""
    return f'<math display="block">{formula}</math>'


def together(formulas: Sequence[str]) -> str:
    """Return several formulas as one block, each on its own line."""
    return display(_table(formulas))


def spaced(formula: str) -> str:
    """Return the formula with products that the page's style spaces."""
    return formula.replace("<mo>\u2062</mo>", "<mo class=x>\u2062</mo>")


def _table(rows: Iterable[str]) -> str:
    cells = "".join(f"<mtr><mtd>{row}</mtd></mtr>" for row in rows)
    return f'<mtable displaystyle="true">{cells}</mtable>'


def _width(pieces: Iterable[str]) -> int:
    """Return the approximate width in letters; a fraction counts both its parts."""
    return sum(len(_TAG.sub("", piece)) for piece in pieces)


def _lines(pieces: Sequence[str]) -> list[str]:
    """Return the pieces joined into lines, indented after the first."""
    rows, room = [""], LINE
    for piece in pieces:
        wide = _width([piece])
        if wide > room and room < LINE:
            piece = '<mspace width="2em"/>' + piece.replace("<mo>", '<mo form="infix">', 1)
            rows, room = [*rows, ""], LINE
        rows[-1] += piece
        room -= wide
    return [f"<mrow>{row}</mrow>" for row in rows]


class Typesetter:
    """Presentation MathML of sums whose terms keep their given order."""

    def __init__(self, letters: Mapping[Any, str]) -> None:
        from sympy import Symbol

        self.letters = {s: Symbol(name, **s.assumptions0) for s, name in letters.items()}

    def equation(self, left: Sequence[Any], right: Sequence[Any]) -> str:
        """Return "sum = sum" in lines of about `LINE` characters, broken before a term."""
        before, after = self.signed(left), self.signed(right)
        if _width([*before, *after]) <= LINE:
            return f"<mrow>{''.join(before)}<mo>=</mo>{''.join(after)}</mrow>"
        after[0] = f'<mo form="infix">=</mo>{after[0]}'
        short = _width(before) <= LINE // 8
        return _table(_lines([*before, *after]) if short else [*_lines(before), *_lines(after)])

    def sum(self, terms: Sequence[Any]) -> str:
        """Return the terms in this order, with their signs between them."""
        return f"<mrow>{''.join(self.signed(terms))}</mrow>"

    def signed(self, terms: Sequence[Any]) -> list[str]:
        """Return each term with the sign before it, the first without a plus; no term is zero."""
        from sympy.printing.precedence import PRECEDENCE

        texts = list[str]()
        for term in terms:
            minus = term.as_coeff_Mul()[0].is_negative
            sign = "<mo>−</mo>" if minus else "<mo>+</mo>" if texts else ""
            size = (-term if minus else term).xreplace(self.letters)
            least = PRECEDENCE["Mul"] if sign else 0  # a sum without a sign needs no brackets
            texts.append(sign + _typeset(size, least))
        return texts or ["<mn>0</mn>"]


@cache
def _typeset(size: Any, least: int) -> str:
    """Return the expression, in brackets if it binds less tightly than `least`."""
    return _written(_printer().parenthesize(size, least, strict=True))


@cache
def _printer() -> Any:
    """Return sympy's printer with functions by their own names and Stumpff's as c_k(z)."""
    from sympy import Symbol
    from sympy.printing.mathml import MathMLPresentationPrinter

    class Printer(MathMLPresentationPrinter):
        def _print_Function(self, expr: Any) -> Any:
            name, arguments = type(expr).__name__, expr.args
            if name == "Held":
                return self._print(arguments[0])
            if name == "stumpff":
                name, arguments = f"c_{arguments[0]}", arguments[1:]
            row = self.dom.createElement("mrow")
            row.appendChild(self._print(Symbol(name)))
            row.appendChild(self._paren_comma_separated(*arguments))
            return row

    return Printer()


def _written(node: Any) -> str:
    """Return a MathML node as text, without rows of one entry."""
    if node.nodeType == node.TEXT_NODE:
        return escape(unescape(node.data), quote=False)
    inner = "".join(map(_written, node.childNodes))
    if node.tagName == "mrow" and len(node.childNodes) == 1:
        return inner
    attributes = "".join(f' {key}="{value}"' for key, value in node.attributes.items())
    return f"<{node.tagName}{attributes}>{inner}</{node.tagName}>"
