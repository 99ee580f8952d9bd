"""Matrix algebras: their bases and structure constants, and what is no algebra."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from sympy import Matrix, Rational, zeros

from discmech.integrators import BadInput, MatrixAlgebra, lie_group, se, sl, so, sp, su
from discmech.integrators.retractions import cayley, exponential
from tests.objects.retractions import close, decimals, direction, element

ALGEBRAS = {
    a.name: (a, dim, closed)
    for a, dim, closed in (
        (so(2), 1, True),
        (so(3), 3, True),
        (so(4), 6, True),
        (so(5), 10, True),
        (se(2), 3, True),
        (se(3), 6, True),
        (sl(2), 3, True),
        (sl(3), 8, False),
        (sp(2), 3, True),
        (sp(4), 10, True),
        (su(2), 3, True),
        (su(3), 8, False),
    )
}


@pytest.fixture(params=ALGEBRAS)
def algebra(request):
    return ALGEBRAS[request.param][0]


@pytest.mark.dear("sp(4)", "so(5)")
@pytest.mark.parametrize("name", ALGEBRAS)
def test_dimension_and_fitness_for_cayley(name):
    algebra, dim, closed = ALGEBRAS[name]
    assert algebra.dim == len(algebra.basis) == dim
    assert algebra.closed_under_triple_products == closed
    if closed:
        cayley.check(algebra)
    else:
        with pytest.raises(BadInput, match=r"Cayley transform does not map .* exponential"):
            cayley.check(algebra)


def matrices(algebra):
    return [Matrix(e).applyfunc(sympy.nsimplify) for e in algebra.basis]


def test_the_basis_is_independent(algebra):
    n = algebra.size
    assert Matrix.hstack(*[e.reshape(n * n, 1) for e in matrices(algebra)]).rank() == algebra.dim


DEFINING = {
    "so": lambda e: e + e.T,
    "se": lambda e: (e[:-1, :-1] + e[:-1, :-1].T).col_join(e[-1, :-1]),
    "sl": lambda e: Matrix([e.trace()]),
    "su": lambda e: (e + e.H).col_join(Matrix([[e.trace()] + [0] * (e.rows - 1)])),
}


def symplectic_form(n):
    half = n // 2
    form = zeros(n)
    for i in range(half):
        form[i, half + i], form[half + i, i] = 1, -1
    return form


def test_the_basis_lies_in_the_algebra(algebra):
    """Skew; traceless; skew-Hermitian; JE + EᵀJ = 0: by the definition of each."""
    form = symplectic_form(algebra.size)
    for e in matrices(algebra):
        kind = algebra.name[:2]
        rest = form * e + e.T * form if kind == "sp" else DEFINING[kind](e)
        assert rest.is_zero_matrix
    if algebra.name.startswith("se"):
        assert all(e[-1, -1] == 0 for e in matrices(algebra))


@pytest.mark.dear("sp(4)", "so(5)")
def test_structure_constants(algebra):
    """They give the commutators back, are antisymmetric, real, and satisfy Jacobi."""
    C, es, m = algebra.structure_constants, matrices(algebra), algebra.dim
    for a in range(m):
        for b in range(a):
            bracket = es[a] * es[b] - es[b] * es[a]
            again = sum((C[c][a, b] * es[c] for c in range(m)), zeros(algebra.size))
            assert (bracket - again).expand().is_zero_matrix
    assert all((c + c.T).is_zero_matrix for c in C)
    assert all(entry.is_real for c in C for entry in c)
    table = np.array([[[C[c][a, b] for b in range(m)] for a in range(m)] for c in range(m)])
    nested = np.einsum("dae,ebc->dabc", table, table)
    jacobi = nested + nested.transpose(0, 2, 3, 1) + nested.transpose(0, 3, 1, 2)
    assert not np.any(jacobi)


def test_hat_and_coordinates_are_inverse(algebra):
    xi = Matrix([Rational(3 * i - 4, 5 + i) for i in range(algebra.dim)])
    assert (algebra.coordinates(algebra.hat(xi)) - xi).expand().is_zero_matrix
    assert algebra.contains(algebra.hat(xi))
    assert not algebra.contains(sympy.eye(algebra.size))


def test_so3_is_the_cross_product():
    xi, x = Matrix([1, 2, 3]), Matrix([-2, 5, 7])
    assert so(3).hat(xi) * x == xi.cross(x)


def test_su2_is_so3():
    """The chosen bases have the structure constants of the cross product, up to order."""
    for constants in (so(3).structure_constants, su(2).structure_constants):
        killing = Matrix(3, 3, lambda a, b, C=constants: sum(
            C[d][a, c] * C[c][b, d] for c in range(3) for d in range(3)))  # fmt: skip
        assert killing == -2 * sympy.eye(3)


def test_complex_matrices_have_real_coordinates():
    """Cayley on su(2): fields, product and ι are real expressions, elements unitary."""
    g = lie_group(su(2))
    s = g.symbols
    none = sympy.zeros(0, 1)
    for matrix in (g.L(none, s["u"], s["h"]), g.R(none, s["u"], s["h"])):
        assert all(entry.is_real and not entry.has(sympy.I) for entry in matrix)
    u, v, h = Matrix([1, -2, 3]) / 4, Matrix([2, 1, -1]) / 3, Rational(2, 5)
    p = g.product(none, u, v, h)
    assert all(entry.is_Rational for entry in p)
    e = g.element(u, h)
    assert (e * e.H - sympy.eye(2)).expand().is_zero_matrix and sympy.expand(e.det()) == 1
    assert (e * g.element(v, h) - g.element(p, h)).applyfunc(sympy.radsimp).expand().is_zero_matrix


def test_wrong_algebras_are_named():
    with pytest.raises(BadInput, match=r"sp\(3\): the size .* is even; write sp\(4\)"):
        sp(3)
    with pytest.raises(BadInput, match="square matrices of one size"):
        MatrixAlgebra("ragged", (((0, 1), (0,)),))
    dependent = MatrixAlgebra("twice", (((0, 1), (0, 0)), ((0, 2), (0, 0))))
    with pytest.raises(BadInput, match="twice: its basis matrices are linearly dependent"):
        dependent.structure_constants  # noqa: B018
    open_one = MatrixAlgebra("open", (((0, 1), (0, 0)), ((0, 0), (1, 0))))
    with pytest.raises(
        BadInput, match=r"matrices 1 and 2 is not .* add it: \[\[1, 0\], \[0, -1\]\]"
    ):
        open_one.structure_constants  # noqa: B018


ROTATION = (((0, -1), (1, 0)),)


@pytest.mark.parametrize(
    "basis",
    [[[[0, -1], [1, 0]]], [np.array([[0.0, -1.0], [1.0, 0.0]])], np.array(ROTATION),
     [sympy.Matrix(ROTATION[0])], ([(0j, "-1"), (Fraction(1), np.int64(0))],),
     (list(row) for row in ROTATION)],
    ids=["lists", "arrays", "one array", "sympy's", "mixed", "generator"],
)  # fmt: skip
def test_a_basis_may_be_given_as_any_matrices(basis):
    algebra = MatrixAlgebra("plane", basis, cover=[np.eye(2)])
    assert algebra.basis == ROTATION and algebra.cover == (((1, 0), (0, 1)),)
    assert algebra == MatrixAlgebra("plane", ROTATION, algebra.cover) and hash(algebra)
    assert repr(lie_group(algebra)) == "group(plane)"


def test_a_basis_of_other_numbers_stays_exact():
    root, third = sympy.sqrt(2), Fraction(1, 3)
    ((first, second),) = MatrixAlgebra("odd", [[[0.5, third], [root, 1j]]]).basis
    assert first == (Fraction(1, 2), third) and second == (root, 1j)
    assert MatrixAlgebra("i", [[[sympy.I / 2]]]).basis == (((sympy.I / 2,),),)


@pytest.mark.parametrize(
    ("basis", "message"),
    [
        ([], "the basis is empty; give at least one"),
        (None, "basis holds None where rows are needed"),
        (ROTATION[0], r"basis\[0\] holds 0 where rows are needed"),
        (["ab"], r"basis\[0\] holds 'ab' where rows"),
        ([[[0, "a"], [1, 0]]], r'basis\[0\]\[0, 1\] is "a", which is no number'),
        ([[[0, np.nan], [1, 0]]], r"\[0, 1\] is nan"),
        ([[[sympy.Symbol("a")]]], r"is a of type Symbol: give a number"),
        ([[[complex("inf+1j")]]], "is inf: give a finite"),
        ([[]], "square matrices of one size"),
        ([[[], []]], "square matrices of one size"),
        ([np.eye(2), np.eye(3)], "square matrices of one size"),
    ],
    ids=str,
)
def test_what_is_no_basis_is_refused(basis, message):
    with pytest.raises(BadInput, match="algebra odd: .*" + message):
        MatrixAlgebra("odd", basis)


@pytest.mark.parametrize(
    ("cover", "message"),
    [
        ([np.eye(3)], "square matrices of one size"),
        ([[[1, 0]]], "square matrices of one size"),
        ([[[-1, 0], [0, -1]], np.eye(2)], "a cover begins with the identity"),
        (7, "cover holds 7 where rows are needed"),
    ],
    ids=str,
)
def test_what_is_no_cover_is_refused(cover, message):
    with pytest.raises(BadInput, match="algebra plane: .*" + message):
        MatrixAlgebra("plane", ROTATION, cover)


def test_a_complex_cover_has_a_real_form():
    """The circle with i·e: [[0, −1], [1, 0]]."""
    circle = MatrixAlgebra("circle", [[[1j]]], [[[1]], [[1j]]]).real
    assert circle.cover[1] == ((0, -1), (1, 0)) and circle.basis == ROTATION


@pytest.mark.slow
@pytest.mark.parametrize("given", [so(3), so(4)], ids=lambda a: a.name)
def test_irrational_bases_have_both_charts(given):
    """A basis vector times √2: τ(ξ)τ(η) = τ(p), and L⁻¹L = 1; ideals are sought over ℚ only."""
    first, *others = given.basis
    scaled = [[sympy.sqrt(2) * e for e in row] for row in first]
    algebra = MatrixAlgebra("scaled", [scaled, *others])
    xi, eta = (direction(algebra, seed) / 9 for seed in (0, 1))
    for tau in (cayley, exponential):
        left = decimals(tau.invariant_fields(algebra, xi)[0])
        assert close(decimals(tau.inverse_left_field(algebra, xi)) * left, sympy.eye(algebra.dim))
        if tau is cayley or given.dim == 3:
            p = decimals(tau.product(algebra, xi, eta))
            both = element(tau, algebra, xi) * element(tau, algebra, eta)
            assert close(element(tau, algebra, p), both)
