"""A system by its Hamiltonian is the system by its Lagrangian, on every groupoid."""

from functools import partial

import mpmath
import numpy as np
import pytest
import sympy

from discmech import (
    BadInput,
    Scene,
    Scheme,
    discretisation,
    lie_group,
    midpoint,
    pair,
    scenes,
    so,
    solution,
)
from discmech.integrators.equations import DiscreteEquations, SceneSymbols
from discmech.integrators.equations.rule_view import with_momenta
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get
from discmech.integrators.scene import takes_fourth
from tests.studies.programs.methods import verlet

#: of every groupoid, with terms linear in the velocity, a force, the time
NAMES = ("kepler", "kapitza-pendulum", "rigid-body", "heavy-top", "rotor-body", "charged-particle",
         "double-pendulum", "damped-pendulum", "kirchhoff", "driven-heavy-top",
         "wong")  # fmt: skip


def energy(lagrangian, x, mu, *rest):
    """μ·v − l at the v that solves μ = ∂l/∂v, linear in v: another way than the bench's own."""
    v = sympy.Matrix(len(mu), 1, lambda i, _: sympy.Dummy(f"v{i}", real=True))
    value = lagrangian(x, v, *rest)
    rows = [sympy.diff(value, e) for e in v]
    ((*found,),) = sympy.linsolve([a - b for a, b in zip(rows, mu, strict=True)], *v)
    return (mu.dot(v) - value).subs(dict(zip(v, found, strict=True)), simultaneous=True)


def by_hamiltonian(name):
    """The scene of that name, given by its Hamiltonian and the momentum of its start."""
    scene = scenes.get(name)
    of = scene.lagrangian
    timed = partial(energy, of)
    plain = (lambda x, mu, p, t: timed(x, mu, p, t)) if takes_fourth(of) else (
        lambda x, mu, p: timed(x, mu, p))  # fmt: skip
    mu0 = solution(scene, 0, digits=60).mu
    return Scene(
        name=f"{name}-by-H", groupoid=scene.groupoid, hamiltonian=plain, x0=scene.x0,
        mu0=[mpmath.nstr(e, 50) for e in mu0], parameters=scene.parameters,
        duration=scene.duration, step=scene.step, force=scene.force, symmetries=scene.symmetries,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_both_move_alike(name):
    """By a rule on L, by maps on the dual and by the reference, to round-off; H is the energy."""
    one, other = scenes.get(name), by_hamiltonian(name)
    for rule in (midpoint, get("dual-gauss-2"), get("runge-kutta-4")):
        schemes = Scheme(one, rule), Scheme(other, rule)
        a, b = (of.flow(one.step).trajectory(20) for of in schemes)
        for p, q in ((a.x, b.x), (a.mu, b.mu)):
            assert np.abs(p - q).max(initial=0) < 2e-13 * max(1, np.abs(p).max(initial=0)), rule
    ends = [solution(s, one.duration / 50, digits=30, proof=False) for s in (one, other)]
    with mpmath.workdps(40):
        a, b = ([*e.x, *e.mu, *e.v] for e in ends)
        assert max(abs(p - q) for p, q in zip(a, b, strict=True)) < mpmath.mpf(10) ** -27


@pytest.mark.parametrize("sign", [1, -1])
def test_a_hamiltonian_with_another_sign_is_seen(sign):
    """The control: of a magnetic term, which leaves energy and order alone."""
    one, other = scenes.get("charged-particle"), by_hamiltonian("charged-particle")
    told = other.hamiltonian
    other = other.with_values(hamiltonian=lambda x, mu, p: told(sign * x, mu, p))
    a, b = (Scheme(s, midpoint).flow(one.step).trajectory(20) for s in (one, other))
    assert (np.abs(a.x - b.x).max() < 1e-12) == (sign == 1)


def relativistic(x, mu, p):
    return sympy.sqrt(1 + mu.dot(mu)) + x.dot(x) / 2


SWIFT = Scene("swift", pair(1), hamiltonian=relativistic, x0=[1], mu0=["1/2"], duration=5)


def of_a_spinning_body(x, mu, p):
    return mu[0] ** 2 / 2 + mu[1] ** 2 / 4 + mu[2] ** 2 / 6 + mu[0] ** 4 / 50


SPINNING = Scene("spinning", lie_group(so(3)), hamiltonian=of_a_spinning_body,
                 mu0=["1/2", "0.7", "0.2"], duration=5)  # fmt: skip


@pytest.mark.parametrize(("name", "rule"), [
    ("kepler", "midpoint"),
    *(pytest.param(name, rule, marks=pytest.mark.slow)
      for name in ("kepler", "heavy-top", "rotor-body") for rule in ("trapezoidal", "gauss-2")),
])  # fmt: skip
def test_momenta_as_unknowns_of_the_step_are_the_lagrangian_in_closed_form(name, rule):
    scene = by_hamiltonian(name)
    rule = get(rule)
    more = with_momenta(SceneSymbols(scene), rule)
    unknown = DiscreteEquations(SceneSymbols(scene, more.stages), more)
    assert more.stages > rule.stages
    a, b = (Scheme(scene, rule, e).flow(scene.step).trajectory(20) for e in (None, unknown))
    for p, q in ((a.x, b.x), (a.mu, b.mu)):
        assert np.abs(p - q).max(initial=0) < 2e-13 * max(1, np.abs(p).max(initial=0))


@pytest.mark.slow
@pytest.mark.parametrize("scene", [SWIFT, SPINNING], ids=lambda s: s.name)
def test_rules_run_on_a_hamiltonian_whose_lagrangian_is_not_closed(scene):
    """At their orders, and Gauss's collocation is the map on the dual."""
    wanted = np.array([float(e) for e in solution(scene, 2, digits=30).mu])
    for name, order in (("midpoint", 2), ("trapezoidal", 2), ("gauss-2", 4)):
        assert get(name).applies(scene)
        flows = [Scheme(scene, get(name)).flow(f"1/{n}") for n in (20, 40)]
        errors = [abs(f.trajectory(2 * n).mu[-1] - wanted).max()
                  for f, n in zip(flows, (20, 40), strict=True)]  # fmt: skip
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.02)
        row = flows[0].trajectory(3)
        assert flows[0].pullback_defect(row.x[1], row.u[1]) < 1e-14
    if scene is SWIFT:
        one, other = (Scheme(scene, get(r)).flow("1/20").trajectory(40)
                      for r in ("gauss-2", "dual-gauss-2"))  # fmt: skip
        assert abs(one.x - other.x).max() < 1e-14


