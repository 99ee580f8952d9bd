"""The continuous Euler-Lagrange equations of a scene on its Lie algebroid.

    dx/dt = rho(x) xi,
    d/dt dl/dxi^g = rho^i_g dl/dx^i - C^n_{gm} xi^m dl/dxi^n + f_g

(Weinstein 1996; Martinez 2001), f the scene's force and A^T lambda that of its constraints, with
anchor rho and structure functions C derived here, from the matrices of the algebra or from the
target and product that a user gave:

    pair     rho = 1,                      C = 0
    group    rho = 0 (no base),            [e_m, e_n] = C^g_{mn} e_g
    action   rho^i_g = (x e_g)^i (row vectors x), else d/ds x.(e + s e_g), the same C
    product  both side by side; with a connection A in the frame e_i - A^a_i e_a, e_a
    local    rho = db/du / h at u = 0,     C^g_{mn} = (d2p^g/du^m dv^n - d2p^g/dv^m du^n) / h

Of a scene that gives its Hamiltonian,

    dx/dt = rho(x) dH/dmu,   dmu_g/dt = -rho^i_g dH/dx^i - C^n_{gm} dH/dmu_m mu_n + f_g,

and mu stands wherever these pages say xi. Of a one-form theta and a Hamiltonian H on the pair
groupoid, whose Lagrangian theta(x) v - H(x) is linear in the velocity,

    A dx/dt = dH/dx,   A_ij = d_i theta_j - d_j theta_i,   mu = theta,

and x alone is the state.

Everything is exact: sympy expressions with rational (or algebraic) coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpmath
import sympy

from discmech.integrators.scene import (
    BadInput,
    arguments_of,
    refuse_unwritten,
    short_numbers,
    without_text,
)

from ..failures import ReferenceFailure
from .algebroid import Algebroid, algebroid_of
from .constrained_start import on_constraints
from .elimination import explicit_rates
from .exact import exact_number, parameter_values, without_floats


@dataclass(frozen=True)
class Equations:
    """dz/dt = rates(z), z = (x, xi, attitude row by row, t if it counts): exact and explicit.

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
    timed: bool = False
    forced: bool = False
    #: rows that stay independent while constraints determine the motion, one after another: A of
    #: the constraints A xi = a, or the matrix (M, -B^T; A, 0) if they push along other rows B
    constraints: tuple[sympy.Expr, ...] = ()
    #: True if constraints may do work: they move, or push along other rows than their own
    driven: bool = False

    def block(self, name: str) -> slice:
        """Return the slice of a block of states: x, v, attitude or time."""
        ends = [0, self.dim_x, self.dim_x + self.dim_u]
        ends += [ends[-1] + self.attitude_size**2, len(self.states)]
        at = ("x", "v", "attitude", "time").index(name)
        return slice(ends[at], ends[at + 1])


#: the time, on which a Lagrangian or a force may depend
T = sympy.Symbol("t", real=True)


@dataclass(frozen=True)
class Mechanics:
    """The exact mechanics of a scene.

    l(x, v) or l(x, v, t), the components of its force (empty without a force), the start, and of
    the constraints A xi = a, with the force B^T lambda, A and B (k x dim_u) and a (k x 1).
    """

    x: sympy.Matrix
    v: sympy.Matrix
    structure: Algebroid
    lagrangian: sympy.Expr
    acting: tuple[sympy.Expr, ...]
    admitted: sympy.Matrix
    moving: sympy.Matrix
    pushing: sympy.Matrix
    start: tuple[sympy.Expr, ...]
    #: True if v is the momentum, and the Lagrangian the Hamiltonian
    hamiltonian: bool = False
    #: whether the Lagrangian is linear in v, so that dx/dt follows from x alone
    degenerate: bool = False

    @property
    def timed(self) -> bool:
        """True if something depends on the time."""
        constraints = (*self.admitted, *self.moving, *self.pushing)
        return any(e.has(T) for e in (self.lagrangian, *self.acting, *constraints))

    @property
    def driven(self) -> bool:
        """True if constraints may do work: they move, or push along other rows than their own."""
        return any(self.moving) or self.pushing != self.admitted


