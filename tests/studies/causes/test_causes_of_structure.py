"""Defects of symplecticity and of momenta: one constructed case for each cause, and its name."""

import itertools
from dataclasses import replace

import pytest
import sympy

from discmech.integrators import Conserved, Scene, Scheme, discretisation, pair, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import midpoint
from discmech.studies import check
from discmech.studies.causes.solver_sweep import of_symplecticity
from discmech.studies.core.case import Case
from discmech.studies.momentum.cause import of_scene
from tests.studies.causes.faults import Broken, cause, crooked, damped, drifting, impatient, loose


def symplecticity(scene, fault, digits=30):
    return Broken("symplecticity", scenes.get(scene), midpoint, digits, 16, fault=fault)


def test_a_residual_of_the_solver_is_told_from_structure():
    found = cause(symplecticity("rigid-body", loose))
    assert found["cause"] == "solver residual"
    sizes = [defect for _, defect in found["evidence"]["swept"]]
    assert sizes[0] > 1e3 * sizes[-1] and found["evidence"]["solved"] < 1e-25


def test_a_defect_of_constraints_is_not_blamed_on_the_bracket():
    """On a nonholonomic scene none is kept, by a sound step neither."""
    case = Case("symplecticity", scenes.get("suslov"), midpoint, 16, 16)
    assert of_symplecticity(case, "constraint", case.scene.step, 0, 1e-13) is None


def test_structure_stays_however_well_steps_are_solved():
    found = cause(symplecticity("rigid-body", damped))
    assert found["cause"] == "structure"
    sizes = [defect for _, defect in found["evidence"]["swept"]]
    assert sizes[-1] > 1e-8 and found["evidence"]["solved"] > 1e-8


@pytest.mark.dear("impatient")
@pytest.mark.parametrize(("fault", "name"), [(drifting, "update"), (impatient, "solver residual")])
def test_steps_that_are_not_of_sound_maps_are_told_from_a_broken_form(fault, name):
    """On a pair groupoid any arrow keeps the forms: the residual alone tells."""
    found = cause(symplecticity("pendulum", fault))
    evidence = found["evidence"]
    assert found["cause"] == name and evidence["taken"] > 1e-8 and evidence["solved"] < 1e-28
    assert (evidence["residual"] < 1e-28) is (name == "update")
    assert (evidence["own"] < 1e-28) is (name == "update")
    sizes = [defect for _, defect in evidence["swept"]]
    assert all(a > 500 * b for a, b in itertools.pairwise(sizes))


@pytest.mark.slow
def test_the_form_of_a_composition_is_diagnosed_too():
    """It has no pullback, and the maps of its substeps are solved anew: it is the structure."""
    rule = discretisations.get("triple-jump:midpoint")
    scene = scenes.get("rigid-body")
    found = cause(Broken("symplecticity", scene, rule, 30, 16, fault=crooked))
    assert found["cause"] == "structure" and "poisson" in found["sentence"]


@discretisation(order=2)
def pushed(L, G, x, u, h):
    """The midpoint rule with a kinetic energy that prefers the first axis, by O(h³)."""
    return h * L(G.target(x, u, h / 2), u) + h**3 * u[0] ** 2 / 10


def momentum(scene, rule, fault=None):
    case = Case("momentum", scenes.get(scene), rule, 30, 40)
    return case if fault is None else Broken(**vars(case), fault=fault)


def test_a_discrete_lagrangian_that_is_not_invariant_is_told_by_the_ends_of_an_arrow():
    found = cause(momentum("kepler", pushed))
    assert found["cause"] == "invariance" and "angular momentum" in found["sentence"]
    assert found["evidence"]["gap"] > 1e-8


@discretisation(order=2)
def uneven(L, G, x, u, h):
    """The midpoint rule with a ridge across the orbit, far from its start."""
    return h * L(G.target(x, u, h / 2), u) + h * x[1] * sympy.exp(-400 * (x[0] + 1) ** 2) / 10**4


