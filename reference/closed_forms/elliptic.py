"""Jacobi's functions with their amplitude unwound, and Legendre's integrals for any amplitude.

Parameter m = k^2, 0 <= m < 1. mpmath evaluates the functions on one period, the integrals anywhere.
"""

from __future__ import annotations

from typing import Any

import mpmath


def jacobi(u: Any, m: Any) -> tuple[Any, Any, Any, Any]:
    """Return sn, cn, dn and am of a real u; am grows with u."""
    if m == 0:
        return mpmath.sin(u), mpmath.cos(u), mpmath.mpf(1), u
    half_period = 2 * mpmath.ellipk(m)
    turns = mpmath.nint(u / half_period)
    rest = u - turns * half_period
    sn, cn, dn = (mpmath.re(mpmath.ellipfun(name, rest, m=m)) for name in ("sn", "cn", "dn"))
    flip = -1 if int(turns) % 2 else 1
    return flip * sn, flip * cn, dn, turns * mpmath.pi + mpmath.atan2(sn, cn)


def first_kind(amplitude: Any, m: Any) -> Any:
    """Return F(amplitude | m) for any real amplitude."""
    return mpmath.re(mpmath.ellipf(amplitude, m))


def third_kind(n: Any, amplitude: Any, m: Any) -> Any:
    """Return Pi(n; amplitude | m), the integral of du / (1 - n sn^2 u), for n < 1."""
    return mpmath.re(mpmath.ellippi(n, amplitude, m))
