"""Lie groupoids near their identities: axioms, closed forms, charts, points of a step.

Inverses, ρ, L, R, C and the invariant fields are held to the paper's equations in `tests/paper/`.

All evaluations are exact, at rational points near the identities, in the middle and near the edge
of the chart. Derivatives along a curve are difference quotients over 2·10⁻⁴⁰ in exact arithmetic,
right to more than 40 digits.
"""

import pytest
import sympy
from sympy import Matrix, Rational, Symbol, eye, zeros

from discmech.integrators.groupoids.axioms import axioms
from discmech.integrators.numbers import evaluate
from tests.objects import ARROWS, GROUPOIDS, LARGE, STEPS, arrows

pytestmark = pytest.mark.sampled

everywhere = pytest.mark.parametrize("stratum", ARROWS)
at_steps = pytest.mark.parametrize("h", STEPS, ids=str)
EPS = Rational(1, 10**40)


def marked(names):
    """Transcendental numbers and many dimensions take their time: they are checked by test-all."""
    slow = {"action(so(3), exponential)", "group(se(2), exponential)", *LARGE}
    return [pytest.param(n, marks=pytest.mark.slow if n in slow else ()) for n in names]


@pytest.fixture(params=marked([*GROUPOIDS, *LARGE]), scope="module")
def g(request):
    return {**GROUPOIDS, **LARGE}[request.param]


def exact(e):
    """A rational as it is; another number without symbols to 160 digits, as a rational."""
    if e.is_Rational or e.free_symbols:
        return e
    return Rational(*map(int, evaluate(e, 160).as_integer_ratio()))


def vanishes(matrix):
    """Exactly if rational, else to 100 of 160 digits; what is no number yet is cancelled."""
    numbers = [exact(e) if e.is_number else sympy.cancel(e) for e in matrix]
    return all(abs(e) < Rational(1, 10**100) if e.is_Rational else e == 0 for e in numbers)


def agree(found, wanted):
    """Equal but for the error of a difference quotient."""
    pairs = zip(map(exact, found), map(exact, wanted), strict=True)
    return all(abs(a - b) <= EPS * (1 + abs(b)) for a, b in pairs)


def slope(curve):
    """d/dε at ε = 0 of a curve of columns; the error is of the size EPS² × third derivative."""
    return (curve(EPS) - curve(-EPS)) / (2 * EPS)


def unit(length, i):
    return eye(length)[:, i]


@everywhere
@at_steps
def test_axioms(g, stratum, h):
    laws = axioms(g, arrows(g, stratum, h))
    assert "p(x, u, ι(x, u)) = 0 (inverses)" in laws  # left out where no inversion is known
    for law, difference in laws.items():
        assert vanishes(difference), law


@everywhere
@at_steps
def test_increment_is_the_way_to_the_target(g, stratum, h):
    point = arrows(g, stratum, h)
    x, u = point["x"], point["u"]
    assert vanishes(g.increment(x, u, h) - (g.target(x, u, h) - x))


@pytest.mark.dear("group(se(2))")
@pytest.mark.parametrize("name", ["pair(2)", "group(se(2))", "action(se(2))"])
def test_closed_forms_are_the_derived_ones_identically(name):
    """Of those that state them and are small; a groupoid given by b and p has none to compare."""
    g = GROUPOIDS[name]
    s = g.symbols
    x, u, h = s["x"], s["u"], s["h"]
    derived = g.derived
    assert vanishes(g.rho(x, h) - derived["rho"])
    assert vanishes(g.L(x, u, h) - derived["L"])
    assert vanishes(g.R(x, u, h) - derived["R"])
    for mine, wanted in zip(g.structure_functions(x, h), derived["C"], strict=True):
        assert vanishes(mine - wanted)


def along(field, function, x):
    """The derivative of a column of functions of x along a field on the base."""
    return function.jacobian(x) * field if len(x) else 0 * function


