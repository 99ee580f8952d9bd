"""Verdicts in every system of units: a scene told in others has the same, and so have controls.

In units of which the old length is X, the old time T and the old action A, the base and velocities
of a pair are multiplied by X and X/T, velocities of a group by 1/T, and the Lagrangian by A/T.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import sympy
from sympy import Integer, Matrix, exp

from discmech import Lattice
from discmech.integrators import (
    Scene,
    Scheme,
    StepFailure,
    lie_group,
    one_step,
    pair,
    product,
    rules,
    scenes,
    so,
)
from discmech.studies.core import controls
from discmech.studies.symplecticity.limits import limit, limits

pytestmark = pytest.mark.sampled


def _spinning(x, v, p):
    """A sprung mass that carries a body, whose spin drives it: lengths beside angles."""
    spin = sum(i * v[1 + k] ** 2 for k, i in enumerate((1, 2, 3)))
    return (v[0] ** 2 + spin - x[0] ** 2) / 2 + v[0] * v[3] / 4 + x[0] * v[2] / 5


SPINNING = Scene("spinning-mass", product(pair(1), lie_group(so(3))), _spinning,
                 x0=["0.5"], v0=["0.3", "0.7", "0.6", "0.5"], step="0.1")  # fmt: skip
#: scene → which components of x, and of u, hold a length; one of each kind of groupoid, one stiff
LENGTHS = {"harmonic": ({0}, {0}), "pendulum": ((), ()), "kepler": ({0, 1}, {0, 1}),
           "fpu": (range(6), range(6)), "rigid-body": ((), ()), "heavy-top": ((), ()),
           "rotor-body": ((), ()), "spinning-mass": ({0}, {0})}  # fmt: skip
#: where no power of a length leaves the doubles at 10^±150: x² is as far as they go
QUADRATIC = ("harmonic", "spinning-mass")
#: a step of three unknowns is solved by a determinant, the cube of an action
CUBED = ("rigid-body", "heavy-top")
UNITS = ("length", "time", "action")


@dataclass(frozen=True)
class Units:
    """How many of the new units the old ones of length, time and action are, as powers of ten."""

    length: int = 0
    time: int = 0
    action: int = 0

    def of(self, name):
        return Fraction(10) ** getattr(self, name)

    def __str__(self):
        return ",".join(f"{n} 1e{getattr(self, n)}" for n in UNITS if getattr(self, n)) or "own"


def others():
    for name in LENGTHS:
        for power in (10, -10, 150, -150):
            for unit in UNITS:
                if unit == "length" and not LENGTHS[name][0]:
                    continue
                if unit == "length" and abs(power) > 10 and name not in QUADRATIC:
                    continue
                # a step beyond 1e±100 is refused
                least = {"time": 90, "action": 100 if name in CUBED else 150}.get(unit, 150)
                yield name, Units(**{unit: max(-least, min(least, power))})


@cache
def derived(name):
    """The scheme in letters for the units, so that it is derived once."""
    scene = SPINNING if name == SPINNING.name else scenes.get(name)
    n, m = scene.groupoid.dim_x, scene.groupoid.dim_u

    def lagrangian(x, v, p):
        own_x, own_v = x.copy(), v * p.time_unit
        for i in LENGTHS[name][0]:
            own_x[i] = x[i] / p.length_unit
        for i in LENGTHS[name][1]:
            own_v[i] = own_v[i] / p.length_unit
        return p.action_unit / p.time_unit * scene.lagrangian(own_x, own_v, p)

    letters = {f"{unit}_unit": 1 for unit in UNITS}
    told = scene.with_values(name=f"{name}-told", symmetries=(), fast=None)
    told = Scene(told.name, told.groupoid, lagrangian, {**scene.parameters, **letters},
                 scene.x0, scene.v0, scene.duration, scene.step)  # fmt: skip
    assert (n, m) == (told.groupoid.dim_x, told.groupoid.dim_u)
    return Scheme(told, rules.trapezoidal), scene


def in_units(name, units):
    """The scheme of the scene as told in other units."""
    scheme, scene = derived(name)
    of_x, of_u = LENGTHS[name]
    length, time = units.of("length"), units.of("time")
    return scheme.at(
        x0=[e * (length if i in of_x else 1) for i, e in enumerate(scene.x0)],
        v0=[e * (length if i in of_u else 1) / time for i, e in enumerate(scene.v0)],
        duration=scene.duration * time, step=scene.step * time,
        parameters={f"{unit}_unit": units.of(unit) for unit in UNITS},
    )  # fmt: skip


def defects(name, units, steps=4):
    """The worst (pullback, Poisson, residual) of a run in double precision."""
    scheme = in_units(name, units)
    flow = scheme.flow(scheme.scene.step)
    run = flow.trajectory(steps)
    found = []
    for k in (0, steps - 1):
        x, u, mu = run.x[k], run.u[k], run.mu[k]
        found.append((flow.pullback_defect(x, u), flow.poisson_defect(x, mu, u0=u),
                      flow.step_defect(x, mu, run.x[k + 1], run.mu[k + 1], u0=u)))  # fmt: skip
    return dict(zip(("pullback", "poisson", "residual"), map(max, zip(*found, strict=True)),
                    strict=True))  # fmt: skip


every_unit = pytest.mark.parametrize(
    ("name", "units"), [pytest.param(*of, id=f"{of[0]} {of[1]}") for of in others()]
)


@pytest.mark.dear("-10]", "rotor", "mass length 1e150")
@every_unit
def test_sound_schemes_keep_their_forms_and_their_equations_in_every_unit(name, units):
    allowed = limits(16)
    for kind, value in defects(name, units).items():
        assert value <= allowed[kind], kind


@pytest.mark.dear("rotor", "fpu length 1e", "top action 1e-10]", "mass length 1e150")
@every_unit
def test_controls_are_caught_in_every_unit(name, units):
    scheme = in_units(name, units)
    flow = scheme.flow(scheme.scene.step)
    caught = 1e3 * limit(16)
    for control in ("explicit Euler", "Heun"):
        assert max(controls.runge_kutta_defects(flow, control, 2)) >= caught, control
    run = flow.trajectory(2)
    assert controls.damped_defect(flow, run.x[1], run.u[1]) >= caught
    if name in ("heavy-top", "rotor-body", "spinning-mass"):
        flipped = flow.poisson_defect(run.x[1], run.mu[1], u0=run.u[1], bracket_sign=-1)
        assert flipped >= caught


@every_unit
@pytest.mark.parametrize("part", ("x", "mu"))
def test_a_step_that_is_off_in_any_one_component_is_caught_in_every_unit(name, units, part):
    """By a part in 10⁸ of it: a large component hides no small one."""
    scheme = in_units(name, units)
    flow = scheme.flow(scheme.scene.step)
    run = flow.trajectory(2)
    x, u, mu = run.x[1], run.u[1], run.mu[1]
    for component in range(getattr(run, part).shape[1]):
        after = {"x": run.x[2].copy(), "mu": run.mu[2].copy()}
        after[part][component] *= 1 + 1e-8
        if not after[part][component]:
            continue
        found = flow.step_defect(x, mu, after["x"], after["mu"], u0=u)
        assert found > limits(16)["residual"], component


@pytest.mark.parametrize("name", CUBED)
@pytest.mark.parametrize("power", (150, -150))
def test_units_that_no_double_holds_are_refused(name, power):
    scheme = in_units(name, Units(action=power))
    with pytest.raises(StepFailure, match="no longer finite"):
        scheme.flow(scheme.scene.step).trajectory(1)


@pytest.mark.parametrize("digits", (16, 50))
def test_a_component_that_others_hide_is_solved_for_to_its_own_digits(digits):
    """Of masses in a row at rest, of which one is pushed, the last ones move by 1e-25 of it."""
    fpu = scenes.get("fpu")
    flow = Scheme(fpu, rules.midpoint).flow(fpu.step, digits)
    run = flow.trajectory(6)
    for k in range(6):
        found = flow.step_defect(run.x[k], run.mu[k], run.x[k + 1], run.mu[k + 1], u0=run.u[k])
        assert found <= limits(digits)["residual"]


def test_what_is_zero_on_both_sides_is_no_defect():
    """The plane x₃ = 0 of a central force is kept exactly; a push out of it is no round-off."""
    flat = Scene("flat", pair(3), lambda x, v, p: (v.dot(v) - x.dot(x)) / 2,
                 x0=[1, 0, 0], v0=[0, 1, 0], step="0.1")  # fmt: skip
    flow = Scheme(flat, rules.midpoint).flow(flat.step)
    run = flow.trajectory(1)
    assert flow.pullback_defect(run.x[0], run.u[0]) <= 1e-40
    assert flow.poisson_defect(run.x[0], run.mu[0]) <= 1e-40
    assert flow.step_defect(run.x[0], run.mu[0], run.x[1], run.mu[1]) <= 2.0**-52
    assert flow.step_defect(run.x[0], run.mu[0], run.x[1] + [0, 0, 1e-30], run.mu[1]) == 1


def test_an_equilibrium_of_forces_that_cancel_is_no_defect():
    """What is left of two springs' pulls is round-off of each, not of their sum."""

    def lagrangian(x, v, p):
        return v[0] ** 2 / 2 - 3 * (x[0] - p.a) ** 2 / 2 - (x[0] + 3 * p.a) ** 2 / 2

    still = Scene("held", pair(1), lagrangian, {"a": "1/3"}, x0=[0], v0=[0], step="0.1")
    flow = Scheme(still, rules.midpoint).flow(still.step)
    run = flow.trajectory(3)
    for k in range(3):
        found = flow.step_defect(run.x[k], run.mu[k], run.x[k + 1], run.mu[k + 1], u0=run.u[k])
        assert found <= limits(16)["residual"]
    assert flow.step_defect(run.x[0], run.mu[0], run.x[1], run.mu[1] + 1e-12) > 1e-13


