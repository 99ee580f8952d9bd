"""Forces: virtual work of the integral principle, exact derivatives, orders, no cost."""

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import (
    BadInput,
    Conserved,
    Scene,
    Scheme,
    lie_group,
    midpoint,
    pair,
    rules,
    scenes,
    so,
)
from discmech.integrators.compiler import kernel_text
from tests.integrators.equations.forced_scenes import FORCED, forced, order, rubbed, with_force
from tests.objects import GROUPOIDS, arrows, scheme

DIGITS = 50
#: (scene, rule): every kind of groupoid meets every plain rule, two a rule with stages
MET = [
    *((name, rule) for name in FORCED for rule in ("rectangle", "midpoint", "trapezoidal")),
    ("spring-pendulum", "gauss-2"), ("heavy-top", "gauss-2"),
]  # fmt: skip

SLOW = pytest.mark.slow

FRACTIONS = [
    pytest.param(name, theta, marks=[SLOW] if "expon" in name and 0 < theta < 1 else [])
    for name in GROUPOIDS
    for theta in (0, sympy.Rational(1, 3), 1)
]


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "theta"), FRACTIONS)
def test_what_displaces_a_fraction_of_an_arrow(name, theta):
    """(−ρa, R(x, θu) a + L(x, θu) c_θ) is what the fraction θ of the displaced arrow has become."""
    g, h = GROUPOIDS[name], sympy.Rational(1, 10)
    s, theta = g.symbols, sympy.sympify(theta)
    point = arrows(g, "generic", h)
    x, u = point["x"], point["u"]
    at = {**dict(zip(s["x"], x, strict=True)), **dict(zip(s["u"], u, strict=True)), s["h"]: h}
    right, left = (
        sympy.Matrix(f).subs(at) for f in g.displacement_at(s["x"], s["u"], s["h"], theta)
    )
    R, L = g.R(x, u, theta * h), g.L(x, u, theta * h)
    gaps = [R + L * right - theta * g.R(x, u, h), L * left - theta * g.L(x, u, h)]
    if theta == 0:  # the chart of no step: −a and 0
        gaps = [right + sympy.eye(g.dim_u), left]
    assert all(abs(e.evalf(30)) < 1e-20 for gap in gaps for e in gap)


def points_of(rule, stage, u, h):
    """(θ, w(θ), dw/dθ, weight) where a rule asks for the force, in mpmath.

    Without dw/dθ the rule asks for it at the velocity u.
    """
    if rule == "trapezoidal":
        return [(mpmath.mpf(c), c * u, None, h / 2) for c in (0, 1)]
    if rule == "midpoint":
        return [(mpmath.mpf(1) / 2, u / 2, None, h)]
    nodes = [(1 - 1 / mpmath.sqrt(3)) / 2, (1 + 1 / mpmath.sqrt(3)) / 2]
    # w = θu + s Q, Q = ∫P over the Legendre polynomial P = 2θ − 1
    return [(c, c * u + stage * (c * c - c), u + stage * (2 * c - 1), h / 2) for c in nodes]


