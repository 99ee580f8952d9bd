"""Anchor and structure functions of the Lie algebroid of a groupoid, derived from scene data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .exact import exact_array, without_floats
from .failures import ReferenceFailure

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True)
class Algebroid:
    """rho (dim_x x dim_u) and the non-zero C^g_{mn}, as {(g, m, n): expression}."""

    rho: sympy.Matrix
    constants: dict[tuple[int, int, int], sympy.Expr]
    dim_x: int
    dim_u: int
    basis: tuple[sympy.Matrix, ...] = ()


def algebroid_of(scene: Any, x: sympy.Matrix) -> Algebroid:
    """The algebroid of the scene's groupoid at the symbolic base point x."""
    import sympy

    groupoid = scene.groupoid
    n, m = groupoid.dim_x, groupoid.dim_u
    if groupoid.kind == "pair":
        return Algebroid(sympy.eye(n), {}, n, m)
    if groupoid.kind in ("group", "action"):
        basis = tuple(
            exact_array(matrix, f"the algebra's basis in scene {scene.name}")
            for matrix in groupoid.algebra.basis
        )
        if len(basis) != m:
            raise ReferenceFailure(
                f"the algebra of scene {scene.name} has {len(basis)} basis matrices where its "
                f"groupoid has dim_u = {m}; give {m}"
            )
        return Algebroid(
            _row_anchor(basis, x, scene.name), structure_constants(basis, scene.name), n, m, basis
        )
    if groupoid.kind == "local":
        return _local(scene, x)
    raise ReferenceFailure(
        f"scene {scene.name} lives on a groupoid of unknown kind {groupoid.kind!r}; "
        "references know pair, group, action and local ones"
    )


def _row_anchor(basis: tuple[sympy.Matrix, ...], x: sympy.Matrix, name: str) -> sympy.Matrix:
    """rho with columns x e_g; x is one row vector, or several below each other, flattened."""
    import sympy

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
    """C^g_{mn} with [e_m, e_n] = C^g_{mn} e_g, from the commutators of the matrices."""
    import sympy

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
            found = (coordinates * flat).applyfunc(sympy.simplify)
            if (columns * found - flat).applyfunc(sympy.simplify) != sympy.zeros(columns.rows, 1):
                raise ReferenceFailure(
                    f"the algebra of scene {name} is not closed: [e_{i}, e_{j}] leaves the span "
                    "of its basis; add the missing matrices"
                )
            for g, constant in enumerate(found):
                if constant != 0:
                    constants[g, i, j], constants[g, j, i] = constant, -constant
    return constants


def _local(scene: Any, x: sympy.Matrix) -> Algebroid:
    """rho and C of a groupoid given by its target b(x, u; h) and product p(x, u, v; h)."""
    import sympy

    groupoid = scene.groupoid
    n, m = groupoid.dim_x, groupoid.dim_u
    u = sympy.Matrix(m, 1, lambda i, _: sympy.Symbol(f"u{i}", real=True))
    w = sympy.Matrix(m, 1, lambda i, _: sympy.Symbol(f"u'{i}", real=True))
    h = sympy.Symbol("h", positive=True)
    try:
        target = sympy.Matrix(n, 1, list(groupoid.target(x, u, h)))
        product = sympy.Matrix(m, 1, list(groupoid.product(x, u, w, h)))
    except Exception as error:
        raise ReferenceFailure(
            f"target or product of scene {scene.name} cannot be evaluated on symbols "
            f"({type(error).__name__}: {error}); write them with sympy functions"
        ) from error

    def at_identity(expression: sympy.Expr) -> sympy.Expr:
        zero: dict[Any, Any] = {symbol: 0 for symbol in (*u, *w)}
        found = sympy.cancel(without_floats(expression / h).subs(zero))
        if found.has(sympy.nan, sympy.zoo):
            raise ReferenceFailure(
                f"target or product of scene {scene.name} cannot be differentiated at the "
                "identity u = 0 (0/0); write them with functions that are regular there"
            )
        if found.has(h):
            found = sympy.simplify(found)
        if found.has(h):
            raise ReferenceFailure(
                f"target or product of scene {scene.name} does not scale with the step: {found} "
                "should not depend on h; let u be a velocity, as in b = x + h*u"
            )
        return found

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