def mechanics_of(scene: Any) -> Mechanics:
    """Return the mechanics; raises `ReferenceFailure` for a scene that can have no reference."""
    x = sympy.Matrix(scene.groupoid.dim_x, 1, lambda i, _: sympy.Symbol(f"x{i}", real=True))
    v = sympy.Matrix(scene.groupoid.dim_u, 1, lambda i, _: sympy.Symbol(f"v{i}", real=True))
    if scene.lagrangian is None:
        raise ReferenceFailure(
            f"scene {scene.name} has no continuous Lagrangian, so nothing to refer to; "
            "give it lagrangian=..., or measure it without a reference"
        )
    energy, one_form = getattr(scene, "hamiltonian", None), getattr(scene, "one_form", None)
    if one_form is not None:
        theta = _exact(scene, "one-form", one_form, x)
        if len(theta) != len(x):
            raise ReferenceFailure(
                f"the one-form of scene {scene.name} has {len(theta)} components where x has "
                f"{len(x)}; give {len(x)}"
            )
        lagrangian = sum(a * b for a, b in zip(theta, v, strict=True))
        lagrangian -= _number(scene, "Hamiltonian", energy, x)
        energy = None
    elif energy is not None:
        lagrangian = _number(scene, "Hamiltonian", energy, x, v)
    else:
        lagrangian = _number(scene, "Lagrangian", scene.lagrangian, x, v)
    structure = algebroid_of(scene, x)
    phi, admitted, moving, pushing = _constraints(scene, structure, x)
    if one_form is not None:
        start = _numbers(scene, "x0", scene.x0, len(x))
    else:
        start = _start(scene, x, v, phi, admitted * v - moving, energy is not None)
    acting: tuple[sympy.Expr, ...] = ()
    if getattr(scene, "force", None) is not None:
        acting = _exact(scene, "force", scene.force, x, v)
        if energy is not None:  # a function of the velocity
            speeds = [lagrangian.diff(e) for e in v]
            acting = tuple(e.xreplace(dict(zip(v, speeds, strict=True))) for e in acting)
        if len(acting) != len(v):
            raise ReferenceFailure(
                f"the force of scene {scene.name} has {len(acting)} components where its groupoid "
                f"has dim_u = {len(v)}; give {len(v)}"
            )
    return Mechanics(
        x, v, structure, lagrangian, acting, admitted, moving, pushing, start,
        energy is not None, one_form is not None,
    )  # fmt: skip


def velocity_of(mechanics: Mechanics, at: Any) -> list[Any]:
    """Return dH/dmu at a solution, mpf, with the digits of its momentum.

    Of a degenerate scene it is dx/dt.
    """
    if mechanics.degenerate:
        with mpmath.workdps(at.certain_digits + 20):
            values = sympy.lambdify([*mechanics.x], _first_order(mechanics), "mpmath")(*at.x)
            return list(mpmath.lu_solve(*values))
    letters = [*mechanics.x, *mechanics.v, T]
    rows = [mechanics.lagrangian.diff(e) for e in mechanics.v]
    with mpmath.workdps(at.certain_digits + 20):
        time = mpmath.mpf(at.t.numerator) / at.t.denominator
        values = sympy.lambdify(letters, rows, "mpmath")(*at.x, *at.mu, time)
        return [mpmath.mpf(e) for e in values]


def _constraints(scene: Any, structure: Algebroid, x: sympy.Matrix) -> tuple[sympy.Matrix, ...]:
    """Return phi (0 x 1 without any), and A, a, B of the constraints A xi = a and their force B^T
    lambda.

    Of phi(x, t) = 0 they are phi' rho, -dphi/dt and again phi' rho; they come first.
    """
    m = structure.dim_u
    phi, rows, right = sympy.zeros(0, 1), sympy.zeros(0, m), sympy.zeros(0, 1)
    pushing: list[sympy.Matrix] = [sympy.zeros(0, m), sympy.zeros(0, m)]
    for each in getattr(scene, "all_constraints", ()):
        try:
            with short_numbers(f"the constraint of scene {scene.name}"):
                time = [T] if each.timed else []
                answer = each.function(x, parameter_values(scene), *time)
                parts = each.kind.parts(without_text(answer, f"the constraint of {scene.name}"), m)
        except BadInput:
            raise
        except Exception as error:
            raise ReferenceFailure(
                f"the constraint of scene {scene.name} cannot be evaluated on symbols "
                f"({type(error).__name__}: {error}); write it with sympy functions of x and p"
            ) from error
        positions = _matrix(parts.positions, 1)
        own = positions.jacobian(x) * structure.rho if len(positions) else sympy.zeros(0, m)
        along = _matrix([e for row in parts.rows for e in row], m)
        phi = phi.col_join(positions)
        rows, right = rows.col_join(along), right.col_join(_matrix(parts.shift, 1))
        if parts.reactions is not None:
            other = _matrix([e for row in parts.reactions for e in row], m)
            own, along = other[: len(positions), :], other[len(positions) :, :]
        pushing = [one.col_join(more) for one, more in zip(pushing, (own, along), strict=True)]
    of_phi = phi.jacobian(x) * structure.rho if len(phi) else sympy.zeros(0, m)
    moving = (-phi.diff(T)).col_join(right)
    return phi, of_phi.col_join(rows), moving, pushing[0].col_join(pushing[1])


