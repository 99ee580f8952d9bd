"""The continuous system on the dual algebroid: momentum, velocity, energy, vector field.

ẋ = ρ̂(x) ξ,   μ̇_γ = ρ̂^i_γ ∂l/∂x^i − Ĉ^ν_{γμ} ξ^μ μ_ν + f_γ,   μ = ∂l/∂ξ

f is the scene's force; if the time is a coordinate, its rate is 1.

For a degenerate Lagrangian ϑ(x)·v − H(x) the Euler–Lagrange equations A ẋ = ∂H, A_ij = ∂_i ϑ_j −
∂_j ϑ_i, are of first order, so ẋ = B ∂H with the Poisson tensor B = A⁻¹, {xⁱ, xʲ} = Bⁱʲ, in closed
form. In (x, μ) the bracket is Dirac's, of the constraint μ = ϑ(x).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from ..errors import BadInput, CannotMeasure
from ..numbers import Arithmetic, jacobian, numeric, sympy
from ..numbers.types import Column, Exact, Expression, Number, SymbolicMatrix
from ..scene import Scene
from .symbols import SceneSymbols

#: coordinates that the two-form couples, whose inverse is written out: the Pfaffian has 1·3·5·7
#: terms
MOST_TIED = 8
CLOSED = 3  # largest number of velocities coupled by the mass matrix that are solved for as letters


def momentum(s: SceneSymbols) -> Column:
    """Return ∂l/∂ξ at (x, u), m×1."""
    return jacobian([s.lagrangian], s.u).T


def mass_matrix(s: SceneSymbols) -> SymbolicMatrix:
    """Return ∂²l/∂ξ² at (x, u), m×m."""
    return jacobian(momentum(s), s.u)


@lru_cache(maxsize=256)
def closed_velocity(s: SceneSymbols) -> Column | None:
    """Return ξ(x, μ), m×1, as expressions; None if they do not exist or are long.

    They exist for a Lagrangian that is quadratic in the velocity, and are short if the mass matrix
    couples at most three velocities. For a Hamiltonian they are ∂H/∂μ, and for a degenerate
    Lagrangian B ∂H.
    """
    if s.degenerate:
        return inverse_two_form(s) * jacobian([s.hamiltonian], s.x).T
    if s.hamiltonian is not None:
        return jacobian([s.hamiltonian], s.mu).T
    mu, mass = momentum(s), mass_matrix(s)
    blocks = mass.connected_components()
    if mass.free_symbols & set(s.u) or max(map(len, blocks)) > CLOSED:
        return None
    right, xi = s.mu - mu.xreplace(dict.fromkeys(s.u, 0)), sympy.zeros(len(s.mu), 1)
    for block in blocks:
        tied = mass.extract(block, block).applyfunc(lambda e: e.simplify())
        for i, e in zip(block, tied.LUsolve(right.extract(block, [0])), strict=True):
            xi[i] = e
    return xi


def energy(s: SceneSymbols) -> Expression:
    """Return H = μ·ξ − l at (x, ξ, μ), ξ in the letters `s.u`: stationary in ξ where μ = ∂l/∂ξ.

    For a degenerate Lagrangian it is H(x), at any μ.
    """
    if s.degenerate:
        return s.hamiltonian
    return s.mu.dot(s.u) - s.phase_lagrangian


def energy_gradient(s: SceneSymbols) -> tuple[Column, Column]:
    """Return ∂H/∂x = −∂l/∂x and ∂H/∂μ = ξ at (x, ξ), ξ in the letters `s.u`.

    For a degenerate Lagrangian they are that of H(x), and 0.
    """
    if s.degenerate:
        return jacobian([s.hamiltonian], s.x).T, 0 * s.u
    slope = -jacobian([s.phase_lagrangian], s.x).T if len(s.x) else sympy.zeros(0, 1)
    return slope, s.u


def power(s: SceneSymbols) -> Expression:
    """Return dH/dt = f·ξ − ∂l/∂t at (x, ξ), ξ in the letters `s.u`."""
    work = s.force.dot(s.u) if s.forced else sympy.S.Zero
    return work - s.phase_lagrangian.diff(s.x[-1]) if s.clocked else work


def natural_structure(s: SceneSymbols, x: Column) -> tuple[SymbolicMatrix, list[SymbolicMatrix]]:
    """Return the anchor ρ̂ (n×m) and the structure functions Ĉ (m of m×m) at x, without h."""

    def over_step(matrix: SymbolicMatrix) -> SymbolicMatrix:
        parts = (matrix / s.h).applyfunc(sympy.sympify)
        return parts.applyfunc(lambda e: sympy.cancel(e) if e.has(s.h) else e)

    structure = s.groupoid.structure_functions(x, s.h)
    return over_step(s.groupoid.rho(x, s.h)), [over_step(c) for c in structure]


def poisson_tensor(s: SceneSymbols, x: Column, mu: Column) -> SymbolicMatrix:
    """Return the bracket of (x, μ), (n+m)×(n+m): {xⁱ, μ_γ} = ρ̂ⁱ_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ.

    For a degenerate Lagrangian it is Dirac's.
    """
    if s.degenerate:
        return dirac_tensor(s).xreplace(dict(zip(s.x, x, strict=True)))
    rho, structure = natural_structure(s, x)
    bracket = sympy.zeros(len(mu))
    for nu, c in enumerate(structure):
        bracket -= c * mu[nu]
    return sympy.zeros(len(x)).row_join(rho).col_join((-rho.T).row_join(bracket))


def rates(s: SceneSymbols) -> Column:
    """Return (ẋ, μ̇) at (x, ξ, μ), ξ in the letters `s.u`, (n+m)×1."""
    rho, structure = natural_structure(s, s.x)
    mu_dot = rho.T * jacobian([s.phase_lagrangian], s.x).T if len(s.x) else 0 * s.mu
    for nu, c in enumerate(structure):
        mu_dot -= c * s.u * s.mu[nu]
    x_dot = rho * s.u
    if s.clocked:
        x_dot[-1] += 1
    return x_dot.col_join(mu_dot + s.force if s.forced else mu_dot)


def field_parts(s: SceneSymbols) -> list[SymbolicMatrix]:
    """Return the parts of the field at (x, ξ, μ), ξ in the letters `s.u`, as columns of sympy.

    They are f = (ẋ, μ̇), its derivatives by z = (x, μ) and by ξ, ∂ξ/∂z·M = (−∂²l/∂ξ∂x, 1), and M,
    the mass matrix (1 for a degenerate Lagrangian).
    """
    f, states = rates(s), [*s.x, *s.mu]
    moving, mass = (-jacobian(momentum(s), s.x)).row_join(sympy.eye(len(s.mu))), mass_matrix(s)
    if s.degenerate:
        moving, mass = jacobian(closed_velocity(s), states), sympy.eye(len(s.mu))  # type: ignore[arg-type]
    return [list(f), jacobian(f, states), jacobian(f, s.u), moving, mass]


def vector_field(s: SceneSymbols) -> Column:
    """Return (ẋ, μ̇) at (x, μ), (n+m)×1; `CannotMeasure` if ξ(x, μ) has no short closed form."""
    xi = closed_velocity(s)
    if xi is None:
        raise CannotMeasure(f"{s.name}: there is no short closed form of ξ(x, μ).")
    return rates(s).xreplace(dict(zip(s.u, xi, strict=True)))


def initial_momentum(
    s: SceneSymbols, scene: Scene, numbers: Arithmetic, t0: Exact = 0
) -> list[Number]:
    """Return μ₀ = ∂l/∂ξ(x₀, v₀) at the time t₀, or the scene's own, in an arithmetic.

    Raises `CannotMeasure` if the scene has only a discrete Lagrangian and gives no μ₀, and
    `BadInput` if l has no momentum there.
    """
    if scene.mu0 is not None:
        with numbers.working():
            return [numbers.number(e) for e in scene.mu0]
    if scene.lagrangian is None:
        raise CannotMeasure(
            f"{scene.name} has only a discrete Lagrangian, so its start needs the momentum: "
            "Scene(..., mu0=...), or trajectory(..., mu0=...)."
        )
    f = _momentum_function(s, numbers)
    with numbers.working():
        x = [numbers.number(v) for v in s.with_time(scene.x0, t0)]
        v = [numbers.number(v) for v in scene.v0]
        try:
            return list(f(x, v, [numbers.number(p) for p in scene.parameter_values]))
        except (ArithmeticError, ValueError) as error:
            raise BadInput(
                f"{scene.name}: its Lagrangian has no momentum ∂l/∂v at x0, v0 ({error}); mend it, "
                "begin elsewhere or take other parameters."
            ) from error


@lru_cache(maxsize=512)
def _momentum_function(s: SceneSymbols, numbers: Arithmetic) -> Callable[..., list[Number]]:
    """Return ∂l/∂ξ as f(x, v, parameters)."""
    return numeric({"x": s.x, "v": s.u, "p": s.parameter_list}, [list(momentum(s))], numbers)


def two_form(s: SceneSymbols) -> SymbolicMatrix:
    """Return A = ϑ′ᵀ − ϑ′ at x, n×n, with ϑ′_ij = ∂_j ϑ_i."""
    slope = jacobian(s.one_form, s.x)
    return slope.T - slope


@lru_cache(maxsize=256)
def inverse_two_form(s: SceneSymbols) -> SymbolicMatrix:
    """Return B = A⁻¹ at x, n×n; raises `BadInput` if A is singular everywhere, or large."""
    A, B = two_form(s), sympy.zeros(len(s.x))
    for block in A.connected_components():
        if len(block) > MOST_TIED:
            raise BadInput(
                f"{s.name}: dϑ ties {len(block)} coordinates together, and its inverse is written "
                f"out for up to {MOST_TIED}: take coordinates in which it has smaller blocks."
            )
        tied = A.extract(block, block)
        whole = pfaffian(tied)
        if len(block) % 2 or whole == 0 or whole.simplify() == 0:
            names = ", ".join(f"x[{i}]" for i in block)
            raise BadInput(
                f"{s.name}: dϑ is singular everywhere, in {names}, so no motion follows from "
                "dϑ(·, ẋ) = dH: give a one-form whose dϑ is regular."
            )
        for i in range(len(block)):
            for j in range(i):
                rest = [k for k in range(len(block)) if k not in (i, j)]
                entry = (-1) ** (i + j) * pfaffian(tied.extract(rest, rest)) / whole
                B[block[i], block[j]], B[block[j], block[i]] = -entry, entry
    return B


def pfaffian(A: SymbolicMatrix) -> Expression:
    """Return the Pfaffian of an antisymmetric matrix, with square det A; 1 if empty."""
    if not A.rows:
        return sympy.S.One
    total = sympy.S.Zero
    for j in range(1, A.rows):
        if A[0, j] != 0:
            rest = [k for k in range(1, A.rows) if k != j]
            total += (-1) ** (j + 1) * A[0, j] * pfaffian(A.extract(rest, rest))
    return total


def orientation(s: SceneSymbols) -> Expression:
    """Return the Pfaffian of A at x: where it changes its sign dϑ is singular."""
    A = two_form(s)
    pfaffians = [pfaffian(A.extract(block, block)) for block in A.connected_components()]
    return sympy.Mul(*pfaffians)


def dirac_tensor(s: SceneSymbols) -> SymbolicMatrix:
    """Return the bracket of (x, μ) at μ = ϑ(x), 2n×2n: B, and along the constraint ϑ′B, ϑ′Bϑ′ᵀ."""
    along = sympy.eye(len(s.x)).col_join(jacobian(s.one_form, s.x))
    return along * inverse_two_form(s) * along.T
