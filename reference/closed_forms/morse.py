"""Morse's oscillator: e^{ax} = (1 - s cos(W t + f)) / (1 - s^2), s^2 = E/D < 1.

W = a sqrt(2D (1 - s^2) / m).
With y = e^{ax} the energy is m y'^2 / (2 a^2) + D (y - 1)^2 = E y^2, a harmonic motion of y
(Slater, Nature 180 (1957), 1352). Not from rest at y = 1, where s = 0.
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, is_zero, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    return p.mass * v[0] ** 2 / 2 - p.depth * (1 - sympy.exp(-p.width * x[0])) ** 2


def _square(p: Any, x0: Numbers, v0: Numbers) -> Any:
    """Return E/D."""
    return p.mass * v0[0] ** 2 / (2 * p.depth) + (1 - sympy.exp(-p.width * x0[0])) ** 2


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    positive = sign(p.mass) > 0 and sign(p.depth) > 0 and not is_zero(p.width)
    return positive and sign(1 - _square(p, x0, v0)) > 0 and not is_zero(_square(p, x0, v0))


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    square = number_to_mpf(_square(p, x0, v0))
    m, depth, a = (number_to_mpf(e) for e in (p.mass, p.depth, p.width))
    x, v = number_to_mpf(x0[0]), number_to_mpf(v0[0])
    s, rate = mpmath.sqrt(square), a * mpmath.sqrt(2 * depth * (1 - square) / m)
    y = mpmath.exp(a * x)
    phase = mpmath.atan2(a * v * y * (1 - square) / rate, 1 - (1 - square) * y) + rate * t
    y = (1 - s * mpmath.cos(phase)) / (1 - square)
    return Motion([mpmath.log(y) / a], [s * rate * mpmath.sin(phase) / (1 - square) / (a * y)])


FORM = ClosedForm("morse", "cosine of a logarithm", "pair", lagrangian, motion, applies)