def _matrix(entries: Any, columns: int) -> sympy.Matrix:
    """Return exact entries, row by row."""
    numbers = [without_floats(sympy.sympify(e)) for e in entries]
    return sympy.Matrix(len(numbers) // columns, columns, numbers)


def _number(scene: Any, what: str, function: Any, *states: sympy.Matrix) -> sympy.Expr:
    """Return the one value of a function of (x, p), (x, v, p) or (x, v, p, t)."""
    values = _exact(scene, what, function, *states)
    if len(values) != 1:
        raise ReferenceFailure(f"the {what} of scene {scene.name} has {len(values)} values; give 1")
    return values[0]


def _exact(scene: Any, what: str, function: Any, *states: sympy.Matrix) -> tuple[sympy.Expr, ...]:
    """Return the entries of a function of (x, p), (x, v, p) or (x, v, p, t)."""
    values = parameter_values(scene)
    timed = arguments_of(function) == 4

    def entries(parameters: Any) -> list[sympy.Expr]:
        answer = function(*states, parameters, *([T] if timed else []))
        value = without_text(answer, f"the {what} of scene {scene.name}")
        many = hasattr(value, "shape") or isinstance(value, (list, tuple))
        listed = [sympy.sympify(e) for e in (list(value) if many else [value])]
        return [e[0] if getattr(e, "shape", None) == (1, 1) else e for e in listed]

    try:
        with short_numbers(f"the {what} of scene {scene.name}"):
            components = entries(values)
            for entry in components:
                refuse_unwritten(entry, f"the {what} of scene {scene.name}")
            # so that they cannot absorb exact parameters
            if any(e.has(sympy.Float) for e in components):
                components = _with_symbolic_parameters(values, entries)
    except BadInput:
        raise
    except Exception as error:
        raise ReferenceFailure(
            f"the {what} of scene {scene.name} cannot be evaluated on symbols "
            f"({type(error).__name__}: {error}); write it with sympy functions of x, v and p"
        ) from error
    for k, entry in enumerate(components):
        if not isinstance(entry, sympy.Expr) or hasattr(entry, "shape"):  # matrices are Expr, too
            raise ReferenceFailure(
                f"component {k} of the {what} of scene {scene.name} is {entry}: give a number"
            )
    known = {e for state in states for e in state} | {T for _ in range(timed)}
    unknown = set().union(*(e.free_symbols for e in components)) - known
    if unknown:
        raise ReferenceFailure(
            f"the {what} of scene {scene.name} contains unknown symbols "
            f"{', '.join(sorted(map(str, unknown)))}; make them parameters of the scene"
        )
    if any(e.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo) for e in components):
        raise ReferenceFailure(
            f"the {what} of scene {scene.name} is not finite with these parameters; "
            "change the parameter that makes it so"
        )
    return tuple(components)


@dataclass(frozen=True)
class Balance:
    """The equations mass · (xi', multipliers) = force, before they are solved for their rates.

    With k constraints A xi = a the multipliers are further unknowns, and A xi' = da/dt - (dA/dt) xi
    further rows.
    """

    mechanics: Mechanics
    momentum: sympy.Matrix
    x_rates: sympy.Matrix
    mass: sympy.Matrix
    force: sympy.Matrix


