"""The symmetric neighbourhood as a thing one asks: margins, distances, what a run reports."""

import math

import numpy as np
import pytest
import sympy

from discmech.integrators import (
    BadInput,
    LocalGroupoid,
    Scene,
    Scheme,
    StepFailure,
    cayley,
    exponential,
    lie_group,
    pair,
    product,
    rectangle,
    scenes,
    se,
    sl,
    so,
    su,
    trapezoidal,
)
from discmech.integrators.rules import get as rule
from tests.objects import ALGEBRAS, GROUPOIDS, LARGE, affine_group


@pytest.mark.parametrize("name", [*GROUPOIDS, *LARGE])
def test_every_groupoid_can_be_asked(name):
    g = {**GROUPOIDS, **LARGE}[name]
    x = [0.3 + 0.1 * i for i in range(g.dim_x)]
    local = isinstance(g, LocalGroupoid)  # nobody knows where its chart ends
    at_identity = g.position(x, [0] * g.dim_u, "0.1")
    assert at_identity.inside and (local or at_identity.margin == 1)
    near = g.position(x, [0.5 - 0.2 * i for i in range(g.dim_u)], "0.1")
    assert near.inside and 0 < near.margin <= 1
    assert min(near.condition_L, near.condition_R) >= 1
    assert (near.distance is None) == local


def turned(angles, size):
    """ξ of so(n) for rotations by these angles in the planes (0, 1), (2, 3), …: Cayley's."""
    algebra = so(size)
    hat = np.zeros((size, size))
    for k, angle in enumerate(angles):
        a = 2 * math.tan(angle / 2)
        hat[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0, -a], [a, 0]]
    basis = np.array([np.ravel(e) for e in algebra.basis], dtype=float)
    return np.linalg.lstsq(basis.T, hat.ravel(), rcond=None)[0]


@pytest.mark.parametrize(
    ("size", "angles"),
    [(2, [0.4]), (2, [3.1]), (3, [3.1]), (4, [3.1, 0.2]), (4, [3.1, 3.1]), (5, [2.0, 3.1])],
)
def test_cayleys_margin_is_the_product_of_the_half_angles_cosines(size, angles):
    """Also where every angle is near a half-turn, and e + g is near 0 in all directions alike."""
    at = lie_group(so(size)).position([], turned(angles, size), 1)
    assert at.inside
    assert at.margin == pytest.approx(math.prod(math.cos(a / 2) for a in angles), rel=1e-9)
    assert at.distance == pytest.approx(2 * math.cos(max(angles) / 2), rel=1e-9)


@pytest.mark.parametrize(
    "algebra", (su(2), su(2).real, sl(2)), ids=("su(2)", "su(2).real", "sl(2)")
)
def test_minus_e_is_the_edge_of_su2_and_sl2(algebra):
    group = lie_group(algebra)
    direction = [0, 1, -1] if algebra.name == "sl(2)" else [0, 2, 0]
    margins = [group.position([], [c * e for e in direction], 1).margin for c in (0.1, 10, 1e4)]
    assert margins[0] > 0.99 and margins == sorted(margins, reverse=True) and margins[2] < 1e-3


def quick(names):
    """Those of less than six dimensions, and one whose exponential has no closed form."""
    slow = {n for n in names if ALGEBRAS[n].dim >= 6 and n != "sl(3)"}
    return [pytest.param(n, marks=pytest.mark.slow if n in slow else ()) for n in names]


#: ξ that turns at the rate 1, and one that goes along with it and does not turn
TURNS = {
    "so(3)": (so(3), [0.6, 0, 0.8]),
    "su(2)": (su(2), [0.6, 0, 0.8]),
    "se(2)": (se(2), [1, 5.0, -3.0]),
    "se(3)": (se(3), [0.6, 0, 0.8, 5.0, -3.0, 7.0]),
    "sl(2)": (sl(2), [0, 0.5, -0.5]),
    "so(4)": (so(4), [1, 0, 0, 0, 0, 0]),
    "so(5)": (so(5), [1, *[0] * 9]),
}


