"""Free rigid body: angular velocity by Jacobi's functions, attitude by the third integral.

Axes are ordered so that axis 3 is the one that the momentum circles (an odd order reverses the
sign of the axial vector). Then with 2T = w.Iw and M = |Iw| (Landau and Lifshitz, Mechanics,
section 37; Whittaker, Analytical Dynamics, section 69):

    w1 = a1 cn u,  w2 = s2 a2 sn u,  w3 = s3 a3 dn u,   u = p t + u0,
    p^2 = (I3 - I2)(M^2 - 2T I1) / (I1 I2 I3),
    m = (I2 - I1)(2T I3 - M^2) / ((I3 - I2)(M^2 - 2T I1)),

and on the separatrix M^2 = 2T I2 the same with sech, tanh, sech. The body's axis 3 turns about the
fixed momentum with the rate M/I3 + M (I3 - I1)/(I1 I3) / (1 - n sn^2 u),
n = I3 (I1 - I2) / (I1 (I3 - I2)) <= 0, an elliptic integral of the third kind.
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .elliptic import first_kind, jacobi, third_kind
from .form import ClosedForm, Motion, Numbers, is_zero, sign
from .rotations import cross, momentum_frame, rotation


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    if len(p.inertia) != 3:
        raise TypeError("three moments of inertia")
    return sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2


def basis() -> tuple[Any, ...]:
    """Return so(3) with the hat map: hat(a) b = a x b."""
    return tuple(sympy.Matrix(3, 3, lambda i, j, g=g: -sympy.LeviCivita(g, i, j)) for g in range(3))


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    return all(sign(moment) > 0 for moment in p.inertia)


def axis_order(moments: list[Any], v0: Numbers) -> tuple[int, int, int]:
    """Return the axes (1, 2, 3) of the formulas; equal moments first."""
    first, middle, last = sorted(range(3), key=lambda i: moments[i].evalf(60))
    if is_zero(moments[middle] - moments[last]):
        return last, middle, first
    energy = sum(moments[i] * v0[i] ** 2 for i in range(3))
    square = sum((moments[i] * v0[i]) ** 2 for i in range(3))
    if is_zero(moments[middle] - moments[first]) or sign(square - energy * moments[middle]) >= 0:
        return first, middle, last
    return last, middle, first


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    moments = [moment for moment in p.inertia]
    start = [number_to_mpf(value) for value in v0]
    torque = cross([moments[i] * v0[i] for i in range(3)], list(v0))
    if all(is_zero(component) for component in torque):
        return Motion([], start, rotation([t * value for value in start]))
    order = axis_order(moments, v0)
    parity = 1 if order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1
    w, turned = _ordered_motion([moments[i] for i in order], [parity * v0[i] for i in order], t)
    velocity, attitude = [mpmath.mpf(0)] * 3, mpmath.matrix(3, 3)
    for a, i in enumerate(order):
        velocity[i] = parity * w[a]
        for b, j in enumerate(order):
            attitude[i, j] = turned[a, b]
    return Motion([], velocity, attitude)


def _ordered_motion(moments: list[Any], v0: list[Any], t: Any) -> tuple[list[Any], Any]:
    """Return angular velocity and attitude if axis 3 is the circled one and nothing is steady."""
    exact_energy = sum(i * w**2 for i, w in zip(moments, v0, strict=True))
    exact_square = sum((i * w) ** 2 for i, w in zip(moments, v0, strict=True))
    separatrix = is_zero(exact_square - exact_energy * moments[1])
    low, high = exact_square - exact_energy * moments[0], exact_energy * moments[2] - exact_square
    i1, i2, i3 = (number_to_mpf(moment) for moment in moments)
    w1, w2, w3 = (number_to_mpf(w) for w in v0)
    total, below, above = (number_to_mpf(q) for q in (exact_square, low, high))
    momentum = mpmath.sqrt(total)
    a1 = mpmath.sqrt(above / (i1 * (i3 - i1)))
    a2 = mpmath.sqrt(above / (i2 * (i3 - i2)))
    a3 = mpmath.sqrt(below / (i3 * (i3 - i1)))
    p = mpmath.sqrt((i3 - i2) * below / (i1 * i2 * i3))
    n = i3 * (i1 - i2) / (i1 * (i3 - i2))
    s3 = -1 if w3 < 0 else 1
    s1 = -1 if separatrix and w1 < 0 else 1
    s2 = s1 * s3 * (1 if i3 > i2 else -1)
    if separatrix:
        u0 = mpmath.asinh(s2 * (w2 / a2) * (s1 * a1 / w1))
        u = u0 + p * t
        sn, cn = mpmath.tanh(u), 1 / mpmath.cosh(u)
        dn = cn
        integral = _separatrix_integral(n, u) - _separatrix_integral(n, u0)
    else:
        m = (i2 - i1) * above / ((i3 - i2) * below)
        phase = mpmath.atan2(s2 * w2 / a2, w1 / a1)
        u0 = first_kind(phase, m)
        u = u0 + p * t
        sn, cn, dn, amplitude = jacobi(u, m)
        integral = third_kind(n, amplitude, m) - third_kind(n, phase, m) if n else u - u0
    velocity = [s1 * a1 * cn, s2 * a2 * sn, s3 * a3 * dn]
    angle = momentum * t / i3 + momentum * (i3 - i1) / (i1 * i3) * integral / p
    before = momentum_frame([i1 * w1, i2 * w2, i3 * w3])
    after = momentum_frame([i * w for i, w in zip((i1, i2, i3), velocity, strict=True)])
    turn = rotation([mpmath.mpf(0), mpmath.mpf(0), angle])
    return velocity, before.T * turn * after


def _separatrix_integral(n: Any, u: Any) -> Any:
    """Return the integral of du / (1 - n tanh^2 u), n < 0."""
    root = mpmath.sqrt(-n)
    return (u + root * mpmath.atan(root * mpmath.tanh(u))) / (1 - n)


FORM = ClosedForm(
    "rigid-body", "Jacobi's elliptic functions", "group", lagrangian, motion, applies, basis,
    attitude=True,
)  # fmt: skip