def balance_of(scene: Any) -> Balance:
    """Return the Euler-Lagrange equations of a scene, with its forces and constraints."""
    mechanics = mechanics_of(scene)
    x, v, structure, lagrangian = (
        mechanics.x, mechanics.v, mechanics.structure, mechanics.lagrangian,
    )  # fmt: skip
    n, m = structure.dim_x, structure.dim_u
    momentum = sympy.Matrix([lagrangian.diff(v[g]) for g in range(m)])
    if mechanics.hamiltonian:
        return _by_hamiltonian(mechanics)
    x_rates = structure.rho * v if n else sympy.zeros(0, 1)
    force = sympy.Matrix([_force(structure, lagrangian, momentum, x, v, g) for g in range(m)])
    for g, component in enumerate(mechanics.acting):
        force[g] += component
    for g in range(m):
        force[g] -= momentum[g].diff(T)
        force[g] -= sum((momentum[g].diff(x[i]) * x_rates[i] for i in range(n)), sympy.S.Zero)
    mass = sympy.Matrix(m, m, lambda i, j: momentum[i].diff(v[j]))
    admitted = mechanics.admitted
    if k := admitted.rows:
        off = admitted * v - mechanics.moving
        turning = off.diff(T) + (off.jacobian(x) * x_rates if n else sympy.zeros(k, 1))
        mass = mass.row_join(-mechanics.pushing.T).col_join(admitted.row_join(sympy.zeros(k, k)))
        force = force.col_join(-turning)
    return Balance(mechanics, momentum, x_rates, mass, force)


def _by_hamiltonian(mechanics: Mechanics) -> Balance:
    """Return the equations in (x, mu), whose mass matrix is 1."""
    x, mu, structure, energy = (
        mechanics.x, mechanics.v, mechanics.structure, mechanics.lagrangian,
    )  # fmt: skip
    n, m = structure.dim_x, structure.dim_u
    speed = sympy.Matrix([energy.diff(e) for e in mu])
    force = sympy.zeros(m, 1)
    for (a, b, c), constant in structure.constants.items():
        # C^a_{bc} in the order of `_force`: of component b, with the speed c
        force[b] -= constant * speed[c] * mu[a]
    for g in range(m):
        force[g] -= sum((structure.rho[i, g] * energy.diff(x[i]) for i in range(n)), sympy.S.Zero)
        force[g] += mechanics.acting[g] if mechanics.acting else 0
    x_rates = structure.rho * speed if n else sympy.zeros(0, 1)
    return Balance(mechanics, mu, x_rates, sympy.eye(m), force)


def _first_order(mechanics: Mechanics) -> tuple[sympy.Matrix, sympy.Matrix]:
    """A and dH/dx of A dx/dt = dH/dx."""
    x, v = mechanics.x, mechanics.v
    slope = sympy.Matrix([mechanics.lagrangian.diff(e) for e in v]).jacobian(x)
    energy = mechanics.lagrangian.xreplace(dict.fromkeys(v, sympy.S.Zero))
    return (slope.T - slope).applyfunc(sympy.simplify), sympy.Matrix([-energy.diff(e) for e in x])


def _of_first_order(scene: Any, mechanics: Mechanics) -> Equations:
    """dx/dt = A^-1 dH/dx: planes of two coordinates written out, others by elimination."""
    x, v = mechanics.x, mechanics.v
    theta = [mechanics.lagrangian.diff(e) for e in v]
    energy = -mechanics.lagrangian.xreplace(dict.fromkeys(v, sympy.S.Zero))
    A, slope = _first_order(mechanics)
    at_start = dict(zip(x, mechanics.start, strict=True))
    if sympy.simplify(A.xreplace(at_start).det()) == 0:
        raise ReferenceFailure(
            f"dtheta of scene {scene.name} is singular at the start, so that no velocity follows; "
            "start elsewhere"
        )
    blocks, assignments = A.connected_components(), list[Any]()
    if all(len(block) == 2 for block in blocks):
        rates: list[Any] = [sympy.S.Zero] * len(x)
        for i, j in blocks:
            over = sympy.simplify(1 / A[i, j])
            rates[i], rates[j] = (sympy.cancel(e) if e.is_rational_function(*x) else e
                                  for e in (-over * slope[j], over * slope[i]))  # fmt: skip
    else:
        assignments, rates = explicit_rates(scene.name, A, slope, at_start, len(x))
    return Equations(
        scene.name, tuple(x), mechanics.start, tuple(assignments), tuple(rates),
        mechanics.lagrangian, tuple(theta), energy, len(x), 0, 0,
    )  # fmt: skip