@pytest.mark.parametrize(
    "rule", ["midpoint", "trapezoidal", pytest.param("gauss-2", marks=pytest.mark.slow)]
)
def test_the_force_has_the_work_of_the_integral_principle(rule):
    """Heavy top: ∫ f·(A⁻¹ δA) over a displaced path of attitudes, which nobody trivialised.

    A(θ) = A₀ τ(hw(θ)); a e→ + c e← displaces A₀ by −a and the end by c, and the path between is
    that of the displaced arrow's chart. Compared at 50 digits, δ by a central difference.
    """
    flow = forced("heavy-top", rule).flow("1/5", 70)
    basis = [mpmath.matrix(e.tolist()) for e in so(3).matrices]

    def hat(w):
        return sum((w[i] * basis[i] for i in range(3)), mpmath.zeros(3))

    def vee(matrix):
        return np.array([mpmath.fsum(matrix[i, j] * e[i, j] for i in range(3) for j in range(3)) / 2
                         for e in basis])  # fmt: skip

    def cayley(w):
        one = mpmath.eye(3)
        return (one - hat(w) / 2) ** -1 * (one + hat(w) / 2)

    def uncayley(g):
        one = mpmath.eye(3)
        return vee(2 * (g - one) * (g + one) ** -1)

    with mpmath.workdps(70):
        h = mpmath.mpf(1) / 5
        values = [mpmath.mpf(k) / 7 for k in (2, 3, -1, 3, -2, 5, 1, -4, 2)]
        u, a, c = (np.array(values[i : i + 3]) for i in (0, 3, 6))
        x = [mpmath.mpf(k) / 7 for k in (2, 3, 6)]
        with flow.numbers.working():
            at = flow.context.vectors(x, u)
            own = [flow.geometry.stages(*at), *flow.geometry.discrete_force(*at)]
            stage, minus, plus = map(flow.numbers.public, own)
        eps = mpmath.mpf(10) ** -22

        def path(t, theta, w):
            """A(θ) of the arrow displaced by t(a e→ + c e←), A₀ = 1."""
            start, end = cayley(-t * a), cayley(h * u) * cayley(t * c)
            moved = uncayley(start**-1 * end) / h
            return start * cayley(h * (w + theta * (moved - u)))

        wanted = mpmath.mpf(0)
        for theta, w, dw, weight in points_of(rule, stage, u, h):
            shift = vee(path(0, theta, w) ** -1 * (path(eps, theta, w) - path(-eps, theta, w)))
            xi = u
            if dw is not None:
                ahead, behind = (cayley(h * (w + e * dw)) for e in (eps, -eps))
                xi = vee(cayley(h * w) ** -1 * (ahead - behind)) / (2 * eps) / h
            f = [-xi[i] / (4 + i) - xi[i] * xi[i - 1] / 7 for i in range(3)]
            wanted += weight * mpmath.fsum(f * shift) / (2 * eps)
        work = mpmath.fsum([*(minus * a), *(plus * c)])
        assert abs(work - wanted) < mpmath.mpf(10) ** -40 * abs(wanted)


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "rule"), [e for e in MET if e[1] != "gauss-2"])
def test_the_maps_of_a_step_hold_that_force(name, rule):
    """F± with the force less F± without it, against the displacement of points (50 digits)."""
    one = forced(name, rule)
    made = one.flow("0.1", DIGITS)
    free = Scheme(one.scene.with_values(force=None), one.rule).flow("0.1", DIGITS)
    start = made.trajectory(0)
    with made.numbers.working():
        x, u = made.context.vectors(start.base[0], start.u[0])
        maps, without = made.geometry.at(x, u), free.geometry.at(x[: len(free.scheme.x)], u)
        for part, f in zip(("minus", "plus"), made.geometry.discrete_force(x, u), strict=True):
            added = (maps[part] - without[part]) / made.context.h
            assert max(abs(added - f)) < 1e-45
            assert max(abs(f)) > 1e-6 or (rule, part) == ("rectangle", "plus")


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "rule"), MET)
def test_the_derivative_of_a_step_is_exact(name, rule):
    """FL and its like against central differences, with a force that is no gradient."""
    flow = forced(name, rule).flow("0.1", DIGITS)
    n, eps = len(flow.scheme.x), flow.numbers.number("1e-15")
    with flow.numbers.working():
        z = np.concatenate(flow.context.vectors(flow.scheme.scene.x0, flow.scheme.scene.v0))
        here = flow.geometry.at(z[:n], z[n:])
        for j in range(len(z)):
            step = np.array([eps if i == j else 0 * eps for i in range(len(z))])
            up, down = (flow.geometry.at(e[:n], e[n:]) for e in (z + step, z - step))
            for part in ("minus", "plus"):
                slopes = here[f"of_{part}"][:, j]
                assert max(abs((up[part] - down[part]) / (2 * eps) - slopes)) < 1e-20


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "rule"), MET)
def test_orders_against_the_forced_equations(name, rule):
    one = forced(name, rule)
    assert order(one, "0.5", (16, 32)) == pytest.approx(one.order, abs=0.12)


def test_a_force_ends_symmetry_of_the_rectangle_rule_on_a_group():
    """Without a base every rule is h·l(u), and of order 2; a force at one end is not symmetric."""
    assert scheme("rigid-body", "rectangle").order == 2
    assert forced("rigid-body", "rectangle").order == 1
    assert forced("rigid-body", "trapezoidal").self_adjoint


