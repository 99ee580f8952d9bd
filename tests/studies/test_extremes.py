"""Extremes: outcomes as they are defined, every extreme possible, nothing silent."""

import math
from fractions import Fraction

import pytest
from sympy import Rational

from discmech.integrators import BadInput, discretisation, midpoint, scenes, trapezoidal
from discmech.studies import get
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.extremes.edges import EXTREMES, Extreme
from discmech.studies.extremes.measuring import FINE, WRONG, _size, _told, one_extreme
from discmech.studies.stability.stiff import FAMILIES
from tests.studies.as_json import run_study


def told(error, estimate, energy=1e-9):
    return _told({"error": error, "estimate": estimate, "energy": energy})["outcome"]


def test_outcomes_by_their_criteria():
    assert told(1e-3, 1e-3) == "right"
    assert told(1e-3, 2e-4) == "right"  # within ten times what smaller steps say
    assert told(1e-3, 1e-5) == "wrong, silent"  # returned, and not right to its accuracy
    assert told(1e-10, 0.0) == "right"
    assert told(0.5, 0.1) == "wrong, noticed"
    assert told(0.5, 1e-3) == "wrong, silent"
    assert told(0.5, 1e-3, energy=0.2) == "wrong, noticed"
    assert told(0.5, 1e-3, energy=None) == "wrong, noticed"  # an energy that is not finite
    assert told(None, 0.3) == told(None, 0.0) == "no reference"
    assert WRONG == 1e-2


def test_sizes_of_extreme_vectors():
    import numpy as np

    assert _size(np.array([3e200, 4e200])) == pytest.approx(5e200)
    assert _size(np.array([3e-200, 4e-200])) == pytest.approx(5e-200)
    assert _size(np.zeros(2)) == 0


OFTEN = ("charged-particle",)  # the others wait for the slow tests
EVERY = [pytest.param(n, marks=() if n in OFTEN else pytest.mark.slow) for n in EXTREMES]


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_nothing_is_silent(name):
    """And with a step that resolves the motion a rule of second order is right or says so."""
    choice = Choice(scenes=(scenes.get(name),), rules=(midpoint, trapezoidal))
    found = run_study(get("extremes"), choice)
    assert len(found["cases"]) == 2 * len(EXTREMES[name])
    for case in found["cases"]:
        assert case["verdict"] == "pass", (case["extreme"], case["reason"])
        for row in case["rows"]:
            assert row["message"] or row["estimate"] is not None
            assert math.isfinite(row["error"] or 0.0)
            assert bool(row["message"]) is (row["outcome"] in ("stopped", "refused"))


def test_the_start_beside_the_separatrix_is_right():
    extreme = EXTREMES["rigid-body"][1]
    assert extreme.name == "1e-12 beside the separatrix"
    row = one_extreme(scheme_of(scenes.get("rigid-body"), midpoint), extreme, FINE, 256)
    assert row["outcome"] == "right" and row["error"] < 1e-6


def test_a_step_for_the_slow_motion_alone_is_silently_wrong_on_a_rod():
    """What was found here: at I₂/I₁ = 10⁸ the body turns slowly, but Cayley's step feels
    √(ξ·Iξ/I₁); a tenth of the visible motion is then wrong by half, and half that step agrees."""
    family = FAMILIES["rigid-body"]
    ratio = Fraction(10**8)
    slow = Extreme("rod", family.values(ratio), 1.0)
    scheme = scheme_of(scenes.get("rigid-body"), midpoint)
    assert one_extreme(scheme, slow, FINE, 256)["error"] > 0.1
    right = Extreme("rod", family.values(ratio), family.frequency(ratio))
    assert one_extreme(scheme, right, FINE, 256)["outcome"] == "right"


@pytest.mark.slow
def test_a_rule_for_another_problem_is_silent_and_fails():
    """It converges, keeps its energy, and is wrong: its time runs a tenth too fast."""

    @discretisation()
    def hasty(L, G, x, u, h):
        fast = Rational(11, 10)
        return h * fast * (L(x, u / fast) + L(G.target(x, u, h), u / fast)) / 2

    own = (("extreme", ("mass 1e100",)),)
    choice = Choice(scenes=(scenes.get("pendulum"),), rules=(hasty,), own=own)
    (case,) = run_study(get("extremes"), choice)["cases"]
    assert case["verdict"] == "fail" and "nor the energy tell" in case["reason"]


def test_an_extreme_that_no_scene_has_is_no_sign():
    strange = Extreme("strange", {"parameters": {"moon": 1}}, 1.0)
    with pytest.raises(BadInput, match="pendulum has no parameter 'moon'"):
        one_extreme(scheme_of(scenes.get("pendulum"), midpoint), strange, FINE, 1)


def test_what_stops_says_where_and_why():
    own = (("extreme", ("e = 0.999",)),)
    choice = Choice(scenes=(scenes.get("kepler"),), rules=(midpoint,), own=own)
    (case,) = run_study(get("extremes"), choice)["cases"]
    fine, coarse = case["rows"]
    assert fine["outcome"] == "right"
    assert coarse["outcome"] == "stopped" and "kepler with midpoint: Newton" in coarse["message"]
    assert case["command"].endswith("--extreme 'e = 0.999'")