@pytest.mark.parametrize(("power", "offset"), [(-60, 0), (-150, 0), (0, 10**10)])
def test_a_small_nonlinearity_is_no_affine_equation(power, offset):
    """In small units, or seen from far, every derivative at a random point is small."""
    kepler = scenes.get("kepler")
    scene = kepler.with_values(
        lagrangian=lambda x, v, p: Integer(10) ** power * kepler.lagrangian(
            x - Matrix([offset, 0]), v, p),
        x0=[kepler.x0[0] + offset, kepler.x0[1]], symmetries=(),
    )  # fmt: skip
    run = Scheme(scene, rules.midpoint).flow(kepler.step, 50).trajectory(2)
    assert run.newton_mean > 1


@pytest.mark.parametrize("power", [-150, -60, -11, 40, 150])
@pytest.mark.parametrize("well", [lambda y: exp(-(y**2)), lambda y: y**4])
def test_a_nonlinearity_of_any_length_is_no_affine_equation(well, power):
    """At x = 1 it is lost beside the mass: exp(-10²²) in short lengths, 10⁻¹⁶⁰ in long ones."""
    unit = Integer(10) ** power
    scene = Scene("well", pair(1), lambda x, v, p: v[0] ** 2 / 2 - unit**2 * well(x[0] / unit),
                  x0=[unit], v0=[0], step="0.1")  # fmt: skip
    assert Scheme(scene, rules.midpoint).flow(scene.step, 50).trajectory(2).newton_mean > 1


