"""Anchor and structure functions of the Lie algebroid of a groupoid, derived from scene data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy

from ..failures import ReferenceFailure, shown
from .exact import exact_array, without_floats


@dataclass(frozen=True)
class Algebroid:
    """The anchor rho (dim_x x dim_u) and the non-zero C^g_{mn}, as {(g, m, n): expression}.

    ``basis``: matrices with dA/dt = A (v^g basis_g) for the attitude A, if there is a real one; it
    may depend on x (a connection) and has zeros for velocities that do not turn the body.
    """

    rho: sympy.Matrix
    constants: dict[tuple[int, int, int], sympy.Expr]
    dim_x: int
    dim_u: int
    basis: tuple[sympy.Matrix, ...] = ()


def algebroid_of(scene: Any, x: sympy.Matrix) -> Algebroid:
    """Return the algebroid of the scene's groupoid at the symbolic base point x."""
    return _algebroid(scene.groupoid, x, scene.name)


def _algebroid(groupoid: Any, x: sympy.Matrix, name: str) -> Algebroid:
    n, m = groupoid.dim_x, groupoid.dim_u
    if groupoid.kind == "pair":
        return Algebroid(sympy.eye(n), {}, n, m)
    if groupoid.kind in ("group", "action"):
        basis = tuple(
            exact_array(matrix, f"the algebra's basis in scene {name}", real=False)
            for matrix in groupoid.algebra.basis
        )
        if len(basis) != m:
            raise ReferenceFailure(
                f"the algebra of scene {name} has {len(basis)} basis matrices where its "
                f"groupoid has dim_u = {m}; give {m}"
            )
        moved = getattr(groupoid, "right_action", None)
        rho = _moved_anchor(basis, moved, x, name) if moved else _row_anchor(basis, x, name)
        real = all(entry.is_real for matrix in basis for entry in matrix)
        return Algebroid(rho, structure_constants(basis, name), n, m, basis if real else ())
    if groupoid.kind == "product":
        return _product(groupoid, x, name)
    if groupoid.kind == "local":
        return _local(groupoid, x, name)
    raise ReferenceFailure(
        f"scene {name} lives on a groupoid of unknown kind {shown(groupoid.kind)}; "
        "references know pair, group, action, product and local ones"
    )


def _product(groupoid: Any, x: sympy.Matrix, name: str) -> Algebroid:
    """Return algebroids side by side; with a connection A in the frame e_i - A^a_i e_a, e_a."""
    one, two = groupoid.parts
    at = one.dim_x
    parts = [_algebroid(one, x[:at, :], name), _algebroid(two, x[at:, :], name)]
    k = parts[0].dim_u
    constants = dict(parts[0].constants)
    for (g, i, j), constant in parts[1].constants.items():
        constants[g + k, i + k, j + k] = constant
    rho = sympy.diag(parts[0].rho, parts[1].rho)
    basis = _product_basis(parts)
    whole = Algebroid(rho, constants, groupoid.dim_x, groupoid.dim_u, basis)
    if groupoid.connection is None:
        return whole
    A = sympy.Matrix(groupoid.connection(x)).applyfunc(without_floats)
    if A.shape != (parts[1].dim_u, k):
        raise ReferenceFailure(
            f"the connection of scene {name} is a {A.shape} matrix; give {(parts[1].dim_u, k)}"
        )
    frame = sympy.eye(groupoid.dim_u)
    frame[k:, :k] = -A
    return in_frame(whole, frame, x)


def _product_basis(parts: list[Algebroid]) -> tuple[sympy.Matrix, ...]:
    """Return matrices of the attitude's velocity if one part is a group; 0 for the other part."""
    groups = [p for p in parts if p.basis and not p.dim_x]
    if len(groups) != 1:
        return ()
    size = groups[0].basis[0].rows
    zero = sympy.zeros(size, size)
    return tuple(
        matrix for p in parts for matrix in (p.basis if p is groups[0] else (zero,) * p.dim_u)
    )


def in_frame(algebroid: Algebroid, frame: sympy.Matrix, x: sympy.Matrix) -> Algebroid:
    """Return the same algebroid with the columns of frame(x) as basis of sections.

    [f_m, f_n] = f_m^a f_n^b [e_a, e_b] + (rho(f_m) f_n - rho(f_n) f_m), by the Leibniz rule.
    """
    m, back = algebroid.dim_u, frame.inv()
    fields = [frame[:, i] for i in range(m)]
    moves = [algebroid.rho * f for f in fields]
    constants: dict[tuple[int, int, int], sympy.Expr] = {}
    for i in range(m):
        for j in range(i):
            bracket = fields[j].jacobian(x) * moves[i] - fields[i].jacobian(x) * moves[j]
            for (g, a, b), constant in algebroid.constants.items():
                bracket[g] += constant * fields[i][a] * fields[j][b]
            for g, value in enumerate((back * bracket).applyfunc(sympy.cancel)):
                if value != 0:
                    constants[g, i, j], constants[g, j, i] = value, -value
    basis = tuple(
        sum((f[a] * e for a, e in enumerate(algebroid.basis)), 0 * algebroid.basis[0])
        for f in (fields if algebroid.basis else ())
    )
    return Algebroid(algebroid.rho * frame, constants, algebroid.dim_x, m, basis)


