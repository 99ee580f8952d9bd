"""Laws of Lagrangians ϑ(x)·v − H(x) that are linear in the velocity, over scenes and methods."""

from fractions import Fraction
from functools import cache
from math import log2
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy

from discmech import BadInput, Scene, Scheme, pair, scenes, solution
from discmech.integrators import StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get
from discmech.integrators.scenes import DEGENERATE
from discmech.integrators.scenes.ablowitz_ladik import ring
from discmech.studies.core.parasitic import gaps_of

HALF = ("degenerate-euler", "degenerate-gauss-1", "degenerate-gauss-2")
PROJECTED = ("projected-gauss-1", "projected-gauss-2", "projected-gauss-1-midpoint",
             "projected-gauss-1-standard")  # fmt: skip
OTHERS = ("implicit-midpoint", "average-vector-field", "runge-kutta-4")
REVERSIBLE = {*HALF[1:], *PROJECTED[:3], "implicit-midpoint", "average-vector-field"}
LINEAR = ("vortex-pair", "four-vortices")  # scenes whose ϑ is, so that a step keeps μ = ϑ(x)
CANONICAL = ("lotka-volterra-half", "guiding-centre", "ablowitz-ladik")  # half of ϑ vanishes
HALVED = {"vortex-pair", *CANONICAL}
DEAR = {"vortex-pair", "four-vortices", "magnetic-mirror", "guiding-centre", "ablowitz-ladik"}
#: they show what others do
LATER = {"degenerate-gauss-2", "projected-gauss-2", "projected-gauss-1-midpoint",
         "average-vector-field"}  # fmt: skip
PAIRS = [
    pytest.param(s, m, id=f"{s}-{m}", marks=pytest.mark.slow if s in DEAR or m in LATER else ())
    for s in DEGENERATE
    for m in (*(HALF if s in HALVED else ()), *PROJECTED, *OTHERS)
]  # fmt: skip


@cache
def scheme(scene, name):
    return Scheme(scenes.get(scene), get(name))


@cache
def place(scene):
    """A state on the motion, where nothing is special."""
    s = scheme(scene, "dual-gauss-2")
    return tuple(s.flow(s.scene.step).trajectory(7).x[-1])


def end(s, step, steps):
    run = s.flow(step, digits=50).trajectory(steps, steps, x0=place(s.scene.name))
    return np.array([*run.x[-1], *run.mu[-1]])


@pytest.mark.sampled
@mpmath.workdps(60)
@pytest.mark.parametrize(("scene", "name"), PAIRS)
def test_one_step_has_its_order_and_ends_at_the_momentum_of_x(scene, name):
    """‖Φ_h − Φ_{h/2}²‖ is of order p + 1 in h; μ′ = ϑ(x′); to and fro is no step if reversible."""
    s = scheme(scene, name)
    h = sympy.Rational("1e-4")
    errors = [max(abs(end(s, e, 1) - end(s, e / 2, 2))) for e in (h, h / 2)]
    assert log2(errors[0] / errors[1]) == pytest.approx(s.order + 1, abs=0.01)
    assert np.abs(gaps_of(s, h, 1)[0][1]).max() < 1e-28
    # where λ = 0 the standard projection is none
    plain = scene in LINEAR + CANONICAL and name == "projected-gauss-1-standard"
    assert s.self_adjoint == (name in REVERSIBLE or plain)


@pytest.mark.sampled
@pytest.mark.parametrize(("scene", "name"), PAIRS)
def test_the_form_is_kept_where_it_is_claimed(scene, name):
    """dϑ at states of a run, exactly; a method that claims nothing does not keep it by chance."""
    s = scheme(scene, name)
    flow, run = s.flow(s.scene.step, digits=30), s.flow(s.scene.step).trajectory(20)
    defect = max(float(flow.poisson_defect(run.x[k], run.mu[k])) for k in (0, 13))
    kept = {*HALF, *(PROJECTED if scene in LINEAR + CANONICAL else ())}
    if name in kept | ({"implicit-midpoint"} if scene in LINEAR else set()):
        assert defect < 1e-40
    elif scene != "vortex-pair" or name == "runge-kutta-4":  # on two circles much is kept
        assert defect > 1e-14


@pytest.mark.slow
@pytest.mark.parametrize("scene", [pytest.param(e, marks=pytest.mark.slow if e in DEAR else ())
                                   for e in DEGENERATE])  # fmt: skip
