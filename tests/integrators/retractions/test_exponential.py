"""The exponential's closed forms, derivatives and logarithm, and what a retraction refuses."""

import pytest
from sympy import Matrix, Rational, Symbol, eye, pi, sqrt, zeros

from discmech.integrators import (
    BadInput,
    MatrixAlgebra,
    Scene,
    action,
    cayley,
    exponential,
    lie_group,
    sl,
    so,
    su,
)
from discmech.integrators.numbers import evaluate_matrix
from discmech.integrators.retractions.ad_spectrum import turnings
from discmech.integrators.retractions.matrix_functions import (
    DEXP,
    DEXP_INVERSE,
    DISPLACEMENT,
    MatrixFunction,
)  # fmt: skip
from tests.objects import ALGEBRAS, ARROWS
from tests.objects.retractions import close, decimals, direction, element, fields, point

pytestmark = pytest.mark.sampled

EPS, ROOT = Rational(1, 10**30), sqrt(2)
CLOSED = ["so(3)", "su(2)", "sl(2)", "se(2)", "se(3)", "so(4)", "heisenberg", "pair of so(3)"]
GENERAL = ["sl(3)", "su(3)", "so(5)", "sp(4)"]
everywhere = pytest.mark.parametrize("stratum", ARROWS)


@pytest.mark.parametrize("name", CLOSED)
@everywhere
def test_closed_forms_are_the_general_construction(name, stratum):
    algebra = ALGEBRAS[name]
    xi = point(exponential, algebra, stratum)
    assert turnings(algebra)
    left, right = fields(exponential, algebra, xi)
    general = decimals(MatrixFunction(DEXP_INVERSE, algebra.adjoint)(xi))
    assert close(right, general) and close(left, general + algebra.ad(xi))
    backwards = decimals(MatrixFunction(DEXP, algebra.adjoint)(-xi))
    assert close(decimals(exponential.inverse_left_field(algebra, xi)), backwards)
    general = decimals(MatrixFunction(DISPLACEMENT, algebra.real.basis)(xi))
    assert close(element(exponential, algebra, xi) - eye(algebra.real.size), general)


@pytest.mark.slow
def test_which_algebras_have_a_closed_form():
    assert [n for n, a in ALGEBRAS.items() if turnings(a)] == CLOSED
    assert [n for n, a in ALGEBRAS.items() if not turnings(a)] == GENERAL


def mostly_slow(names, fast):
    return [pytest.param(n, marks=() if n in fast else pytest.mark.slow) for n in names]


@pytest.mark.parametrize(
    "name", mostly_slow([*CLOSED, "sl(3)"], fast=("so(3)", "se(3)", "heisenberg"))
)
@everywhere
def test_derivatives_of_every_order(name, stratum):
    """∂R and ∂²R along a line by exact differentiation, against differences of the order below."""
    algebra = ALGEBRAS[name]
    xi, way, t = point(exponential, algebra, stratum), direction(algebra, 7), Symbol("t", real=True)
    e = exponential.invariant_fields(algebra, xi + t * way)[1][0, algebra.dim - 1]
    for _ in range(2):
        slope = e.diff(t)
        ahead, here, back = (
            decimals([f.xreplace({t: s})])[0] for f, s in ((e, EPS), (slope, 0 * t), (e, -EPS))
        )
        assert abs((ahead - back) / (2 * EPS) - here) <= (1 + abs(here)) / 10**30
        e = slope


@pytest.mark.dear(but=("se(2)",))
@pytest.mark.parametrize("name", mostly_slow([*CLOSED, "sl(3)"], fast=("so(3)", "su(2)", "se(2)")))
@pytest.mark.parametrize("stratum", ["near", "generic"])
def test_the_logarithm_inverts_the_product(name, stratum):
    """exp p(ξ, η) = exp ξ exp η, and p(ξ, −ξ) = 0; derivatives along ξ and η by differences."""
    algebra = ALGEBRAS[name]
    xi, eta = (point(exponential, algebra, stratum, seed) / 2 for seed in (0, 1))
    p = decimals(exponential.product(algebra, xi, eta))
    both = element(exponential, algebra, xi) * element(exponential, algebra, eta)
    assert close(element(exponential, algebra, p), both)
    assert close(decimals(exponential.product(algebra, xi, -xi)), zeros(algebra.dim, 1))
    t = Symbol("t", real=True)
    for line in ((xi + t * eta, eta), (xi, eta + t * xi)):
        entry = exponential.product(algebra, *line)[0]
        ahead, here, back = (
            decimals([f.xreplace({t: s})])[0]
            for f, s in ((entry, EPS), (entry.diff(t), 0 * t), (entry, -EPS))
        )
        assert abs((ahead - back) / (2 * EPS) - here) <= Rational(1, 10**35)


