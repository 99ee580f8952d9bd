"""The trace of a rule's exact step on the oscillator as a rational function of w = (hω)².

A rule that is made of finitely many arithmetic operations has such a trace. Then every point of an
interval of stability is known, not only those of a grid: its ends are roots of polynomials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

from discmech.integrators.numbers import LazyModule, mpmath

#: digits of the traces: a continued fraction loses about two per point, and polynomials of degree
#: 40 are evaluated from z = 1/20 to 1000
DIGITS = 300
MOST = 96  # points after which a trace counts as no rational function
CHECKS = 3  # further points at which the function has to agree
AGREE = 1e-40
TOUCH = 1e-20  # two roots with a smaller relative distance are one double root

# the sign between two roots is taken at this share, which no rule's fractions meet
INSIDE = 0.381966

flint: Any = LazyModule("flint")
polynomials: Any = LazyModule("numpy.polynomial")
Trace = Callable[[Fraction], Any]


@dataclass(frozen=True)
class StableSet:
    """Open intervals of z = hω where |tr M| > 2, and the z where it only touches 2, to `farthest`.

    At a touched point the step is a half or a whole turn, with M = ∓1 or a shear: forces that the
    oscillator does not have may open an interval there.
    """

    unstable: list[tuple[float, float]]
    touched: list[float]


def stable_set(trace: Trace, farthest: float) -> StableSet | None:
    """Return the set for every z ≤ farthest, from tr M(z) at exact z to `DIGITS`.

    None if no rational function of z² is found; `CHECKS` further points have to confirm it to 40
    digits.
    """
    quotient = rational(trace)
    if quotient is None:
        return None
    above, below = quotient

    def unstable_at(w: Any) -> bool:
        return bool(abs(above(w)) > 2 * abs(below(w)))

    with mpmath.workdps(DIGITS):
        roots = [w for two in (2, -2) for w in _positive_roots(above + two * below)]
        # at a pole of the trace |tr| > 2 on both sides, so it is no end
        crossings, touched = _apart(sorted(roots), farthest)
        most = mpmath.mpf(farthest) ** 2
        edges = [mpmath.mpf(0), *crossings, most]
        intervals: list[list[Any]] = []
        for a, b in pairwise(edges):
            if not unstable_at(a + INSIDE * (b - a)):
                continue
            if intervals and intervals[-1][1] == a:
                intervals[-1][1] = b
            else:
                intervals.append([a, b])
        return StableSet(
            [(float(mpmath.sqrt(a)), float(mpmath.sqrt(b))) for a, b in intervals],
            [float(mpmath.sqrt(w)) for w in touched],
        )


def rational(trace: Trace) -> tuple[Any, Any] | None:
    """Return the polynomials (P, Q) with tr M(z) = P(z²)/Q(z²), or None.

    They are found by Thiele's continued fraction in w = z², from points in no order of size.
    """
    with mpmath.workdps(DIGITS):
        points: list[Any] = []
        rows: list[Any] = []  # the fraction's coefficients

        def value(w: Any) -> Any:
            total = rows[-1]
            for a, at in zip(reversed(rows[:-1]), reversed(points[: len(rows) - 1]), strict=True):
                total = a + (w - at) / total
            return total

        agreed = 0
        for k in range(MOST):
            z = Fraction(20_000 ** (((k * 37) % MOST) / MOST)) / 20  # to 1000, in no order
            w, wanted = mpmath.mpf(z.numerator) ** 2 / z.denominator**2, trace(z)
            if rows and abs(value(w) - wanted) <= AGREE * (1 + abs(wanted)):
                agreed += 1
                if agreed == CHECKS:
                    return _polynomials(points, rows)
                continue
            agreed, inverse = 0, wanted
            for a, at in zip(rows, points, strict=True):
                if inverse == a:
                    break  # this point adds nothing at this depth
                inverse = (w - at) / (inverse - a)
            else:
                points.append(w)
                rows.append(inverse)
    return None


def _polynomials(points: list[Any], rows: list[Any]) -> tuple[Any, Any]:
    Polynomial, one = polynomials.Polynomial, mpmath.mpf(1)
    above, below = Polynomial([rows[-1]]), Polynomial([one])
    for a, at in zip(reversed(rows[:-1]), reversed(points[: len(rows) - 1]), strict=True):
        # a + (w − at) below/above
        above, below = Polynomial([-at, one]) * below + a * above, above
    size = max(map(abs, below.coef))
    return above / size, below / size


def _positive_roots(polynomial: Any) -> list[Any]:
    """Return the positive real roots with multiplicity; round-off may split a double one."""
    with mpmath.workdps(DIGITS), flint.ctx.workprec(128):  # more bits than a double's
        size = max(map(abs, polynomial.coef)) or mpmath.mpf(1)
        # the remainder of a coefficient that vanishes only makes a root at 0 or far away
        whole = flint.fmpz_poly([int(mpmath.nint(e / size * 10**DIGITS)) for e in polynomial.coef])
        if whole.degree() < 1:
            return []
        roots = []
        for root, times in whole.complex_roots():
            real, imaginary = (_number(e) for e in (root.real, root.imag))
            if real > 0 and abs(imaginary) <= mpmath.sqrt(TOUCH) * real:
                roots += [real] * times
        return roots


def _number(ball: Any) -> Any:
    mantissa, exponent = ball.mid().man_exp()
    return mpmath.ldexp(mpmath.mpf(int(mantissa)), int(exponent))


def _apart(roots: list[Any], farthest: float) -> tuple[list[Any], list[Any]]:
    """Return (roots at which the sign changes, double roots), below farthest²."""
    crossed: list[Any] = []
    touched: list[Any] = []
    for w in roots:
        if w > farthest**2 or w < 1e-20:
            continue
        if crossed and abs(w - crossed[-1]) <= mpmath.sqrt(TOUCH) * w:
            touched.append(crossed.pop())
        else:
            crossed.append(w)
    return crossed, touched
