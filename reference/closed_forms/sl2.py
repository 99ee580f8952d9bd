"""Geodesics of SL(2) with a diagonal left-invariant metric (a, b, c): Jacobi's functions.

In the basis [e0, e1] = 2 e1, [e0, e2] = -2 e2, [e1, e2] = e0 and with w = a v0,

    X = sqrt(b) v1 - sqrt(c) v2,    Y = sqrt(b) v1 + sqrt(c) v2,
    w' = -2 X Y,  X' = p w Y,  Y' = q w X,    p = 2/a - 1/sqrt(bc),  q = 2/a + 1/sqrt(bc),

Euler's equations in disguise, with the integrals F = X^2 + p w^2/2 and G = Y^2 + q w^2/2
(derived here). For p > 0 all is bounded; if q F < p G, with l^2 = 2 p G and m = q F / (p G),

    w = -s sqrt(2F/p) sn u,  X = sqrt(F) cn u,  Y = s sqrt(G) dn u,    u = u0 + l t,  s = sign Y;

if q F > p G, X and Y change places; if they are equal, sn, cn, dn become tanh, sech, sech.
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .elliptic import first_kind, jacobi
from .form import ClosedForm, Motion, Numbers, is_zero, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    if len(p.inertia) != 3:
        raise TypeError("three coefficients")
    return sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2


def basis() -> tuple[Any, ...]:
    """Return the diagonal matrix, then E12 and E21."""
    return tuple(sympy.Matrix(e) for e in ([[1, 0], [0, -1]], [[0, 1], [0, 0]], [[0, 0], [1, 0]]))


def _constants(p: Any, v0: Numbers) -> tuple[Any, Any, Any, Any, Any, Any, Any]:
    """Return p, q, w, X, Y at the start, F, G: exact."""
    a, b, c = p.inertia
    root = 1 / sympy.sqrt(b * c)
    slow, fast = 2 / a - root, 2 / a + root
    w = a * v0[0]
    x, y = (sympy.sqrt(b) * v0[1] + k * sympy.sqrt(c) * v0[2] for k in (-1, 1))
    return slow, fast, w, x, y, x**2 + slow * w**2 / 2, y**2 + fast * w**2 / 2


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    """Return True for bounded motions that are not at rest."""
    if not all(sign(moment) > 0 for moment in p.inertia):
        return False
    slow, _, w, x, y, _, _ = _constants(p, v0)
    return sign(slow) > 0 and sum(map(is_zero, (w, x, y))) < 2


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    exact = _constants(p, v0)
    slow, fast, w, x, y, f, g = map(number_to_mpf, exact)
    regime = sign(exact[0] * exact[6] - exact[1] * exact[5])
    if regime >= 0:
        w, x, y = _ordered(slow, w, x, y, f, g, regime, fast, t)
    else:
        w, y, x = _ordered(fast, w, y, x, g, f, -regime, slow, t)
    a, b, c = map(number_to_mpf, p.inertia)
    return Motion([], [w / a, (y + x) / (2 * mpmath.sqrt(b)), (y - x) / (2 * mpmath.sqrt(c))])


def _ordered(
    p: Any, w: Any, x: Any, y: Any, f: Any, g: Any, regime: int, q: Any, t: Any
) -> tuple[Any, Any, Any]:
    """Return w, X, Y at t if Y never vanishes (or, for regime 0, only in the limit)."""
    s = -1 if y < 0 else 1
    top, speed = mpmath.sqrt(2 * f / p), mpmath.sqrt(2 * p * g)
    if regime == 0:  # X and Y vanish together: sech has no sign of its own
        k = -1 if x < 0 else 1
        u = mpmath.atanh(-s * k * w / top) + speed * t
        sn, cn, dn = mpmath.tanh(u), k / mpmath.cosh(u), 1 / mpmath.cosh(u)
        return -s * k * top * sn, mpmath.sqrt(f) * cn, s * mpmath.sqrt(g) * dn
    m = q * f / (p * g)
    u = first_kind(mpmath.atan2(-s * w / top, x / mpmath.sqrt(f)), m) + speed * t
    sn, cn, dn, _ = jacobi(u, m)
    return -s * top * sn, mpmath.sqrt(f) * cn, s * mpmath.sqrt(g) * dn


FORM = ClosedForm("sl2", "Jacobi's elliptic functions", "group", lagrangian, motion, applies, basis)
