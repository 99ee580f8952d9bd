"""Section 3.5 against the bench: what `Scheme` derives for the same discrete Lagrangian."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, lru_cache
from typing import Any

from sympy import zeros

from discmech.integrators import Scene, Scheme, rectangle

from .curves import W_by_curves, minus_by_curve, plus_by_curve
from .numbers import numbers
from .rows import Claim, checked, same
from .sample import Sample
from .section_3_equations import FL_by_formula, euler_lagrange_side


@checked(
    "3.5-bench",
    r"`Scheme` derives this $\lambda$, $F^-$, $F^+$, $FL$, $W$ and $\Omega$ for the same $L_d$",
)
def derived_by_the_bench(s: Sample) -> Iterator[Claim]:
    g, other, derive = (s.x, s.u), (s.y, s.w), bench_of(s)
    minus = [minus_by_curve(s, g, a) for a in range(s.m)]
    plus = [plus_by_curve(s, g, a) for a in range(s.m)]
    W, zero = W_by_curves(s, *g), zeros(s.m)
    yield same("residual", derive("residual"), euler_lagrange_side(s, g, other))
    yield same("legendre_minus", derive("legendre_minus"), minus)
    yield same("legendre_plus", derive("legendre_plus"), plus)
    yield same("FL", derive("FL"), FL_by_formula(s, *g))
    yield same("W", derive("W"), W)
    omega = zero.row_join(W).col_join((-W.T).row_join(zero))
    yield same("omega", derive("omega"), omega)


def bench_of(s: Sample) -> Any:
    """A function that gives a part of the scheme as numbers, at (x, u) and v = w.

    A mutant has the scheme of what it is a mutant of.
    """
    return _bench_of(s.original)


@lru_cache(maxsize=64)
def _bench_of(s: Sample) -> Any:
    general = s.L_d_

    def discrete_lagrangian(x: Any, u: Any, h: Any, p: Any) -> Any:
        return general.value(x, u)

    start = {"x0": [0] * s.n, "v0": [0] * s.m}
    scene = Scene("audit", s.g, discrete_lagrangian=discrete_lagrangian, **start)
    of = Scheme(scene, rectangle)
    pairs = {of.h: s.h}
    for letters, values in ((of.x, s.x), (of.u, s.u), (of.v, s.w)):
        pairs |= dict(zip(letters, values, strict=True))

    @cache
    def derive(part: str) -> Any:
        return numbers(getattr(of, part).xreplace(pairs))

    return derive
