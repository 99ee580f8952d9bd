"""A rule with letters for its irrational and its open numbers, and what is said of the others.

The step is derived once in these letters, and evaluated at their images in a field.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, wraps
from types import SimpleNamespace
from typing import Any

from discmech.integrators import BadInput, Discretisation
from discmech.integrators.equations import written
from discmech.integrators.errors import CannotMeasure, at_line
from discmech.integrators.numbers import floats_exact, sympy
from discmech.integrators.numbers.types import Expression

from .constants import Algebraic, Open

#: a fraction with such a power of two as its denominator was written as a float
BINARY = 2**20


@dataclass
class Told:
    """What was seen in the formula of a rule: open numbers, floats, and how it asks for L.

    taken: the most derivatives of L in it, infinite where they are not known; places: the (x, v) at
    which it asks, in its letters.
    """

    open: list[str] = field(default_factory=list)
    floats: list[Any] = field(default_factory=list)
    taken: float = 0
    places: list[Any] = field(default_factory=list)

    @property
    def notes(self) -> list[str]:
        """Sentences on floats."""
        few = [f"{float(e)!r} is {e}" for e in self.floats[:3]]
        said = "floats in the rule have their exact binary values: " + ", ".join(few)
        return [said + ("." if len(self.floats) <= 3 else ", …")] if few else []


def lettered(rule: Discretisation, told: Told) -> Discretisation:
    """Return the rule with letters (`constants`) for its numbers; told: gets what is seen.

    Raises `BadInput`, when it is called, for a rule that gives another value each time.
    """
    if rule.method is not None:
        return replace(rule, base=lettered(rule.base, told))  # type: ignore[call-arg, attr-defined]
    formula, free = rule.formula, rule.parameters
    names = [name for name in free if name in inspect.signature(formula).parameters]

    @wraps(formula)
    def with_letters(first: Any, *rest: Any) -> Any:
        # a rule asks its second argument, the groupoid, for letters, and a map the system
        constant = (first if not hasattr(rest[0], "constant") else rest[0]).constant
        symbols = {name: sympy.Symbol(name, real=True) for name in names}
        own = {name: sympy.Symbol(name, real=True) for name in free}
        first.parameters = SimpleNamespace(**own)  # those of a class are no scene's

        def letters(e: Any) -> Expression:
            return _lettered(e, constant, free, told, rest[-1 - (rule.stages > 0)])

        if hasattr(first, "df"):  # a map's system: H is any function, no polynomial
            first.df, first.degree = _watched(type(first).df, first, told), None
            # the numbers of the states at which it is asked
            first.letters = lambda z: type(first).letters(first, map(letters, z))
        value, again = formula(first, *rest, **symbols), formula(first, *rest, **symbols)
        if value != again:
            raise BadInput(
                f"{at_line(formula)}{rule.name} gives another value each time it is called: write "
                "it without random numbers."
            )
        value = _each(value, letters)
        if hasattr(first, "potential"):
            told.taken, places = _asked(formula, first, rest, symbols)
            told.places = [_each(e, letters) for e in places]
        return value

    with_letters.told = told  # type: ignore[attr-defined]
    return replace(rule, formula=with_letters, parameters=())


def _watched(method: Callable[..., Any], of: Any, told: Told) -> Callable[..., Any]:
    """Return a method that tells when it is called."""

    def called(*arguments: Any) -> Any:
        told.taken = max(told.taken, 1)
        return method(of, *arguments)

    return called


class _AnyLagrangian:
    """A Lagrangian without a formula: what a rule differentiates stays a derivative of it.

    To look for its terms fails.
    """

    def __init__(self, of: Any) -> None:
        self.s, self.parameters = of.s, of.parameters

    def __call__(self, x: Any, u: Any) -> Expression:
        return _without_formula("L")(*x, *u)

    def fast(self, x: Any) -> Expression:
        return _without_formula("fast")(*x)

    def potential(self, x: Any) -> Expression:
        return -self(x, 0 * self.s.u)

    def gradient(self, x: Any) -> Any:
        return sympy.Matrix([_without_formula(f"gradient {i}")(*x) for i in range(len(self.s.u))])

    def mass(self, x: Any) -> Any:
        from discmech.integrators.equations.mass import Mass

        m = len(self.s.u)
        return Mass(m, m, lambda i, j: _without_formula(f"mass {i} {j}")(*x))


@cache
def _without_formula(name: str) -> Any:
    """Return a function of which nothing is known; who looks for its terms gets an error."""
    function = sympy.Function(f"{name} of a proof", real=True)
    for asked in ("_eval_expand_basic", "coeff", "as_poly", "has", "find", "is_polynomial"):
        setattr(function, asked, _no_terms)
    return function


def _no_terms(*_: Any, **__: Any) -> Any:
    raise NotImplementedError


def _asked(
    formula: Callable[..., Any], of: Any, rest: Any, symbols: Any
) -> tuple[float, list[Any]]:
    """Return the most derivatives of L in a rule, and the columns (x, v) at which it asks for L.

    The number is infinite if the rule needs the formula of L.
    """
    s, n, places = of.s, len(of.s.x), dict[Any, None]()
    m = range(len(s.u))
    known: dict[str, Any] = {
        "L": lambda *a: s.lagrangian_at(sympy.Matrix(a[:n]), sympy.Matrix(a[n:])),
        "fast": lambda *x: s.fast_at(sympy.Matrix(x)),
    }
    slopes: dict[str, Any] = {
        f"gradient {i}": lambda *x, i=i: of.part("gradient", sympy.Matrix(x))[i] for i in m
    }
    curved: dict[str, Any] = {
        f"mass {i} {j}": lambda *x, i=i, j=j: of.part("mass", sympy.Matrix(x))[i, j]
        for i in m
        for j in m
    }
    known |= slopes | curved

    def look(e: Any, swap: dict[Any, Any]) -> None:
        """Note the arguments of L in e; swap: the values of letters that are bound there."""
        if isinstance(e, sympy.Subs):
            for part in e.point:
                look(part, swap)
            point = [part.xreplace(swap) for part in e.point]
            look(e.expr, swap | dict(zip(e.variables, point, strict=True)))
            return
        if any(isinstance(e, _without_formula(name)) for name in known):
            still = any(isinstance(e, _without_formula(name)) for name in (*slopes, *curved))
            at = [part.xreplace(swap) for part in e.args] + [sympy.Integer(0) for _ in m if still]
            for name, value in known.items():
                at = [part.replace(_without_formula(name), value).doit() for part in at]
            at = [floats_exact(written(part)) for part in [*at, *s.u][: n + len(s.u)]]
            places[tuple(at)] = None
        for part in e.args:
            look(part, swap)

    try:
        value = sympy.sympify(formula(_AnyLagrangian(of), *rest, **symbols)).doit()
        taken = max((_depth(e) for e in value.atoms(sympy.Derivative)), default=0)
        for several, own in ((curved, 2), (slopes, 1)):
            if any(value.has(_without_formula(name)) for name in several):
                taken += own  # at least as many as there are
                break
        look(value, {})
        return float(taken), [*places]
    except Exception:  # a rule may do anything with an expression, as look for its factors
        return float("inf"), []


def _depth(e: Any) -> Any:
    return e.derivative_count + max(map(_depth, e.expr.atoms(sympy.Derivative)), default=0)


def _each(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return the value of a rule, or the columns of a map, with each expression changed."""
    if isinstance(value, list | tuple):
        return type(value)(_each(e, change) for e in value)
    return value.applyfunc(change) if hasattr(value, "applyfunc") else change(value)


