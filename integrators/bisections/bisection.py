"""Local bisections of a groupoid and their translations in numbers (paper, section 4.1).

A local bisection through (x₀, u₀) is given by its section of α, linear in the base:

    Σ_α(x) = (x, σ(x)),   σ(x) = u₀ + S (x − x₀)

S = 0, the constant section, serves pair (translations of the base), groups (the element), actions
and products: there it is a bisection wherever the chart reaches. In general S comes from the
existence proof: the graph of S must be a complement of ker Tα, which every graph is, and of ker Tβ.
Translations act on arrows near the identities:

    L_Σ(x, u) = (z, p(z, σ(z), u))  with  b(z, σ(z)) = x,      R_Σ(x, u) = (x, p(x, u, σ(b(x, u))))
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any

import numpy as np

from ..errors import BadInput, shown
from ..geometry import vector_in
from ..groupoids import Groupoid
from ..numbers import (
    Arithmetic,
    LazyModule,
    arithmetic,
    exact_rational,
    jacobian,
    newton,
    numeric_function,
    numeric_text,
)
from ..numbers.types import Function, Given, GivenVector, Matrix, Number, Numbers, Vector

linalg = LazyModule("scipy.linalg")

#: an arrow (x, u), n and m numbers
Point = tuple[Vector, Vector]
#: largest condition number of β on a bisection: beyond it fewer than four digits of x survive
STEEPEST = 1e12


def in_own_numbers(method: Function) -> Function:
    """Decorate a method of x (n numbers) and others (m) to compute in the own arithmetic."""

    @wraps(method)
    def wrapped(self: Any, *vectors: Numbers) -> Any:
        with self.numbers.working():
            lengths = (self.n, self.m, self.m)
            return method(self, *map(self.vector, vectors, lengths))

    return wrapped


class Bisection:
    """A local bisection through the arrow (x0, u0) at step h, in an arithmetic.

    x0: n numbers, u0: m numbers; `slope` is S, m×n: by default 0, and for a `LocalGroupoid` from
    `complement_slope`. Raises `BadInput` if β is no diffeomorphism on it near x0, for other shapes,
    for values that are not numbers, and for a step of 0. Its methods take numbers of any kind and
    compute in the arithmetic's own (beyond double precision gmpy2's, to all digits).
    """

    def __init__(
        self, groupoid: Groupoid, x0: GivenVector, u0: GivenVector, step: Given,
        digits: int = 16, slope: Any = None,
    ) -> None:  # fmt: skip
        if not isinstance(groupoid, Groupoid):
            raise BadInput(f"a bisection of {shown(groupoid)}: give a groupoid, such as pair(1).")
        self.groupoid, self.numbers = groupoid, arithmetic(digits)
        n, m = self.n, self.m = groupoid.dim_x, groupoid.dim_u
        self.step = exact_rational(step, "the step of a bisection")
        if self.step == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        if slope is None and not groupoid.by_maps:
            slope = np.zeros((m, n))
        if slope is not None and np.shape(slope) != (m, n):
            raise BadInput(
                f"{groupoid.name}: the slope of a bisection is {np.shape(slope)}, but must be "
                f"{(m, n)}; leave it out, and it is chosen."
            )
        with self.numbers.working():
            self.h = self.numbers.number(self.step)
            self.x0, self.u0 = self.vector(x0, n, "x0"), self.vector(u0, m, "u0")
            chosen = slope is None
            if not chosen:
                self.slope = self.vector(np.ravel(slope), m * n, "slope").reshape(m, n)
            try:
                here = self.maps(self.x0, self.u0, 0 * self.u0)
                if chosen:
                    slope = complement_slope(here["b_x"], here["b_u"]).ravel()
                    self.slope = self.vector(slope, m * n).reshape(m, n)
                steep = np.linalg.cond(self._along(here).astype(float)) if n else 1.0
            except (ArithmeticError, ValueError):  # the maps have no value there
                steep = math.inf
            if not steep < STEEPEST:
                raise BadInput(
                    f"{groupoid.name}: β is no diffeomorphism on that section through x = {x0}; "
                    "leave slope out, and it is chosen so that β is one, or take another arrow."
                )

    def vector(self, values: GivenVector, length: int, name: str = "a vector") -> Vector:
        """Return `length` numbers of this arithmetic (`vector_in`)."""
        return vector_in(self.numbers, values, length, f"{self.groupoid.name}: {name}")

    @in_own_numbers
    def section(self, x: Vector) -> Vector:
        """Return σ(x), m numbers."""
        return np.asarray(self.u0 + self.slope @ (x - self.x0))

    def _along(self, at: dict[str, np.ndarray], part: str = "b") -> Vector:
        """Return the derivative by x of b(x, σ(x)), n×n, or of p(x, σ(x), u), m×n."""
        return np.asarray(at[f"{part}_x"] + at[f"{part}_u"] @ self.slope)

    def _solved(self, change: Callable[[Vector], Vector], start: Vector, off: str) -> Vector:
        """Return Newton's solution from a start; `off` describes the point in the error."""
        solution = newton(change, start, 1, self.numbers.eps)
        if solution is None:
            raise BadInput(
                f"{self.groupoid.name}: {off} the bisection; take one through a nearer arrow."
            )
        return solution

    @in_own_numbers
    def source_of(self, y: Vector) -> Vector:
        """Return z with b(z, σ(z)) = y, n numbers, by Newton from x0; it is α∘Σ_β of the paper.

        Raises `BadInput` if y is too far from β(x0, u0).
        """

        def change(z: Vector) -> Vector:
            at = self.maps(z, self.section(z), 0 * self.u0)
            return np.asarray(self.numbers.solve(self._along(at), y - at["target"]))

        point = [float(e) for e in y]
        return self._solved(change, self.x0, f"{point} is no target of an arrow of")

    @in_own_numbers
    def left(self, x: Vector, u: Vector) -> Point:
        """Return L_Σ(x, u) = h·(x, u) with h in Σ, β(h) = x; it preserves the β-fibres."""
        z = self.source_of(x)
        return z, self.maps(z, self.section(z), u)["product"]

    @in_own_numbers
    def right(self, x: Vector, u: Vector) -> Point:
        """Return R_Σ(x, u) = (x, u)·h with h in Σ, α(h) = b(x, u); it preserves the α-fibres."""
        y = self.maps(x, u, 0 * self.u0)["target"]
        return x, self.maps(x, u, self.section(y))["product"]

    @in_own_numbers
    def left_tangent(self, x: Vector, u: Vector) -> Matrix:
        """Return T L_Σ at (x, u), (n+m)×(n+m)."""
        z = self.source_of(x)
        at = self.maps(z, self.section(z), u)
        back = self.numbers.solve(self._along(at), self.numbers.identity(self.n))
        zero = self.numbers.zeros(self.n, self.m)
        return np.block([[back, zero], [self._along(at, "p") @ back, at["p_v"]]])

    @in_own_numbers
    def right_tangent(self, x: Vector, u: Vector) -> Matrix:
        """Return T R_Σ at (x, u), (n+m)×(n+m)."""
        y = self.maps(x, u, 0 * self.u0)["target"]
        at = self.maps(x, u, self.section(y))
        through = at["p_v"] @ self.slope
        one, zero = self.numbers.identity(self.n), self.numbers.zeros(self.n, self.m)
        bottom = [at["p_x"] + through @ at["b_x"], at["p_u"] + through @ at["b_u"]]
        return np.block([[one, zero], bottom])

    @in_own_numbers
    def without_left(self, x: Vector, u: Vector) -> Point:
        """Return L_Σ⁻¹(x, u): the arrow that L_Σ maps to (x, u); raises `BadInput` if too far."""
        sigma = self.section(x)

        def change(v: Vector) -> Vector:
            at = self.maps(x, sigma, v)
            return np.asarray(self.numbers.solve(at["p_v"], u - at["product"]))

        near = self.maps(x, sigma, 0 * self.u0)["target"]
        return near, self._solved(change, 0 * self.u0, "the arrow is too far from")

    @in_own_numbers
    def without_right(self, x: Vector, u: Vector) -> Point:
        """Return R_Σ⁻¹(x, u): the arrow that R_Σ maps to (x, u); raises `BadInput` if too far."""

        def change(v: Vector) -> Vector:
            slope = self.right_tangent(x, v)[self.n :, self.n :]
            return np.asarray(self.numbers.solve(slope, u - self.right(x, v)[1]))

        return x, self._solved(change, 0 * self.u0, "the arrow is too far from")

    @in_own_numbers
    def maps(self, x: Vector, u: Vector, v: Vector) -> dict[str, np.ndarray]:
        """Return b, p and their derivatives at (x, u), (b, v)."""
        return groupoid_maps(self.groupoid, self.numbers, self.h, x, u, v)


