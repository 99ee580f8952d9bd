"""Schemes: at other values, self-adjointness and order."""

import numpy as np
import pytest

from discmech.integrators import (
    BadInput,
    Scheme,
    black_box,
    discretisation,
    midpoint,
    pair,
    scenes,
    vary,
)
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import CannotMeasure
from tests.objects import ALIKE, PLAIN, SCENES, SCHEMES, flow, named, scheme, two_thirds

KEPLER = {"parameters": {"strength": 2}, "x0": ["1/2", "1/3"]}
PENDULUM = {"parameters": {"gravity": 3}, "x0": ["1/2"]}


@pytest.mark.parametrize(
    ("scene", "rule", "values"),
    [("kepler", "midpoint", KEPLER), ("pendulum", "suzuki:rectangle", PENDULUM),
     ("pendulum", "gauss-2", PENDULUM)],
)  # fmt: skip
def test_a_scheme_at_other_values_is_the_scheme_derived_there(scene, rule, values):
    scene, rule = scenes.get(scene), discretisations.get(rule)
    scheme, derived = Scheme(scene, rule), Scheme(scene.with_values(**values), rule)
    scheme.flow("1/20").trajectory(3)
    moved = scheme.at(**values)
    assert moved.scene.x0 == derived.scene.x0
    run, other = (of.flow("1/20").trajectory(50) for of in (moved, derived))
    assert np.array_equal(run.x, other.x) and np.array_equal(run.mu, other.mu)
    assert moved.flow("1/20").poisson_defect(run.x[7], run.mu[7]) < 1e-15
    one, other = (f.scheme.scene.parameter_values for f in (derived.flow(1), moved.flow(1)))
    assert one == other and {*values["parameters"].values()} <= {*one}


def test_equations_know_no_value():
    """One object for all values, for a composition and its base, and for all their adjoints."""
    scheme = Scheme(scenes.get("pendulum"), discretisations.get("suzuki:rectangle"))
    moved = scheme.at(parameters={"gravity": 3}, x0=["1/2"])
    assert moved.equations is scheme.equations is scheme.base.equations
    assert moved.adjoint.equations is scheme.adjoint.equations
    assert moved.adjoint.scene is moved.scene


def test_what_was_derived_cannot_change():
    scheme = Scheme(scenes.get("heavy-top"), midpoint)
    with pytest.raises(BadInput, match="another groupoid makes another scheme"):
        scheme.at(groupoid=pair(3))
    with pytest.raises(BadInput, match="another shape"):
        scheme.at(parameters={"center": [1, 2]})
    with pytest.raises(BadInput, match="must be 1"):
        scheme.at(x0=[1, 1, 1])
    with pytest.raises(BadInput, match="no parameter 'mass'"):
        scheme.at(parameters={"mass": 1})


@pytest.mark.slow
def test_an_asymmetric_pair_of_points_is_self_adjoint_only_on_the_pair_groupoid():
    assert scheme("kepler", "two-thirds").self_adjoint
    assert not scheme("heavy-top", "two-thirds").self_adjoint


#: scenes on charts in which the inverse of u is not −u
SKEW = ("affine-group", "affine-on-line", "framed-plane")


@pytest.mark.parametrize(("scene", "rule"), named(
    (s, r) for s, of in SCENES.items() if s not in SKEW
    for r in (PLAIN if of.discrete_lagrangian is None else ("own",))
))  # fmt: skip
def test_order_of_the_built_in_rules(scene, rule):
    assert scheme(scene, rule).order == (1 if rule == "rectangle" and scene not in ALIKE else 2)


@pytest.mark.dear("heavy-top-by-hand")
@pytest.mark.sampled
@pytest.mark.parametrize(
    ("scene", "rule"),
    [pair for pair in SCHEMES if pair[0] in (*SKEW, "moving-mass", "heavy-top-by-hand")],
)
def test_orders_as_measured(scene, rule):
    """The end of a unit of time at two steps, against a fine one of the same rule.

    Where ι = −u fails at second order, u is a velocity to first order only.
    """
    coarse, half, fine = (
        np.concatenate([run.x[-1], run.mu[-1]])
        for run in (flow(scene, rule, f"1/{n}").trajectory(n, every=n) for n in (100, 200, 12800))
    )
    measured = np.log2(np.abs(coarse - fine).max() / np.abs(half - fine).max())
    wanted = 1 if scene in SKEW or rule == "rectangle" else 2
    assert measured == pytest.approx(wanted, abs=0.05) and scheme(scene, rule).order == wanted


def test_velocities_of_a_rule_that_cannot_be_asked_by_answers_count_too():
    """It looks into L first: the answer has one term, so what is derived is written out."""

    @discretisation(order=2)
    def formula(L, G, x, u, h):
        potential = L(x, u).as_ordered_terms()[1]
        velocity = G.velocity(x, u / 2, u, h)
        return h * L(G.target(x, u / 2, h), velocity) + h**3 * potential

    of = Scheme(SCENES["affine-on-line"], formula)
    assert not of.groupoid.symmetric_chart and of.order == 2


def test_an_order_that_is_not_stated_is_none():
    assert scheme("heavy-top", "two-thirds").order is None
    assert two_thirds.order is None


def test_a_scene_says_itself_how_it_is_discretised():
    pendulum, box = scenes.get("pendulum"), black_box(order=1)(lambda q, p, h: (q, p))
    assert type(pendulum.discretise(midpoint)) is Scheme
    assert type(pendulum.discretise(box)) is type(Scheme(pendulum, box)) is not Scheme


#: what only a discrete Lagrangian, and what only steps of one size have
OF_ARROWS = ("FL", "W", "omega", "residual", "legendre_minus", "legendre_plus", "rho", "L", "R",
             "discrete_lagrangian")  # fmt: skip
WITHOUT = {
    "map": ("pendulum", discretisations.get("implicit-midpoint"), (*OF_ARROWS, "adjoint")),
    "constraints": ("cartesian-pendulum", midpoint, OF_ARROWS),
    "black box": ("pendulum", black_box(order=1)(lambda q, p, h: (q, p)),
                  (*OF_ARROWS, "adjoint", "modified_equation")),
    "steps that vary": ("pythagorean", vary(discretisations.get("trapezoidal"), way="naive"),
                        ("adjoint", "modified_equation")),
}  # fmt: skip


@pytest.mark.parametrize("case", WITHOUT)
def test_a_thing_that_a_scheme_has_not_is_refused_in_a_sentence(case):
    scene, rule, names = WITHOUT[case]
    found = Scheme(scenes.get(scene), rule)
    for name in names:
        with pytest.raises(CannotMeasure, match=f"no {name.replace('_', '.')}"):
            getattr(found, name)()  # one of them is a method
