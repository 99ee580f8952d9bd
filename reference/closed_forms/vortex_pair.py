"""Two point vortices: they turn round their centre of vorticity (Kirchhoff 1876, lecture 20).

With strengths g1, g2 at a distance d the rate is (g1 + g2)/(2 pi d^2); where g1 + g2 = 0 they go
straight on.
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from .form import ClosedForm, Motion, Numbers, is_zero


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    g, k = p.strengths
    square = (x[0] - x[2]) ** 2 + (x[1] - x[3]) ** 2
    return g * x[1] * v[0] + k * x[3] * v[2] + g * k * sympy.log(square) / (4 * sympy.pi)


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    return len(x0) == 4 and not is_zero(p.strengths[0] + p.strengths[1])


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    g, k = (number_to_mpf(e) for e in p.strengths)
    x = [number_to_mpf(e) for e in x0]
    first, second = mpmath.mpc(*x[:2]), mpmath.mpc(*x[2:])
    centre = (g * first + k * second) / (g + k)
    rate = (g + k) / (2 * mpmath.pi * abs(first - second) ** 2)
    arms = [(e - centre) * mpmath.expj(rate * t) for e in (first, second)]
    places = [centre + arm for arm in arms]
    speeds = [mpmath.mpc(0, rate) * arm for arm in arms]
    return Motion(
        [e for z in places for e in (z.real, z.imag)], [e for z in speeds for e in (z.real, z.imag)]
    )


FORM = ClosedForm("vortex-pair", "a rotation", "pair", lagrangian, motion, applies)