def groupoid_maps(
    groupoid: Groupoid, numbers: Arithmetic, h: Number, x: Vector, u: Vector, v: Vector
) -> dict[str, np.ndarray]:
    """Return b (target), p (product) and their derivatives at (x, u), (b, v), in an arithmetic."""
    names = ("target", "product", "b_x", "b_u", "p_x", "p_u", "p_v")
    return dict(zip(names, _maps(groupoid, numbers)(x, u, v, h), strict=True))


@lru_cache(maxsize=64)
def _maps(groupoid: Groupoid, numbers: Arithmetic) -> Function:
    return numeric_function(_text_of_maps(groupoid), numbers)


@lru_cache(maxsize=64)
def _text_of_maps(groupoid: Groupoid) -> str:
    """Return the text of the maps, which serves every arithmetic."""
    s = groupoid.symbols
    x, u, v, h = s["x"], s["u"], s["v"], s["h"]
    b, p = groupoid.target(x, u, h), groupoid.product(x, u, v, h)
    slopes = [jacobian(b, w) for w in (x, u)] + [jacobian(p, w) for w in (x, u, v)]
    return numeric_text({"x": x, "u": u, "v": v, "h": h}, [list(b), list(p), *slopes])


def complement_slope(b_x: Matrix, b_u: Matrix) -> Matrix:
    """Return S (m×n) whose graph {(δx, S δx)} is a complement of ker Tα and ker Tβ at an arrow.

    As in the paper's existence proof, C is a complement of A = ker Tα and B = ker Tβ
    (`common_complement`), as far from both as possible. Double precision suffices to choose it.
    """
    b_x, b_u = np.asarray(b_x, dtype=float), np.asarray(b_u, dtype=float)
    n, m = b_u.shape
    if n == 0:
        return np.zeros((m, 0))
    A = np.vstack([np.zeros((n, m)), np.eye(m)])  # ker Tα: δx = 0
    C = common_complement(A, linalg.null_space(np.hstack([b_x, b_u])))
    return np.asarray(np.linalg.solve(C[:n].T, C[n:].T).T)


def common_complement(A: Matrix, B: Matrix) -> Matrix:
    """Return a basis (columns) of C with A ⊕ C = B ⊕ C = V (paper, lemma of section 4.1).

    A and B: columns that span subspaces of equal dimension. {c} is a basis of A ∩ B, {a} completes
    it to A and {b} to B, and {d} completes these to V; then C = span{a + b, d}. In orthonormal
    principal vectors (each a is orthogonal to every b but its own) C is the orthogonal complement
    of a − b and c.
    """
    A, B = (np.linalg.qr(basis)[0] for basis in (A, B))
    left, cosines, right = np.linalg.svd(A.T @ B)
    a, b = A @ left, B @ right.T
    shared = cosines > 1 - 1e-12  # to half the digits of the angle: a = b = c
    return np.asarray(linalg.null_space(np.where(shared, a, a - b).T))
