"""The same motion in two descriptions: they must agree, to round-off or to the order of the method.

Each comparison stands beside one that must fail: a description that is slightly another one.
"""

from fractions import Fraction
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from sympy import Matrix, Rational

from discmech.integrators import (
    LocalGroupoid,
    Scene,
    action,
    cayley,
    exponential,
    lie_group,
    midpoint,
    pair,
    product,
    rectangle,
    scenes,
    so,
    su,
    trapezoidal,
)
from tests.objects import OWN_SCENES, scheme_of

RULES = [rectangle, midpoint, trapezoidal]
rules = pytest.mark.parametrize("rule", RULES, ids=lambda r: r.name)

DIGITS = 30  # nothing is compiled, and what agrees by accident to 16 digits is told apart
ROUNDOFF = 1e-27  # of some dozen steps


@pytest.fixture(autouse=True)
def enough_digits():
    with mpmath.workdps(DIGITS + 10):
        yield


def run(scene, rule, steps=40, digits=DIGITS, step=None, **how):
    return scheme_of(scene, rule).flow(step or scene.step, digits).trajectory(steps, **how)


def gap(a, b):
    """The largest difference over a run, relative to the largest entry."""
    return float(np.abs(a - b).max() / np.abs(a).max())


def norm(vector):
    return np.sum(np.asarray(vector) ** 2) ** 0.5


# -- two descriptions of one discrete motion: the same trajectory to round-off --------------------


def top_on_the_group(center=("2/3", "1/3", "2/3")):
    """The heavy top with its whole attitude A (row by row) as base: Γ = e₃ᵀA, given as Γ₀ᵀA."""
    top = scenes.get("heavy-top")
    start = Matrix(1, 3, [Rational(2, 7), Rational(3, 7), Rational(6, 7)])

    def lagrangian(x, v, p):
        return top.lagrangian((start * x.reshape(3, 3)).T, v, p)

    attitude = [int(i == j) for i in range(3) for j in range(3)]
    return Scene(
        "heavy-top-on-the-group", action(so(3), rows=3), lagrangian,
        {**top.parameters, "center": center}, x0=attitude, v0=top.v0, step=top.step,
    )  # fmt: skip


@pytest.mark.dear(but=("rectangle",))
@rules
def test_heavy_top_by_advected_vector_and_by_attitude(rule):
    """L(A, Ω) = l(A⁻¹γ, Ω): reduction commutes with discretisation, for each rule."""
    top = scenes.get("heavy-top")
    few, whole = run(top, rule), run(top_on_the_group(), rule)
    gamma = np.array([[2, 3, 6]]) @ whole.x.reshape(-1, 3, 3)
    assert gap(few.mu, whole.mu) < ROUNDOFF
    assert gap(few.x, gamma[:, 0, :] / 7) < ROUNDOFF


def test_another_centre_of_mass_is_seen():
    top = scenes.get("heavy-top")
    other = run(top_on_the_group(center=("2/3", "1/3", "0.666667")), midpoint)
    assert gap(run(top, midpoint).mu, other.mu) > 1e-8


def gibbs(factor):
    """p of SO(3) in Gibbs vectors, by hand; 1 is right."""

    def p(x, u, v, h):
        return list((u + v + factor * h * u.cross(v) / 2) / (1 - h**2 * u.dot(v) / 4))

    return LocalGroupoid(0, 3, target=lambda x, u, h: [], product=p, name="so(3) by p alone")


def body_on(groupoid):
    body = scenes.get("rigid-body")
    return body.with_values(groupoid=groupoid, symmetries=())


@pytest.mark.parametrize("digits, bound", [(16, 1e-13), (DIGITS, ROUNDOFF)])
def test_a_group_by_its_algebra_and_by_b_and_p_alone(digits, bound):
    known, local = (
        run(body_on(g), trapezoidal, 2000 if digits == 16 else 100, digits)
        for g in (lie_group(so(3)), gibbs(1))
    )
    assert gap(known.mu, local.mu) < bound
    assert gap(known.u, local.u) < bound


def test_the_opposite_group_is_seen():
    """p with the factors exchanged is a group too, with the bracket's other sign."""
    known, other = run(body_on(lie_group(so(3))), midpoint), run(body_on(gibbs(-1)), midpoint)
    assert gap(known.mu, other.mu) > 0.1


def column(values):
    return Matrix([Rational(e.numerator, e.denominator) for e in values])


