"""Formulas as a reader wants them: ascending powers of the step, common factors outside."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from html import escape
from typing import Any

LARGEST = 3000  # operations; what is larger is only freed of common factors
LINE = 105  # letters in a line of an equation
_TIMES = '<mo lspace="0.1em" rspace="0.1em">&#8290;</mo>'
_TAG = re.compile(r"<[^>]*>|&#8290;")


def ascending(
    expression: Any, h: Any, base: Collection[Any], named: dict[Any, Any] | None = None
) -> list[Any]:
    """Terms that add up to the expression exactly, in ascending powers of h, each factored.

    What depends on the symbols in `base` (potentials) stands apart from what does not. Terms whose
    denominators contain h are gathered over one denominator and come last. With `named`, a
    denominator is a letter, and this dictionary is told which (letter → denominator). Sums under
    roots that do not depend on h stay as they are: written out they would only be longer.
    """
    from sympy import Add, Function, Symbol, cancel, count_ops, factor_terms, fraction, together

    opaque = any(type(f).__name__ == "stumpff" for f in expression.atoms(Function))
    if opaque or count_ops(expression) > LARGEST:
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
    found = _powers(Add(*plain), h, base)
    if broken:
        above, below = fraction(cancel(together(Add(*broken))))
        number, below = below.as_content_primitive()
        above /= number
        below = Add(*_powers(below, h, ())).xreplace(roots)
        if named is None:
            return [e.xreplace(roots) for e in (*found, Add(*_powers(above, h, base)) / below)]
        known = {value: letter for letter, value in named.items()}
        letter = known.get(below) or Symbol("Δ" + "′" * len(named), real=True)
        named[letter] = below
        found += [term / letter for term in _powers(above, h, base)]
    return [term.xreplace(roots) for term in found]


def _under_roots(expression: Any, h: Any) -> dict[Any, Any]:
    """The sums under roots that are free of h, each by a letter that can stand for it."""
    from sympy import Pow, Symbol

    found = {p.base for p in expression.atoms(Pow) if p.base.is_Add and not p.exp.is_Integer}
    free = sorted((root for root in found if not root.has(h)), key=str)
    return {Symbol(f"root {k}", positive=True): root for k, root in enumerate(free)}


def _powers(expression: Any, h: Any, base: Collection[Any]) -> list[Any]:
    """c₀ + c₁h + …, as the terms of c₀, of c₁h and so on."""
    from sympy import Add, collect, count_ops, factor, factor_terms, fraction

    powers = collect(_expanded(expression), h, evaluate=False) if expression != 0 else {}
    found = []
    for power in sorted(powers, key=lambda p: p.as_base_exp()[1] if p.has(h) else 0):
        kin: dict[Any, list[Any]] = {}
        for term in Add.make_args(_expanded(powers[power])):
            kind = bool(term.free_symbols & set(base))
            kin.setdefault((kind, str(fraction(term)[1].as_coeff_Mul()[1])), []).append(term)
        for _, terms in sorted(kin.items()):
            part = Add(*terms)
            small = count_ops(part) < LARGEST // 10
            found.append(power * (factor(part) if small else factor_terms(part)))
    return found


def _expanded(expression: Any) -> Any:
    from sympy import expand

    return expand(expression, power_base=False, power_exp=False, log=False)


def _width(pieces: Iterable[str]) -> int:
    """About how many letters wide; a fraction is counted with both its parts."""
    return sum(len(_TAG.sub("", piece)) for piece in pieces)


def _lines(head: str, pieces: Sequence[str]) -> list[str]:
    """Pieces put together to lines, those after the first indented."""
    rows, room = [head], LINE
    for piece in pieces:
        wide = _width([piece])
        if wide > room and room < LINE:
            rows.append('<mspace width="2em"/>')
            room = LINE
        rows[-1] += piece
        room -= wide
    return [f"<mrow>{row}</mrow>" for row in rows]


def _fence(inner: str) -> str:
    """Brackets, as tall as what they hold only where that is tall."""
    flat = "" if "<mfrac" in inner or "<mroot" in inner else ' stretchy="false"'
    return f"<mrow><mo{flat}>(</mo>{inner}<mo{flat}>)</mo></mrow>"


class Typesetter:
    """Presentation MathML; the factors of a product stand in the order step, parameters, rest."""

    def __init__(self, letters: Mapping[Any, str], h: Any, coordinates: Iterable[Any]) -> None:
        self.letters = letters
        self.h = h
        self.coordinates = set(coordinates)

    def equation(self, left: Sequence[Any], right: Sequence[Any]) -> str:
        """Sum = sum, in lines of about `LINE` characters, broken before a term."""
        before, after = self.signed(left), self.signed(right)
        if _width([*before, *after]) <= LINE:
            return f"<mrow>{''.join(before)}<mo>=</mo>{''.join(after)}</mrow>"
        rows = [*_lines("", before), *_lines('<mo form="infix">=</mo>', after)]
        if _width(before) <= LINE // 8:
            rows[:2] = [rows[0] + rows[1]]
        cells = "".join(f"<mtr><mtd>{row}</mtd></mtr>" for row in rows)
        return f'<mtable displaystyle="true">{cells}</mtable>'

    def sum(self, terms: Sequence[Any]) -> str:
        """The terms in this order, with their signs between them."""
        return f"<mrow>{''.join(self.signed(terms))}</mrow>"

    def signed(self, terms: Sequence[Any]) -> list[str]:
        """Each term with the sign before it; the first without a plus. Nothing is zero."""
        found: list[str] = []
        for term in terms:
            minus = term.as_coeff_Mul()[0].is_negative
            form = ' form="infix"' if found else ""
            sign = f"<mo{form}>−</mo>" if minus else f"<mo{form}>+</mo>" if found else ""
            size = -term if minus else term
            shown = self._fenced(size) if minus and size.is_Add else self.product(size)
            found.append(sign + shown)
        return found or ["<mn>0</mn>"]

    def product(self, term: Any) -> str:
        """A product without sign; sums stand beside, not in, a fraction over something short."""
        from sympy import Mul, fraction

        above, below = fraction(term)
        factors = sorted((f for f in Mul.make_args(above) if f != 1), key=self._rank)
        if below == 1 or term.is_Add:
            return self._row(factors) if not term.is_Add else self.expression(term)
        if all(f.is_number or f.is_Symbol for f in Mul.make_args(below)):
            sums = [f for f in factors if f.is_Add]
            rest = self._row([f for f in factors if not f.is_Add])
            small = f"<mfrac>{rest}{self.expression(below)}</mfrac>"
            beside = _TIMES.join(self._fenced(f) for f in sums)
            return f"<mrow>{small}{_TIMES if sums else ''}{beside}</mrow>"
        return f"<mfrac>{self._row(factors)}{self.expression(below)}</mfrac>"

    def expression(self, given: Any) -> str:
        """Any expression; what this class does not know is written as sympy does."""
        from sympy.printing.mathml import mathml

        if given.is_Integer and given >= 0:
            return f"<mn>{given}</mn>"
        if given.is_Symbol:
            return self.symbol(self.letters.get(given, str(given)))
        if given.is_Add:
            return self.sum(sorted(given.args, key=self._place))
        if given.is_Mul or given.is_Rational:
            return self.sum([given])
        if given.is_Pow and given.exp.as_coeff_Mul()[0].is_negative:
            return self.product(given)
        if given.is_Pow:
            return self._power(given.base, given.exp)
        if type(given).__name__ == "stumpff":
            return f"{self.symbol(f'c_{given.args[0]}')}{self._fenced(given.args[1])}"
        if type(given).__name__ == "Held":
            return self.expression(given.args[0])
        if given.is_Function:
            inner = "<mo>,</mo>".join(self.expression(a) for a in given.args)
            return f"<mrow><mi>{escape(type(given).__name__)}</mi>{_fence(inner)}</mrow>"
        return str(mathml(given, printer="presentation"))

    @staticmethod
    def symbol(name: str) -> str:
        """x_1, inertia_2 or z′_1 with its index below."""
        letter, _, index = name.rpartition("_")
        if not letter or not index.isdigit():
            return f"<mi>{escape(name)}</mi>"
        return f"<msub><mi>{escape(letter)}</mi><mn>{index}</mn></msub>"

    def _power(self, base: Any, exponent: Any) -> str:
        if exponent.is_Rational and (exponent.p, exponent.q) == (1, 2):
            return f"<msqrt>{self.expression(base)}</msqrt>"
        below = self.expression(base) if base.is_Symbol else self._fenced(base)
        if exponent.is_Rational and exponent.q > 1:
            above = f"<mrow><mn>{exponent.p}</mn><mo>/</mo><mn>{exponent.q}</mn></mrow>"
        else:
            above = self.expression(exponent)
        if below.startswith("<msub>"):
            inner = below.removeprefix("<msub>").removesuffix("</msub>")
            return f"<msubsup>{inner}{above}</msubsup>"
        return f"<msup>{below}{above}</msup>"

    def _row(self, factors: Sequence[Any]) -> str:
        if len(factors) < 2:
            return self.expression(factors[0]) if factors else "<mn>1</mn>"
        shown = [self._fenced(f) if f.is_Add else self.expression(f) for f in factors]
        return f"<mrow>{_TIMES.join(shown)}</mrow>"

    def _fenced(self, given: Any) -> str:
        return _fence(self.expression(given))

    def _rank(self, factor: Any) -> tuple[int, str]:
        """Numbers, the step, parameters, coordinates, functions of them, sums."""
        symbols = factor.free_symbols
        kinds = [
            not symbols,
            symbols == {self.h},
            not factor.is_Add and not symbols & self.coordinates,
            factor.is_Symbol or (factor.is_Pow and factor.base.is_Symbol),
            not factor.is_Add,
            True,
        ]
        return kinds.index(True), str(factor)

    def _place(self, term: Any) -> tuple[int, bool, str]:
        """Ascending powers of the step, and first what has a positive sign."""
        power = term.as_coeff_exponent(self.h)[1]
        rank = int(power) if power.is_Integer else 99
        return rank, bool(term.as_coeff_Mul()[0].is_negative), str(term)
