"""Kepler's problem by Kepler's equation in the difference of eccentric anomalies D.

With r0 = |x0|, s = x0.v0, the semi-major axis a = 1 / (2/r0 - |v0|^2/k) and the mean motion
n = sqrt(k/|a|^3) (Bate, Mueller, White, Fundamentals of Astrodynamics, section 4.4; Battin, 4.3):

    ellipse    n t = D - (1 - r0/a) sin D + s/sqrt(k a) (1 - cos D)
    hyperbola  n t = (1 - r0/a) sinh D + s/sqrt(-k a) (cosh D - 1) - D

and x = f x0 + g v0, v = f' x0 + g' v0 with Lagrange's coefficients, in any dimension.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, is_zero, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    return v.dot(v) / 2 + p.strength / sympy.sqrt(x.dot(x))


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    """Return True for ellipses and hyperbolas of an attracting centre, without collision."""
    if len(x0) < 2 or sign(p.strength) <= 0 or all(is_zero(a) for a in x0):
        return False
    moment = any(
        not is_zero(x0[i] * v0[j] - x0[j] * v0[i]) for i in range(len(x0)) for j in range(i)
    )
    return moment and not is_zero(_inverse_axis(p, sympy.Matrix(x0), sympy.Matrix(v0)))


def _inverse_axis(p: Any, x0: Any, v0: Any) -> Any:
    return 2 / sympy.sqrt(x0.dot(x0)) - v0.dot(v0) / p.strength


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    exact = _inverse_axis(p, sympy.Matrix(x0), sympy.Matrix(v0))
    closed = sign(exact) > 0
    k, a = number_to_mpf(p.strength), 1 / number_to_mpf(exact)
    x, v = [number_to_mpf(c) for c in x0], [number_to_mpf(c) for c in v0]
    r0 = mpmath.sqrt(mpmath.fdot(x, x))
    size = abs(a)
    n = mpmath.sqrt(k / size**3)
    near, slant = 1 - r0 / a, mpmath.fdot(x, v) / mpmath.sqrt(k * size)
    sin, cos = (mpmath.sin, mpmath.cos) if closed else (mpmath.sinh, mpmath.cosh)
    if closed:
        t = t - mpmath.nint(n * t / (2 * mpmath.pi)) * 2 * mpmath.pi / n

    def mean(d: Any) -> Any:  # n t as a function of D
        if closed:
            return d - near * mpmath.sin(d) + slant * (1 - mpmath.cos(d))
        return near * mpmath.sinh(d) + slant * (mpmath.cosh(d) - 1) - d

    def radius(d: Any) -> Any:  # r / |a|, the derivative of `mean`
        if closed:
            return 1 - near * mpmath.cos(d) + slant * mpmath.sin(d)
        return near * mpmath.cosh(d) + slant * mpmath.sinh(d) - 1

    d = increasing_root(mean, radius, n * t)
    r = size * radius(d)
    bend = 1 - cos(d) if closed else cos(d) - 1
    lag = d - sin(d) if closed else sin(d) - d
    f, g = 1 - size / r0 * bend, t - lag / n
    df, dg = -mpmath.sqrt(k * size) / (r * r0) * sin(d), 1 - size / r * bend
    return Motion(
        [f * b + g * c for b, c in zip(x, v, strict=True)],
        [df * b + dg * c for b, c in zip(x, v, strict=True)],
    )


def increasing_root(function: Callable[[Any], Any], slope: Callable[[Any], Any], goal: Any) -> Any:
    """Return the root of function(d) = goal for an increasing function: a bracket, then Newton."""
    low = high = mpmath.mpf(0)
    width = mpmath.mpf(1)
    while function(high) < goal:
        low, high, width = high, high + width, 2 * width
    while function(low) > goal:
        low, high, width = low - width, low, 2 * width

    def miss(d: Any) -> Any:
        return function(d) - goal

    d = low
    if low < high:
        d = mpmath.findroot(miss, (low, high), solver="anderson", maxsteps=999, verify=False)
    for _ in range(2):  # the remaining error is of the order of the square of the last correction
        d -= miss(d) / slope(d)
    return d


FORM = ClosedForm("kepler", "Kepler's equation", "pair", lagrangian, motion, applies)