def test_it_is_so_where_the_run_loses_it_and_not_at_its_start():
    found = cause(replace(momentum("kepler", uneven), steps=400))
    assert found["cause"] == "invariance" and " from t = " in found["sentence"]
    assert found["evidence"]["made"] > found["evidence"]["change"] / 2 > 0


def told_of(scene, rule=midpoint):
    """What is said of a momentum that drifts."""
    (case,) = check("momentum", [scene], [rule], [30], 40)["cases"]
    return case["diagnosis"]


@pytest.mark.slow
def test_a_quantity_that_the_motion_does_not_keep_is_the_scenes_mistake():
    kepler = scenes.get("kepler")
    pulled = kepler.with_values(
        name="pulled", lagrangian=lambda x, v, p: kepler.lagrangian(x, v, p) + x[0] / 100
    )
    found = told_of(pulled)
    assert found["cause"] == "scene" and found["evidence"]["motion"] > 1e-6


@pytest.mark.parametrize(("more", "lost"), [
    (lambda x, p, t: 0, False), (lambda x, p, t: (p.a - p.b) * x[0], False),
    (lambda x, p, t: x[1] * x[2] ** 2, True),
    (lambda x, p, t: x[0] * sympy.exp(-400 * (t - 4) ** 2), True),
])  # fmt: skip
def test_it_is_so_of_one_that_is_kept_in_a_plane_or_at_the_start_alone(more, lost):
    spin = Conserved("spin", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])
    scene = Scene("flat", pair(3), lambda x, v, p, t: v.dot(v) / 2 - x.dot(x) / 2 + more(x, p, t),
                  x0=[1, 0, 0], v0=[0, 1, 0], duration=10, step="1/20", symmetries=[spin],
                  parameters={"a": 1, "b": 1})  # fmt: skip
    told = of_scene(Scheme(scene, midpoint), spin)
    assert (told and told["cause"]) == ("scene" if lost else None)


ODD = {
    "rigid-body": Conserved("odd", lambda x, mu, p: x.T * mu, attitude=True),
    "damped-pendulum": Conserved("odd", lambda x, mu, p: x[0]),  # on which no force does work
}


@pytest.mark.dear("rigid-body")
@pytest.mark.parametrize(("name", "rule"), [
    ("rigid-body", "midpoint"), ("rigid-body", "implicit-midpoint"),
    ("rigid-body", "triple-jump:midpoint"),
    ("damped-pendulum", "midpoint"),
])  # fmt: skip
def test_it_is_so_of_an_attitude_under_a_force_and_of_every_method(name, rule):
    scene = scenes.get(name).with_values(name="odd", symmetries=[ODD[name]])
    found = told_of(scene, rule)
    assert found["cause"] == "scene" and "odd" in found["sentence"]


def bent_plane(x, v, p):
    """The harmonic oscillator of the plane in (X, Y − X²): its rotations are not affine."""
    y, dy = x[1] + x[0] ** 2, v[1] + 2 * x[0] * v[0]
    return (v[0] ** 2 + dy**2 - x[0] ** 2 - y**2) / 2


def test_a_symmetry_that_is_not_affine_is_the_coordinates_mistake():
    turned = Conserved(
        "J", lambda x, mu, p: x[0] * mu[1] - (x[1] + x[0] ** 2) * (mu[0] - 2 * x[0] * mu[1])
    )
    scene = Scene("bent", pair(2), bent_plane, x0=["1/2", "1/3"], v0=["1/5", 1], duration=10,
                  step="1/20", symmetries=[turned])  # fmt: skip
    found = told_of(scene)
    assert found["cause"] == "coordinates" and found["evidence"]["gap"] > 1e-8


def test_a_run_that_loses_what_its_discrete_lagrangian_keeps_is_to_blame_itself():
    found = cause(momentum("kepler", midpoint, drifting))
    assert found["cause"] == "run" and found["evidence"]["gap"] < 1e-28
