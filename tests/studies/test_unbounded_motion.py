"""Motions without bound or with an end leave a study inconclusive; methods that blow up fail."""

import gc
import weakref
from contextlib import suppress

import numpy as np
import pytest

from discmech.integrators import BadInput, Scene, discretisation, pair, rules, scenes
from discmech.integrators.scene import Conserved
from discmech.reference import MotionEnds
from discmech.studies import get
from discmech.studies.core.ended import refuse_ended
from tests.studies.as_json import run_case
from tests.studies.cached_results import case, measured

#: a geodesic of the hyperbolic plane: it runs to the boundary x₂ = 0, where μ grows without end
GEODESIC = Scene(
    "half-plane", pair(2), lambda x, v, p: v.dot(v) / (2 * x[1] ** 2),
    x0=[0, 1], v0=[1, 0], step="0.1", duration=10,
    symmetries=[Conserved("translation", lambda x, mu, p: mu[0])],
)  # fmt: skip
HILL = Scene("hill", pair(1), lambda x, v, p: (v[0] ** 2 + x[0] ** 2) / 2,
             x0=[1], v0=[0], step="0.1", duration=10)  # fmt: skip
SPRING = Scene("spring", pair(1), lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2,
               x0=[1], v0=[0], step="0.5", duration=10)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["explicit-euler", "runge-kutta-4", "rectangle"])
def test_a_bounded_motion_that_a_method_blows_up_is_its_failure(rule):
    scene = SPRING.with_values(step="5") if rule != "explicit-euler" else SPRING
    found = measured("energy", scene, rules.get(rule), 16, 10_000)
    assert found["verdict"] == "fail"


#: a rest at some height: it falls into the centre at t = 0.281
FALL = scenes.get("kepler").with_values(name="fall", v0=[0, 0])
SHORT = FALL.with_values(name="short", duration="1/4")
#: down a hill of x⁴, at the bottom at t = 0.753
STEEP = Scene("steep", pair(1), lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 4,
              x0=[1], v0=[1], step="0.01", duration=5)  # fmt: skip


@pytest.mark.dear("scene3-momentum", "energy", "scene2")
@pytest.mark.parametrize(("scene", "study", "rule"), [
    (FALL, "energy", "trapezoidal"),  # which jumps over the centre, with a band of all the energy
    # beyond its duration, which ends before the fall does
    (SHORT, "energy", "trapezoidal"), (SHORT, "symplecticity", "midpoint"),
    (FALL, "momentum", "midpoint"), (STEEP, "symplecticity", "midpoint"),
])  # fmt: skip
def test_a_motion_that_ends_is_no_failure_of_a_method(scene, study, rule):
    found = measured(study, scene, rule, 16, 2000)
    assert found["verdict"] == "inconclusive" and "singular there" in found["reason"]


#: it falls into a centre at t = 1.111
COLLISION = Scene("collision", pair(1), hamiltonian=lambda x, mu, p: mu[0] ** 2 / 2 - 1 / x[0],
                  x0=[1], mu0=[0], step="0.1", duration=5)  # fmt: skip


@pytest.mark.parametrize("digits", [16, 50])
def test_no_ladder_is_cut_before_the_end_of_a_motion(digits):
    """No step near a collision is short enough, and a pass at t = 10⁻⁷ would say nothing of it."""
    found = measured("order", COLLISION, "midpoint", digits)
    assert found["verdict"] == "inconclusive"
    assert "stops at t = 1.11072: the solution is singular there" in found["reason"]


@pytest.mark.dear("scene0-energy")
@pytest.mark.parametrize(("scene", "study", "rule", "steps"), [
    (GEODESIC, "energy", "midpoint", 10_000), (GEODESIC, "momentum", "midpoint", 10_000),
    (HILL, "energy", "midpoint", 10_000), (STEEP, "symplecticity", "trapezoidal", 200),
])  # fmt: skip
def test_a_motion_that_leaves_every_bound_is_no_failure(scene, study, rule, steps):
    found = measured(study, scene, rule, 16, steps)
    assert found["verdict"] == "inconclusive" and "leaves every bound" in found["reason"]


@pytest.mark.slow
def test_a_method_that_stops_long_before_the_motion_does_is_to_blame():
    late = FALL.with_values(name="late", x0=[1, 0], step="1/4", duration=2)

    @discretisation()
    def singular(L, G, x, u, h):
        return h * L(x, u) + h / (x[0] - 1)

    found = measured("momentum", late, singular, 16, 100)
    assert found["verdict"] == "fail"


def test_bad_input_to_the_reference_leaves_the_failure_of_the_step(monkeypatch):
    def refused(*arguments, **named):
        raise BadInput("no exact number")

    monkeypatch.setattr("discmech.reference.solution", refused)
    other = FALL.with_values(name="refused")  # of which nothing is known yet
    found = run_case(get("momentum"), case("momentum", other, rules.get("midpoint"), 16, 2000))
    assert found["verdict"] == "fail" and "did not converge" in found["reason"]


@pytest.mark.slow
def test_an_end_that_is_remembered_keeps_nothing_of_who_asked_first():
    def asked():
        run = np.zeros(2)  # a million rows, in a study
        with suppress(MotionEnds):
            refuse_ended(case("momentum", other, rules.get("midpoint"), 16, 2000), 3.0)
            pytest.fail("it goes on")
        return weakref.ref(run)

    other = FALL.with_values(name="remembered")
    found = asked()
    gc.collect()
    assert found() is None
