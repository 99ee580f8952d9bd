"""Splittings with a user's own coefficients, of a Lagrangian or of a Hamiltonian.

With φ^A and φ^B the flows of two parts of H,

    … ∘ φ^B_{b_2 h} ∘ φ^A_{a_2 h} ∘ φ^B_{b_1 h} ∘ φ^A_{a_1 h}

is the composition of Φ_h = φ^A_h ∘ φ^B_h and its adjoint with a₁ = β₁, b₁ = β₁ + α₁, a₂ = α₁ + β₂
and so on, and has the same order (McLachlan, SIAM J. Sci. Comput. 16 (1995), 151; Hairer, Lubich,
Wanner, III.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import wraps
from itertools import accumulate

from ..errors import BadInput, arguments_checked, check_function, shown
from ..numbers import to_sympy, working_digits
from ..numbers.types import Column, Exact, Expression, Function, GivenVector, Letter, Mpf
from .composition import described_own, with_own
from .discretisation import Discretisation
from .one_step import DualSystem, OneStepMap
from .order_conditions import OwnNumbers, check_sum, read
from .rectangle import rectangle

PARTS = ("kinetic", "potential")


@dataclass(frozen=True)
class Share:
    """The sum of some of the coefficients; called with digits it returns mpf."""

    own: OwnNumbers
    places: tuple[int, ...]

    def __call__(self, digits: int) -> Mpf:
        with working_digits(digits + 10):
            sizes = self.own(digits)
            return sum(sizes[i] for i in self.places)

    @property
    def exact(self) -> Exact:
        """The sum of the numbers as they were given."""
        return sum((self.own.numbers[i] for i in self.places), Fraction(0))

    def letter(self, s: DualSystem) -> Expression:
        """Return an exact number, or a letter if it was rounded."""
        rounded = any(self.own.rounded[i] for i in self.places)
        return s.constant(self) if rounded else to_sympy(self.exact)


@arguments_checked
def splitting(
    coefficients: GivenVector,
    *,
    parts: Sequence[Function] | None = None,
    first: str = "kinetic",
    order: int | None = None,
    name: str | None = None,
    source: str = "",
) -> Discretisation:
    """Return the splitting with coefficients a₁, b₁, a₂, b₂, …, a's of one part, b's of the other.

    parts: functions (x, mu, p) whose sum is H, for scenes with a Lagrangian or a Hamiltonian: then
    it is an explicit one-step map of their flows, each of which must be a polynomial in h. With
    three parts or more, Φ_h = φ^1_h ∘ … ∘ φ^k_h is composed with its adjoint. Without parts these
    are T and V of L = T(x, v) − V(x), and `first` names the first one, "kinetic" (a drift) or
    "potential" (a kick): a composition of the rectangle rule, which is the splitting itself on a
    pair groupoid with a constant mass matrix, and has its order everywhere. Numbers, order, name
    and source: see `compose`.

    Raises `BadInput` like `compose`, for sums of a's or b's that are not 1, and, when a scheme is
    made, for parts that do not add up to H or whose flow is no polynomial.
    """
    if first not in PARTS:
        raise BadInput(f'splitting: first={shown(first)}; say "kinetic" or "potential".')
    numbers, rounded = read(coefficients, "splitting")
    if len(numbers) < 2:
        raise BadInput("splitting: give at least two coefficients, one of each part.")
    names = PARTS if first == PARTS[0] else PARTS[::-1]
    if parts is not None:
        functions = _functions(parts)
        if first != PARTS[0]:
            raise BadInput("splitting: parts= are taken in their order; leave first= out.")
        names = ("first", "second" if len(functions) == 2 else "last")
    for i, part in enumerate(names):
        check_sum(f"splitting: of the {part} part", numbers[i::2], rounded[i::2])
    if first == "potential":
        numbers, rounded = [Fraction(0), *numbers], [Fraction(0), *rounded]
    # the last coefficient follows from the sums
    sizes = list(accumulate(numbers[:-1], lambda before, total: total - before))
    errors = list(accumulate(rounded[:-1]))
    if len(sizes) % 2:
        sizes, errors = [*sizes, Fraction(0)], [*errors, Fraction(0)]
    own = OwnNumbers(tuple(sizes), tuple(errors), True, 1)
    if parts is None:
        return with_own("splitting", rectangle, own, order, name, source)
    reached = max(1, own.order_over(1))
    label, why = described_own("splitting", own, reached, order, name)
    about = source or f"a splitting of order {reached}" + (f": {why}" if why else "")
    return OneStepMap(label, _formula(functions, own), reached, about)


def _functions(parts: Sequence[Function]) -> tuple[Function, ...]:
    if not isinstance(parts, list | tuple) or len(parts) < 2:
        raise BadInput("splitting: parts= is a list of two or more functions (x, mu, p).")
    for i, part in enumerate(parts):
        check_function(part, f"splitting: part {i + 1}", "(x, mu, p)")
    return tuple(parts)


def _formula(parts: tuple[Function, ...], own: OwnNumbers) -> Function:
    """Return the map, as a function of the module of the first part."""
    legs: list[tuple[int, tuple[int, ...]]] = []  # (part, places of the coefficients)
    for i in range(len(own.numbers)):
        forth = [*range(len(parts))]
        for part in forth if i % 2 == 0 else forth[::-1]:
            if legs and legs[-1][0] == part:
                legs[-1] = part, (*legs[-1][1], i)
            else:
                legs.append((part, (i,)))
    shares = [(part, Share(own, places)) for part, places in legs]

    @wraps(parts[0])
    def formula(s: DualSystem, z: Column, h: Letter) -> Column:
        s.check_parts(parts)
        for part, share in shares:
            if share.exact:
                z = s.flow(parts[part], z, share.letter(s) * h)
        return z

    del formula.__dict__["__wrapped__"]
    return formula