def test_integers_among_the_entries_of_a_matrix_are_no_floats():
    """At 50 digits 1/3 in an elimination is a third to 50 digits."""
    from discmech.integrators.numbers import arithmetic

    numbers = arithmetic(50)
    with numbers.working():
        a = np.array([[3, 1], [1, 2]], dtype=object)
        left = a @ numbers.solve(a, np.array([1, 0], dtype=object)) - [1, 0]
        assert max(abs(left)) < 1e-60


@pytest.mark.parametrize("power", (150, -150))
def test_the_velocities_of_a_map_are_solved_for_with_masses_of_any_size(power):
    """A mass of 10¹⁵⁰ is an integer that numpy has no number for."""
    spring = Scene("heavy", pair(1), lambda x, v, p: Integer(10) ** power * (v[0] ** 2 - x[0] ** 2),
                   x0=[1], v0=["1/2"], step="0.1")  # fmt: skip
    run = Scheme(spring, rules.get("explicit-euler")).flow(spring.step).trajectory(2)
    assert np.allclose(run.u[:, 0], run.mu[:, 0] / 10.0**power / 2)


@pytest.mark.slow
def test_stages_are_determined_in_every_unit():
    """At points in no unit the residual's derivative had lost all its digits."""

    @one_step(groupoids="pair", stages=2)
    def two_parts(s, z, h, K):
        first, second = K
        rows = [first - s.f(z + h * first / 6)]
        rows.append(second - s.f(z + h * (first / 3 + second / 3)))
        return z + h * (first + 2 * second) / 3, rows

    scene = scenes.get("double-pendulum")
    length, time, action = Fraction(10) ** 9, Fraction(1, 100), Fraction(1, 100)

    def lagrangian(x, v, p):
        return action / time * scene.lagrangian(x / length, v * time / length, p)

    told = Scene("double-pendulum-told", scene.groupoid, lagrangian, scene.parameters,
                 [e * length for e in scene.x0], [0, 0], scene.duration * time,
                 scene.step * time)  # fmt: skip
    assert Scheme(told, two_parts).scene is told


