"""Laws of one-step maps on the dual algebroid, over groupoids and maps."""

import math
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy

from discmech import Scene, Scheme, one_step, pair, scenes
from discmech.integrators.equations import DualSystem, SceneSymbols, energy
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import arithmetic, evaluate_matrix, numeric, random_point
from discmech.integrators.rules import MAPS, get
from discmech.studies.work_precision.peers.equations import equations_of
from tests.objects import OWN_SCENES

QUICK = ("pendulum", "rigid-body")
DRIVEN = ("duffing", "driven-heavy-top")  # with a force and the time
WHERE = (*QUICK, "kepler", "charged-particle", "heavy-top", "rotor-body", "wong", *DRIVEN)
LATER = {"dual-gauss-3", "heun", "rkmk-4"}  # they show what others do
#: (scene, map) of all that exist there
PAIRS = [(s, m) for s in WHERE for m, rule in MAPS.items() if rule.applies(scenes.get(s))]
PAIRS = [
    pytest.param(*p, id="-".join(p), marks=() if quick else pytest.mark.slow)
    for p in PAIRS
    for quick in [(p[0] in QUICK and p[1] not in LATER) or p == ("duffing", "average-vector-field")]
]
SELF_ADJOINT = {
    "implicit-midpoint", "dual-gauss-2", "dual-gauss-3", "stoermer-verlet", "newmark",
    "average-vector-field", "discrete-gradient",
}  # fmt: skip
SYMPLECTIC = {"implicit-midpoint", "dual-gauss-2", "dual-gauss-3", "stoermer-verlet"}
KEEP_ENERGY = {"average-vector-field", "discrete-gradient"}


@cache
def scheme(scene, name):
    return Scheme(scenes.get(scene), get(name))


def local_order(s):
    """(The order of ‖Φ_h − Φ_{h/2}²‖ in h, None without errors; runs of the smaller step.)"""
    errors = []
    for h in (sympy.Rational("1e-4"), sympy.Rational("5e-5")):
        once, twice = (s.flow(h / k, digits=50).trajectory(k) for k in (1, 2))
        errors.append(size(state(once) - state(twice)))
    return math.log2(errors[0] / errors[1]) if any(errors) else None, once, twice


def state(run, row=-1):
    return np.concatenate([run.base[row], run.mu[row]])


def size(vector):
    return max(map(abs, vector))


@pytest.mark.sampled
@pytest.mark.parametrize(("scene", "name"), PAIRS)
def test_compiled_steps_are_those_of_fifty_digits(scene, name):
    s = scheme(scene, name)
    step = s.scene.step
    run, fine = s.flow(step).trajectory(8), s.flow(step, digits=50).trajectory(8)
    assert size((state(fine) - state(run)).astype(float)) < 1e-13 * size(state(run))
    at, after = (run.base[3], run.mu[3]), (run.base[4], run.mu[4])
    assert s.flow(step).step_defect(*at, *after) < 1e-14  # the map itself, no kernel


@pytest.mark.dear("pendulum-implicit-midpoint")
@pytest.mark.sampled
@mpmath.workdps(60)
@pytest.mark.parametrize(("scene", "name"), PAIRS)
def test_the_order_is_that_of_local_errors(scene, name):
    """‖Φ_h − Φ_{h/2}²‖ is of order p + 1 in h, and (Φ_h − 1)/h goes to the vector field."""
    s = scheme(scene, name)
    found, once, twice = local_order(s)
    # z̈ of so short a step hides nothing: the next term of the error is 10⁻⁴ of this one
    assert found == pytest.approx(s.order + 1, abs=0.01)
    equations = equations_of(s)  # what other people's integrators are given
    z = state(once, 0).astype(float)
    slope = ((state(twice) - state(twice, 0)) * 20_000).astype(float)
    assert size(slope - equations.f(0.0, z)) < 1e-2 * size(slope)


@pytest.mark.sampled
@mpmath.workdps(60)
@pytest.mark.parametrize(("scene", "name"), PAIRS)
def test_the_derivative_is_that_of_differences(scene, name):
    """The derivative of the step, by the implicit function theorem, in a random direction."""
    assert gap_of_derivative(scheme(scene, name)) < 1e-25


def gap_of_derivative(s):
    flow, n = s.flow("0.01", digits=50), len(s.x)
    start = flow.trajectory(0)
    with flow.numbers.working():
        x, mu = flow.context.vectors(start.base[0], start.mu[0])
        near = flow.context.vector(s.scene.v0, len(mu))
        *_, m = flow.geometry.step(x, mu, flow.geometry.start(x, mu, near))
        m = flow.numbers.public(m.value)
    direction = np.array([mpmath.mpf(e) for e in np.random.default_rng(3).uniform(-1, 1, len(m))])
    ends = []
    for sign in (1, -1):
        z = state(start) + sign * direction * mpmath.mpf(10) ** -15
        run = flow.trajectory(1, x0=z[:n], mu0=z[n:])
        ends.append(state(run))
    return size((ends[0] - ends[1]) * 10**15 / 2 - m @ direction)


