"""Rigorous bounds on the residuals of the polynomials of one Taylor step in the equations.

Each node n of the tape is a polynomial of degree N - 1 on |t| <= H (a state: degree N). Its error r
is the distance to the node's true value along the states' polynomials. The recurrences make the
coefficients of each node's defining relation vanish up to index N - 1, but for rounding, so that

    c = a b       |c~ - a~ b~| <= 4u |a||b| + sum_{i+j >= N} |a_i||b_j| H^{i+j}

in the norm |a| = sum_k |a_k| H^k, and with the errors of the arguments
r_c <= that + |a| r_b + |b| r_a + r_a r_b; the other operations likewise. The defect of the states,
sup |p' - f(p)|, follows from the linear forms of the rates (Corliss, Rihm 1996; Makino, Berz 2003
for such remainders). u = 2^(1 - precision); everything here is rounded up, at 53 bits.

Why 8u is enough (`SLACK`): mpfr rounds each operation to u/2, inner products are summed exactly and
rounded once (fsum), and a constant is within u (`tube` checks it). Most roundings act on one
term in the recurrence of a power: the constant r, k a_k, their product with a coefficient, the sum,
its multiple by r, the difference, k a_0 and the quotient: u + 7u/2 < 5u, with their products of
second order. A linear form adds u/2 for each of its additions, which `form` counts; a state in
Horner's rule has 2N roundings of u/2, and that of the offset, u/2 of the slope.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import accumulate, chain, repeat
from typing import Any

import gmpy2

from ..failures import Unproven
from ..taylor import SeriesProgram, Step
from ..taylor.balls import enclosed, rounded, working
from ..taylor.tape import Linear
from .majorants import Majorant, abs_exact, high, majorant

SLACK = 8  # in units of u: an upper bound of the roundings of one coefficient


@lru_cache(maxsize=4096)
def size_of(factor: Any) -> Any:
    """Return |factor| of an exact number, rounded up."""
    with working():
        return rounded(enclosed(factor).abs_upper())


def finite(bound: Any) -> bool:
    """Return True if the bound is finite."""
    return bool(gmpy2.is_finite(bound))


class Remainders:
    """Errors of all nodes over one step; make and use it in the `upward` context."""

    def __init__(self, program: SeriesProgram, step: Step, order: int, precision: int) -> None:
        self.order = order
        self.unit = gmpy2.mpfr(2) ** (1 - precision)
        size = gmpy2.mpfr(abs_exact(step.size))
        powers = list(accumulate(repeat(size, order), gmpy2.mul, initial=gmpy2.mpfr(1)))
        zero = gmpy2.mpfr(0)
        self.known: list[Majorant] = []
        for series in step.nodes:
            sizes = chain(map(abs, series), repeat(zero, order + 1 - len(series)))
            terms = list(map(gmpy2.mul, sizes, powers))
            self.known.append(majorant(series, terms, step.size))
        for place, operation in enumerate(program.operations):
            n = self.known[place]
            error = self._error(operation, place)
            if not finite(n.norm + error):
                raise Unproven("a series is not finite")
            self.known[place] = replace(n, error=error)

    def form(self, form: Linear) -> Any:
        """Return the error of a computed linear form in nodes, with its rounding and cut-off."""
        total = gmpy2.mpfr(0)
        rounding = (len(form) + SLACK) * self.unit
        for node, factor in form.items():
            if node is None:
                total += rounding * size_of(factor)
                continue
            a = self.known[node]
            total += size_of(factor) * (a.error + rounding * a.norm + a.terms[self.order])
        return total

    def _error(self, operation: tuple[Any, ...], place: int) -> Any:
        kind, n = operation[0], self.known[place]
        if kind == "state":
            return n.error
        if kind == "linear":
            return self.form(dict(operation[1]))
        method = getattr(self, f"_{kind.lower()}", None)
        if method is None:
            raise Unproven(f"there is no remainder of {operation[1]}")
        a = self.known[operation[1]]
        if kind in ("sin", "cos", "sinh", "cosh"):
            mate = self.known[place + (1 if kind in ("sin", "sinh") else -1)]
            return method(n, a, mate)
        if kind == "power":
            return method(n, a, size_of(operation[2]))
        return method(n, a, *(self.known[i] for i in operation[2:]))

    def _residual(self, a: Majorant, b: Majorant) -> Any:
        return SLACK * self.unit * a.norm * b.norm + high(a, b)

    def _times(self, n: Majorant, a: Majorant, b: Majorant) -> Any:
        return self._residual(a, b) + a.norm * b.error + b.norm * a.error + a.error * b.error

    def _square(self, n: Majorant, a: Majorant) -> Any:
        return self._times(n, a, a)

    def _over(self, n: Majorant, a: Majorant, b: Majorant) -> Any:
        """Return a bound of |n - A/B| = |n B - A| / |B|."""
        miss = self._residual(n, b) + SLACK * self.unit * a.norm + a.terms[self.order]
        return (miss + n.norm * b.error + a.error) / b.least()

    def _inverse(self, n: Majorant, a: Majorant) -> Any:
        miss = self._residual(n, a) + SLACK * self.unit
        return (miss + n.norm * a.error) / a.least()

    def _sqrt(self, n: Majorant, a: Majorant) -> Any:
        """Return a bound of |n - sqrt A| = |n^2 - A| / (n + sqrt A)."""
        a.least()
        miss = self._residual(n, n) + SLACK * self.unit * a.norm + a.terms[self.order]
        return (miss + a.error) / n.least()

    def _power(self, n: Majorant, a: Majorant, r: Any) -> Any:
        """Return the bound for n = w a^r with w' = (n' a - r a' n) / a^(r+1)."""
        least = a.least()
        drift = self._residual(n.slopes(), a) + r * self._residual(a.slopes(), n)
        start = SLACK * self.unit * n.norm * (1 + r * abs(gmpy2.log(a.series[0])))
        near = (start + drift / least) * (a.norm / least) ** r
        return near + (n.norm + near) * gmpy2.expm1(r * a.error / least)

    def _exp(self, n: Majorant, a: Majorant) -> Any:
        """Return the bound for n = w exp(a) with w' = (n' - a' n) exp(-a)."""
        drift = SLACK * self.unit * n.norm + self._residual(a.slopes(), n)
        near = drift * gmpy2.exp(2 * a.tails[1])
        return near + (n.norm + near) * gmpy2.expm1(a.error)

    def _sin(self, n: Majorant, a: Majorant, mate: Majorant, growth: Any = 1) -> Any:
        """Return the bound: both errors obey the pair's own linear equations with two residuals."""
        both, slopes = n.norm + mate.norm, a.slopes()
        drift = SLACK * self.unit * both + self._residual(slopes, n) + self._residual(slopes, mate)
        near = drift * growth
        return near + (both + near) * a.error * gmpy2.exp(a.error)

    _cos = _sin

    def _sinh(self, n: Majorant, a: Majorant, mate: Majorant) -> Any:
        return self._sin(n, a, mate, gmpy2.exp(2 * a.tails[1]))

    _cosh = _sinh

    def _abs(self, n: Majorant, a: Majorant) -> Any:
        a.least()
        return a.error + a.terms[self.order]

    def _sign(self, n: Majorant, a: Majorant) -> Any:
        a.least()
        return 0
