"""Judge whether the floats of a rule explain an order that is too low.

1/6 as a float is off by 9e-18. With 50 digits a method with it is inconsistent, by the fault of the
float and not of the method: double precision never shows it. Each float is changed, and a step
measured again, which shows how its last bits change every component. An error that the last bits of
all floats together can reach is explained by them; a larger one has another cause.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from discmech.integrators import BadInput, Scheme, StepFailure
from discmech.integrators.numbers import mpmath, sympy
from discmech.integrators.rules import Discretisation
from discmech.reference import surroundings

from ..core.single_steps import Floats
from .order import GUARD, NEAR, ComponentOrder, LocalOrder, at_place, digits_for, names_of
from .places import Place

# a fraction with a longer power of 2 as its denominator is a float that was written or computed
BITS = 30
MOST = 24  # the largest number of floats that are changed
MOVED = Fraction(1, 2**20)  # the relative change of a float: far above its last bit, and small
#: units of its last bit by which a computed float, such as a node of numpy's, may be off
UNITS = 4
#: powers of 10 that multiply an ordinary step, for the longer steps that are tried
LONGER = (-5, -4, -3, -2)


def floats_of(scheme: Scheme, local: LocalOrder, wanted: float) -> Floats:
    """Return the floats of a rule and whether they explain an order below the wanted one.

    local: the order that single steps show.
    """
    place = local.place
    assert place is not None
    found = _Seen(scheme.rule)
    if scheme.rule.method is not None:
        return Floats()
    try:
        Scheme(scheme.scene, found.rule())
        values = sorted(found.values)[:MOST]
        if not values:
            return Floats()
        digits = digits_for(scheme.order or 2)
        step = Fraction(local.step)
        own = _end(scheme, place, step, digits)
        with mpmath.workdps(digits + GUARD):
            bounds = [mpmath.mpf(0) for _ in own]
            for value in values:
                moved = _end(Scheme(scheme.scene, found.rule(value)), place, step, digits)
                for i, (a, b) in enumerate(zip(moved, own, strict=True)):
                    bounds[i] += abs(a - b) * UNITS * MOVED.denominator / mpmath.mpf(2) ** 53
    except (BadInput, StepFailure):
        return Floats()
    low = {c.name for c in local.components if c.place is place and _is_low(c, wanted)}
    explain, size = _explained(scheme, place, step, digits, own, bounds, low)
    explain = explain and _above(scheme, place, step, bounds, wanted)
    unit = float(max(values)) * 2.0**-53
    return Floats(tuple(map(float, values)), explain, max(size, unit))


def _is_low(component: ComponentOrder, wanted: float) -> bool:
    return component.order is not None and component.order < wanted - NEAR


def _explained(
    scheme: Scheme, place: Place, step: Fraction, digits: int, own: Sequence[Any],
    bounds: Sequence[Any], low: set[str],
) -> tuple[bool, float]:  # fmt: skip
    """Return (True if the components' errors are within their bounds, the largest relative error).

    low: the components whose order is too low; only their bounds count.
    """
    (exact,) = surroundings(scheme.scene).after(place.x, place.u, place.t, [step], digits + GUARD)
    size, explain = 0.0, True
    with mpmath.workdps(digits + GUARD):
        before, after = [*place.x, *place.mu], [*exact.x, *exact.mu]
        rows = zip(names_of(exact), own, after, before, bounds, strict=True)
        for name, got, wanted, start, bound in rows:
            off, moved = abs(got - wanted), abs(wanted - start)
            explain = explain and (off <= bound or name not in low)
            if moved:
                size = max(size, float(off / moved))
    return explain, size


def _above(
    scheme: Scheme, place: Place, step: Fraction, bounds: Sequence[Any], wanted: float
) -> bool:
    """True if no lower order shows at longer steps, where errors exceed those of the floats."""
    digits = digits_for(scheme.order or 2)
    with mpmath.workdps(digits + GUARD):
        parts = [bound * step.denominator / step.numerator for bound in bounds]
    for power in LONGER:
        first = place.length / 8 * Fraction(10.0**power)
        flows = [scheme.flow(h, digits) for h in (first, first * Fraction(3, 10))]
        found = at_place(scheme, place, flows, digits, parts, halved=True)
        if any(_is_low(c, wanted) for c in found):
            return False
    return True


def _end(scheme: Scheme, place: Place, step: Fraction, digits: int) -> list[Any]:
    run = scheme.flow(step, digits).trajectory(1, **place.start)
    return [*run.x[-1], *run.mu[-1]]


class _Seen:
    """A rule that records the floats it makes, or has one of them changed."""

    def __init__(self, rule: Discretisation) -> None:
        self.given, self.values = rule, set[sympy.Rational]()

    def rule(self, moved: Any = None) -> Discretisation:
        """Return the rule with one float changed by `MOVED` of it; without one it records all."""

        def changed(expression: Any) -> Any:
            if isinstance(expression, tuple | list):
                return type(expression)(map(changed, expression))
            if hasattr(expression, "applyfunc"):
                return expression.applyfunc(changed)
            if not hasattr(expression, "atoms"):
                expression = sympy.sympify(expression)
            numbers = expression.atoms(sympy.Number)
            long = {e: sympy.Rational(e) for e in numbers if _is_float(e)}
            self.values |= {abs(e) for e in long.values()}
            factor = 1 + sympy.Rational(MOVED.numerator, MOVED.denominator)
            return expression.xreplace(
                {e: r * factor if abs(r) == moved else r for e, r in long.items()}
            )

        formula = self.given.formula

        def plain(*arguments: Any) -> Any:
            first, *others = arguments
            if not self.given.asks_lagrangian:
                first = _Asked(first, changed)
            return changed(formula(first, *others))

        plain.__name__ = getattr(formula, "__name__", "formula")
        return replace(self.given, formula=plain)


class _Asked:
    """The view that a map receives, with the floats in its calls changed."""

    def __init__(self, view: Any, changed: Callable[[Any], Any]) -> None:
        self._view, self._changed = view, changed

    def __getattr__(self, name: str) -> Any:
        given = getattr(self._view, name)
        if name not in ("f", "H", "dH", "B"):
            return given
        return lambda *at: given(*map(self._changed, at))


def _is_float(number: Any) -> bool:
    """True if a number is one of 53 bits, and no short fraction."""
    exact = sympy.Rational(number)
    q = int(exact.q)
    return q & (q - 1) == 0 and q.bit_length() > BITS
