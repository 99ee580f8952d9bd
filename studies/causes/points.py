"""The mean of the points at which a rule evaluates L: order 2 needs it in the middle of the step.

With L_d = h Σ b_i L(b(x, u; θ_i h), u), Σ b_i = 1, and θ̄ = Σ b_i θ_i, the midpoint's velocity is u
up to O(h²), so L_d = L_d^E + h² (θ̄ − 1/2) ∂l/∂x·ρ(x)u + O(h³).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.equations import answers_of
from discmech.integrators.numbers import sympy

MEANT = 1000  # largest denominator of a fraction that somebody may write as a float: 0.333 for 1/3


def mean_of_points(scheme: Scheme) -> str:
    """Return θ̄ of such a rule as 1/3 or 0.5774, or "" for another rule and without x."""
    s, of = scheme.s, scheme.discrete.of
    if not of.weighted or not len(s.x):
        return ""
    whole = mean = sympy.Integer(0)
    for weight, call in of.asked:
        point, velocity = call.args[: len(s.x)], call.args[len(s.x) :]
        fraction, share = _fraction(s, of.G, point), of.resolved(weight) / s.h
        if fraction is None or tuple(velocity) != tuple(s.u) or not share.is_number:
            return ""
        whole, mean = whole + share, mean + share * fraction
    return _meant(mean) if _meant(whole) == "1" else ""


def sum_of_weights(scheme: Scheme) -> str:
    """Return Σ b_i of a rule h Σ b_i L(…) as 1 or 9/10, or "" for any other."""
    of = scheme.discrete.of
    if not of.weighted:
        return ""
    whole = sum((of.resolved(weight) / scheme.s.h for weight, _ in of.asked), sympy.Integer(0))
    return _meant(whole) if whole.is_number else ""


def _meant(number: Any) -> str:
    """Return the fraction with a small denominator that equals it up to round-off, or decimals."""
    value = Fraction(str(number.evalf(30)))
    near = value.limit_denominator(MEANT)
    if abs(value - near) <= 2.0**-52:
        return str(near)
    # near a simple fraction, but not equal to it
    beside = abs(value - value.limit_denominator(12)) < 1e-4
    return f"{float(value):.12g}" if beside else f"{float(value):.4g}"


def _fraction(s: Any, seen: Any, point: Sequence[Any]) -> Any:
    """Return θ of a point b(x, u; θh), on pairs also of x + θhu; None for any other point."""
    if tuple(point) == tuple(s.x):
        return 0
    rest = answers_of(point, seen.Target)
    if rest is not None and tuple(rest[:-1]) == (*s.x, *s.u):
        shares = {rest[-1] / s.h}
    elif s.groupoid.canonical and len(point) == len(s.u):
        shares = {((e - x) / (s.h * u)).expand() for e, x, u in zip(point, s.x, s.u, strict=True)}
    else:
        return None
    return shares.pop() if len(shares) == 1 and all(e.is_number for e in shares) else None