def test_who_has_no_force_pays_for_none():
    """Fewer operations than 20, 309, 218, 330 before there were forces; no force, the same text."""
    counts = {
        ("pendulum", "trapezoidal"): 19, ("heavy-top", "trapezoidal"): 286,
        ("rigid-body", "midpoint"): 197, ("kepler", "gauss-2"): 256,
    }  # fmt: skip
    for (name, rule), wanted in counts.items():
        text = kernel_text(scheme(name, rule).flow("0.1").system)
        kernels = text.split("FAINT = ")[0]
        assert sum(map(kernels.count, "+-*/")) == wanted
    zero = with_force("pendulum", lambda x, v, p: [0]).with_values(name="pendulum")
    texts = {kernel_text(Scheme(s, rules.get("trapezoidal")).flow("0.1").system)
             for s in (zero, scenes.get("pendulum"))}  # fmt: skip
    assert len(texts) == 1


def pendulum(**more):
    return Scene(**{"name": "bad", "groupoid": pair(1), "x0": [1], "v0": [0],
                    "lagrangian": lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2,
                    **more})  # fmt: skip


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (lambda x, v, p: [x[0], x[0]], "has 2 components, but the velocity has 1"),
        (lambda x, v, p: [sympy.Symbol("z") * v[0]], "holds the unknown symbol z"),
        (lambda x, v, p: [v[0] / sympy.Integer(0)], "is not finite"),
        (lambda x, v, p: [p.mass], "asks for what is not there"),
        (lambda x, v, p: None, "is None, not an expression"),
        (lambda x, v: [v[0]], r"write it with \(x, v, p\)"),
    ],
)
def test_a_force_that_fits_nothing_is_said_in_a_sentence(force, said):
    with pytest.raises(BadInput, match=said):
        Scheme(pendulum(force=force), rules.get("midpoint"))


def test_a_force_needs_a_lagrangian_and_a_rule_that_sums_its_values():
    with pytest.raises(BadInput, match="force= is 3; give a function"):
        pendulum(force=3)
    with pytest.raises(BadInput, match="beside a lagrangian="):
        Scene("bad", lie_group(so(3)), v0=[1, 0, 0], force=rubbed,
              discrete_lagrangian=lambda x, u, h, p: h * u.dot(u))  # fmt: skip
    for what, of in (
        ("take another rule", lambda L, G, x, u, h: h * L(x, u) ** 2),
        ("depend on the state", lambda L, G, x, u, h: h * (1 + h * x[0]) * L(x, u)),
        (
            "write its weights as fractions",
            lambda L, G, x, u, h: h * (1 / 6 * L(x, u) + 5 / 6 * L(G.target(x, u, h), u)),
        ),
    ):
        with pytest.raises(BadInput, match=f"no weighted sum of values of L: .*{what}"):
            Scheme(pendulum(force=rubbed), rules.Discretisation("odd", of))


def test_a_force_that_is_no_real_number_at_the_start_is_named():
    def pushed(x0):
        return Scene("rooted", pair(1), lambda x, v, p: v.dot(v) / 2, x0=[x0], v0=[0],
                     force=lambda x, v, p: [sympy.sqrt(x[0] - 1)])  # fmt: skip

    with pytest.raises(BadInput, match=r"component 0 of the force, sqrt\(x_0 - 1\), is no real"):
        Scheme(pushed("0.5"), rules.get("midpoint"))
    run = Scheme(pushed(2), rules.get("midpoint")).flow("0.01").trajectory(1)
    assert run.mu[-1, 0] == pytest.approx(0.01, rel=1e-4)
    begun = Scene("begun", pair(1), lambda x, v, p: v.dot(v) / 2, x0=[1], v0=[0],
                  force=lambda x, v, p, t: [1 / t])  # fmt: skip
    with pytest.raises(BadInput, match="component 0 of the force, 1/t, is no real"):
        Scheme(begun, rules.get("midpoint"))


def test_numbers_may_be_text_and_quantities_a_list():
    kept = Conserved("both", lambda x, mu, p: [mu[0], x[0] * mu[1]])
    scene = Scene("plain", pair(2), lambda x, v, p: v.dot(v) / 2, x0=[0, 0], v0=[1, 0],
                  force=lambda x, v, p: ["1/10", x[0]], symmetries=kept)  # fmt: skip
    s = Scheme(scene, midpoint).s
    assert list(s.force) == [sympy.Rational(1, 10), s.x[0]] and scene.symmetries == (kept,)
    assert kept.at(s.x, s.mu, s.parameters, s.h).shape == (2, 1)
    of_array = Conserved("first", lambda x, mu, p: np.array(mu[0]))
    assert s.conserved(kept) == [s.mu[0], s.x[0] * s.mu[1]] and s.conserved(of_array) == [s.mu[0]]