def _lettered(
    e: Any, constant: Callable[..., Any], names: tuple[str, ...], told: Told, h: Any
) -> Expression:
    try:
        e = sympy.sympify(e, strict=True)
        parts = sympy.preorder_traversal(e)
    except (sympy.SympifyError, TypeError, AttributeError):
        return e  # the bench says what is wrong with it
    swap: dict[Any, Any] = {}
    for part in parts:
        if part in swap:
            parts.skip()
        elif isinstance(part, sympy.Symbol):
            if part.name in names or part.is_real is None:
                told.open += [part.name] * (part.name not in told.open)
                swap[part] = constant(Open(part.name))
        elif not _is_analytic(part, h):
            raise CannotMeasure(f"{str(part)[:60]} is no rational function of the state and h")
        elif part.is_Rational or part.is_Float:
            number = sympy.Rational(part)
            if number.q >= BINARY and number.q & (number.q - 1) == 0 and number not in told.floats:
                told.floats.append(number)
        elif hasattr(part, "written_out"):
            continue  # an answer, even if it is a number
        elif getattr(part, "is_number", False) and part.is_finite and part.is_real:
            swap[part] = constant(Algebraic(part))
            parts.skip()
    return e.xreplace(swap) if swap else e


def _is_analytic(e: Any, h: Any) -> bool:
    """Return False for a root of letters, unless it is one of h alone and not 0 there, and for a
    size or a sign: a field has none, or takes one of two."""
    if e.is_Pow and e.exp.is_Rational and not e.exp.is_Integer and e.base.free_symbols:
        return e.base.free_symbols == {h} and e.base.subs(h, 0) != 0
    of_signs = (sympy.Abs, sympy.sign, sympy.Max, sympy.Min, sympy.Piecewise, sympy.Heaviside)
    return not isinstance(e, of_signs) or not e.free_symbols
