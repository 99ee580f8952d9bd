"""Matrix Lie algebras: a basis of exact square matrices, everything else derived from it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, combinations, combinations_with_replacement, permutations, product
from math import prod

from .errors import BadInput, shown
from .numbers import exact_matrices, floats_exact, sympy
from .numbers.types import Exact, Expressions, SymbolicMatrix

Nested = tuple[tuple[Exact, ...], ...]


@dataclass(frozen=True)
class MatrixAlgebra:
    """The span of `basis` (m linearly independent N×N matrices), closed under the commutator.

    Coordinates ξ ∈ Rᵐ stand for the matrix ξ^γ e_γ. Matrices are given as rows, or as numpy's or
    sympy's, and stored as nested tuples of exact numbers: building an algebra loads nothing, and
    what needs symbolic mathematics is derived when first asked for.
    `cover`: elements B of the group, e first, such that every g has det(e + g B⁻¹) ≠ 0 for one of
    them: their translates of the Cayley chart hold the whole group (paper, section 4.3).
    Raises `BadInput` unless they are square matrices of numbers, all of one size, and e is first.
    """

    name: str
    basis: tuple[Nested, ...]
    cover: tuple[Nested, ...] = ()

    def __post_init__(self) -> None:
        for part in ("basis", "cover"):
            entries = exact_matrices(getattr(self, part), f"algebra {self.name}: {part}")
            object.__setattr__(self, part, entries)
        if not self.basis:
            raise BadInput(f"algebra {self.name}: the basis is empty; give at least one matrix.")
        matrices = (*self.basis, *self.cover)
        sizes = {(len(e), len(row)) for e in matrices for row in e or ((),)}
        if len(sizes) != 1 or any(rows != columns or not rows for rows, columns in sizes):
            raise BadInput(
                f"algebra {self.name}: basis and cover need square matrices of one size, "
                f"but the shapes {sorted(sizes)} occur."
            )
        if self.translates[0] != _signature((1,) * self.size):
            raise BadInput(f"algebra {self.name}: a cover begins with the identity matrix; add it.")

    @property
    def dim(self) -> int:
        """m, the number of basis matrices."""
        return len(self.basis)

    @property
    def size(self) -> int:
        """N, the number of rows of a basis matrix."""
        return len(self.basis[0])

    @property
    def translates(self) -> tuple[Nested, ...]:
        """The elements B of the cover, or e alone where no cover is known."""
        return self.cover or (_signature((1,) * self.size),)

    def hat(self, xi: Expressions) -> SymbolicMatrix:
        """The N×N sympy matrix ξ^γ e_γ of the coordinates ξ (length m)."""
        return sum((c * e for c, e in zip(xi, self.matrices, strict=True)), sympy.zeros(self.size))

    def coordinates(self, *matrices: SymbolicMatrix) -> SymbolicMatrix:
        """The coordinates of N×N sympy matrices that lie in the algebra, a column (m×1) each."""
        columns = self.dual * _side_by_side(matrices)
        # complex matrices have real coordinates; left alone, i·i would never be multiplied out
        return columns.applyfunc(lambda e: e.expand(complex=True)) if self.is_complex else columns

    @cached_property
    def is_complex(self) -> bool:
        """True if a basis matrix has an entry that is not real."""
        return any(  # without sympy: building an action loads nothing
            isinstance(entry, complex) or getattr(entry, "is_real", True) is False
            for e in self.basis for row in e for entry in row
        )  # fmt: skip

    def contains(self, *matrices: SymbolicMatrix) -> bool:
        """True if the matrices are combinations of the basis, exactly."""
        basis = _side_by_side(self.matrices)
        rest = _side_by_side(matrices) - basis * self.coordinates(*matrices)
        return all(entry == 0 or sympy.simplify(entry) == 0 for entry in rest)

    @cached_property
    def matrices(self) -> list[SymbolicMatrix]:
        """The basis with sympy's numbers; floats and complex ones are their exact values."""
        return [sympy.Matrix(e).applyfunc(floats_exact) for e in self.basis]

    @cached_property
    def dual(self) -> SymbolicMatrix:
        """The m×N² matrix that maps a matrix to its coordinates (least squares, exact)."""
        columns = _side_by_side(self.matrices)
        gram = columns.H * columns
        if gram.det() == 0:
            raise BadInput(
                f"algebra {self.name}: its basis matrices are linearly dependent; leave out "
                "those that are combinations of the others."
            )
        return gram.inv() * columns.H

    @cached_property
    def structure_constants(self) -> list[SymbolicMatrix]:
        """m matrices: entry [γ][μ, ν] is Ĉ^γ_{μν} of [e_μ, e_ν] = Ĉ^γ_{μν} e_γ.

        Raises `BadInput` if a commutator leaves the span of the basis.
        """
        constants = [sympy.zeros(self.dim) for _ in range(self.dim)]
        for m, n in combinations(range(self.dim), 2):
            a, b = self.matrices[m], self.matrices[n]
            bracket = a * b - b * a
            if not self.contains(bracket):
                raise BadInput(
                    f"algebra {self.name}: the commutator of basis matrices {m + 1} and {n + 1} "
                    f"is not a combination of the basis; add it: {bracket.tolist()}."
                )
            for g, value in enumerate(self.coordinates(bracket)):
                constants[g][m, n], constants[g][n, m] = value, -value
        return constants

    def ad(self, xi: Expressions) -> SymbolicMatrix:
        """The m×m matrix of η ↦ [ξ, η], with entries Ĉ^γ_{μν} ξ^μ."""
        row = sympy.Matrix([list(xi)])
        return sympy.Matrix.vstack(*[row * c for c in self.structure_constants])

    @cached_property
    def ideals(self) -> list[SymbolicMatrix]:
        """Projections (m×m, rational) on ideals whose direct sum the algebra is; [1] if simple.

        They are eigenspaces of a random map that commutes with every ad_ξ.
        """
        one, t = sympy.eye(self.dim), sympy.Symbol("t")
        rows = [
            sympy.kronecker_product(one, a.T) - sympy.kronecker_product(a, one)
            for a in map(self.ad, one.tolist())
        ]
        over_q = sympy.polys.matrices.DomainMatrix.from_Matrix(sympy.Matrix.vstack(*rows))
        if not (over_q.domain.is_ZZ or over_q.domain.is_QQ):
            return [one]  # irrational constants: the roots below would not be found
        kernel = over_q.convert_to(sympy.QQ).nullspace().to_Matrix()
        # multiples of a prime: no pattern that two ideals might share
        weights = sympy.Matrix([[(7919 * (i + 1)) % 101 for i in range(kernel.rows)]])
        commuting = (weights * kernel).reshape(self.dim, self.dim)
        factors = [f.as_poly(t) for f, _ in sympy.factor_list(commuting.charpoly(t).as_expr())[1]]
        roots = [-f.nth(0) / f.nth(1) for f in factors if f.degree() == 1]
        spaces = [sympy.Matrix.hstack(*(commuting - r * one).nullspace()) for r in roots]
        if len(roots) < 2 or sum(space.cols for space in spaces) != self.dim:
            return [one]
        basis, ends = sympy.Matrix.hstack(*spaces), accumulate(space.cols for space in spaces)
        back = basis.inv()
        return [
            space * back[end - space.cols : end, :] for space, end in zip(spaces, ends, strict=True)
        ]

    @cached_property
    def real(self) -> MatrixAlgebra:
        """The algebra itself if its matrices are real, else with a + ib ↦ [[a, −b], [b, a]]."""
        if not self.is_complex:
            return self
        matrices = (sympy.Matrix(e).applyfunc(floats_exact) for e in (*self.basis, *self.cover))
        parts = (e.as_real_imag() for e in matrices)
        real = [a.row_join(-b).col_join(b.row_join(a)).tolist() for a, b in parts]
        return MatrixAlgebra(self.name, real[: self.dim], real[self.dim :])  # type: ignore[arg-type]

    @cached_property
    def adjoint(self) -> tuple[Nested, ...]:
        """The m×m matrices of ad along each basis matrix, as nested tuples."""
        units = sympy.eye(self.dim).tolist()
        return tuple(tuple(map(tuple, self.ad(row).tolist())) for row in units)

    @cached_property
    def closed_under_triple_products(self) -> bool:
        """True if ξηξ stays in the algebra, as Cayley needs: true of so, se, sp, sl(2), su(2).

        It is tested by polarisation on e_a e_c e_b + e_b e_c e_a.
        """
        es = self.matrices
        pairs = combinations_with_replacement(es, 2)
        return self.contains(*(a * e * b + b * e * a for a, b in pairs for e in es))