@pytest.mark.parametrize("name", quick(TURNS))
def test_the_exponential_ends_at_a_whole_turn_of_ad(name):
    """dexp is singular there; translations, however long, are no edge."""
    algebra, xi = TURNS[name]
    group = lie_group(algebra, exponential)
    for turn, inside in ((0.5, True), (0.999, True), (1.001, False), (1.4, False)):
        at = group.position([], [2 * math.pi * turn * e for e in xi], 1)
        assert at.inside is inside
        assert at.distance == pytest.approx(2 * math.pi * (1 - turn), abs=1e-6)
        assert at.margin == pytest.approx(max(0, 1 - turn**2), abs=1e-6)


@pytest.mark.parametrize("name", quick(ALGEBRAS))
def test_what_a_run_watches_is_never_farther_from_the_edge_than_it_is(name):
    """Exactly as far, where the exponential has closed forms."""
    group = lie_group(ALGEBRAS[name], exponential)
    s, generator = group.symbols, np.random.default_rng(2)
    extents = group.extents(s["x"], s["u"], s["h"])
    for _ in range(5):
        u = generator.normal(size=group.dim_u)
        at = {s["h"]: 1, **dict(zip(s["u"], map(float, u), strict=True))}
        rests = [float(value.xreplace(at).evalf()) for _, value in extents]
        margin = group.position([], u.tolist(), 1).margin
        watched = min([1.0, *rests])
        if name in ("sl(3)", "su(3)", "so(5)", "sp(4)"):
            assert watched <= margin + 1e-9
        else:
            assert max(0, watched) == pytest.approx(margin, abs=1e-6)


def positions(scene, run):
    return [scene.groupoid.position(x, u, run.step) for x, u in zip(run.x, run.u, strict=True)]


@pytest.mark.sampled
@pytest.mark.parametrize("retraction", (cayley, exponential), ids=("cayley", "exponential"))
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=pytest.mark.slow if n in ("kirchhoff", "wong", "rotor-body") else ())
    for n in ("rigid-body", "kirchhoff", "wong", "rotor-body", "pendulum")
])  # fmt: skip
def test_a_run_reports_its_smallest_margin(name, retraction):
    """Also where a group is one part of a product, and where translations are large."""
    scene = scenes.get(name).with_retraction(retraction)
    run = Scheme(scene, trapezoidal).flow(1 if name != "pendulum" else "0.1").trajectory(30)
    at = positions(scene, run)
    assert run.margin == pytest.approx(min(p.margin for p in at), rel=1e-6)
    assert all(p.inside for p in at)
    assert (run.margin == 1) == (name == "pendulum")


@pytest.mark.parametrize("digits", (16, 30))
def test_a_composition_reports_the_margin_of_its_substeps(digits):
    """Of the triple jump's substeps the middle one is the longest: 1.7 steps backward."""
    scene = scenes.get("rigid-body")
    whole = Scheme(scene, trapezoidal).flow("1", digits).trajectory(10).margin
    run = Scheme(scene, rule("triple-jump:trapezoidal")).flow("1", digits).trajectory(10)
    assert run.margin < whole - 0.01


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=() if n == "so(3)" else pytest.mark.slow) for n in TURNS if n != "so(5)"
])  # fmt: skip
def test_a_step_beyond_the_exponentials_chart_is_refused(name):
    """Started on a solution beyond the whole turn Newton may stay there: that is an error."""
    algebra, xi = TURNS[name]
    scene = Scene(
        "turning-body",
        lie_group(algebra, exponential),
        lambda x, v, p: sum((2 + (3 * i) % 5) * e**2 for i, e in enumerate(v)) / 4,
        v0=[1] * algebra.dim,
    )
    flow, refused, ran = Scheme(scene, rectangle).flow(1), 0, 0
    for size in (4.0, 6.2, 6.4, 8.0, 40.0):
        u = size * (np.array(xi) + 0.001)
        mu = flow.geometry.at([], u)["minus"]
        try:
            run = flow.trajectory(0, mu0=mu, u0=u)
        except StepFailure as failure:
            refused += "edge of its chart" in str(failure)
        else:
            ran += 1
            assert scene.groupoid.position([], run.u[0], 1).inside
    assert ran and refused > 1