@pytest.mark.sampled
@pytest.mark.parametrize(("scene", "name"), [p for p in PAIRS if p.values[0] not in DRIVEN])
def test_what_is_kept_and_what_is_not(scene, name):
    s = scheme(scene, name)
    flow = s.flow(s.scene.step, digits=50)
    run = flow.trajectory(4)
    canonical = s.scene.groupoid.kind == "pair"
    defect = flow.poisson_defect(run.x[1], run.mu[1])
    linear = scene == "charged-particle"
    if canonical and (name in SYMPLECTIC or (linear and s.self_adjoint)):
        assert defect < 1e-45
    else:  # on a Lie–Poisson system the midpoint is not Poisson, nor is what keeps energy
        assert defect > 1e-25
    assert s.self_adjoint is (name in SELF_ADJOINT)
    drift = abs(value_of_energy(s, run)[-1] / value_of_energy(s, run)[0] - 1)
    exact = DualSystem(SceneSymbols(s.scene)).degree is not None or name == "discrete-gradient"
    if name in KEEP_ENERGY:
        assert drift < (1e-45 if exact else 1e-14)
    elif not exact:
        assert drift > 1e-13


def value_of_energy(s, run):
    numbers = arithmetic(50)
    symbols = s.s
    letters = {"x": symbols.x, "u": symbols.u, "mu": symbols.mu, "p": symbols.parameter_list}
    with numbers.working():
        f = numeric(letters, [energy(symbols)], numbers)
        p = [numbers.number(e) for e in s.scene.parameter_values]
        rows = (
            [[numbers.number(e) for e in part] for part in row]
            for row in zip(run.x, run.u, run.mu, strict=True)
        )
        return [f(*row, p) for row in rows]


@pytest.mark.parametrize("scene", WHERE)
def test_the_field_is_the_bracket_with_the_energy(scene):
    """s.f = s.B s.dH + s.force, s.dH is the gradient of s.H, by the letters' own derivatives."""
    s = SceneSymbols(scenes.get(scene))
    view = DualSystem(s)
    z = sympy.Matrix([*s.x, *s.mu])
    gap = view.letters(view.f(z) - view.B(z) * view.dH(z) - view.force(z))
    gradient = view.scope.total(view.letters([view.H(z)]), z).T - view.letters(view.dH(z))
    point = random_point([*z, *s.q], [s.h])
    for matrix in (gap, gradient):
        assert max(map(abs, evaluate_matrix(matrix, 30, point, view.graph))) < 1e-25


def test_casimirs_are_kept_by_what_moves_along_coadjoint_orbits():
    """And by Gauss collocation, as they are quadratic; not by the classical Runge–Kutta method."""
    drift = {}
    for name in ("rkmk-4", "dual-gauss-2", "runge-kutta-4"):
        run = scheme("rigid-body", name).flow("0.1").trajectory(500)
        squares = (run.mu**2).sum(axis=1)
        drift[name] = abs(squares / squares[0] - 1).max()
    assert drift["rkmk-4"] < 1e-13 and drift["dual-gauss-2"] < 1e-13
    assert drift["runge-kutta-4"] > 1e-8


@pytest.mark.slow
def test_casimirs_are_kept_beside_a_base_too():
    run = scheme("heavy-top", "rkmk-4").flow("0.05").trajectory(500)
    for casimir in ((run.x**2).sum(axis=1), (run.x * run.mu).sum(axis=1)):
        assert abs(casimir / casimir[0] - 1).max() < 1e-13


def test_stoermer_verlet_and_gauss_are_the_variational_rules():
    """Trapezoidal, midpoint and gauss-2 on a pair groupoid, written on the dual."""
    for name, rule in (("stoermer-verlet", "trapezoidal"), ("implicit-midpoint", "midpoint"),
                       ("dual-gauss-1", "midpoint"), ("dual-gauss-2", "gauss-2"),
                       ("newmark-0.5-0", "trapezoidal")):  # fmt: skip
        one, other = (
            Scheme(scenes.get("kepler"), get(e)).flow("0.01", digits=50).trajectory(3)
            for e in (name, rule)
        )
        assert size(state(one) - state(other)) < 1e-45


