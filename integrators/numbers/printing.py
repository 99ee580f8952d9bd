"""From expressions to straight-line Python, run on any kind of number.

One text serves numba (double precision), numpy arrays, gmpy2 and mpmath: integers stay literal,
other constants are coefficients computed once in the arithmetic at hand.
"""

from __future__ import annotations

from .arithmetic import FUNCTIONS, refused
from .exact import refuse_long
from .lazy import sympy
from .multi_output import is_table
from .types import Expression

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
    if e.is_Rational:
        refuse_long((int(e.p), int(e.q)), "what a step computes")
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
