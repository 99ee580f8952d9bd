"""Symmetric heavy top I = (A, A, C), centre on axis 3: nutation, precession and spin.

With G = (vertical, in the body) of length g, W its weight, s = O3 constant, M = mu.G and the energy
E, the height z = G3 solves (Whittaker, Analytical Dynamics, sections 71 and 72; Goldstein 5.7)

    z'^2 = (g^2 - z^2)(2E - C s^2 - 2 W z)/A - (M - C s z)^2/A^2 = (2W/A)(z - z1)(z2 - z)(z3 - z),
    z = z1 + (z2 - z1) sn^2 u,    u = u0 + k t,  k^2 = W (z3 - z1)/(2A),  m = (z2 - z1)/(z3 - z1).

With the integrals of the third kind P of 1/(g - z) and Q of 1/(g + z) over time, a = (M - C s g)/2
and b = -(M + C s g)/2, the phases of G1 + i G2 in the body and of axis 3 about the vertical move by

    (C/A - 1) s t + (a P + b Q)/A       and       (a P - b Q)/A

(derived here from G' = G x O, which gives (log(G1 + i G2))' = -i s + i z (O1 + i O2)/(G1 + i G2)).
The equations keep their form under G -> -G, W -> -W: a hanging top is an upright one. The spherical
pendulum is the spherical top A = C.
"""

from __future__ import annotations

from typing import Any

import mpmath

from ..equations import number_to_mpf
from .elliptic import first_kind, jacobi, third_kind
from .form import ClosedForm, Motion, Numbers, is_zero, sign
from .rigid_body import basis
from .rotations import cross, rotation


def lagrange_top(x: Any, v: Any, p: Any) -> Any:
    """Return the Lagrangian of the scene lagrange-top."""
    if len(p.inertia) != 3 or not is_zero(p.inertia[0] - p.inertia[1]):
        raise TypeError("two equal moments of inertia")
    if not (is_zero(p.center[0]) and is_zero(p.center[1])):
        raise TypeError("a centre of mass on the third axis")
    kinetic = sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2
    return kinetic - p.weight * x.dot(p.center)


def spherical_pendulum(x: Any, v: Any, p: Any) -> Any:
    """Return the Lagrangian of the scene spherical-pendulum."""
    return p.mass * p.length**2 * v.dot(v) / 2 - p.mass * p.gravity * p.length * x[2]


def _top(p: Any) -> tuple[Any, Any, Any]:
    """Return A, C, W of either scene, exact."""
    if hasattr(p, "center"):
        return p.inertia[0], p.inertia[2], p.weight * p.center[2]
    return p.mass * p.length**2, p.mass * p.length**2, p.mass * p.gravity * p.length


def _cubic(p: Any, x0: Numbers, v0: Numbers) -> tuple[Any, list[Any]]:
    """Return g^2 and the coefficients of z'^2, highest first: exact, for W > 0."""
    a, c, w = _top(p)
    if sign(w) < 0:
        x0, w = [-x for x in x0], -w
    square, s = sum(x**2 for x in x0), v0[2]
    moment = a * (x0[0] * v0[0] + x0[1] * v0[1]) + c * x0[2] * s
    energy = (a * (v0[0] ** 2 + v0[1] ** 2)) / a + 2 * w * x0[2] / a  # (2E - C s^2)/A
    return square, [
        2 * w / a,
        -energy - (c * s / a) ** 2,
        -2 * w * square / a + 2 * moment * c * s / a**2,
        energy * square - (moment / a) ** 2,
    ]


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    """Return True for all but the plane motions through a pole, and the homoclinic one."""
    a, c, w = _top(p)
    if sign(a) <= 0 or sign(c) <= 0 or is_zero(w) or (is_zero(x0[0]) and is_zero(x0[1])):
        return False
    square, _ = _cubic(p, x0, v0)
    moment = a * (x0[0] * v0[0] + x0[1] * v0[1]) + c * x0[2] * v0[2]
    # A pole may be reached for M = +-C s g. For any other M the cubic is negative at both poles, so
    # that z3 > g, and z1 = z2 is a steady precession.
    return not is_zero(moment**2 - (c * v0[2]) ** 2 * square)


