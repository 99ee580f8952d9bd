"""Laws of every flow: Ψ and its inverse, tangent, symplecticity, in double precision and 50 digits.

Each runs over every scheme at a tiny step, the scene's own and one near the largest that is stable,
from points near the identities, generic ones and ones far out.
"""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from tests.objects import PLAIN, SCENES, SCHEMES, TURN, exact_start, flow, named, scheme

pytestmark = pytest.mark.sampled

#: (digits, limit of a defect, limit of an error relative to the state)
PRECISIONS = ((16, 1e-13, 1e-11), (50, 1e-45, 1e-44))
SIZES = {"tiny": Fraction(1, 10**4), "own": Fraction(1), "large": Fraction(6)}
START = {
    "near": Fraction(1, 10**7),
    "generic": Fraction(1),
    "far": Fraction(5),
    "edge": Fraction(1000),  # of Cayley's chart: rotations by nearly half a turn in a step
}
#: of rules with stages and of compositions some, on each kind of groupoid
STAGED = (
    ("pendulum", "lobatto-3"), ("kepler", "gauss-2"), ("moving-mass", "gauss-1"),
    ("rigid-body", "gauss-1"), ("affine-group", "gauss-2"), ("affine-on-line", "lobatto-3"),
    ("framed-plane", "lobatto-2"), ("rotor-body", "gauss-1"),
)  # fmt: skip
COMPOSED = (("pendulum", "kahan-li-8:trapezoidal"), ("kepler", "blanes-moan-6:rectangle"))
every_scheme = pytest.mark.parametrize(("scene", "rule"), named(SCHEMES))
both_precisions = pytest.mark.parametrize(("digits", "limit", "tolerance"), PRECISIONS)


def step_of(scene, size):
    return SCENES[scene].step * SIZES[size]


def start_of(scene, start):
    """x0, and v0 scaled into the stratum; far out only as far as h·u stays in the chart."""
    velocity = [START[start] * v for v in SCENES[scene].v0]
    if not any(velocity):
        velocity = [START[start] / 2 for _ in velocity]
    return SCENES[scene].x0, velocity


def strata():
    for scene, rule in SCHEMES:
        yield scene, rule, "own", "near"
        yield scene, rule, "tiny", "generic"
        yield scene, rule, "large", "generic"
        if scene != "kepler":
            yield scene, rule, "own", "far"
        # near half a turn the inverse step is not found where a base moves by no linear action
        if SCENES[scene].groupoid.dim_u == 3 and scene not in ("moebius", "stereographic"):
            yield scene, rule, "own", "edge"
    for scene, rule in STAGED:
        yield scene, rule, "own", "generic"


everywhere = pytest.mark.parametrize(("scene", "rule", "size", "start"), named(strata()))
#: the same where no force acts: it need not keep any form
unforced = pytest.mark.parametrize(
    ("scene", "rule", "size", "start"), named(e for e in strata() if SCENES[e[0]].force is None)
)


def distance(found, wanted):
    pairs = [(a, b) for p, q in zip(found, wanted, strict=True) for a, b in zip(p, q, strict=True)]
    return float(max(abs(a - b) for a, b in pairs) / (1 + max(abs(b) for _, b in pairs)))


def work(digits):
    return mpmath.workdps(digits + 10)


@pytest.mark.dear("driven-heavy-top", "along", "charged")
@everywhere
@both_precisions
def test_evolve_and_devolve_are_inverse(scene, rule, size, start, digits, limit, tolerance):
    f = flow(scene, rule, step_of(scene, size), digits)
    x, u = f.context.vectors(*start_of(scene, start))
    with work(digits):
        point = [f.numbers.public(part) for part in (x, u)]
        after = f.evolve(*point)
        # at a tiny step u = (y − x)/h has the round-off of x, divided by h
        assert distance(f.devolve(*after), point) < tolerance / min(1, float(abs(f.step)))
        before = f.devolve(*point)
        assert distance(f.evolve(*before), point) < tolerance / min(1, float(abs(f.step)))
        assert distance(after, point) > 0


@unforced
@both_precisions
def test_symplectic_and_poisson(scene, rule, size, start, digits, limit, tolerance):
    f = flow(scene, rule, step_of(scene, size), digits)
    point = start_of(scene, start)
    assert 0 <= f.pullback_defect(*point) <= limit
    run = f.trajectory(2)
    for row in (0, 2):
        assert 0 <= f.pullback_defect(run.base[row], run.u[row]) <= limit
        assert 0 <= f.poisson_defect(run.base[row], run.mu[row]) <= limit


