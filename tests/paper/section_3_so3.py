"""Section 3.6.2: SO(3) with the Cayley transform, component by component."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Function, Matrix, Rational, eye, symbols

from discmech.integrators import cayley, so

from .rows import SYMBOLIC, Claim, checked, printed, same

h = symbols("h", positive=True)
now, then = (Matrix(3, 1, symbols(f"x_{k} y_{k} z_{k}", real=True)) for k in ("k", "l"))
E = [
    Matrix([[0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    Matrix([[0, 0, 1], [0, 0, 0], [-1, 0, 0]]),
    Matrix([[0, -1, 0], [1, 0, 0], [0, 0, 0]]),
]


def slopes(at: Any) -> Any:
    """∂L/∂x, ∂L/∂y, ∂L/∂z of a generic function at a point."""
    return Matrix([Function(f"L_{letter}")(*at) for letter in "xyz"])


@checked("3.6.2-10", r"the basis $e_1,e_2,e_3$ of $so(3)$", how=SYMBOLIC)
def basis() -> Iterator[Claim]:
    for index in range(3):
        yield same("the bench's", so(3).hat(eye(3)[:, index]), E[index])
        a, b = E[(index + 1) % 3], E[(index + 2) % 3]
        yield same("[e_2, e_3] = e_1 and so on", a * b - b * a, E[index])


@checked(
    "3.6.2-11",
    r"the equations in components, with $1+\frac{h^2z^2}4$ in the third",
    "so3-square",
    "dangling-plus",
    how=SYMBOLIC,
)
def components() -> Iterator[Claim]:
    """The third equation has h²z² for the printed h²z [misprint: so3-square]."""
    found = by_matrices(slopes)
    mended = as_printed(now, slopes(now), then, slopes(then), power=2)
    yield same("the bench's", by_bench(slopes), found)
    for index in range(3):
        yield same(f"equation {index + 1}", found[index], mended[index])
    wrong = as_printed(now, slopes(now), then, slopes(then), power=1)
    yield printed("so3-square", found[2], wrong[2])


def pair_with(matrix: Any, covector: Any) -> Any:
    """⟨ξ, ∂L⟩ for a matrix ξ of so(3)."""
    return Matrix([matrix[2, 1], matrix[0, 2], matrix[1, 0]]).dot(covector)


def by_matrices(momentum: Any) -> list[Any]:
    """⟨(e + hη_k/2) e_γ (e − hη_k/2), ∂L⟩ − ⟨(e − hη_l/2) e_γ (e + hη_l/2), ∂L⟩."""
    one = eye(3)
    a, b = (h / 2 * sum((c * e for c, e in zip(at, E, strict=True)), 0 * one) for at in (now, then))
    return [
        pair_with((one + a) * e * (one - a), momentum(now))
        - pair_with((one - b) * e * (one + b), momentum(then))
        for e in E
    ]


def by_bench(momentum: Any) -> Any:
    """The same by the bench's L and R."""
    L, _ = cayley.invariant_fields(so(3), h * now)
    _, R = cayley.invariant_fields(so(3), h * then)
    return L.T * momentum(now) - R.T * momentum(then)


def as_printed(at: Any, p: Any, at_next: Any, q: Any, power: int) -> list[Any]:
    """The three sums in the paper's order of terms; `power` is that of z in 1 + h²z/4."""
    half, quarter = h * Rational(1, 2), h**2 * Rational(1, 4)
    (x, y, z), (X, Y, Z) = at, at_next
    first = (
        (1 + quarter * x**2) * p[0]
        + (quarter * x * y + half * z) * p[1]
        - (half * y - quarter * x * z) * p[2]
        - (1 + quarter * X**2) * q[0]
        + (half * Z - quarter * X * Y) * q[1]
        - (half * Y + quarter * X * Z) * q[2]
    )
    second = (  # nothing follows −hz/2 [misprint: dangling-plus]
        (quarter * x * y - half * z) * p[0]
        + (1 + quarter * y**2) * p[1]
        + (half * x + quarter * y * z) * p[2]
        - (half * Z + quarter * X * Y) * q[0]
        - (1 + quarter * Y**2) * q[1]
        + (half * X - quarter * Y * Z) * q[2]
    )
    third = (
        (half * y + quarter * x * z) * p[0]
        - (half * x - quarter * y * z) * p[1]
        + (1 + quarter * z**power) * p[2]
        + (half * Y - quarter * X * Z) * q[0]
        - (half * X + quarter * Y * Z) * q[1]
        - (1 + quarter * Z**power) * q[2]
    )
    return [first, second, third]
