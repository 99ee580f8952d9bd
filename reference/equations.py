"""The continuous Euler-Lagrange equations of a scene on its Lie algebroid.

    dx/dt = rho(x) xi,
    d/dt dl/dxi^g = rho^i_g dl/dx^i - C^n_{gm} xi^m dl/dxi^n

(Weinstein 1996; Martinez 2001), with anchor rho and structure functions C derived here, from the
matrices of the algebra or from the target and product that a user gave:

    pair     rho = 1,                      C = 0
    group    rho = 0 (no base),            [e_m, e_n] = C^g_{mn} e_g
    action   rho^i_g = (x e_g)^i (row vectors x), else d/ds x.(e + s e_g), the same C
    product  both side by side; with a connection A in the frame e_i - A^a_i e_a, e_a
    local    rho = db/du / h at u = 0,     C^g_{mn} = (d2p^g/du^m dv^n - d2p^g/dv^m du^n) / h

Everything is exact: sympy expressions with rational (or algebraic) coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .algebroid import Algebroid, algebroid_of
from .elimination import explicit_rates
from .exact import exact_number, parameter_values, without_floats
from .failures import ReferenceFailure

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True)
class Equations:
    """dz/dt = rates(z), z = (x, xi, attitude row by row): exact and explicit.

    ``assignments`` are intermediate values, to be evaluated in this order before ``rates``.
    """

    name: str
    states: tuple[sympy.Symbol, ...]
    start: tuple[sympy.Expr, ...]
    assignments: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    rates: tuple[sympy.Expr, ...]
    lagrangian: sympy.Expr
    momentum: tuple[sympy.Expr, ...]
    energy: sympy.Expr
    dim_x: int
    dim_u: int
    attitude_size: int


def base_and_velocity(scene: Any) -> tuple[sympy.Matrix, sympy.Matrix]:
    """Symbols x (dim_x x 1) and xi (dim_u x 1)."""
    import sympy

    x = sympy.Matrix(scene.groupoid.dim_x, 1, lambda i, _: sympy.Symbol(f"x{i}", real=True))
    v = sympy.Matrix(scene.groupoid.dim_u, 1, lambda i, _: sympy.Symbol(f"v{i}", real=True))
    return x, v


def exact_lagrangian(scene: Any, x: sympy.Matrix, v: sympy.Matrix) -> sympy.Expr:
    """l(x, v) with the scene's parameters in it; floats written in it count as exact."""
    import sympy

    if scene.lagrangian is None:
        raise ReferenceFailure(
            f"scene {scene.name} has no continuous Lagrangian, so nothing to refer to; "
            "give it lagrangian=..., or measure it without a reference"
        )
    values = parameter_values(scene)
    try:
        expression = sympy.sympify(_scalar(scene.lagrangian(x, v, values)))
        if expression.has(sympy.Float):  # keep floats from eating the exact parameters
            expression = _with_symbolic_parameters(scene, x, v, values)
    except ReferenceFailure:
        raise
    except Exception as error:
        raise ReferenceFailure(
            f"the Lagrangian of scene {scene.name} cannot be evaluated on symbols "
            f"({type(error).__name__}: {error}); write it with sympy functions of x, v and p"
        ) from error
    unknown = expression.free_symbols - set(x) - set(v)
    if unknown:
        raise ReferenceFailure(
            f"the Lagrangian of scene {scene.name} contains unknown symbols "
            f"{', '.join(sorted(map(str, unknown)))}; make them parameters of the scene"
        )
    if expression.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
        raise ReferenceFailure(
            f"the Lagrangian of scene {scene.name} is not finite with these parameters; "
            "change the parameter that makes it so"
        )
    return expression