@pytest.mark.slow
def test_what_is_regular_is_found_where_it_is_diagonal():
    """Of this ∂²H/∂μ² sympy's own singular values find no digits."""
    gyro = Scene("gyro", lie_group(so(3)), parameters={"e": "0.1"}, mu0=["0.4", "0.7", "-0.2"],
                 hamiltonian=lambda x, mu, p: mu[0] ** 2 / 2 + mu[1] ** 2 / 3 + mu[2] ** 2 / 5
                 + mu[2] / 3 + p.e * mu[0] ** 4 / 4, duration=5)  # fmt: skip
    assert not gyro.has_lagrangian and midpoint.applies(gyro)
    ends = [
        Scheme(gyro, get(r)).flow("1/20").trajectory(4).mu[-1] for r in ("midpoint", "dual-gauss-3")
    ]
    assert abs(ends[0] - ends[1]).max() < 1e-4


def test_what_rules_cannot_ask_of_such_a_hamiltonian_is_said():
    pushed = Scene("pushed", pair(1), hamiltonian=relativistic, x0=[1], mu0=["1/2"], duration=5,
                   force=lambda x, v, p: [-v[0]])  # fmt: skip
    assert not midpoint.applies(pushed) and get("dual-gauss-2").applies(pushed)
    with pytest.raises(CannotMeasure, match=r"a force acts with the weight .* dual-gauss-2"):
        Scheme(pushed, midpoint)
    with pytest.raises(CannotMeasure, match="asks for more than values of the Lagrangian"):
        Scheme(SWIFT, by_gradient)
    with pytest.raises(CannotMeasure, match="∂²H/∂mu² of its Hamiltonian is singular"):
        Scheme(scenes.get("abc-flow"), midpoint)


@discretisation()
def by_gradient(L, G, x, u, h):
    return h * L(x, u) + h**3 * L.gradient(x)[0] ** 2


def test_a_hamiltonian_without_a_lagrangian_runs_by_maps_and_boxes():
    assert not SWIFT.has_lagrangian and scenes.get("kepler").has_lagrangian
    wanted = solution(SWIFT, 1, digits=40)
    assert wanted.certain_digits >= 40
    for rule, bound in ((get("dual-gauss-3"), 1e-11), (verlet, 1e-3)):
        run = Scheme(SWIFT, rule).flow("1/50").trajectory(50)
        assert abs(run.x[-1, 0] - float(wanted.x[0])) < bound
        assert abs(run.mu[-1, 0] - float(wanted.mu[0])) < bound
    speed = float(wanted.mu[0] / mpmath.sqrt(1 + wanted.mu[0] ** 2))
    assert float(wanted.v[0]) == pytest.approx(speed, abs=1e-14)


BAD = {"name": "bad", "groupoid": pair(1), "x0": [1], "mu0": [0]}


def kinetic(x, mu, p):
    return mu[0] ** 2 / 2


@pytest.mark.parametrize(("given", "words"), [
    ({"hamiltonian": lambda x, mu, p: kinetic(x, mu, p) + sympy.Abs(x[0])},
     "the Hamiltonian of bad holds Abs"),
    ({"hamiltonian": lambda x, mu: 0}, r"hamiltonian= is a function of .*\(x, mu, p\)"),
    ({"hamiltonian": kinetic, "mu0": None}, "give the momentum mu0"),
    ({"hamiltonian": kinetic, "lagrangian": kinetic}, "stands alone; leave lagrangian= out"),
    ({"hamiltonian": kinetic, "holonomic": lambda x, p: [x[0]]}, "leave holonomic= out"),
    ({"hamiltonian": lambda x, mu, p: 1 / x[0] + mu[0], "x0": [0]}, "its Hamiltonian is no finite"),
    ({"hamiltonian": lambda x, mu, p: sympy.Symbol("q") * mu[0]}, "the unknown symbol q"),
    ({"hamiltonian": lambda x, mu, p: np.sin(x[0])}, "write it with sympy functions"),
    ({"hamiltonian": lambda x, mu, p: None}, "its Hamiltonian is None"),
])  # fmt: skip
def test_bad_input_is_one_sentence(given, words):
    with pytest.raises(BadInput, match=words) as caught:
        Scheme(Scene(**{**BAD, **given}), get("dual-gauss-2"))
    assert "\n" not in str(caught.value)