@pytest.mark.slow
def test_rows_that_say_their_unknowns_one_after_another_are_not_solved():
    """Störmer–Verlet compiles to what trapezoidal does, but for names; a mass of x stays a row."""
    solved = [scheme("kepler", e).flow("0.01").system.w for e in ("stoermer-verlet", "trapezoidal")]
    assert len(solved[0]) == len(solved[1]) == 2
    runs = [scheme("kepler", e).flow("0.01").trajectory(200)
            for e in ("stoermer-verlet", "trapezoidal")]  # fmt: skip
    assert abs(runs[0].x - runs[1].x).max() < 1e-14 and abs(runs[0].mu - runs[1].mu).max() < 1e-14
    assert len(scheme("double-pendulum", "stoermer-verlet").flow("0.01").system.w) == 4


@pytest.mark.slow
def test_a_negative_step_and_compositions():
    s = scheme("kepler", "implicit-midpoint")
    there = s.flow("0.01").trajectory(20)
    back = s.flow("-0.01").trajectory(20, x0=there.x[-1], mu0=there.mu[-1])
    assert size(state(back) - state(there, 0)) < 1e-13
    jump = Scheme(scenes.get("kepler"), get("triple-jump:implicit-midpoint"))
    assert jump.order == 4
    one, other = (
        f.flow("0.01").trajectory(100).mu[-1] for f in (jump, scheme("kepler", "dual-gauss-2"))
    )
    assert size(one - other) < 1e-5
    with pytest.raises(CannotMeasure, match=r"heun is a one-step map .* no adjoint"):
        Scheme(scenes.get("kepler"), get("triple-jump:heun")).flow("0.01")


def test_rows_of_velocities():
    """u of a row is ξ(x, μ): here μ over the moments of inertia."""
    s = scheme("rigid-body", "runge-kutta-4")
    run = s.flow("0.01").trajectory(10, every=5)
    inertia = [float(e) for e in s.scene.parameter_values]
    assert run.u == pytest.approx(run.mu / inertia, rel=1e-14)
    assert run.iterations.tolist() == [1, 1, 1]


#: a mass that grows with the speed: ξ(x, μ) has no closed form, and is an unknown of the step
FAST = Scene(
    name="relativistic", groupoid=pair(1), x0=["0.5"], v0=["0.3"], duration=5,
    lagrangian=lambda x, v, p: -sympy.sqrt(1 - v[0] ** 2) - x[0] ** 2 / 2,
)  # fmt: skip


@pytest.mark.parametrize("name", ["runge-kutta-4", "implicit-midpoint", "stoermer-verlet"])
def test_without_a_closed_form_of_the_velocity(name):
    s = Scheme(FAST, get(name))
    assert "velocity" in dict(s.equations.unknowns)
    run, fine = (s.flow("0.05", digits=d).trajectory(20) for d in (16, 50))
    assert size((state(run) - state(fine)).astype(float)) < 1e-14
    closed = run.mu / np.sqrt(1 + run.mu**2)
    assert run.u == pytest.approx(closed, rel=1e-14)
    energies = np.sqrt(1 + run.mu**2) + run.x**2 / 2
    assert abs(energies - energies[0]).max() < (1e-7 if name == "runge-kutta-4" else 1e-3)
    symplectic = name in SYMPLECTIC
    assert bool(s.flow("0.05").poisson_defect(run.x[3], run.mu[3]) < 1e-15) is symplectic


OFTEN = ("framed-plane", "moebius")  # by hand, with a step in ρ; a right action


@pytest.mark.dear("framed-plane")
@mpmath.workdps(60)
@pytest.mark.parametrize(
    "scene", [s if s in OFTEN else pytest.param(s, marks=pytest.mark.slow) for s in OWN_SCENES]
)
def test_every_groupoid_of_a_user_has_a_field_to_follow(scene):
    s = Scheme(OWN_SCENES[scene], get("implicit-midpoint"))
    assert local_order(s)[0] in (None, pytest.approx(3, abs=0.01))
    assert gap_of_derivative(s) < 1e-25
    run, fine = (s.flow(s.scene.step, digits=d).trajectory(5) for d in (16, 50))
    assert size((state(run) - state(fine)).astype(float)) < 1e-13 * size(state(run))


@mpmath.workdps(60)
@pytest.mark.parametrize("scene", ["pendulum", "rigid-body", "heavy-top"])
def test_a_map_may_ask_for_the_derivative_of_the_field(scene):
    """The linearly implicit midpoint rule."""

    @one_step(order=2, implicit=True)
    def rosenbrock(s, z, Z, h):
        return Z - z - h * s.f(z) - h * s.df(z) * (Z - z) / 2

    s = Scheme(scenes.get(scene), rosenbrock)
    assert local_order(s)[0] == pytest.approx(3, abs=0.01)
    assert s.self_adjoint is (scene != "pendulum")  # Kahan's method where the field is quadratic
    assert gap_of_derivative(s) < 1e-25