@pytest.mark.dear("[exponential-5]")
@pytest.mark.parametrize("step", (5, 8, 12, 40))
@pytest.mark.parametrize("retraction", (cayley, exponential), ids=("cayley", "exponential"))
def test_shrunk_steps_go_where_whole_ones_cannot(step, retraction):
    """Also where Newton in the whole step ran off to 10⁹: that is no start for the halves."""
    scene = scenes.get("rigid-body").with_retraction(retraction)
    run = Scheme(scene, rectangle).flow(step, on_edge="shrink").trajectory(20)
    sizes = np.linalg.norm(run.mu.astype(float), axis=1)
    assert np.max(abs(sizes - sizes[0])) < 1e-13
    assert run.margin > 1 / scene.groupoid.reach**0.5 - 1e-12
    assert (run.edges > 0) == (retraction is exponential)


@pytest.mark.parametrize(("u", "said"), [
    ([1, 2], "2 entries, but 3 are needed"),
    ([1, 2, "x"], "no number"),
    ([1, 2, math.nan], "finite"),
    (7, "list of 3 numbers"),
])  # fmt: skip
def test_a_wrong_question_is_answered_with_a_sentence(u, said):
    with pytest.raises(BadInput, match=said):
        lie_group(so(3)).position([], u, 1)


def test_a_step_of_nothing_has_no_position():
    with pytest.raises(BadInput, match="step of 0"):
        pair(1).position([1], [1], 0)


def test_a_retraction_that_does_not_fit_is_refused_before_it_is_asked():
    with pytest.raises(BadInput, match=r"does not map sl\(3\) into its group"):
        lie_group(sl(3)).position([], [0.1] * 8, 1)


def test_where_a_local_chart_has_no_real_value_it_has_ended():
    """The pair groupoid of x > 0 by u = (y − x)/(h√x): from 1 on, hu = −2 leads below 0."""
    g = LocalGroupoid(
        1,
        1,
        target=lambda x, u, h: [x[0] + h * u[0] * sympy.sqrt(x[0])],
        product=lambda x, u, v, h: [u[0] + v[0] * sympy.sqrt(1 + h * u[0] / sympy.sqrt(x[0]))],
        name="root",
    )
    assert g.position([1], [0.5], 1).inside
    assert not g.position([1], [-2], 1).inside
    with pytest.raises(BadInput, match="short: target returned 2 entries, but 1 are needed"):
        LocalGroupoid(
            1, 1, target=lambda x, u, h: [1, 2], product=lambda x, u, v, h: [u[0]], name="short"
        ).position([1], [1], 1)


def test_a_product_of_pairs_has_no_edge_and_a_local_part_an_unknown_one():
    assert product(pair(1), pair(1)).position([0, 0], [1, 1], 1).distance == math.inf
    for other in (pair(1), lie_group(so(3))):
        at = product(other, affine_group()).position(
            [0] * other.dim_x, [0.1] * (other.dim_u + 2), 1
        )
        assert at.inside and at.distance is None and at.margin < 0.99


def test_the_least_of_a_products_parts_counts():
    both = product(lie_group(so(3)), lie_group(so(3), exponential))
    first, second = both.parts
    u, v = [1.0, 2.0, 0.5], [0.1, 3.0, 0.2]
    at = both.position([], u + v, 1)
    parts = first.position([], u, 1), second.position([], v, 1)
    assert at.margin == pytest.approx(min(p.margin for p in parts))
    assert at.distance == pytest.approx(min(p.distance for p in parts))