def in_plain_coordinates(scene, strength=1):
    """A scene with a connection, without: the Lagrangian carries it, η = ξ + A(x)ẋ."""
    groupoid = scene.groupoid
    n = groupoid.dim_x

    def A(x):
        return strength * Matrix(groupoid.connection(x))

    def lagrangian(x, v, p):
        eta = v[n:, 0] + A(x) * v[:n, 0]
        return scene.lagrangian(x, v[:n, 0].col_join(eta), p)

    x0, v0 = column(scene.x0), column(scene.v0)
    v0[n:, 0] -= A(x0) * v0[:n, 0]
    return scene.with_values(
        groupoid=product(*groupoid.parts), lagrangian=lagrangian, v0=list(v0), symmetries=()
    )


def in_the_frame(scene, run):
    """Momenta (p − Aᵀq, q) in the frame of the connection."""
    mu, n = run.mu.copy(), scene.groupoid.dim_x
    for row, x in zip(mu, run.x, strict=True):
        row[:n] -= np.array(scene.groupoid.connection(x)).T @ row[n:]
    return mu


@pytest.mark.slow
def test_a_connection_in_the_groupoid_or_in_the_lagrangian():
    """The midpoint rule knows no difference: A is taken at the middle of the step either way."""
    scene = OWN_SCENES["carried-along"]
    adapted, plain = run(scene, midpoint), run(in_plain_coordinates(scene), midpoint)
    assert gap(adapted.x, plain.x) < ROUNDOFF
    assert gap(adapted.mu, in_the_frame(scene, plain)) < ROUNDOFF
    other = run(in_plain_coordinates(scene, Rational(1001, 1000)), midpoint)
    assert gap(adapted.x, other.x) > 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("rule", [rectangle, trapezoidal], ids=lambda r: r.name)
def test_the_other_rules_take_the_connection_elsewhere_and_agree_in_the_limit(rule):
    scene = OWN_SCENES["carried-along"]
    first, second = (scheme_of(s, rule) for s in (scene, in_plain_coordinates(scene)))
    gaps = []
    for steps in (16, 32, 64):
        one, two = (s.flow(Fraction(1, steps), DIGITS).trajectory(steps).x for s in (first, second))
        gaps.append(gap(one, two))
    assert abs(np.log2(gaps[1] / gaps[2]) - rule.order) < 0.1
    assert gaps[2] > 1e-6


def test_a_product_of_what_has_nothing_to_do_with_each_other():
    """Pendulum × rigid body: each moves as if alone."""
    pendulum, body = scenes.get("pendulum"), scenes.get("rigid-body")

    def lagrangian(x, v, p):
        both = pendulum.lagrangian(x, v[:1, 0], p), body.lagrangian(x, v[1:, 0], p)
        return both[0] + both[1]

    both = Scene(
        "both", product(pair(1), lie_group(so(3))), lagrangian,
        {**pendulum.parameters, **body.parameters}, x0=pendulum.x0, v0=[*pendulum.v0, *body.v0],
        step="0.1",
    )  # fmt: skip
    for rule in RULES:
        together = run(both, rule)
        one, two = run(pendulum, rule), run(body, rule)
        assert gap(np.hstack([one.mu, two.mu]), together.mu) < ROUNDOFF
        assert gap(one.x, together.x) < ROUNDOFF


# -- two discretisations of one continuous motion: the same in the limit --------------------------


def observed_order(first, second, steps):
    """The orders between successive gaps |first(n) − second(n)|, n steps each."""
    gaps = [float(norm(np.subtract(first(n), second(n)))) for n in steps]
    return [float(np.log2(a / b)) for a, b in pairwise(gaps)], gaps


def end(scene, rule, time, steps):
    last = run(scene, rule, steps, step=Fraction(time) / steps, every=steps)
    return last.x[-1], last.mu[-1]


@rules
def test_kepler_and_reduced_kepler(rule):
    """r = |x| and p_r = x·p/r of the one are x and μ of the other, to the rule's order."""
    order = 1 if rule is rectangle else 2

    def plane(n):
        x, p = end(scenes.get("kepler"), rule, 2, n)
        r = norm(x)
        return [r, x @ p / r, x[0] * p[1] - x[1] * p[0]]

    def polar(n):
        x, mu = end(scenes.get("reduced-kepler"), rule, 2, n)
        return [x[0], mu[0], mu[1]]

    orders, gaps = observed_order(plane, polar, [200, 400, 800])
    assert abs(orders[-1] - order) < 0.05 and gaps[-1] > 1e-9
    assert abs(plane(200)[2] - polar(200)[2]) < ROUNDOFF  # the angular momentum, exactly


