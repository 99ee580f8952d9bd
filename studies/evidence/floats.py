"""Judge whether the floats of a rule explain an order that is too low.

1/6 as a float is off by 9e-18. With 50 digits a method with it is inconsistent, by the fault of the
float and not of the method: double precision never shows it. Each float is changed, and a step
measured again, which shows how its last bits change every component. An error that the last bits of
all floats together can reach is explained by them; a larger one has another cause. So has a power
of the step that is too low and larger than these bits make it, as by weights of nine digits.
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

from ..core.limits import OF_ORDER
from ..core.single_steps import Floats
from .order import GUARD, NEAR, PART, ComponentOrder, LocalOrder, digits_for

if TYPE_CHECKING:
    from . import Evidence

# a fraction with a longer power of 2 as its denominator is a float that was written or computed
BITS = 30
MOST = 24  # the largest number of floats that are changed
MOVED = Fraction(1, 2**20)  # the relative change of a float: far above its last bit, and small
#: units of its last bit by which a computed float, such as a node of numpy's, may be off
UNITS = 4
#: an error is taken for so many powers of the step beyond the wanted one: what further ones leave
#: in the lower ones is a product of nearly all steps, 10⁻³⁰ of the error and less
SPARE = 16
LEAST = 2.0**-80  # far above that, and far below what the last bit of a float makes


def floats_of(evidence: Evidence, wanted: float) -> tuple[Floats, LocalOrder | None]:
    """Return the floats of a rule and whether they explain an order of steps below the wanted one.

    evidence: that of the steps, with their order. The second result is one that is too low at
    longer steps too, where floats would explain the shorter ones; or None.
    """
    local, scheme = evidence.order, evidence.whole
    place, observer = local.place, _Seen(scheme.rule)
    assert place is not None
    if scheme.rule.method is not None:
        return Floats(), None
    try:
        evidence.with_rule(observer.rule())
        values = sorted(observer.values)[:MOST]
        if not values:
            return Floats(), None
        step, digits = Fraction(local.step), digits_for(scheme.order or 2)
        moved = [evidence.with_rule(observer.rule(value)) for value in values]
        own, changes = _changed(scheme, moved, place, step, digits)
        low = {c.name for c in local.components if c.place is place and _is_low(c, wanted)}
        lower, factors = _lower(evidence, place, moved, round(wanted))
        with mpmath.workdps(digits + GUARD):
            share = mpmath.mpf(float(step)) / mpmath.mpf(float(place.length))
            of_order = share ** np.arange(round(wanted) + 1, len(factors) + 1)
            expected = of_order @ factors[round(wanted) :]
            bounds = abs(changes).sum(axis=0)
        explain, size = _explained(evidence, place, step, own, expected, bounds, low)
    except (BadInput, StepFailure):
        return Floats(), None
    size = max(size, float(max(values)) * 2.0**-53)
    return Floats(tuple(map(float, values)), explain and lower is None, size), lower


def _is_low(component: ComponentOrder, wanted: float) -> bool:
    return component.order is not None and component.order < wanted - NEAR


def _explained(
    evidence: Evidence, place: Any, step: Fraction, own: Any, expected: Sequence[Any],
    bounds: Sequence[Any], low: set[str],
) -> tuple[bool, float]:  # fmt: skip
    """Return (True if the components' errors are within their bounds, the largest relative error).

    expected: what powers of the wanted order and higher ones leave of each. low: the components
    whose order is too low; only their bounds count.
    """
    size, explain = 0.0, True
    with mpmath.workdps(digits_for(evidence.whole.order or 2) + GUARD):
        starts = [*np.ravel(place.x), *np.ravel(place.mu)]
        rows = zip(evidence.errors(place, step), own, starts, expected, bounds, strict=True)
        for (name, gap, _), got, start, part, bound in rows:
            off, moved = abs(gap), abs(got - gap - start)
            explain = explain and (abs(gap - part) <= bound or name not in low)
            if moved:
                size = max(size, float(off / moved))
    return explain, size


def _changed(
    scheme: Any, moved: Sequence[Any], place: Any, step: Fraction, digits: int
) -> tuple[Any, Any]:
    """Return the end of a step and what the last bits of each float change of it, mpf (r, k)."""
    own = end_of(scheme, place, step, digits)
    with mpmath.workdps(digits + GUARD):
        part = UNITS * MOVED.denominator / mpmath.mpf(2) ** 53
        return own, np.array([part * (end_of(one, place, step, digits) - own) for one in moved])


def _lower(
    evidence: Evidence, place: Any, moved: Sequence[Any], wanted: int
) -> tuple[LocalOrder | None, Any]:
    """Return (the order below the wanted one that exceeds what the rounding of floats makes; the
    factors of the powers of the step over the place's length, from the first power on, (k, c)).

    An error is a sum of powers of the step, whose factors follow from as many steps, and so is what
    a moved float changes. The first is None if coefficients that are printed with 14 digits may
    have that part in every power that is too low.
    """
    whole, digits = evidence.whole, digits_for(evidence.whole.order or 2)
    steps = [place.length * PART / 2**k for k in range(wanted + SPARE)]
    rows = [evidence.errors(place, h) for h in steps]
    ends = [_changed(whole, moved, place, h, digits)[1] for h in steps]
    with mpmath.workdps(digits + GUARD):
        shares = [mpmath.mpf(float(PART)) / 2**k for k in range(len(steps))]
        table = mpmath.matrix([[t ** (j + 1) for j in range(len(steps))] for t in shares])
        powers = np.array((table**-1).tolist())
        factors, unsure = (of(powers) @ np.array([[each[k] for each in row] for row in rows])
                           for k, of in ((1, np.array), (2, abs)))  # fmt: skip
        of_floats = sum(abs(powers @ change) for change in np.swapaxes(ends, 0, 1))
        bounds = OF_ORDER["floats: printed"] * of_floats + unsure
        bounds = np.maximum(bounds, LEAST * abs(factors[wanted]))
        beyond = np.array(abs(factors[:wanted]) / (bounds[:wanted] + mpmath.eps**2), dtype=float)
    lower = np.flatnonzero((beyond > 1).any(axis=1))
    if not len(lower):
        return None, factors
    name = rows[0][int(beyond[lower[0]].argmax())][0]
    return LocalOrder(float(lower[0]), name, float(steps[0]), place), factors


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


#: what a map asks for at states, in whose expressions floats may be
_ASKED = (
    "f", "df", "H", "dH", "B", "force", "xi", "theta", "dtheta", "act", "chart_velocity",
    "coadjoint",
)  # fmt: skip


class _Asked:
    """The view that a map receives, with the floats in its calls changed."""

    def __init__(self, view: Any, changed: Callable[[Any], Any]) -> None:
        self._view, self._changed = view, changed

    def __getattr__(self, name: str) -> Any:
        attribute = getattr(self._view, name)
        if name not in _ASKED:
            return attribute
        return lambda *at: attribute(*map(self._changed, at))


def _is_float(number: Any) -> bool:
    """True if a number is one of 53 bits, and no short fraction."""
    exact = sympy.Rational(number)
    q = int(exact.q)
    return q & (q - 1) == 0 and q.bit_length() > BITS