def numbers(column):
    return [complex(sympy.N(e, 30)).real for e in column]


def at_the_border(g, x, u):
    """cu where 𝒲 ends, to a hundredth, from within; u itself where it has no end."""
    low, high = 0.0, 1.0
    while g.position(x, [high * e for e in u], 1).symmetric and high < 1e3:
        low, high = high, 2 * high
    while high < 1e3 and high - low > 1e-2 * high:
        middle = (low + high) / 2
        within = g.position(x, [middle * e for e in u], 1).symmetric
        low, high = (middle, high) if within else (low, middle)
    return [min(low, 1.0 if high > 1e3 else low) * e for e in u]


SYMMETRIC = [name for name, g in GROUPOIDS.items() if not isinstance(g, LocalGroupoid)]


@pytest.mark.parametrize("name", [
    pytest.param(n, marks=() if n in ("pair(2)", "group(so(3))", "action(se(2))") else
                 pytest.mark.slow) for n in (*SYMMETRIC, *LARGE)
])  # fmt: skip
def test_the_symmetric_neighbourhood_is_one(name):
    """Proposition 3.1, at the border of 𝒲, where it is hardest: it holds the identities of its
    arrows' ends and their inverses, and the products of its arrows lie in the chart."""
    g = {**GROUPOIDS, **LARGE}[name]
    generator = np.random.default_rng(7)
    x = generator.uniform(-0.4, 0.4, g.dim_x).tolist()
    u = at_the_border(g, x, generator.normal(size=g.dim_u).tolist())
    column = sympy.Matrix
    y = numbers(g.target(column(len(x), 1, x), column(u), 1))
    inverse = numbers(g.inversion(column(len(x), 1, x), column(u), 1))
    assert g.position(x, u, 1).symmetric and g.position(y, inverse, 1).symmetric  # i(𝒲) = 𝒲
    for end in (x, y):
        assert g.position(end, [0] * g.dim_u, 1).symmetric
    for other in ([0.999 * e for e in u], generator.normal(size=g.dim_u).tolist()):
        v = at_the_border(g, y, other)
        both = g.product(*(column(len(e), 1, e) for e in (x, u, v)), 1)
        both = numbers(both)
        assert g.position(x, both, 1).inside
        if hasattr(g, "algebra"):
            left, right, found = (
                np.array(g.element(column(e), 1).evalf().tolist(), dtype=complex)
                for e in (u, v, both)
            )
            assert np.allclose(left @ right, found, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("retraction", (cayley, exponential), ids=("cayley", "exponential"))
def test_on_so3_it_is_less_than_a_quarter_turn(retraction):
    """And cannot be more: two quarter turns are a half turn, where both charts end."""
    group = lie_group(so(3), retraction)
    edge = 2.0 if retraction is cayley else math.pi / 2
    axis = np.array([2.0, -1.0, 2.0]) / 3
    assert group.position([], (0.999999 * edge * axis).tolist(), 1).symmetric
    assert not group.position([], (1.000001 * edge * axis).tolist(), 1).symmetric
    quarter = np.array(group.element(sympy.Matrix(edge * axis), 1).evalf().tolist(), dtype=float)
    assert np.trace(quarter) == pytest.approx(1)  # 1 + 2 cos θ
    assert np.linalg.det(np.eye(3) + quarter @ quarter) == pytest.approx(0, abs=1e-12)
    beyond = sympy.Matrix((1.1 * edge * axis).tolist())
    twice = np.array(numbers(group.product(sympy.zeros(0, 1), beyond, beyond, 1)))
    assert twice @ axis < 0  # it came in again on the other side: p is no longer continuous


def test_whether_a_chart_by_hand_has_one_is_not_known():
    assert affine_group().position([], [0.1, 0.1], 1).symmetric is None
    both = product(lie_group(so(3)), affine_group())
    assert both.position([], [0.1] * 5, 1).symmetric is None