def equations_of(scene: Any, attitude: bool = False) -> Equations:
    """Return the explicit Euler-Lagrange equations of a scene, with dA/dt = A xi^ if requested."""
    balance = balance_of(scene)
    if balance.mechanics.degenerate:
        return _of_first_order(scene, balance.mechanics)
    mechanics, momentum, mass, force = (
        balance.mechanics, balance.momentum, balance.mass, balance.force,
    )  # fmt: skip
    x, v, structure, admitted = mechanics.x, mechanics.v, mechanics.structure, mechanics.admitted
    n, m, start = structure.dim_x, structure.dim_u, mechanics.start
    at_start = dict(zip([*x, *v, T], [*start, sympy.S.Zero], strict=True))
    assignments, v_rates = explicit_rates(scene.name, mass, force, at_start, m)
    if admitted.rows and not mass[:m, :m].free_symbols:
        turned = mass[:m, :m].inv() * mechanics.pushing.T
        tied = admitted * turned
        size = sympy.simplify(tied.det())
        if not size.free_symbols:  # written out, because the terms of an elimination may have poles
            free = mass[:m, :m].inv() * force[:m, :]
            v_rates = free + turned * tied.adjugate() * (force[m:, :] - admitted * free) / size
            assignments, v_rates = [], list(v_rates.applyfunc(sympy.simplify))
    states, rates, size = [*x, *v], [*balance.x_rates, *v_rates[:m]], 0
    if attitude:
        size = structure.basis[0].rows
        matrix = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"A{i}_{j}", real=True))
        speed = [mechanics.lagrangian.diff(e) for e in v] if mechanics.hamiltonian else v
        velocity = sum((structure.basis[g] * speed[g] for g in range(m)), sympy.zeros(size, size))
        states += list(matrix)
        rates += list(matrix * velocity)
        start = (*start, *sympy.eye(size))
    if mechanics.timed:
        states, rates, start = [*states, T], [*rates, sympy.S.One], (*start, sympy.S.Zero)
    energy = sum((momentum[g] * v[g] for g in range(m)), sympy.S.Zero) - mechanics.lagrangian
    if mechanics.hamiltonian:
        energy = mechanics.lagrangian
    return Equations(
        scene.name, tuple(states), start, tuple(assignments), tuple(rates), mechanics.lagrangian,
        tuple(momentum), energy, n, m, size, mechanics.timed, bool(mechanics.acting),
        tuple(admitted if mechanics.pushing == admitted else mass), mechanics.driven,
    )  # fmt: skip


def _start(
    scene: Any,
    x: sympy.Matrix,
    v: sympy.Matrix,
    phi: sympy.Matrix,
    off: sympy.Matrix,
    hamiltonian: bool = False,
) -> tuple[sympy.Expr, ...]:
    """Return (x0, v0), or (x0, mu0), as exact sympy numbers.

    At t = 0 they satisfy phi = 0 and A xi - a = 0.
    """
    second = ("mu0", scene.mu0) if hamiltonian else ("v0", scene.v0)
    start = *_numbers(scene, "x0", scene.x0, len(x)), *_numbers(scene, *second, len(v))
    if not off.rows:
        return start
    at_start = {T: sympy.S.Zero}
    return on_constraints(scene.name, start, phi.xreplace(at_start), off.xreplace(at_start), x, v)


def _numbers(scene: Any, name: str, start: Any, wanted: int) -> tuple[sympy.Expr, ...]:
    if len(start) != wanted:
        raise ReferenceFailure(
            f"{name} of scene {scene.name} has {len(start)} entries where its groupoid "
            f"has {wanted}; give {wanted}"
        )
    return tuple(exact_number(e, f"{name}[{i}] of scene {scene.name}") for i, e in enumerate(start))


def _with_symbolic_parameters(values: Any, entries: Any) -> list[sympy.Expr]:
    substitution: dict[Any, Any] = {}
    symbols = type(values)()
    for name, value in vars(values).items():
        if isinstance(value, sympy.MatrixBase):
            letters = sympy.Matrix(*value.shape, lambda i, j: sympy.Dummy(real=True))
            substitution.update(zip(letters, value, strict=True))
        else:
            letters = sympy.Dummy(real=True)
            substitution[letters] = value
        setattr(symbols, name, letters)
    return [without_floats(e).subs(substitution) for e in entries(symbols)]


def _force(
    structure: Algebroid, lagrangian: Any, momentum: Any, x: Any, v: Any, g: int
) -> sympy.Expr:
    """Return rho^i_g dl/dx^i - C^n_{gm} xi^m dl/dxi^n."""
    terms = [structure.rho[i, g] * lagrangian.diff(x[i]) for i in range(structure.dim_x)]
    terms += [
        -constant * v[b] * momentum[n]
        for (n, a, b), constant in structure.constants.items()
        if a == g
    ]
    return sympy.expand(sympy.Add(*terms)) if not structure.dim_x else sympy.Add(*terms)
