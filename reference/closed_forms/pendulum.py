"""Plane pendulum by Jacobi's elliptic functions, in all its regimes.

With w^2 = g/l and m = (v0^2 / (2 w^2) + 1 - cos x0) / 2, the energy over that of the separatrix
(Landau and Lifshitz, Mechanics, section 11; DLMF 22.19(i)):

    m < 1  libration    sin(x/2) = k sn(u | m),    v = 2 k w cn(u | m),        u = u0 + w t
    m = 1  separatrix   sin(x/2) = tanh u,         v = 2 s w / cosh u,         u = u0 + s w t
    m > 1  rotation     x/2 = s am(u | 1/m),       v = 2 s k w dn(u | 1/m),    u = u0 + k w t

k = sqrt(m), s the sign of v0; angles are continuous (not reduced to one turn).
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .elliptic import first_kind, jacobi
from .form import ClosedForm, Motion, Numbers, is_zero, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    kinetic = p.mass * p.length**2 * v[0] ** 2 / 2
    return kinetic + p.mass * p.gravity * p.length * sympy.cos(x[0])


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    return sign(p.gravity / p.length) > 0


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    square = p.gravity / p.length
    exact_m = (v0[0] ** 2 / (2 * square) + 1 - sympy.cos(x0[0])) / 2
    angle, speed = number_to_mpf(x0[0]), number_to_mpf(v0[0])
    if is_zero(sympy.sin(x0[0])) and v0[0] == 0:  # at rest, hanging or upright
        return Motion([angle], [speed])
    w, m = mpmath.sqrt(number_to_mpf(square)), number_to_mpf(exact_m)
    k, s = mpmath.sqrt(m), sign(v0[0])
    regime = sign(exact_m - 1)
    if regime > 0:
        u = first_kind(s * angle / 2, 1 / m) + k * w * t
        _, _, dn, am = jacobi(u, 1 / m)
        return Motion([2 * s * am], [2 * s * k * w * dn])
    turns = mpmath.nint(angle / (2 * mpmath.pi))
    half = angle / 2 - turns * mpmath.pi
    if regime == 0:
        u = mpmath.asinh(mpmath.tan(half)) + s * w * t
        x = 2 * mpmath.atan(mpmath.sinh(u))
        return Motion([x + 2 * turns * mpmath.pi], [2 * s * w / mpmath.cosh(u)])
    phase = mpmath.atan2(mpmath.sin(half) / k, speed / (2 * k * w))
    sn, cn, dn, _ = jacobi(first_kind(phase, m) + w * t, m)
    x = 2 * mpmath.atan2(k * sn, dn)
    return Motion([x + 2 * turns * mpmath.pi], [2 * k * w * cn])


FORM = ClosedForm("pendulum", "Jacobi's elliptic functions", "pair", lagrangian, motion, applies)
