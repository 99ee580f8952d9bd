"""Exact numbers: a scene's data are integers, fractions, decimal strings or exact expressions.

A float is its exact binary value; write "0.1" for one tenth. Double precision rounds each number
once, and high precision never sees a rounded one.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from numbers import Complex, Integral, Real
from threading import Lock
from typing import Any

from ..errors import LISTED, BadInput, shown
from .lazy import sympy
from .types import Exact, Expression, Function, Given, GivenVector, Rows

#: bits of a numerator or denominator: Python writes no integer of more than 4,300 digits
LARGEST = 14_000
#: bits of a user's intermediate number: computed within a tenth of a second
LONGEST = 2**20
#: largest power of ten of a number that is written as text
LARGEST_POWER = 9999
FLOAT_BITS = 1000  # bits of a whole number that is certainly a double
#: modules of sympy with functions of whole numbers that are computed exactly
_EXACT = ("sympy.functions.combinatorial", "sympy.functions.special")
_COUNTING = ("factorial", "factorial2", "subfactorial", "binomial", "RisingFactorial",
             "FallingFactorial", "fibonacci", "lucas", "tribonacci", "harmonic", "bernoulli",
             "euler", "genocchi", "catalan", "bell", "gamma", "zeta", "polygamma")  # fmt: skip
#: largest number of nested parts of an expression, without products. Derivatives of n nested parts
#: have n³ parts when they are written: a hundred sines are derived in ten seconds, a hundred sums
#: of Horner's form in four, three hundred sines never
DEEPEST = 100
# the depth from which Python needs more than its 1000 calls, and calls per level
SHALLOW, FRAMES = 20, 100
LONG = 200  # characters of a number with roots
_SUMS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
         ast.Div: operator.truediv}  # fmt: skip
LARGEST_COUNT = 2**53  # the last whole number up to which double precision counts
SMALLEST = Fraction(1, 10**300)  # its inverse and half are doubles, too


def exact(value: Given, what: str) -> Exact:
    """Return `value` as a Fraction, or unchanged if it is an exact sympy number.

    Raises `BadInput` (naming `what`) for text that is not a number, for nan and for infinities, and
    for numbers of more than 4,200 digits.
    """
    number = _read(value, what)
    if isinstance(number, Fraction):
        refuse_long((number.numerator, number.denominator), what)
    return number


@contextmanager
def within_doubles(what: str) -> Iterator[None]:
    """Raise `BadInput` if the block meets a whole number that no double can hold."""
    try:
        yield
    except OverflowError:
        raise BadInput(
            f"{what} has a number that is larger than any double: choose units that fit the motion."
        ) from None


def refuse_large(expression: Expression, what: str) -> None:
    """Raise `BadInput` for a long number, and for too many nested parts.

    Up to `DEEPEST` it lets Python go as deep as derivatives of such an expression need.
    """
    level, depth = {expression}, 0
    while level:
        depth += 1
        if depth > DEEPEST:
            raise BadInput(
                f"{what} has more than {DEEPEST} functions, sums and powers one inside another, "
                "and its second derivatives would never be done: end such a loop sooner, or write "
                "what it goes to."
            )
        level = _inside(level)
    refuse_unwritten(expression, what)
    if depth > SHALLOW:
        sys.setrecursionlimit(max(sys.getrecursionlimit(), FRAMES * depth))


def _inside(level: set[Expression]) -> set[Expression]:
    """Return the arguments of these expressions, and those of products among them."""
    parts, pending = set[Expression](), [part for e in level for part in e.args]
    while pending:
        part = pending.pop()
        if part.is_Mul:
            pending.extend(part.args)
        else:
            parts.add(part)
    return parts


def _read(value: Given, what: str) -> Exact:
    if isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", "") == "b":
        raise BadInput(f"{what} is {shown(value)}: give a number, not a truth value.")
    if isinstance(value, str):
        try:
            # Python reads digits of any script, and underscores between them
            power = re.search(r"[eE]([+-]?[\d_]+)\s*$", value)
            large = power is not None and abs(int(power[1])) > LARGEST_POWER
            number = Fraction(0) if large else Fraction(value.strip())
        except (ValueError, ZeroDivisionError):
            if "sqrt" in value and (root := _with_roots(value)) is not None:
                return _read(root, what)
            raise BadInput(
                f'{what} is "{value[:LISTED]}", which is no number: write a decimal ("0.1") '
                'or a fraction ("1/3").'
            ) from None
        if large:  # its integer alone would fill the memory
            raise BadInput(f"{what} is {value[:40]}: choose units that fit the motion.")
        return number
    if getattr(value, "is_Rational", False):  # one of sympy's
        return Fraction(int(value.p), int(value.q))
    if hasattr(value, "_mpf_") and not hasattr(value, "as_mantissa_exp"):  # not one of gmpy2's
        sign, mantissa, exponent, _ = value._mpf_
        if not mantissa and exponent:
            raise BadInput(f"{what} is {value}: give a finite number.")
        return Fraction(-int(mantissa) if sign else int(mantissa)) * Fraction(2) ** int(exponent)
    if getattr(value, "is_number", False):  # an exact sympy number such as sqrt(2)/2
        refuse_unwritten(value, what)
        if not value.is_real or not value.is_finite:
            raise BadInput(f"{what} is {value}: give a finite real number.")
        return value
    if getattr(value, "shape", None) == () and not hasattr(value, "as_integer_ratio"):
        value = value.item()  # numpy's integers, and arrays of no dimension
    try:
        return Fraction(*map(int, value.as_integer_ratio()))
    except (OverflowError, ValueError):
        raise BadInput(f"{what} is {value}: give a finite number.") from None
    except (AttributeError, TypeError):
        raise BadInput(
            f"{what} is {shown(value)} of type {type(value).__name__}: give a number."
        ) from None


def _with_roots(text: str) -> Expression | None:
    """Return a number that is written with sqrt(...), + - * / and brackets; None for any other.

    No name but sqrt is known, and nothing is called.
    """

    def value(node: ast.AST) -> Expression:
        match node:
            case ast.Constant(value=int() | float()):
                return to_sympy(_read(ast.get_source_segment(text, node) or "", text))
            case ast.UnaryOp(op=ast.USub()):
                return -value(node.operand)
            case ast.BinOp(op=op) if type(op) in _SUMS:
                return _SUMS[type(op)](value(node.left), value(node.right))
            case ast.Call(func=ast.Name(id="sqrt"), args=[inner], keywords=[]):
                return sympy.sqrt(value(inner))
        raise ValueError

    try:
        return value(ast.parse(text, mode="eval").body) if len(text) <= LONG else None
    except (ValueError, SyntaxError, TypeError):
        return None


def exact_rational(value: Given, what: str) -> Fraction:
    """Return a Fraction, for steps and durations; raises as `exact` does, and if irrational."""
    number = exact(value, what)
    if not isinstance(number, Fraction):
        raise BadInput(
            f"{what} is {shown(value)}: give a fraction or a decimal, nothing irrational."
        )
    return number


def measure(value: Given, what: str) -> Fraction:
    """Return `exact_rational` of a number that is also a double: a time, a tolerance, a length.

    Raises `BadInput` beyond 1e-300 or 1e300, too.
    """
    number = exact_rational(value, what)
    if number and not SMALLEST <= abs(number) <= 1 / SMALLEST:
        raise BadInput(f"{what} is beyond 1e-300 or 1e300: choose units that fit the motion.")
    return number


def whole_number(name: str, value: object, least: int) -> int:
    """Return a count that a user gave; raises `BadInput` for any other value."""
    if type(value) is int and least <= value <= LARGEST_COUNT:
        return value  # the check of all kinds of whole numbers takes longer than a step
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not whole or not least <= value <= LARGEST_COUNT:  # type: ignore[operator]
        raise BadInput(
            f"{name} is {shown(value)}: give a whole number from {least}, "
            "up to 2**53, the last that double precision counts to."
        )
    return int(value)  # type: ignore[call-overload]


def exact_vector(values: GivenVector, length: int, what: str) -> tuple[Exact, ...]:
    """Return a tuple of `length` exact numbers; raises `BadInput` for any other shape."""
    entries = listed(values, length, what)
    return tuple(exact(entry, f"{what}[{i}]") for i, entry in enumerate(entries))


def listed(values: GivenVector, length: int, what: str) -> list[Given]:
    """Return the `length` entries unchanged; raises `BadInput` (naming `what`) otherwise."""
    many = isinstance(values, Iterable) or hasattr(values, "shape")  # also a sympy column
    if isinstance(values, str) or not many or getattr(values, "shape", None) == ():
        raise BadInput(f"{what} is {shown(values)}: give a list of {length} numbers.")
    entries = list(values)
    if len(entries) != length:
        raise BadInput(
            f"{what} has {len(entries)} entries, but {length} are needed: {shown(entries)}."
        )
    return entries


def exact_nested(value: Given | Iterable[Given], what: str) -> Exact | tuple[Exact, ...]:
    """Return numbers, lists and lists of lists of numbers, all exact (tuples for lists)."""
    many = isinstance(value, Iterable) and getattr(value, "shape", None) != ()
    if many and not isinstance(value, str):
        return tuple(exact_nested(entry, f"{what}[{i}]") for i, entry in enumerate(value))
    return exact(value, what)


def exact_matrices(values: Iterable[Rows], what: str) -> tuple[tuple[tuple[Exact, ...], ...], ...]:
    """Return matrices as nested tuples of exact numbers: given as rows, or as numpy's or sympy's.

    Entries may be complex. Raises `BadInput` for anything but a list of matrices of numbers.
    """
    return tuple(
        tuple(
            tuple(_entry(e, f"{at}[{i}, {j}]") for j, e in enumerate(_list(row, at)))
            for i, row in enumerate(_list(matrix, at))
        )
        for at, matrix in ((f"{what}[{k}]", m) for k, m in enumerate(_list(values, what)))
    )


def _list(values: object, what: str) -> list[Any]:
    values = values.tolist() if hasattr(values, "tolist") else values
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise BadInput(
            f"{what} holds {shown(values)} where rows are needed: give a list of matrices, each a "
            "list of rows, such as [[0, -1], [1, 0]]."
        )
    return list(values)


def _entry(value: Given, what: str) -> Exact:
    """Return an exact number, whole ones as int; Python's complex numbers and sympy's stay."""
    if isinstance(value, Complex) and not isinstance(value, Real) and value.imag:
        for part in (value.real, value.imag):
            exact(part, what)
        return complex(value)
    if getattr(value, "is_number", False):
        refuse_unwritten(value, what)
        if value.is_finite and value.is_real is False:
            return value
    number = exact(value.real if isinstance(value, complex) else value, what)
    whole = isinstance(number, Fraction) and number.denominator == 1
    return number.numerator if whole else number


def to_sympy(value: Exact) -> Expression:
    """Return an exact number (from `exact`) as a sympy number."""
    return sympy.Rational(value) if isinstance(value, Fraction) else value


def without_text(answer: Any, what: str) -> Any:
    """Return what a function gave, in the same lists, each text in it as the number that it is.

    Raises `BadInput`, with `what` for its name, for text that is no number: sympy would run it, and
    round "0.3" to the fifteen digits of its floats.
    """
    if isinstance(answer, str):
        try:
            return to_sympy(exact(answer, what))
        except BadInput:
            raise BadInput(
                f'{what} is the text {shown(answer)}: a number may be text, such as "1/10", and a '
                "formula is written without quotes."
            ) from None
    if hasattr(answer, "dtype") and any(isinstance(e, str) for e in answer.flat):
        answer = answer.tolist()
    if isinstance(answer, list | tuple):
        return type(answer)(without_text(e, what) for e in answer)
    return answer


def floats_exact(expression: Expression) -> Expression:
    """Return a sympy expression with each float replaced by its exact binary value.

    Raises a `ValueError` for text: sympy would run it.
    """
    expression = sympy.sympify(expression, strict=True)
    floats = {f: sympy.Rational(f) for f in expression.atoms(sympy.Float)}
    return expression.xreplace(floats) if floats else expression


def flatten(value: Exact | tuple[Exact, ...]) -> list[Exact]:
    """Return the numbers of a nested tuple, in order."""
    return [n for entry in value for n in flatten(entry)] if isinstance(value, tuple) else [value]


#
# A few letters are enough for a number that fills the memory: 10**(10**7), or the factorial of 10⁷.
# Sympy computes one as soon as it stands in a sum or a product, and would never end.


def refuse_long(integers: Iterable[int], what: str) -> None:
    """Raise `BadInput` if one of the integers is longer than Python writes them."""
    _refuse(max((n.bit_length() for n in integers), default=0), what)


def refuse_unwritten(expression: Expression, what: str) -> None:
    """Raise `BadInput` for a number in it that is too long, or would be if it were computed."""
    _refuse(_bits(expression, {})[0], what)


def _refuse(bits: float, what: str, most: int = LARGEST) -> None:
    if bits > most:
        many = f"about {int(bits) * 3 // 10}" if bits < 2**50 else "more than 10¹⁵"
        raise BadInput(
            f"{what} has an exact number of {many} digits, such as a high power of a fraction: "
            "write it as a decimal, or choose units that fit the motion."
        )


def _bits(part: Expression, known: dict[Expression, tuple[float, bool]]) -> tuple[float, bool]:
    """Return (a bound of the bits of the exact numbers in it, True if it is a number itself).

    A sum or a product counts as its longest part. A value above `LARGEST` is not a bound any more.
    """
    if part in known:
        return known[part]
    inner = [_bits(argument, known) for argument in part.args]
    bits = longest = max((b for b, _ in inner), default=0)
    constant = not (part.is_Symbol or any(not told for _, told in inner))
    if part.is_Rational:
        bits = _bits_of(part)
    elif part.is_Float:
        bits = int(part._mpf_[1]).bit_length() + abs(part._mpf_[2])
    elif constant and longest <= LARGEST and inner:
        sizes = [_size(a, b) for a, (b, _) in zip(part.args, inner, strict=True)]
        if part.is_Pow and inner[0][0] > 1:  # its base is at least 2
            bits = max(longest, inner[0][0] * sizes[1])
        elif type(part).__name__ in ("exp", "sinh", "cosh"):
            bits = max(longest, 2 * sizes[0])
        elif type(part).__module__.startswith(_EXACT) and not part.has(sympy.Float):
            bits = max(longest, max(sizes) * longest)  # n! has about n log₂ n
    known[part] = bits, constant
    return known[part]


def _bits_of(number: Expression) -> int:
    return max(int(number.p).bit_length(), int(number.q).bit_length())


def _size(number: Expression, bits: float) -> float:
    """Return a bound of its absolute value."""
    if bits > FLOAT_BITS:
        return math.inf
    if number.is_Float:
        return abs(float(number))
    return abs(int(number.p) / int(number.q)) if number.is_Rational else 2.0**bits


_lock, _watching = Lock(), [0]
_before = list[tuple[type, str, object]]()  # class, name, and its original function


@contextmanager
def short_numbers(what: str) -> Iterator[None]:
    """Raise `BadInput` if the block lets sympy compute a number of more than `LONGEST` bits.

    Powers of numbers, factorials and similar functions are checked before they are computed, by all
    threads while one of them is in such a block. Numbers that Python computes itself are not
    checked.
    """
    with _lock:
        _watching[0] += 1
        if _watching[0] == 1:
            _watch(what)
    try:
        yield
    finally:
        with _lock:
            _watching[0] -= 1
            while _before and not _watching[0]:
                kind, name, own = _before.pop()
                setattr(kind, name, own)


def _watch(what: str) -> None:
    for kind in (sympy.Integer, sympy.Rational):
        _before.append((kind, "_eval_power", kind.__dict__["_eval_power"]))
        kind._eval_power = _power(kind._eval_power, what)
    for kind in (getattr(sympy, name) for name in _COUNTING):
        _before.append((kind, "eval", kind.__dict__["eval"]))
        kind.eval = classmethod(_counting(kind.__dict__["eval"].__func__, what))


def _power(function: Function, what: str) -> Function:
    def power(base: Expression, exponent: Expression) -> Expression | None:
        if exponent.is_Rational and (bits := _bits_of(base)) > 1:
            _refuse(bits * _size(exponent, _bits_of(exponent)), what, LONGEST)
        return function(base, exponent)

    return power


def _counting(function: Function, what: str) -> Function:
    def counting(kind: type, *arguments: Expression) -> Expression | None:
        for number in arguments:
            if getattr(number, "is_Rational", False):
                bits = _bits_of(number)
                _refuse(_size(number, bits) * bits, what, LONGEST)
        return function(kind, *arguments)

    return counting