def _moved_anchor(
    basis: tuple[sympy.Matrix, ...], moved: Any, x: sympy.Matrix, name: str
) -> sympy.Matrix:
    """Return rho with columns d/ds x.(e + s e_g) at s = 0, for a right action that a user gave."""
    s, one = sympy.Symbol("s", real=True), sympy.eye(basis[0].rows)
    try:
        curves = [sympy.Matrix(x.rows, 1, list(moved(x, one + s * e))) for e in basis]
    except Exception as error:
        raise ReferenceFailure(
            f"the action of scene {name} cannot be evaluated on symbols "
            f"({type(error).__name__}: {error}); write it with sympy functions"
        ) from error
    slopes = [curve.applyfunc(without_floats).diff(s).subs(s, 0) for curve in curves]
    return sympy.Matrix.hstack(*slopes).applyfunc(sympy.cancel)


def _row_anchor(basis: tuple[sympy.Matrix, ...], x: sympy.Matrix, name: str) -> sympy.Matrix:
    """Return rho with columns x e_g; x is one row vector, or several together, flattened."""
    size = basis[0].rows
    if x.rows % size:
        raise ReferenceFailure(
            f"x of scene {name} has {x.rows} entries, which are no rows of length {size} for the "
            "algebra's matrices to act on; give a multiple"
        )
    columns = [(x.reshape(x.rows // size, size) * e).reshape(x.rows, 1) for e in basis]
    return sympy.Matrix.hstack(*columns)


def structure_constants(
    basis: tuple[sympy.Matrix, ...], name: str
) -> dict[tuple[int, int, int], sympy.Expr]:
    """Return C^g_{mn} with [e_m, e_n] = C^g_{mn} e_g, from the commutators of the matrices."""
    columns = sympy.Matrix.hstack(*(e.reshape(e.rows * e.cols, 1) for e in basis))
    gram = columns.T * columns
    if gram.det() == 0:
        raise ReferenceFailure(
            f"the basis of the algebra of scene {name} is linearly dependent; "
            "leave out the superfluous matrices"
        )
    coordinates = gram.inv() * columns.T
    constants: dict[tuple[int, int, int], sympy.Expr] = {}
    for i in range(len(basis)):
        for j in range(i):
            bracket = basis[i] * basis[j] - basis[j] * basis[i]
            flat = bracket.reshape(columns.rows, 1)
            entries = (coordinates * flat).applyfunc(sympy.simplify)
            if (columns * entries - flat).applyfunc(sympy.simplify) != sympy.zeros(columns.rows, 1):
                raise ReferenceFailure(
                    f"the algebra of scene {name} is not closed: [e_{i}, e_{j}] leaves the span "
                    "of its basis; add the missing matrices"
                )
            for g, constant in enumerate(entries):
                if constant != 0:
                    constants[g, i, j], constants[g, j, i] = constant, -constant
    return constants


def _local(groupoid: Any, x: sympy.Matrix, name: str) -> Algebroid:
    """Return rho and C of a groupoid given by its target b(x, u; h) and product p(x, u, v; h)."""
    n, m = groupoid.dim_x, groupoid.dim_u
    u = sympy.Matrix(m, 1, lambda i, _: sympy.Symbol(f"u{i}", real=True))
    w = sympy.Matrix(m, 1, lambda i, _: sympy.Symbol(f"u'{i}", real=True))
    h = sympy.Symbol("h", positive=True)
    try:
        target = sympy.Matrix(n, 1, list(groupoid.target(x, u, h)))
        product = sympy.Matrix(m, 1, list(groupoid.product(x, u, w, h)))
    except Exception as error:
        raise ReferenceFailure(
            f"target or product of scene {name} cannot be evaluated on symbols "
            f"({type(error).__name__}: {error}); write them with sympy functions"
        ) from error

    def at_identity(expression: sympy.Expr) -> sympy.Expr:
        zero: dict[Any, Any] = {symbol: 0 for symbol in (*u, *w)}
        slope = sympy.cancel(without_floats(expression / h).subs(zero))
        if slope.has(sympy.nan, sympy.zoo):
            raise ReferenceFailure(
                f"target or product of scene {name} cannot be differentiated at the "
                "identity u = 0 (0/0); write them with functions that are regular there"
            )
        if slope.has(h):
            slope = sympy.simplify(slope)
        if slope.has(h):
            raise ReferenceFailure(
                f"target or product of scene {name} does not scale with the step: {slope} "
                "should not depend on h; let u be a velocity, as in b = x + h*u"
            )
        return slope

    rho = sympy.Matrix(n, m, lambda i, g: at_identity(target[i].diff(u[g])))
    constants: dict[tuple[int, int, int], sympy.Expr] = {}
    for g in range(m):
        for i in range(m):
            for j in range(i):
                mixed = product[g].diff(u[i], w[j]) - product[g].diff(w[i], u[j])
                constant = at_identity(mixed)
                if constant != 0:
                    constants[g, i, j], constants[g, j, i] = constant, -constant
    return Algebroid(rho, constants, n, m)