@pytest.mark.parametrize("scene", [
    "heavy-top", "lagrange-top", "affine-on-line", "framed-plane", "rotor-body", "kepler",
    "rigid-body",
    pytest.param("wong", marks=pytest.mark.slow),
])  # fmt: skip
@both_precisions
def test_a_flipped_bracket_is_caught(scene, digits, limit, tolerance):
    """Where there are base and group; pairs have no bracket, and of a group −Π is kept as Π is."""
    f = flow(scene, TURN[scene], SCENES[scene].step, digits)
    run = f.trajectory(2)
    found = f.poisson_defect(run.base[1], run.mu[1], bracket_sign=-1)
    if SCENES[scene].groupoid.kind in ("pair", "group"):
        assert found <= limit
    else:
        assert found > (1e3 if digits == 16 else 1e20) * limit


@pytest.mark.parametrize("scene", ["kepler", "rigid-body", "heavy-top", "affine-on-line"])
@both_precisions
def test_a_wrong_map_is_caught(scene, digits, limit, tolerance):
    """A tangent that is off by one part in 10⁶ (10²⁰) fails the pullback of Ω and of Π."""
    from discmech.integrators.geometry import poisson_defect, pullback_defect

    f = flow(scene, "midpoint", SCENES[scene].step, digits)
    off = 1e-6 if digits == 16 else mpmath.mpf(10) ** -20
    after = f.evolve(*start_of(scene, "generic"))
    with f.numbers.working():
        x, u = f.context.vectors(*start_of(scene, "generic"))
        here, there = f.geometry.tracked(x, u), f.geometry.tracked(*f.context.vectors(*after))
        off = f.numbers.number(off)
        tangent = f.geometry.tangent(here, there)
        assert pullback_defect(f.geometry, here, there, tangent) <= limit
        damped = np.vstack([tangent[: len(x)], tangent[len(x) :] * (1 - off)])
        assert pullback_defect(f.geometry, here, there, damped) > 1e3 * limit
        mu, m = here["minus"].value / f.context.h, f.geometry.dual_step(here, f.context.h)
        step = here["target"].value, here["plus"].value / f.context.h
        assert poisson_defect(f.geometry, x, mu, (*step, m)) <= limit
        assert poisson_defect(f.geometry, x, mu, (*step, m * (1 - off))) > 1e3 * limit


@every_scheme
def test_tangent_against_differences_at_50_digits(scene, rule):
    f = flow(scene, rule, step_of(scene, "own"), 50)
    with work(60):
        x, u = (f.numbers.public(part) for part in f.context.vectors(*start_of(scene, "generic")))
        point, n = np.concatenate([x, u]), len(x)
        exact = f.tangent(x, u)
        nearby = mpmath.mpf(10) ** -15
        for column in range(len(point)):
            moved = [point.copy(), point.copy()]
            moved[0][column] += nearby
            moved[1][column] -= nearby
            ahead, back = (np.concatenate(f.evolve(z[:n], z[n:])) for z in moved)
            difference = (ahead - back) / (2 * nearby)
            assert distance([difference], [exact[:, column]]) < 1e-24


@every_scheme
def test_a_step_back_is_the_inverse_of_self_adjoint_rules_and_of_no_others(scene, rule):
    """(x, μ) ↦ Φ₋ₕ(Φₕ(x, μ)), at 50 digits."""
    forth, back = (flow(scene, rule, sign * step_of(scene, "own"), 50) for sign in (1, -1))
    with work(50):
        run = forth.trajectory(1)
        again = back.dual_step(run.base[1], run.mu[1])
        gap = distance(again, (run.base[0], run.mu[0]))
    assert gap < 1e-44 if scheme(scene, rule).self_adjoint else gap > 1e-12


