"""A groupoid at a point of the audit: b, p, ι, ρ, L, R, C as numbers, and a discrete Lagrangian.

The paper's formulas are checked on these. L_d is a cubic polynomial in (x, u), dense enough that
nothing vanishes by accident, made so that the arrows g = (x, u) and h = (y, v) solve the discrete
Euler–Lagrange equations exactly: at such a pair everything in section 3.5 can be asked.

A sample may be a *mutant*: one ingredient is off by about 10⁻³⁰. A check that reads an ingredient
has to notice.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

import mpmath
from sympy import Matrix, Rational, eye, zeros

from .cubic import Cubic
from .numbers import columns, number, numbers, slope

OFF = Rational(1, 10**30)


class Sample:
    """One groupoid with numbers x, u, v, w and steps h; `reads` collects what was asked."""

    def __init__(self, groupoid: Any, point: dict[str, Any]) -> None:
        self.g, self.mutant, self.reads, self.original = groupoid, "", set[str](), self
        self.n, self.m = groupoid.dim_x, groupoid.dim_u
        self.known: dict[Any, Any] = {}
        self.x, self.u, self.v, self.w = (point[name] for name in "xuvw")
        self.h = point["h"]
        self.y = numbers(groupoid.target(self.x, self.u, self.h))
        self.o = zeros(self.m, 1)
        self.L_d_ = Cubic(self.n, self.m)
        gap = self.plus(self.x, self.u) - self.minus(self.y, self.v)
        pushed = numbers(self.R(self.y, self.v).T.LUsolve(gap))
        self.L_d_ = self.L_d_.solving(self.u, self.v, pushed)

    def changed(self, mutant: str = "", L_d: Cubic | None = None) -> Sample:
        """A copy with one ingredient wrong, or with another discrete Lagrangian."""
        other = copy(self)
        other.mutant, other.reads, other.L_d_ = mutant, set(), L_d or self.L_d_
        return other

    # -- the structure maps of section 3.2 ------------------------------------------------------

    def b(self, x: Any, u: Any) -> Any:
        """Target, n×1."""
        return self._read("b", self._once(self.g.target, x, u), x, u)

    def p(self, x: Any, u: Any, v: Any) -> Any:
        """Product, m×1."""
        return self._read("p", self._once(self.g.product, x, u, v), x, u, v)

    def iota(self, x: Any, u: Any) -> Any:
        """ι of the inversion, m×1."""
        return self._read("ι", self._once(self.g.inversion, x, u), x, u)

    def rho(self, x: Any) -> Any:
        """ρ, n×m."""
        return self._read("ρ", numbers(self.g.rho(x, self.h)), x)

    def L(self, x: Any, u: Any) -> Any:
        """L, m×m."""
        return self._read("L", self._once(self.g.L, x, u), x, u)

    def R(self, x: Any, u: Any) -> Any:
        """R, m×m."""
        return self._read("R", self._once(self.g.R, x, u), x, u)

    def C(self, x: Any) -> list[Any]:
        """m matrices, entry [γ][μ, ν]."""
        return [self._read("C", numbers(c), x) for c in self.g.structure_functions(x, self.h)]

    def tau(self, xi: Any) -> Any:
        """τ(ξ), N×N, where the groupoid comes from a matrix group."""
        return self._read("τ", numbers(self.g.element(xi / self.h, self.h)), xi)

    # -- the discrete Lagrangian ----------------------------------------------------------------

    def L_d(self, x: Any, u: Any) -> Any:
        return self._read("L_d", Matrix([self.L_d_.value(x, u)]), x, u)[0]

    def d_x(self, x: Any, u: Any) -> Any:
        return self._gradient(x, u)[: self.n, :]

    def d_u(self, x: Any, u: Any) -> Any:
        return self._gradient(x, u)[self.n :, :]

    def d_xu(self, x: Any, u: Any) -> Any:
        """∂²L_d/∂xⁱ∂u^γ in row i, column γ, n×m."""
        return self._hessian(x, u)[: self.n, self.n :]

    def d_uu(self, x: Any, u: Any) -> Any:
        """∂²L_d/∂u^ν∂u^γ, m×m."""
        return self._hessian(x, u)[self.n :, self.n :]

    def _gradient(self, x: Any, u: Any) -> Any:
        return self._read("dL_d", self.L_d_.gradient(x, u), x, u)

    def _hessian(self, x: Any, u: Any) -> Any:
        return self._read("ddL_d", self.L_d_.hessian(x, u), x, u)

    # -- arrows -----------------------------------------------------------------------------------

    def e(self, index: int) -> Any:
        """The unit column of the fibre."""
        return eye(self.m)[:, index]

    def near_unit(self, x: Any, index: int, t: Any) -> tuple[Any, Any]:
        """The curve t ↦ (x, t e_γ) of arrows through the identity at x."""
        return x, t * self.e(index)

    def times(self, g: Any, h: Any) -> tuple[Any, Any]:
        """(x, u)(y, v) = (x, p(x, u, v))."""
        return g[0], self.p(g[0], g[1], h[1])

    def inverse(self, g: Any) -> tuple[Any, Any]:
        """i(x, u) = (b(x, u), ι(x, u))."""
        return self.b(*g), self.iota(*g)

    def pushed_left(self, g: Any, index: int, t: Any) -> tuple[Any, Any]:
        """g·c(t) with c(t) = (β(g), t e_γ): the curve whose velocity is e←_γ(g)."""
        return g[0], self.p(*g, t * self.e(index))

    def pushed_right(self, g: Any, index: int, t: Any) -> tuple[Any, Any]:
        """i(c(t))·g with c(t) = (α(g), t e_γ): the curve whose velocity is −e→_γ(g)."""
        return self.times(self.inverse(self.near_unit(g[0], index, t)), g)

    # -- invariant fields -------------------------------------------------------------------------

    def left(self, x: Any, u: Any) -> Any:
        """e←_γ in column γ, components (δx, δu): (0, L)."""
        return zeros(self.n, self.m).col_join(self.L(x, u))

    def right(self, x: Any, u: Any) -> Any:
        """e→_γ in column γ, components (δx, δu): (−ρ, R)."""
        return (-self.rho(x)).col_join(self.R(x, u))

    def along(self, function: Callable[[Any, Any], Any], field: Any) -> Any:
        """The derivative of a function of arrows at (x, u) along a tangent vector there."""
        dx, du = field[: self.n, :], field[self.n :, :]
        return slope(lambda t: function(self.x + t * dx, self.u + t * du))

    def minus(self, x: Any, u: Any) -> Any:
        """F⁻_γ = −ρ^i_γ ∂L_d/∂x^i + R^μ_γ ∂L_d/∂u^μ, m×1."""
        return self.R(x, u).T * self.d_u(x, u) - self.rho(x).T * self.d_x(x, u)

    def plus(self, x: Any, u: Any) -> Any:
        """F⁺_γ = L^μ_γ ∂L_d/∂u^μ, m×1."""
        return self.L(x, u).T * self.d_u(x, u)

    def FL(self, x: Any, u: Any) -> Any:
        """(FL)^γ_μ in row γ, column μ: −∂F⁻_μ/∂u^γ, by a difference quotient."""
        du = columns(self.m, lambda a: slope(lambda t: self.minus(x, u + t * self.e(a))))
        return -du.T

    # -- making of ------------------------------------------------------------------------------

    def _once(self, function: Callable[..., Any], *columns: Any) -> Any:
        """The numbers of a function of the groupoid, remembered for all rows and all mutants."""
        key = (function.__name__, *(tuple(column) for column in columns))
        if key not in self.known:
            self.known[key] = numbers(function(*columns, self.h))
        return self.known[key]

    def _read(self, name: str, value: Any, *arguments: Any) -> Any:
        """The value, off by a generic amount if this is the mutant's wrong ingredient."""
        if not value.shape[0] * value.shape[1]:
            return value
        self.reads.add(name)
        if name != self.mutant:
            return value
        flat = [entry for argument in arguments for entry in argument]
        weights = [Rational(5 * k + 3, 7 + k) for k in range(len(flat))]
        s = sum(w * entry for w, entry in zip(weights, flat, strict=True))
        wrong = Matrix(*value.shape, lambda i, j: 2 + i + 3 * j + i * j * s + (1 + i) * s**2)
        return value + OFF * wrong


def rank(matrix: Any) -> int:
    """The rank, with singular values below 10⁻⁴⁰ of the largest taken for zero."""
    with mpmath.workdps(120):
        entries = [[mpmath.mpf(e.p) / e.q for e in map(number, row)] for row in matrix.tolist()]
        values = mpmath.svd(mpmath.matrix(entries), compute_uv=False) if entries else []
        return sum(value > max(values) * mpmath.mpf(10) ** -40 for value in values)