def _steady(p: Any, x0: Numbers, v0: Numbers) -> bool:
    """Return True if z is constant: z' = 0 and z'' = 0 at the start."""
    _, _, w = _top(p)
    z = x0[2] if sign(w) > 0 else -x0[2]
    _, (k3, k2, k1, _) = _cubic(p, x0, v0)
    return is_zero(x0[0] * v0[1] - x0[1] * v0[0]) and is_zero(3 * k3 * z**2 + 2 * k2 * z + k1)


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    flip = sign(_top(p)[2])
    a, c, w = (number_to_mpf(value) for value in _top(p))
    w = abs(w)
    start = [flip * number_to_mpf(x) for x in x0]
    spin = [number_to_mpf(o) for o in v0]
    exact_square, exact = _cubic(p, x0, v0)
    g, s, z0 = mpmath.sqrt(number_to_mpf(exact_square)), spin[2], start[2]
    moment = a * (start[0] * spin[0] + start[1] * spin[1]) + c * s * z0
    rising = sign(flip * (x0[0] * v0[1] - x0[1] * v0[0]))
    z, rate, over, under = _nutation(
        [number_to_mpf(k) for k in exact], z0, rising, g, w / a, t, _steady(p, x0, v0)
    )
    up, down = (moment - c * s * g) / 2, -(moment + c * s * g) / 2
    phase = (c / a - 1) * s * t + (up * over + down * under) / a
    precession = (up * over - down * under) / a
    across = mpmath.sqrt(g**2 - z**2)
    level = mpmath.mpc(start[0], start[1])
    level *= mpmath.expj(phase) * across / abs(level)
    turning = level * mpmath.mpc((moment - c * s * z) / a, rate) / across**2
    vertical = [level.real, level.imag, z]
    return Motion(
        [flip * component for component in vertical],
        [turning.real, turning.imag, s],
        _attitude(start, vertical, precession),
    )


def _nutation(
    cubic: list[Any], z0: Any, rising: int, g: Any, ratio: Any, t: Any, steady: bool
) -> tuple[Any, Any, Any, Any]:
    """Return z, z' and the integrals of 1/(g - z) and 1/(g + z) from 0 to t; ratio = W/A."""
    if steady:
        return z0, mpmath.mpf(0), t / (g - z0), t / (g + z0)
    with mpmath.extradps(15):
        roots = mpmath.polyroots(cubic, maxsteps=500, extraprec=4 * mpmath.mp.prec)
        low, high, far = sorted(mpmath.re(root) for root in roots)
    k, m = mpmath.sqrt(ratio * (far - low) / 2), (high - low) / (far - low)
    below, above = (mpmath.sqrt(max(d, mpmath.mpf(0))) for d in (z0 - low, high - z0))
    if rising == 0:  # exactly a turning point
        below, above = (0, 1) if below < above else (1, 0)
    phi = mpmath.atan2(below, above) * (-1 if rising < 0 else 1)
    sn, cn, dn, amplitude = jacobi(first_kind(phi, m) + k * t, m)
    z = low + (high - low) * sn**2

    def integral(distance: Any, n: Any) -> Any:
        return (third_kind(n, amplitude, m) - third_kind(n, phi, m)) / (k * distance)

    return (
        z,
        2 * (high - low) * k * sn * cn * dn,
        integral(g - low, (high - low) / (g - low)),
        integral(g + low, -(high - low) / (g + low)),
    )


def _attitude(before: list[Any], after: list[Any], precession: Any) -> Any:
    """Return the rotation A with before = A after; axis 3 moves by the angle about the vertical.

    Horizontal-axial frames: rows (level, node, axis 3) in the body, and their images in space.
    """
    g = mpmath.sqrt(mpmath.fdot(before, before))

    def frame(vertical: list[Any]) -> Any:
        across = mpmath.hypot(vertical[0], vertical[1])
        level = [vertical[0] / across, vertical[1] / across, mpmath.mpf(0)]
        axis = [mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(1)]
        return mpmath.matrix([level, cross(axis, level), axis])

    def leaned(z: Any) -> Any:
        """Return level, node and axis in the frame (away, node, vertical) of space."""
        cos, sin = z / g, mpmath.sqrt(1 - (z / g) ** 2)
        return mpmath.matrix([[-cos, 0, sin], [0, -1, 0], [sin, 0, cos]])

    turn = rotation([mpmath.mpf(0), mpmath.mpf(0), precession])
    space = frame(before).T * leaned(before[2]).T  # from (away, node, vertical) at 0 to space
    return space * turn * leaned(after[2]) * frame(after)


FORM = ClosedForm(
    "lagrange-top", "elliptic functions and integrals of the third kind", "action",
    lagrange_top, motion, applies, basis, attitude=True,
)  # fmt: skip
PENDULUM = ClosedForm(
    "spherical-pendulum", FORM.formula, "action", spherical_pendulum, motion, applies, basis,
    attitude=True,
)  # fmt: skip
