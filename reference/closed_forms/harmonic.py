"""Harmonic oscillator: x = x0 cos wt + v0/w sin wt, w^2 = stiffness / mass."""

from __future__ import annotations

from typing import Any

import mpmath

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    return p.mass * v[0] ** 2 / 2 - p.stiffness * x[0] ** 2 / 2


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    return sign(p.stiffness / p.mass) > 0


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    w = mpmath.sqrt(number_to_mpf(p.stiffness / p.mass))
    x, v = number_to_mpf(x0[0]), number_to_mpf(v0[0])
    c, s = mpmath.cos(w * t), mpmath.sin(w * t)
    return Motion([x * c + v / w * s], [v * c - w * x * s])


FORM = ClosedForm("harmonic", "cosine and sine", "pair", lagrangian, motion, applies)
