"""A Lie groupoid near its identities, in local coordinates (paper, section 3.2).

Coordinates (x, u) ∈ Rⁿ×Rᵐ with α(x, u) = x and identities (x, 0). Two maps say everything:

    target    y = b(x, u; h)
    product   (x, u)(y, v) = (x, p(x, u, v; h)),   composable iff y = b(x, u; h)

u is velocity-like: it is scaled by the step h (pair: b = x + hu; group: the element is τ(hu)).
All else is derived here by exact differentiation; a groupoid states what it knows in closed form,
and the laws in the tests compare that with the derived form.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, NamedTuple

from ..errors import BadInput, NoElements
from ..numbers import evaluate_matrix, random_columns, sympy
from ..numbers.types import Column, Expression, FieldPair, Letter, Replacement, SymbolicMatrix
from ..retractions import Extents, Retraction
from .chart_margin import position


class Motion(NamedTuple):
    """The motion of a point z: by ∂z/∂u = A·slope, and along e→ and e← by A·right and A·left.

    A is the anchor, n×k; the others are k×m, and small if A is ρ(z).
    """

    anchor: SymbolicMatrix
    slope: SymbolicMatrix
    right: SymbolicMatrix
    left: SymbolicMatrix


class Groupoid(ABC):
    """The protocol: `dim_x` (n), `dim_u` (m), `target` and `product`; the rest is derived.

    Vectors are sympy column matrices; h is a sympy number or symbol.
    """

    kind: str
    dim_x: int
    dim_u: int
    #: The name of the retraction in use, or None for groupoids that need none.
    retraction: str | None = None
    #: True if u is the difference of places over h: b = x + hu, L = R = 1, and μ is conjugate to x.
    canonical: bool = False
    #: True if target and product, functions of a user, are all that is known of it.
    by_maps: bool = False
    #: The kinds as which rules meet it (`rules.discretisation.GROUPOIDS`), if not `kind` alone.
    kinds: tuple[str, ...] = ()
    #: The factors of a product.
    parts: tuple[Groupoid, ...] = ()
    #: True if a scheme checks the axioms; tests check the closed forms of this package instead.
    by_user: bool = True
    #: The file and line of the user's own map, and what to change if the axioms fail.
    place: str = ""
    fix: str = ""

    @property
    @abstractmethod
    def name(self) -> str:
        """A short name for tables, such as action(so(3))."""

    def __repr__(self) -> str:
        return self.name

    def check(self) -> None:  # noqa: B027 - most have no parts
        """Raise `BadInput` if its parts do not fit each other; `check_axioms` calls this first."""

    @abstractmethod
    def target(self, x: Column, u: Column, h: Expression) -> Column:
        """b(x, u; h), n×1 (paper, section 3.2)."""

    @abstractmethod
    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        """p(x, u, v; h), m×1 (paper, section 3.2)."""

    def element(self, u: Column, h: Expression) -> SymbolicMatrix:
        """The matrix τ(hu), where the groupoid comes from a matrix group; else `NoElements`."""
        raise NoElements(f"{self.name} has no group elements: its arrows are not matrices.")

    def inverse_left(self, x: Column, w: Column, h: Expression) -> SymbolicMatrix:
        """L(x, w; h)⁻¹, m×m: takes dw/dθ of a curve w(θ) in the chart, t = θh, to its velocity ξ.

        In a group ξ is g⁻¹ dg/dt of g(t) = τ(hw(θ)); on pairs dw/dθ itself.
        """
        return self._at(self._inverse_left, x=x, u=w, h=h)

    @cached_property
    def _inverse_left(self) -> SymbolicMatrix:
        s = self.symbols
        return self.L(s["x"], s["u"], s["h"]).inv(method="ADJ").applyfunc(sympy.cancel)

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        """ρ(x) = ∂b/∂u (x, 0; h), n×m (paper, equation rho-L-R); h times the anchor ρ̂."""
        return self._at(self.derived["rho"], x=x, h=h)

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        """L(x, u) = ∂p/∂v (x, u, 0; h), m×m (paper, equation rho-L-R)."""
        return self._at(self.derived["L"], x=x, u=u, h=h)

    def R(self, x: Column, v: Column, h: Expression) -> SymbolicMatrix:
        """R(x, v) = ∂p/∂u (x, 0, v; h), m×m (paper, equation rho-L-R)."""
        return self._at(self.derived["R"], x=x, u=v, h=h)

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        """m matrices; entry [γ][μ, ν] is C^γ_{μν}(x) of [e_μ, e_ν] = C^γ_{μν} e_γ.

        C^γ_{μν} = ∂²p^γ/∂u^μ∂v^ν − ∂²p^γ/∂v^μ∂u^ν at (x, 0, 0) (paper, section 3.2); h times Ĉ.
        """
        return [self._at(c, x=x, h=h) for c in self.derived["C"]]

    def group_parts(self, x: Column, u: Column, h: Expression) -> list[tuple[Any, Column]]:
        """(matrix group, the column ξ of its element) for each group that takes part."""
        return []

    def extents(self, x: Column, u: Column, h: Expression) -> Extents:
        """Return sizes that tell how near an arrow is to each edge (`Retraction.extents`)."""
        return [
            (kind, value)
            for group, xi in self.group_parts(x, u, h)
            for kind, value in group.tau.extents(group.algebra, xi)
            if value.free_symbols
        ]

    @property
    def reach(self) -> float:
        """The size (`extents`) at which a run leaves its chart (`Retraction.reach`)."""
        s = self.symbols
        groups = (group for group, _ in self.group_parts(s["x"], s["u"], s["h"]))
        return min((group.tau.reach(group.algebra) for group in groups), default=math.inf)

    position = position

    def with_retraction(self, retraction: Retraction) -> Groupoid:
        """The groupoid in another retraction's chart; itself where none is used.

        Raises `BadInput` if the retraction does not fit.
        """
        return self

    def inversion(self, x: Column, u: Column, h: Expression) -> Column:
        """ι(x, u) with p(x, u, ι) = 0, m×1: closed form (paper, section 3.2).

        Raises `BadInput` where none could be derived: say `inverse=` then.
        """
        if self._inversion is None:
            raise BadInput(
                f"{self.name}: no closed form of the inversion was found; give it as "
                "inverse=lambda x, u, h: ..."
            )
        return self._at(self._inversion, x=x, u=u, h=h)

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        """b(x, u; h) − x with the difference cancelled, so that nothing is lost at small h."""
        return (self.target(x, u, h) - x).applyfunc(sympy.cancel)

    def point_motion(
        self, x: Column, u: Column, h: Expression, theta: Expression, z: Column
    ) -> Motion:
        """Return the motion of the point z = b(x, u; θh); only the anchor may contain z.

        At the end of the step (θ = 1) e→ and e← move it by 0 and ρ(z), on every groupoid.
        """
        point, one = self.target(x, u, theta * h), sympy.eye(self.dim_x)
        slope, rho = point.jacobian(u), self.rho(z, h)
        if theta == 1:
            return Motion(one, slope, 0 * rho, rho)
        along = point.jacobian(x) * self.rho(x, h)
        return Motion(one, slope, slope * self.R(x, u, h) - along, slope * self.L(x, u, h))

    def displacement_at(self, x: Column, u: Column, h: Expression, theta: Expression) -> FieldPair:
        """Return how e→ and e← displace the fraction θ of the arrow in left trivialisation, m×m
        each.

        c_θ = L(x, θu)⁻¹ (θ (R(x, u) a + L(x, u) c) − R(x, θu) a) for a e→ + c e←: −a at the start,
        c at the end, −(1 − θ)a + θc on pairs. The point b(x, u; θh) is moved by ρ times that.
        """
        one = sympy.eye(self.dim_u)
        if theta in (0, 1):
            return (theta - 1) * one, theta * one
        back, part = self.inverse_left(x, u, theta * h), self.R(x, u, theta * h)
        return back * (theta * self.R(x, u, h) - part), back * theta * self.L(x, u, h)

    @cached_property
    def symbols(self) -> dict[str, Column | Letter]:
        """The letters of derived expressions: columns x (n×1), u and v (m×1), and the step h."""
        lengths = {"x": self.dim_x, "u": self.dim_u, "v": self.dim_u}
        vectors = {
            letter: sympy.Matrix(n, 1, [sympy.Symbol(f"{letter}_{i}", real=True) for i in range(n)])
            for letter, n in lengths.items()
        }
        return {**vectors, "h": sympy.Symbol("h", real=True, nonzero=True)}

    @cached_property
    def derived(self) -> dict[str, SymbolicMatrix | list[SymbolicMatrix]]:
        """ρ, L, R and C by differentiating b and p, in `symbols`; closed forms must equal them."""
        x, u, v, h = (self.symbols[k] for k in ("x", "u", "v", "h"))
        at_u0, at_v0 = dict.fromkeys(u, 0), dict.fromkeys(v, 0)
        b, p = self.target(x, u, h), self.product(x, u, v, h)
        rho = b.jacobian(u).subs(at_u0) if self.dim_x else sympy.zeros(0, self.dim_u)
        p_u, p_v = p.jacobian(u).subs(at_u0), p.jacobian(v).subs(at_v0)
        mixed = [p_v[g, :].jacobian(u).subs(at_u0) for g in range(self.dim_u)]  # [n, m]
        return {
            "rho": rho.applyfunc(sympy.cancel),
            "L": p_v.applyfunc(sympy.cancel),
            "R": p_u.subs(dict(zip(v, u, strict=True))).applyfunc(sympy.cancel),
            "C": [sympy.Matrix(c.T - c).applyfunc(sympy.cancel) for c in mixed],
        }

    @cached_property
    def left_is_identity(self) -> bool:
        """True if L = 1 everywhere, so that velocities are dw/dθ itself."""
        s = self.symbols
        return bool(self.L(s["x"], s["u"], s["h"]) == sympy.eye(self.dim_u))

    @cached_property
    def symmetric_chart(self) -> bool:
        """True if ι = −u + O(u³): (x, −u) is then the inverse to second order.

        Only in such a chart is u at θ = 1/2 the velocity of the middle, so that symmetric rules
        have order 2. With B = ∂²p/∂u∂v at the identity, ι = −u + B(u, u) + …, L = 1 + B(u, ·) + …
        and R = 1 + B(·, u) + …: so L + R has no linear term.
        """
        point = random_columns({"x": self.dim_x, "u": self.dim_u}, small="u")
        x, u, h = point["x"], point["u"] / 10**30, point["h"]
        excess = self.L(x, u, h) + self.R(x, u, h) - 2 * sympy.eye(self.dim_u)
        return all(abs(e) < 10**-40 for e in evaluate_matrix(excess, 100))  # its size is u²

    @cached_property
    def _inversion(self) -> Column | None:
        """Closed form of ι: −u if that solves p = 0, else the solution if p is affine in v."""
        x, u, v, h = (self.symbols[k] for k in ("x", "u", "v", "h"))
        if all(sympy.simplify(entry) == 0 for entry in self.product(x, u, -u, h)):
            return -u
        numerators = self.product(x, u, v, h).applyfunc(lambda e: e.together().as_numer_denom()[0])
        slope = numerators.jacobian(v)
        if slope.free_symbols & set(v) or slope.det() == 0:
            return None
        return slope.LUsolve(-numerators.subs(dict.fromkeys(v, 0))).applyfunc(sympy.cancel)

    def _at(self, expression: SymbolicMatrix, **values: Column | Expression) -> SymbolicMatrix:
        """Put values (vectors or numbers, by the names of `symbols`) into a derived matrix."""
        pairs: Replacement = {}
        for name, value in values.items():
            symbol = self.symbols[name]
            pairs |= {symbol: value} if name == "h" else dict(zip(symbol, value, strict=True))
        return expression.xreplace(pairs) if len(expression) else expression
