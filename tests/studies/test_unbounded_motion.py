"""Motions without bound end a long study as inconclusive; methods that blow up fail."""

from __future__ import annotations

import pytest

from discmech.integrators import Scene, pair, rules
from discmech.integrators.scene import Conserved
from tests.studies.cached_results import measured

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


@pytest.mark.parametrize("study", ["energy", "momentum"])
def test_a_geodesic_that_runs_to_the_boundary_is_no_failure(study):
    found = measured(study, GEODESIC, "midpoint", 16, 10_000)
    assert found["verdict"] == "inconclusive" and "leaves every bound" in found["reason"]


def test_a_motion_that_rolls_down_a_hill_is_no_failure():
    found = measured("energy", HILL, "midpoint", 16, 10_000)
    assert found["verdict"] == "inconclusive" and "leaves every bound" in found["reason"]


@pytest.mark.parametrize("rule", ["explicit-euler", "runge-kutta-4", "rectangle"])
def test_a_bounded_motion_that_a_method_blows_up_is_its_failure(rule):
    scene = SPRING.with_values(step="5") if rule != "explicit-euler" else SPRING
    found = measured("energy", scene, rules.get(rule), 16, 10_000)
    assert found["verdict"] == "fail"