def _side_by_side(matrices: Iterable[SymbolicMatrix]) -> SymbolicMatrix:
    """Return matrices as columns, each row by row."""
    return sympy.Matrix([list(e) for e in matrices]).T


def _elementary(n: int, entries: dict[tuple[int, int], Exact]) -> Nested:
    return tuple(tuple(entries.get((i, j), 0) for j in range(n)) for i in range(n))


def _signature(signs: Sequence[int]) -> Nested:
    return _elementary(len(signs), {(i, i): sign for i, sign in enumerate(signs)})


def _signatures(n: int, fixed: int = 0) -> tuple[Nested, ...]:
    """The 2ⁿ⁻¹ diagonal matrices of signs with determinant 1, e first; `fixed` more entries are 1.

    Some translate of SO(n) has det(e + g B⁻¹) ≥ 2, for the mean of det(B + g) over them is 2.
    """
    signs = [s for s in product((1, -1), repeat=n) if prod(s) == 1]
    return tuple(_signature((*s, *(1,) * fixed)) for s in signs)


def _plus_minus(n: int) -> tuple[Nested, ...]:
    """{e, −e}: det(e + g) + det(e − g) = 4 on SL(2) and SU(2)."""
    return _signature((1,) * n), _signature((-1,) * n)


LARGEST = 12  # the largest size of matrices: so(n) has 2ⁿ⁻¹ translates of its chart


