"""Mathews and Lakshmanan's oscillator: x = A sin(W t + f), W^2 = w^2 / (1 + l A^2).

The energy is E = (v^2 + w^2 x^2) / (2 (1 + l x^2)) = W^2 A^2 / 2, so W^2 = w^2 - 2 E l
where that is positive (Quart. Appl. Math. 32 (1974), 215).
"""

from __future__ import annotations

from typing import Any

import mpmath

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, sign


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    return (v[0] ** 2 - p.frequency**2 * x[0] ** 2) / (1 + p.curvature * x[0] ** 2) / 2


def _square(p: Any, x0: Numbers, v0: Numbers) -> Any:
    """Return W^2."""
    twice_energy = (v0[0] ** 2 + p.frequency**2 * x0[0] ** 2) / (1 + p.curvature * x0[0] ** 2)
    return p.frequency**2 - p.curvature * twice_energy


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    """Return True if x is on the side of 0 of a pole, and the motion comes back."""
    return sign(1 + p.curvature * x0[0] ** 2) > 0 and sign(_square(p, x0, v0)) > 0


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    rate = mpmath.sqrt(number_to_mpf(_square(p, x0, v0)))
    x, v = number_to_mpf(x0[0]), number_to_mpf(v0[0])
    c, s = mpmath.cos(rate * t), mpmath.sin(rate * t)
    return Motion([x * c + v / rate * s], [v * c - rate * x * s])


FORM = ClosedForm("mathews-lakshmanan", "sine", "pair", lagrangian, motion, applies)
