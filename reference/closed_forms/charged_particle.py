"""Charged particle in a uniform magnetic field along axis 3: a helix (Landau, Lifshitz II, 21).

m dv/dt = q v x B in the symmetric gauge: v1 + i v2 turns with exp(-i w t), w = qB/m, and

    x1 + i x2 = x1(0) + i x2(0) + (v1(0) + i v2(0)) (1 - exp(-i w t)) / (i w),    x3 = x3(0) + v3 t.
"""

from __future__ import annotations

from typing import Any

import mpmath

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, is_zero


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    swept = x[0] * v[1] - x[1] * v[0]
    return p.mass * v.dot(v) / 2 + p.charge * p.field * swept / 2


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    return len(x0) in (2, 3) and not is_zero(p.mass) and not is_zero(p.charge * p.field)


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    w = number_to_mpf(p.charge * p.field / p.mass)
    x, v = [number_to_mpf(c) for c in x0], [number_to_mpf(c) for c in v0]
    speed = mpmath.mpc(v[0], v[1])
    turned = speed * mpmath.expj(-w * t)
    place = mpmath.mpc(x[0], x[1]) + (speed - turned) / mpmath.mpc(0, w)
    return Motion(
        [place.real, place.imag, *(a + b * t for a, b in zip(x[2:], v[2:], strict=True))],
        [turned.real, turned.imag, *v[2:]],
    )


FORM = ClosedForm("charged-particle", "a helix", "pair", lagrangian, motion, applies)