@every_scheme
@pytest.mark.parametrize("sign", [1, -1], ids=["forwards", "backwards"])
def test_rows_are_steps_of_evolve_and_solve_the_equations(scene, rule, sign):
    of = scheme(scene, rule)
    f = flow(scene, rule, sign * step_of(scene, "own"), 50)
    with work(60):
        run = f.trajectory(3)
        for k in range(3):
            assert (
                distance(f.evolve(run.base[k], run.u[k]), (run.base[k + 1], run.u[k + 1])) < 1e-44
            )
            assert (
                distance(f.dual_step(run.base[k], run.mu[k]), (run.base[k + 1], run.mu[k + 1]))
                < 1e-44
            )
            assert distance([f.inverse_legendre(run.base[k], run.mu[k])], [run.u[k]]) < 1e-44
        letters = [of.h, *of.s.parameter_list]
        values = dict(zip(letters, [f.step, *of.scene.parameter_values], strict=True))
        values = {s: _sympy(v) for s, v in values.items()}
        for symbols, row in ((of.x, run.base[1]), (of.u, run.u[1]), (of.v, run.u[2])):
            values.update({s: _sympy(v) for s, v in zip(symbols, row, strict=True)})
        for entry in of.residual:
            assert abs(entry.xreplace(values).evalf(60)) < 1e-44
    double = flow(scene, rule, sign * step_of(scene, "own")).trajectory(3)
    for k in range(3):
        again = flow(scene, rule, sign * step_of(scene, "own")).evolve(double.base[k], double.u[k])
        assert distance(again, (double.base[k + 1], double.u[k + 1])) < 1e-13


def _sympy(value):
    from sympy import Float, Rational

    if isinstance(value, Fraction):
        return Rational(value.numerator, value.denominator)
    return Float(mpmath.nstr(value, 62), 62)


@pytest.mark.parametrize(("scene", "rule"), named([*SCHEMES, *STAGED, *COMPOSED]))
def test_double_is_50_digits_rounded(scene, rule):
    short, long = (flow(scene, rule, step_of(scene, "own"), d).trajectory(12) for d in (16, 50))
    for name in ("t", "x", "u", "mu"):
        wanted = getattr(long, name).astype(float)
        assert np.abs(getattr(short, name) - wanted).max(initial=0) < 2e-13
    assert isinstance(long.t[1], mpmath.mpf)
    assert short.x.dtype == float


@every_scheme
def test_the_start_has_the_momentum_of_the_lagrangian(scene, rule):
    """μ₀ = ∂l/∂ξ(x₀, v₀), and the shapes and the first row are as the design says."""
    of, run = scheme(scene, rule), flow(scene, rule, step_of(scene, "own")).trajectory(4)
    n, m = of.s.n, len(of.u)
    assert [a.shape for a in (run.t, run.x, run.u, run.mu)] == [(5,), (5, n), (5, m), (5, m)]
    x0, v0 = exact_start(scene)
    pairs = {**dict(zip(of.s.position, x0, strict=True)), **dict(zip(of.u, v0, strict=True))}
    pairs |= dict.fromkeys(of.x[n:], 0)  # the time
    values = zip(of.s.parameter_list, of.scene.parameter_values, strict=True)
    pairs.update({s: _sympy(v) for s, v in values})
    momentum = [float(of.s.lagrangian.diff(w).xreplace(pairs)) for w in of.u]
    assert np.array_equal(run.x[0], [float(e) for e in x0])
    assert np.allclose(run.mu[0], momentum, rtol=0, atol=1e-15)
    assert np.allclose(run.t, [float(k * step_of(scene, "own")) for k in range(5)], atol=1e-15)


AFFINE = {
    *((s, r) for s in ("harmonic", "charged-particle") for r in PLAIN),
    *((s, r) for r in ("rectangle", "trapezoidal") for s in (
        "pendulum", "kepler", "henon-heiles", "outer-solar-system", "fpu", "spring-pendulum",
        "duffing", "kapitza-pendulum",
    )),
    ("framed-plane", "rectangle"), ("fpu", "imex"),
}  # fmt: skip


@every_scheme
def test_affine_schemes_take_one_correction_and_no_more(scene, rule):
    run = flow(scene, rule, step_of(scene, "own")).trajectory(200)
    if (scene, rule) in AFFINE:
        assert (run.newton_mean, run.newton_max) == (1, 1)
        assert set(run.iterations) == {1}
    else:
        assert 1 < run.newton_mean <= run.newton_max
        assert run.newton_mean < 5


@pytest.mark.parametrize("scene", ["rigid-body", "rigid-body-by-hand", "affine-group"])
def test_groups_carry_no_x(scene):
    f = flow(scene, "midpoint", step_of(scene, "own"))
    run = f.trajectory(10)
    assert run.x.shape == (11, 0)
    assert f.machine.kernels.layout.n == 0
    y, v = f.evolve([], run.u[0])
    assert y.shape == (0,)
    assert np.allclose(v, run.u[1], atol=1e-15)
    y, v = f.evolve(None, run.u[0])
    assert np.allclose(v, run.u[1], atol=1e-15)