def test_the_reference_and_runs_agree(scene):
    """With Gauss collocation; orders are those of single steps."""
    own = scenes.get(scene)
    steps = own.steps_for(own.step) // 20
    wanted = solution(own, steps * own.step, digits=20, proof=scene != "four-vortices")
    assert wanted.certain_digits >= 20
    exact = np.array([*wanted.x, *wanted.mu], float)
    run = scheme(scene, "dual-gauss-3").flow(own.step).trajectory(steps, steps)
    assert np.abs([*run.x[-1], *run.mu[-1]] - exact).max() < 1e-8
    f = np.array([float(e) for e in wanted.v])
    nearby = [solution(own, steps * own.step + h, digits=20, proof=False).x for h in (-1e-6, 1e-6)]
    slope = (np.array(nearby[1], float) - np.array(nearby[0], float)) / 2e-6
    assert np.abs(slope - f).max() < 1e-8 * max(1, np.abs(f).max())


def regauged(scene, f):
    def one_form(x, p):
        return [a + f(x).diff(e) for a, e in zip(scene.one_form(x, p), x, strict=True)]

    return scene.with_values(name=f"{scene.name}-in-gauge", one_form=one_form)


def quadratic(x):
    return x[0] * x[1] + x[1] ** 2 / 3


def quartic(x):
    return x[0] ** 2 * x[1] ** 2 / 80


@pytest.mark.slow
@pytest.mark.parametrize(("name", "maps", "projected"), [
    ("lotka-volterra", ["implicit-midpoint"], ["projected-gauss-1"]),
    *(pytest.param(name, ["dual-gauss-2", "average-vector-field"],
                   ["projected-gauss-1", "projected-gauss-2", "projected-gauss-1-midpoint"],
                   marks=pytest.mark.slow) for name in ("lotka-volterra", "vortex-pair")),
])  # fmt: skip
def test_gauges_that_are_claimed_not_to_matter_and_gauges_that_do(name, maps, projected):
    """The motion, and maps of the vector field, know no gauge; nor do Gauss rules know df of a
    quadratic f, as f(x′) − f(x) is what they make of it. Other gauges make other methods."""
    own = scenes.get(name)
    first, second = solution(own, 2, digits=20), solution(regauged(own, quartic), 2, digits=20)
    assert max(abs(a - b) for a, b in zip(first.x, second.x, strict=True)) < 1e-20

    def run(scene, rule):
        return Scheme(scene, get(rule)).flow(own.step).trajectory(40).x

    for rule in maps:
        assert np.abs(run(own, rule) - run(regauged(own, quartic), rule)).max() < 1e-12
    for rule in projected:
        assert np.abs(run(own, rule) - run(regauged(own, quadratic), rule)).max() < 1e-12, rule
        assert np.abs(run(own, rule) - run(regauged(own, quartic), rule)).max() > 1e-12, rule


@pytest.mark.parametrize("name", [
    "lotka-volterra-half",
    *(pytest.param(e, marks=pytest.mark.slow) for e in ("guiding-centre", "ablowitz-ladik")),
])  # fmt: skip
def test_projections_have_nothing_to_do_where_half_of_the_form_vanishes(name):
    """There the variational Runge–Kutta method is Gauss collocation of (q, p), and λ = 0."""
    runs = [scheme(name, rule).flow("1/20").trajectory(20).x
            for rule in ("degenerate-gauss-1", "projected-gauss-1")]  # fmt: skip
    assert np.abs(runs[0] - runs[1]).max() < 1e-12


def test_the_guiding_centre_has_the_strength_of_a_vacuum_field():
    """χ = F(z) − r²F″/4 + …, F = tan z, has F′ = 1 + F² on the axis; |∇χ| at the flux ψ."""
    z, r = sympy.symbols("z r")
    F = sympy.tan(z)
    potential = F - r**2 * F.diff(z, 2) / 4 + r**4 * F.diff(z, 4) / 64
    flux = r**2 * F.diff(z) / 2 - r**4 * F.diff(z, 3) / 16
    for height in (0.3, 0.5):
        chi, psi, along, across = (
            float(e.subs({z: height, r: 0.01}))
            for e in (potential, flux, potential.diff(z), potential.diff(r))
        )
        strength = scenes.get("guiding-centre").hamiltonian(
            [psi, 0, chi, 0], SimpleNamespace(moment=1)
        )
        assert abs(strength - np.hypot(along, across)) < 1e-3 * psi