def test_a_small_potential_is_a_part_of_the_adjoint():
    """In units near 10⁻¹⁷ the rectangle rule was taken for its own adjoint, so of order 2."""
    unit = Fraction(1, 10**17)

    def lagrangian(x, v, p):
        return (v[0] / unit) ** 2 / 2 + unit**3 * sympy.cos(x[0] / unit)

    told = Scene("pendulum-told", scenes.get("pendulum").groupoid, lagrangian, {}, [unit], [0],
                 1, "1/20")  # fmt: skip
    assert Scheme(told, rules.rectangle).order == 1
    assert Scheme(told, rules.midpoint).order == 2


def _chain(units):
    """Masses on nonlinear springs over a table, in units of length, time and action."""
    X, T, A = (sympy.sympify(units.of(e)) for e in UNITS)

    def on_site(x, v, p):
        return A / T * ((v[0] * T / X) ** 2 / 2 - x[0] / X)

    def on_bond(x, y, p):
        r = (y[0] - x[0]) / X
        return -A / T * (r**2 / 2 + r**4 / 8)

    start = np.array([[0.3], [0.5], [0.4], [0.6]])
    return Lattice("chain", pair(1), 4, {}, on_site, on_bond, x0=start * float(X),
                   v0=0.2 * start[::-1] * float(X / T), step=T / 20, duration=T, restitution=1,
                   contact=lambda x, p: [x[0] / X])  # fmt: skip


OF_SYSTEMS = [Units(), Units(length=-12, time=5), Units(time=-9, action=20), Units(length=60),
              Units(action=-60), Units(length=-6, time=3, action=-25)]  # fmt: skip
#: kernels are compiled for each: in `make test` the last, which changes all units, stands for all
SYSTEMS = [pytest.param(e, id=str(e), marks=[pytest.mark.slow] * (e is not OF_SYSTEMS[-1]))
           for e in OF_SYSTEMS]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("units", SYSTEMS)
def test_a_lattice_with_contact_moves_alike_in_every_unit(units):
    run, plain = (Scheme(e, rules.midpoint).flow(e.step).trajectory(40)
                  for e in (_chain(units), _chain(Units())))  # fmt: skip
    assert len(run.impacts.t) == len(plain.impacts.t) > 2
    length, momentum = float(units.of("length")), float(units.of("action") / units.of("length"))
    assert abs(run.x / length - plain.x).max() < 1e-12
    assert abs(run.mu / momentum - plain.mu).max() < 1e-12


@pytest.mark.parametrize("rule", ["newmark-0.5-0", "implicit-midpoint"])
@pytest.mark.parametrize("units", SYSTEMS)
def test_maps_solve_for_x_and_mu_in_units_of_their_own(rule, units):
    """Slopes of μ that are 1e-16 of those of x, and less, were once not corrected any more."""
    scheme = Scheme(in_units("pendulum", units).scene, rules.get(rule))
    flow = scheme.flow(scheme.scene.step)
    run = flow.trajectory(4)
    for k in range(4):
        found = flow.step_defect(run.x[k], run.mu[k], run.x[k + 1], run.mu[k + 1], u0=run.u[k])
        assert found <= limits(16)["residual"]