def equations_of(scene: Any, attitude: bool = False) -> Equations:
    """The explicit Euler-Lagrange equations of a scene, with dA/dt = A xi^ if asked for."""
    import sympy

    x, v = base_and_velocity(scene)
    start = exact_start(scene)
    lagrangian = exact_lagrangian(scene, x, v)
    structure = algebroid_of(scene, x)
    n, m = structure.dim_x, structure.dim_u
    momentum = sympy.Matrix([lagrangian.diff(v[g]) for g in range(m)])
    x_rates = structure.rho * v if n else sympy.zeros(0, 1)
    force = sympy.Matrix([_force(structure, lagrangian, momentum, x, v, g) for g in range(m)])
    for g in range(m):
        force[g] -= sum((momentum[g].diff(x[i]) * x_rates[i] for i in range(n)), sympy.S.Zero)
    mass = sympy.Matrix(m, m, lambda i, j: momentum[i].diff(v[j]))
    assignments, v_rates = explicit_rates(
        scene.name, mass, force, dict(zip([*x, *v], start, strict=True))
    )
    states, rates, size = [*x, *v], [*x_rates, *v_rates], 0
    if attitude:
        if not structure.basis:
            raise ReferenceFailure(
                f"scene {scene.name} lives on a {scene.groupoid.kind} groupoid, which has no "
                "attitude; ask with attitude=False"
            )
        size = structure.basis[0].rows
        matrix = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"A{i}_{j}", real=True))
        velocity = sum((structure.basis[g] * v[g] for g in range(m)), sympy.zeros(size, size))
        states += list(matrix)
        rates += list(matrix * velocity)
        start = (*start, *sympy.eye(size))
    energy = sum((momentum[g] * v[g] for g in range(m)), sympy.S.Zero) - lagrangian
    return Equations(
        scene.name, tuple(states), start, tuple(assignments), tuple(rates), lagrangian,
        tuple(momentum), energy, n, m, size,
    )  # fmt: skip


def exact_start(scene: Any) -> tuple[sympy.Expr, ...]:
    """(x0, v0) as exact sympy numbers."""
    for name, given, wanted in (
        ("x0", scene.x0, scene.groupoid.dim_x),
        ("v0", scene.v0, scene.groupoid.dim_u),
    ):
        if len(given) != wanted:
            raise ReferenceFailure(
                f"{name} of scene {scene.name} has {len(given)} entries where its groupoid "
                f"has {wanted}; give {wanted}"
            )
    return tuple(
        exact_number(value, f"{name}[{i}] of scene {scene.name}")
        for name, given in (("x0", scene.x0), ("v0", scene.v0))
        for i, value in enumerate(given)
    )


def _scalar(value: Any) -> Any:
    """A 1x1 matrix (such as v.T*v) as its entry."""
    return value[0] if getattr(value, "shape", None) == (1, 1) else value


def _with_symbolic_parameters(scene: Any, x: Any, v: Any, values: Any) -> sympy.Expr:
    import sympy

    substitution: dict[Any, Any] = {}
    symbols = type(values)()
    for name, value in vars(values).items():
        if isinstance(value, sympy.MatrixBase):
            held = sympy.Matrix(*value.shape, lambda i, j: sympy.Dummy(real=True))
            substitution.update(zip(held, value, strict=True))
        else:
            held = sympy.Dummy(real=True)
            substitution[held] = value
        setattr(symbols, name, held)
    expression = sympy.sympify(_scalar(scene.lagrangian(x, v, symbols)))
    return without_floats(expression).subs(substitution)


def _force(
    structure: Algebroid, lagrangian: Any, momentum: Any, x: Any, v: Any, g: int
) -> sympy.Expr:
    """rho^i_g dl/dx^i - C^n_{gm} xi^m dl/dxi^n."""
    import sympy

    terms = [structure.rho[i, g] * lagrangian.diff(x[i]) for i in range(structure.dim_x)]
    terms += [
        -constant * v[b] * momentum[n]
        for (n, a, b), constant in structure.constants.items()
        if a == g
    ]
    return sympy.expand(sympy.Add(*terms)) if not structure.dim_x else sympy.Add(*terms)