def test_a_form_of_which_no_half_vanishes_is_told():
    with pytest.raises(CannotMeasure, match="half of the components of ϑ vanish, and those of lot"):
        scheme("lotka-volterra", "degenerate-euler")


@pytest.mark.parametrize(("scene", "name", "parasitic"), [
    ("lotka-volterra", "midpoint", True), ("lotka-volterra", "trapezoidal", True),
    ("vortex-pair", "midpoint", False), ("vortex-pair", "trapezoidal", True),
])  # fmt: skip
def test_variational_rules_have_parasitic_modes(scene, name, parasitic):
    """Published: not the midpoint rule where ϑ is linear (Vermeeren 2019). They alternate."""
    s = scheme(scene, name)
    gaps, _ = gaps_of(s, s.scene.step, 12)
    if not parasitic:
        assert np.abs(gaps).max() < 1e-25
        return
    assert np.abs(gaps).max() > 1e-5
    changes = np.diff(gaps, axis=0)
    assert (np.einsum("ki,ki->k", changes[:-1], changes[1:]) < 0).all()


def test_two_vortices_turn_round_their_centre():
    own = scenes.get("vortex-pair")
    assert "a rotation agrees" in solution(own, 3, digits=25).evidence
    lattice = scenes.get("ablowitz-ladik")
    wave = lattice.with_values(name="wave", x0=["1/2", 0] * 3)  # ψ = a exp(2i a² t) in all sites
    found = solution(wave, 1, digits=20)
    with mpmath.workdps(30):
        assert abs(mpmath.mpc(found.x[2], found.x[3]) - mpmath.expj(mpmath.mpf(1) / 2) / 2) < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize("sites", [3, 5, 16])
def test_a_ring_of_any_number_of_sites_keeps_its_form(sites):
    lattice = ring(sites)
    flow = Scheme(lattice, get("degenerate-gauss-1")).flow("1/20")
    run = flow.trajectory(100)
    assert flow.poisson_defect(run.x[50], run.mu[50]) < 1e-13
    q, p = run.x[:, 0::2], run.x[:, 1::2]
    norms = np.log(1 + q**2 + p**2).sum(axis=1)
    assert abs(norms / norms[0] - 1).max() < 1e-3


def plane(**given):
    own = {"name": "plane", "groupoid": pair(2), "one_form": lambda x, p: [x[1], 0],
           "hamiltonian": lambda x, p: x.dot(x) / 2, "x0": [1, 0], "duration": 2}  # fmt: skip
    return Scene(**{**own, **given})


def test_a_canonical_one_form_is_the_plane_of_position_and_momentum():
    """The oscillator by L and by ϑ = p dq move alike; a scene is pickled with its one-form."""
    one, other = scenes.get("harmonic"), plane(x0=[scenes.get("harmonic").x0[0], 0])
    p = SimpleNamespace(**one.parameters)
    other = other.with_values(
        hamiltonian=lambda x, _: (
            x[1] ** 2 / (2 * sympy.Rational(p.mass)) + sympy.Rational(p.stiffness) * x[0] ** 2 / 2
        )
    )
    other = other.with_values(x0=[one.x0[0], p.mass * one.v0[0]])
    a, b = (Scheme(s, get("implicit-midpoint")).flow("1/20").trajectory(40) for s in (one, other))
    assert np.abs(a.x[:, 0] - b.x[:, 0]).max() < 1e-13
    assert np.abs(a.mu[:, 0] - b.x[:, 1]).max() < 1e-13


