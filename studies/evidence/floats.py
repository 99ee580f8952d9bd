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
from typing import TYPE_CHECKING, Any

import numpy as np

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.numbers import mpmath, sympy
from discmech.integrators.rules import Discretisation

from ..core.single_steps import Floats
from .order import GUARD, NEAR, ComponentOrder, StepError, digits_for, orders

if TYPE_CHECKING:
    from . import Evidence

# a fraction with a longer power of 2 as its denominator is a float that was written or computed
BITS = 30
MOST = 24  # the largest number of floats that are changed
MOVED = Fraction(1, 2**20)  # the relative change of a float: far above its last bit, and small
#: units of its last bit by which a computed float, such as a node of numpy's, may be off
UNITS = 4
#: powers of 10 that multiply an ordinary step, for the longer steps that are tried
LONGER = (-5, -4, -3, -2)


def floats_of(evidence: Evidence, wanted: float) -> Floats:
    """Return the floats of a rule and whether they explain an order of steps below the wanted one.

    evidence: that of the steps, with their order.
    """
    local, scheme = evidence.order, evidence.whole
    place, observer = local.place, _Seen(scheme.rule)
    assert place is not None
    if scheme.rule.method is not None:
        return Floats()
    try:
        evidence.with_rule(observer.rule())
        values = sorted(observer.values)[:MOST]
        if not values:
            return Floats()
        step, digits = Fraction(local.step), digits_for(scheme.order or 2)
        own = end_of(scheme, place, step, digits)
        with mpmath.workdps(digits + GUARD):
            bounds = [mpmath.mpf(0) for _ in own]
            for value in values:
                moved = end_of(evidence.with_rule(observer.rule(value)), place, step, digits)
                for i, (a, b) in enumerate(zip(moved, own, strict=True)):
                    bounds[i] += abs(a - b) * UNITS * MOVED.denominator / mpmath.mpf(2) ** 53
    except (BadInput, StepFailure):
        return Floats()
    low = {c.name for c in local.components if c.place is place and _is_low(c, wanted)}
    explain, size = _explained(evidence, place, step, own, bounds, low)
    explain = explain and _above(evidence, place, step, bounds, wanted)
    unit = float(max(values)) * 2.0**-53
    return Floats(tuple(map(float, values)), explain, max(size, unit))


def _is_low(component: ComponentOrder, wanted: float) -> bool:
    return component.order is not None and component.order < wanted - NEAR


def _explained(
    evidence: Evidence, place: Any, step: Fraction, own: Any, bounds: Sequence[Any], low: set[str]
) -> tuple[bool, float]:
    """Return (True if the components' errors are within their bounds, the largest relative error).

    low: the components whose order is too low; only their bounds count.
    """
    size, explain = 0.0, True
    with mpmath.workdps(digits_for(evidence.whole.order or 2) + GUARD):
        starts = [*np.ravel(place.x), *np.ravel(place.mu)]
        rows = zip(evidence.errors(place, step), own, starts, bounds, strict=True)
        for (name, gap, _), got, start, bound in rows:
            off, moved = abs(gap), abs(got - gap - start)
            explain = explain and (off <= bound or name not in low)
            if moved:
                size = max(size, float(off / moved))
    return explain, size


def _above(
    evidence: Evidence, place: Any, step: Fraction, bounds: Sequence[Any], wanted: float
) -> bool:
    """True if no lower order shows at longer steps, where errors exceed those of the floats."""
    order = evidence.whole.order or 2
    digits = digits_for(order)
    with mpmath.workdps(digits + GUARD):
        parts = [bound * step.denominator / step.numerator for bound in bounds]

    def errors(steps: Sequence[Fraction]) -> list[list[StepError]]:
        return [evidence.errors(place, h) for h in steps]

    for power in LONGER:
        first = place.length / 8 * Fraction(10.0**power)
        steps = first, first * Fraction(3, 10)
        components = orders(order, place, steps, errors, digits, parts, halved=True)
        if any(_is_low(c, wanted) for c in components):
            return False
    return True


def end_of(scheme: Any, place: Any, step: Fraction, digits: int, count: int = 1) -> Any:
    """Return x and μ after so many steps from a place, in the order of components."""
    run = scheme.flow(step, digits).trajectory(count, count, **place.start)
    return np.concatenate([np.ravel(run.x[-1]), np.ravel(run.mu[-1])])


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
        attribute = getattr(self._view, name)
        if name not in ("f", "H", "dH", "B"):
            return attribute
        return lambda *at: attribute(*map(self._changed, at))


def _is_float(number: Any) -> bool:
    """True if a number is one of 53 bits, and no short fraction."""
    exact = sympy.Rational(number)
    q = int(exact.q)
    return q & (q - 1) == 0 and q.bit_length() > BITS