def test_structure_constants_that_are_no_doubles_are_exact():
    """Thirds: a text R(1/3) is a double, in dexp and its inverse alike; so dexp is summed here."""
    first, *others = sl(2).basis
    algebra = MatrixAlgebra("thirds", (*others, tuple(tuple(3 * e for e in row) for row in first)))
    assert Rational(1, 3) in {e for a in algebra.adjoint for row in a for e in row}
    xi = Matrix([Rational(1, 7), Rational(-1, 5), Rational(1, 11)])
    ad, term = algebra.ad(xi), eye(3)
    dexp = term
    for n in range(2, 50):
        term = term * ad / n
        dexp += term
    inverse = MatrixFunction(DEXP_INVERSE, algebra.adjoint)(xi)
    assert max(abs(evaluate_matrix(dexp * inverse - eye(3), 60))) < Rational(1, 10**58)


@pytest.mark.parametrize("algebra", [sl(3), su(3)], ids=lambda a: a.name)
def test_cayley_is_refused_where_it_leaves_the_group(algebra):
    with pytest.raises(BadInput, match=r"does not map s[lu]\(3\) into its group .*exponential"):
        lie_group(algebra).L(None, direction(algebra, 0), 1)
    with pytest.raises(BadInput, match="use the exponential"):
        lie_group(algebra, exponential).with_retraction(cayley)


@pytest.mark.parametrize("tau", [cayley, exponential], ids=lambda r: r.name)
def test_a_basis_that_is_not_closed_or_not_independent_is_named(tau):
    """Symmetric matrices are closed under ξηξ, and no algebra all the same."""
    e, f, diagonal = ((0, 1), (0, 0)), ((0, 0), (1, 0)), ((1, 0), (0, -1))
    symmetric = MatrixAlgebra("symmetric", (((0, 1), (1, 0)), diagonal, ((1, 0), (0, 1))))
    assert symmetric.closed_under_triple_products
    for algebra in (symmetric, MatrixAlgebra("open", (e, f))):
        with pytest.raises(BadInput, match="commutator of basis matrices 1 and 2 is not a combin"):
            lie_group(algebra, tau).element(direction(algebra, 0), 1)
    with pytest.raises(BadInput, match="linearly dependent"):
        tau.check(MatrixAlgebra("twice", (e, e)))


def test_a_logarithm_beyond_the_half_turn_is_refused():
    turn = Matrix([0, 0, Rational(314159265358979, 10**14)]) / 2
    p = exponential.product(so(3), turn, turn)
    assert abs(decimals(p)[2] - 2 * turn[2]) < Rational(1, 10**30)  # short of it: the right branch
    for longer in (Matrix([0, 0, pi]), Matrix([pi * Rational(3, 5), 0, pi * Rational(4, 5)])):
        half = exponential.product(so(3), longer / 2, longer / 2)
        with pytest.raises(BadInput, match=r"outside the chart of exponential on so\(3\); take"):
            evaluate_matrix(half, 30)


def test_a_composition_outside_cayleys_chart_is_refused():
    """Two quarter turns make a half-turn, which has no coordinates; two of SL(2) reach −e."""
    for algebra, quarter in (
        (so(3), [0, 0, 2]),
        (so(3), [0, ROOT, ROOT]),
        (su(2), [0, 0, 4]),
        (sl(2), [0, 2, -2]),
    ):
        xi = Matrix(quarter)
        with pytest.raises(BadInput, match=r"outside the Cayley chart of s.\(\d\), .*take smaller"):
            cayley.product(algebra, xi, xi)
        assert close(decimals(cayley.product(algebra, xi, xi / 10**9)), xi, 8)


def test_scenes_and_groupoids_exchange_their_retraction():
    group = lie_group(so(3))
    other = group.with_retraction(exponential)
    assert (group.name, other.name) == ("group(so(3))", "group(so(3), exponential)")
    assert (other.retraction, other.with_retraction(cayley).name) == ("exponential", group.name)
    assert action(so(3), exponential).name == "action(so(3), exponential)"
    assert action(so(3), exponential, rows=3).name == "action(so(3), rows=3, exponential)"
    scene = Scene("free", group, lambda x, v, p: v.dot(v), v0=[1, 0, 0])
    assert scene.with_retraction(exponential).groupoid.retraction == "exponential"
    assert scene.with_retraction(cayley) is scene


def test_complex_groups_act_on_real_rows():
    """su(2) acts on C² as R⁴: the attitude of its exponential is a real 4×4 matrix."""
    g = action(su(2), exponential, rows=4)
    xi = direction(su(2), 0)
    x = Matrix([Rational(i == j) for i in range(4) for j in range(4)])
    found = decimals(g.target(x, xi, Rational(1))).reshape(4, 4)
    z = lie_group(su(2), exponential).element(xi, Rational(1))
    parts = [[decimals([e.as_real_imag()[k]])[0] for e in z] for k in (0, 1)]
    real, imaginary = (Matrix(2, 2, part) for part in parts)
    assert close(found, real.row_join(-imaginary).col_join(imaginary.row_join(real)))