def _sized(name: str, n: object, least: int) -> None:
    if type(n) is not int or not least <= n <= LARGEST:
        raise BadInput(
            f"{name}({shown(n)}): the size is a whole number from {least}, to {LARGEST}."
        )


def so(n: int) -> MatrixAlgebra:
    """Skew n×n matrices. so(3) has the paper's basis: ξ̂ x = ξ × x; else E_ji − E_ij for i < j."""
    _sized("so", n, 2)
    pairs = [(1, 2), (2, 0), (0, 1)] if n == 3 else list(combinations(range(n), 2))
    return MatrixAlgebra(
        f"so({n})", tuple(_elementary(n, {(i, j): -1, (j, i): 1}) for i, j in pairs), _signatures(n)
    )


def se(n: int) -> MatrixAlgebra:
    """Rigid motions of Rⁿ as (n+1)×(n+1) matrices: the rotations of so(n), then translations."""
    _sized("se", n, 2)
    rotations = [tuple((*row, 0) for row in e) + ((0,) * (n + 1),) for e in so(n).basis]
    translations = [_elementary(n + 1, {(i, n): 1}) for i in range(n)]
    return MatrixAlgebra(f"se({n})", (*rotations, *translations), _signatures(n, fixed=1))


def sl(n: int) -> MatrixAlgebra:
    """Traceless n×n matrices: the diagonal E_ii − E_i+1,i+1, then E_ij for i ≠ j."""
    _sized("sl", n, 2)
    diagonal = [_elementary(n, {(i, i): 1, (i + 1, i + 1): -1}) for i in range(n - 1)]
    others = [_elementary(n, {place: 1}) for place in permutations(range(n), 2)]
    return MatrixAlgebra(f"sl({n})", (*diagonal, *others), _plus_minus(n) if n == 2 else ())


def sp(n: int) -> MatrixAlgebra:
    """Hamiltonian n×n matrices, n even: JS with S symmetric, J the standard symplectic matrix."""
    _sized("sp", n, 2)
    if n % 2:
        raise BadInput(f"sp({n}): the size of symplectic matrices is even; write sp({n + 1}).")
    k = n // 2
    basis = [{(i, j): 1, (k + j, k + i): -1} for i, j in product(range(k), repeat=2)]
    upper = list(combinations_with_replacement(range(k), 2))
    basis += [{(i, k + j): 1, (j, k + i): 1} for i, j in upper]
    basis += [{(k + i, j): 1, (k + j, i): 1} for i, j in upper]
    cover = _plus_minus(n) if n == 2 else ()
    return MatrixAlgebra(f"sp({n})", tuple(_elementary(n, e) for e in basis), cover)


def su(n: int) -> MatrixAlgebra:
    """Skew-Hermitian traceless n×n matrices; su(2) is −i/2 times the Pauli matrices."""
    _sized("su", n, 2)
    basis: list[dict[tuple[int, int], Exact]] = []
    for i, j in combinations(range(n), 2):
        basis += [{(i, j): -0.5j, (j, i): -0.5j}, {(i, j): -0.5, (j, i): 0.5}]
    basis += [{(i, i): -0.5j, (i + 1, i + 1): 0.5j} for i in range(n - 1)]
    cover = _plus_minus(n) if n == 2 else ()
    return MatrixAlgebra(f"su({n})", tuple(_elementary(n, e) for e in basis), cover)