@pytest.mark.dear("action(so(3)) \\xd7 group(so(2))", "pair(2) \\xd7 group(so(3)), connection")
def test_the_algebroid(g):
    """C antisymmetric, Jacobi with the anchor, and the anchor a morphism: [ρe_a, ρe_b] = C ρ."""
    h, m = Rational(2, 5), g.dim_u
    x = g.symbols["x"]
    at = dict(zip(x, arrows(g, "generic", h, seed=3)["x"], strict=True))
    rho = g.rho(x, h)
    C = g.structure_functions(x, h)
    bracket = [[Matrix(m, 1, [C[c][a, b] for c in range(m)]) for b in range(m)] for a in range(m)]
    for a in range(m):
        for b in range(m):
            assert vanishes((bracket[a][b] + bracket[b][a]).xreplace(at))
            if g.dim_x:
                lie = along(rho[:, a], rho[:, b], x) - along(rho[:, b], rho[:, a], x)
                assert vanishes((lie - rho * bracket[a][b]).xreplace(at))
            for c in range(m):
                total = zeros(m, 1)
                for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
                    inner = bracket[j][k]
                    total += along(rho[:, i], inner, x)
                    total += sum((inner[d] * bracket[i][d] for d in range(m)), zeros(m, 1))
                assert vanishes(total.xreplace(at))


def test_a_bracket_that_depends_on_the_point_and_one_with_a_trace_are_among_them():
    """The list is not too tame: C(x) not constant, and C not unimodular, both occur."""
    framed, h = GROUPOIDS["framed plane"], Rational(1)
    x = framed.symbols["x"]
    assert set().union(*(c.free_symbols for c in framed.structure_functions(x, h)))
    affine = GROUPOIDS["affine group"].structure_functions(zeros(0, 1), h)
    assert [sum(affine[c][a, c] for c in range(2)) for a in range(2)] != [0, 0]


def test_which_charts_are_symmetric(g):
    """ι = −u + O(u³) in all charts but the affine group's, its action's and a moving frame's."""
    x, e = arrows(g, "generic", STEPS[0])["x"], Matrix([1, 2, *range(3, g.dim_u + 1)][: g.dim_u])
    second = (g.inversion(x, EPS * e, STEPS[0]) + EPS * e) / EPS**2
    symmetric = g.name not in ("affine group", "affine action", "framed plane")
    assert g.symmetric_chart == symmetric
    assert (max(abs(exact(entry)) for entry in second) < 10**20 * EPS) == symmetric
    ones = g.L(x, e / 7, STEPS[0]) == eye(g.dim_u)
    assert g.left_is_identity == ones == (g.kind == "pair")


@pytest.mark.parametrize("name", ["action(so(3))", "group(so(3))"])
@everywhere
def test_elements_multiply_and_act(name, stratum):
    """τ(hu) τ(hv) = τ(h p(u, v)), and the target is the row x times the element."""
    g, h = GROUPOIDS[name], Rational(1, 10)
    point = arrows(g, stratum, h)
    u, v = point["u"], point["v"]
    product = g.element(g.product(point["x"], u, v, h), h)
    assert vanishes(g.element(u, h) * g.element(v, h) - product)
    assert vanishes(g.element(u, h) * g.element(u, h).T - eye(3))
    if g.dim_x:
        assert vanishes(g.target(point["x"], u, h) - (point["x"].T * g.element(u, h)).T)


@pytest.mark.dear("action(so(3))-", "action(so(3), rows=3)", "action(so(3), stereographic)",
                  "action(so(3)) \\xd7 group(so(2))")  # fmt: skip
@pytest.mark.parametrize("theta", [Rational(1, 3), Rational(1)], ids=str)
@pytest.mark.parametrize("name", marked(name for name, g in GROUPOIDS.items() if g.dim_x))
@everywhere
def test_fields_on_the_points_of_a_step(name, stratum, theta):
    """How e→ and e← move b(x, u; θh), against moving (x, u) itself."""
    g, h = GROUPOIDS[name], Rational(1, 10)
    m = g.dim_u
    point = arrows(g, stratum, h)
    x, u = point["x"], point["u"]
    s = g.symbols
    z = Matrix(g.dim_x, 1, [Symbol(f"z_{i}") for i in range(g.dim_x)])
    values = {
        **dict(zip(z, g.target(x, u, theta * h), strict=True)),
        **dict(zip(s["x"], x, strict=True)),
        **dict(zip(s["u"], u, strict=True)),
        s["h"]: h,
    }
    motion = g.point_motion(s["x"], s["u"], s["h"], theta, z)
    slopes, right, left = ((motion.anchor * f).subs(values) for f in motion[1:])
    rho, L, R = g.rho(x, h), g.L(x, u, h), g.R(x, u, h)

    def point_at(dx, du):
        return slope(lambda s: g.target(x + s * dx, u + s * du, theta * h))

    for a in range(m):
        assert agree(point_at(-rho[:, a], R[:, a]), right[:, a])
        assert agree(point_at(0 * x, L[:, a]), left[:, a])
        assert agree(point_at(0 * x, unit(m, a)), slopes[:, a])