@pytest.mark.parametrize(("given", "words"), [
    ({"one_form": lambda x, p: [x[1]]}, "its one-form has 1 components, but the velocity has 2"),
    ({"one_form": lambda x, p: sympy.eye(2)}, "its one-form has 4 components, but"),
    ({"one_form": lambda x, p: None}, "its one-form is None"),
    ({"one_form": lambda x: [x[1], 0]}, r"one_form= is a function of .*write it with \(x, p\)"),
    ({"one_form": lambda x, p: [x[0], x[1]]}, r"dϑ is singular everywhere, in x\[0\]"),
    ({"one_form": lambda x, p: [x[1] ** 2, 0]}, "dϑ of its one-form is singular at x0, in the dir"),
    ({"one_form": lambda x, p: [sympy.log(x[1]), 0]}, "its Hamiltonian is no finite real number"),
    ({"one_form": lambda x, p: [abs(x[1]), 0]}, "the one-form of plane holds Abs"),
    ({"one_form": lambda x, p: [sympy.Symbol("q"), 0]}, "its one-form holds the unknown symbol q"),
    ({"hamiltonian": lambda x, p: abs(x[0])}, "the Hamiltonian of plane holds Abs"),
    ({"hamiltonian": lambda x, p: 1 / x[1]}, "its Hamiltonian is no finite real number at x0;"),
    ({"hamiltonian": lambda x, mu, p: x[0]}, r"hamiltonian= .*write it with \(x, p\)"),
    ({"hamiltonian": None}, "beside one_form= give hamiltonian="),
    ({"groupoid": pair(3), "x0": [1, 0, 0]}, r"pair\(n\) with n even"),
    ({"mu0": [0, 0]}, "mu0 is ϑ"),
    ({"force": lambda x, v, p: [0, 0]}, "leave force= out"),
    ({"lagrangian": lambda x, v, p: v[0]}, "leave lagrangian= out"),
])  # fmt: skip
def test_bad_input_is_one_sentence(given, words):
    with pytest.raises(BadInput, match=words) as caught:
        Scheme(plane(**given), get("implicit-midpoint"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("rule", "every", "digits"), [
    ("implicit-midpoint", 1, 16), ("runge-kutta-4", 1, 16), ("runge-kutta-4", 100, 16),
    ("runge-kutta-4", 1, 50), pytest.param("projected-gauss-1", 1, 16, marks=pytest.mark.slow),
])  # fmt: skip
def test_a_form_that_is_singular_on_the_way_is_met_in_a_sentence(rule, every, digits):
    """ẏ = −1/y ends at y = 0, through which an explicit step would go."""
    ending = plane(one_form=lambda x, p: [x[1] ** 2 / 2, 0], x0=[1, 1],
                   hamiltonian=lambda x, p: x[0] + x[1])  # fmt: skip
    with pytest.raises(StepFailure, match=r"dϑ is (nearly )?singular.*stop before") as caught:
        Scheme(ending, get(rule)).flow("1/100", digits).trajectory(100, every)
    assert caught.value.step_index in range(48, 53)


def test_a_singular_form_is_met_at_its_step_however_small_that_is():
    ending = plane(one_form=lambda x, p: [x[1] ** 2 / 2, 0], x0=[1, 1],
                   hamiltonian=lambda x, p: x[0] + x[1])  # fmt: skip
    flow = Scheme(ending, get("explicit-euler")).flow("1e-20", 50)
    with pytest.raises(StepFailure, match="passes a state where dϑ is singular") as caught:
        flow.trajectory(2, x0=[1, "1e-11"], t0=7)
    assert caught.value.step_index == 0


def test_methods_say_where_they_have_no_meaning():
    with pytest.raises(CannotMeasure, match="by one_form= and hamiltonian="):
        Scheme(scenes.get("pendulum"), get("projected-gauss-1"))
    for rule in ("stoermer-verlet", "newmark"):
        with pytest.raises(CannotMeasure, match="x of lotka-volterra is a phase space"):
            scheme("lotka-volterra", rule)
    with pytest.raises(BadInput, match='say "symmetric", "midpoint" or "standard"'):
        get("projected-gauss-1-oblique")


@pytest.mark.dear("[lotka-volterra]", "[magnetic-mirror]", "ladik", "centre")
@pytest.mark.parametrize("scene", DEGENERATE)
def test_a_method_for_forms_of_which_half_vanishes_asks_for_one(scene):
    assert get(HALF[0]).applies(scenes.get(scene)) is (scene in HALVED)


@pytest.mark.parametrize("name", ["degenerate-gauss-1", "projected-gauss-1"])
@pytest.mark.parametrize("far", [0, "1e-12", "1e-5"])
def test_small_motions_near_an_equilibrium_are_followed(name, far):
    """Differences of ϑ are known to the round-off of x, however small the slopes are."""
    near = scenes.get("lotka-volterra-half").with_values(x0=[Fraction(far) + 1, 2])
    run = Scheme(near, get(name)).flow("1/10").trajectory(60)
    assert np.abs(run.x - [1, 2]).max() < 2 * float(far) + 1e-15