def test_a_stronger_sun_is_seen():
    def plane(n):
        return norm(end(scenes.get("kepler"), midpoint, 2, n)[0])

    stronger = scenes.get("reduced-kepler").with_values(parameters={"strength": "1.001"})

    def polar(n):
        return end(stronger, midpoint, 2, n)[0][0]

    orders, gaps = observed_order(plane, polar, [200, 400, 800])
    assert gaps[-1] > 1e-4 and abs(orders[-1]) < 0.5


@pytest.mark.parametrize("retraction", [cayley, exponential], ids=lambda r: r.name)
def test_rigid_body_on_so3_and_on_su2(retraction):
    """su(2) has the structure constants of so(3), and its retraction is another chart.

    Cayley of SO(3) against Cayley and the exponential of SU(2): apart by O(h²), whatever the rule.
    """
    rule = midpoint
    chart, other = body_on(lie_group(so(3))), body_on(lie_group(su(2), retraction))
    orders, gaps = observed_order(
        lambda n: end(chart, rule, 5, n)[1], lambda n: end(other, rule, 5, n)[1], [50, 100, 200]
    )
    assert abs(orders[-1] - 2) < 0.02
    assert gaps[-1] > 1e-6  # the charts differ


def test_the_exponential_is_one_chart_of_both_groups():
    """exp of su(2) covers exp of so(3): the same coordinates, so the same discrete motion."""
    three, two = (run(body_on(lie_group(a, exponential)), midpoint) for a in (so(3), su(2)))
    assert gap(three.mu, two.mu) < ROUNDOFF


def test_other_moments_of_inertia_are_seen():
    body = body_on(lie_group(su(2))).with_values(parameters={"inertia": [1, 2, "3.001"]})
    orders, gaps = observed_order(
        lambda n: end(body_on(lie_group(so(3))), midpoint, 5, n)[1],
        lambda n: end(body, midpoint, 5, n)[1],
        [100, 200, 400],
    )
    assert gaps[-1] > 1e-4 and abs(orders[-1]) < 0.5


@pytest.mark.slow
def test_the_sphere_by_rows_and_by_stereographic_coordinates():
    """The spherical pendulum on rows of R³, and by a right action of one's own on R²."""
    below = OWN_SCENES["stereographic"]
    a, b = Rational(2, 5), Rational(1, 5)
    r = a**2 + b**2
    start = [2 * a / (r + 1), 2 * b / (r + 1), (r - 1) / (r + 1)]
    rows = scenes.get("spherical-pendulum").with_values(x0=start, v0=below.v0, symmetries=())
    for rule in (rectangle, midpoint):
        one, two = run(rows.with_values(step=below.step), rule), run(below, rule)
        assert gap(one.mu, two.mu) < ROUNDOFF
        lifted = np.sum(two.x**2, axis=1)
        assert gap(one.x[:, 2], (lifted - 1) / (lifted + 1)) < ROUNDOFF


def test_the_affine_group_by_b_and_p_alone_against_an_independent_solution():
    """Not unimodular: ẏ = ad*_ξ μ with [e₀, e₁] = e₁, solved by mpmath from equations by hand."""
    scene = OWN_SCENES["affine-group"]
    mass = (mpmath.mpf(1), mpmath.mpf(3) / 2)

    def rates(t, mu):
        # μ̇_γ = −C^ν_γμ ξ^μ μ_ν: C^1_01 = 1
        xi = [mu[0] / mass[0], mu[1] / mass[1]]
        return [-xi[1] * mu[1], xi[0] * mu[1]]

    with mpmath.workdps(30):
        start = [mass[0] * mpmath.mpf("0.3"), mass[1] * mpmath.mpf("0.7")]
        exact = list(mpmath.odefun(rates, 0, start)(2))
    orders, gaps = observed_order(
        lambda n: end(scene, midpoint, 2, n)[1], lambda n: exact, [100, 200, 400, 800]
    )
    assert abs(orders[-1] - scheme_of(scene, midpoint).order) < 0.05
    flipped = [exact[0], -exact[1]]
    assert norm(end(scene, midpoint, 2, 100)[1] - flipped) > 0.1
