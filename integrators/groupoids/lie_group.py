"""A matrix Lie group as a groupoid over one point: reduced systems (paper, section 3.6.2)."""

from __future__ import annotations

from functools import cached_property, lru_cache

from ..algebras import MatrixAlgebra
from ..errors import BadInput, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, FieldPair, SymbolicMatrix
from ..retractions import Retraction, cayley
from .groupoid import Groupoid


class RetractionGroupoid(Groupoid):
    """Base of groups and their actions: arrows τ(hu) in the chart of a retraction.

    Raises `BadInput`, when first used, if the retraction does not fit the algebra.
    """

    #: constructor arguments of a subclass after the algebra and the retraction
    further: tuple[object, ...] = ()

    def __init__(self, algebra: MatrixAlgebra, retraction: Retraction) -> None:
        if not isinstance(algebra, MatrixAlgebra):
            raise BadInput(
                f"the algebra is {shown(algebra)}: give so(3), se(3) or a MatrixAlgebra."
            )
        self.algebra, self.tau = algebra, _known(retraction)
        self.dim_u = algebra.dim
        self.retraction, self.by_user = retraction.name, not retraction.proven

    @property
    def _chart(self) -> str:
        """The retraction as part of the name; Cayley is not named."""
        return "" if self.tau is cayley else f", {self.tau.name}"

    @property
    def _fitting(self) -> Retraction:
        """The retraction; raises `BadInput` unless it fits the algebra."""
        self.tau.check(self.algebra)
        return self.tau

    def check(self) -> None:
        """Raise `BadInput` unless the algebra is closed and the retraction fits it."""
        Retraction.check(self.tau, self.algebra)  # also where a user's own asks for less
        self.tau.check(self.algebra)

    def with_retraction(self, retraction: Retraction) -> RetractionGroupoid:
        if _known(retraction) == self.tau:
            return self
        retraction.check(self.algebra)
        return type(self)(self.algebra, retraction, *self.further)

    def group_parts(self, x: Column, u: Column, h: Expression) -> list[tuple[Groupoid, Column]]:
        return [(self, h * u)]

    def element(self, u: Column, h: Expression) -> SymbolicMatrix:
        return self._fitting.element(self.algebra, h * u)

    def displacement(self, u: Column, h: Expression) -> SymbolicMatrix:
        """τ(hu) − e, N×N, with the difference cancelled."""
        return self._fitting.displacement(self.algebra, h * u)

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        return self._fitting.product(self.algebra, h * u, h * v) / h

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        """dτ⁻¹_{hu} ∘ Ad_{τ(hu)}, m×m (paper, section 3.6.2)."""
        return self._at(self._fields[0], u=u, h=h)

    def R(self, x: Column, v: Column, h: Expression) -> SymbolicMatrix:
        """dτ⁻¹_{hu}, m×m (paper, section 3.6.2)."""
        return self._at(self._fields[1], u=v, h=h)

    @cached_property
    def _inverse_left(self) -> SymbolicMatrix:
        s = self.symbols
        return self._fitting.inverse_left_field(self.algebra, s["h"] * s["u"])

    def displacement_at(self, x: Column, u: Column, h: Expression, theta: Expression) -> FieldPair:
        """(lag, lag + lead) of the retraction."""
        if theta in (0, 1):
            return super().displacement_at(x, u, h, theta)
        lag, lead = (self._at(m, u=u, h=h) for m in self._partial(theta))
        return lag, lag + lead

    @lru_cache(maxsize=32)  # noqa: B019 - a handful of groupoids live as long as the program
    def _partial(self, theta: Expression) -> FieldPair:
        """The retraction's lag and lead at θ, in `symbols`."""
        arguments = self.algebra, self.symbols["h"] * self.symbols["u"], theta
        return self._fitting.lag(*arguments), self._fitting.lead(*arguments)

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        """h times the structure constants of the algebra."""
        return [h * c for c in self.algebra.structure_constants]

    @cached_property
    def _fields(self) -> FieldPair:
        s = self.symbols
        return self._fitting.invariant_fields(self.algebra, s["h"] * s["u"])

    @cached_property
    def _inversion(self) -> Column:
        s = self.symbols
        return self.tau.inverse(self.algebra, s["h"] * s["u"]) / s["h"]


def _known(retraction: object) -> Retraction:
    if not isinstance(retraction, Retraction):
        raise BadInput(f"the retraction is {shown(retraction)}: give cayley itself, not its name.")
    return retraction


class LieGroup(RetractionGroupoid):
    """The group of `algebra`; dim_x = 0, and flows on it carry no x."""

    kind = "group"
    dim_x = 0

    @property
    def name(self) -> str:
        return f"group({self.algebra.name}{self._chart})"

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return x

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        """The 0×m matrix: a group has no base to move on."""
        return sympy.zeros(0, self.dim_u)


def lie_group(algebra: MatrixAlgebra, retraction: Retraction = cayley) -> LieGroup:
    """The Lie group of a matrix algebra in the chart of a retraction."""
    return LieGroup(algebra, retraction)
