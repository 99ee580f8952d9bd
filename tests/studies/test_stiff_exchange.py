"""The exchange of energy between stiff springs, and the invariant of their motion."""

from fractions import Fraction

import numpy as np
import pytest

from discmech.integrators import imex, midpoint, scenes, trapezoidal
from discmech.studies.core.case import scheme_of
from discmech.studies.stability import exchange
from discmech.studies.stability.stiff import FAMILIES


def test_the_exchange_of_energy_comes_out_right_by_imex_and_wrong_by_midpoint():
    errors = {rule.name: exchange.exchange_errors(scheme_of(scenes.get("fpu"), rule))
              for rule in (imex, midpoint)}  # fmt: skip
    assert errors["imex"][5.0] < 0.1 < 0.5 < errors["midpoint"][5.0]
    assert errors["imex"][0.1] < 0.01


def test_the_reference_of_the_exchange_is_that_of_small_steps():
    """Störmer–Verlet at hω = 1/100 and 1/200, extrapolated in h²."""
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), trapezoidal), exchange.OMEGA)
    a, b = (exchange.slow_energies(scheme, exchange.OMEGA, Fraction(1, k))[0] for k in (100, 200))
    left = np.abs((4 * b - a) / 3 - exchange.reference()).max()
    assert left < np.abs(b - a).max() / 50 < 1e-6


def test_stiffer_springs_hand_their_energy_on_rightly_by_imex_alone():
    """hω = 5; by Störmer–Verlet nothing comes to an end there."""
    errors = {
        rule.name: [*exchange.exchange_errors(
            scheme_of(scenes.get("fpu"), rule), Fraction(200), [exchange.COARSE]
        ).values()]
        for rule in (imex, midpoint, trapezoidal)
    }  # fmt: skip
    assert errors["imex"] < [0.2] < [0.7] < errors["midpoint"]
    assert errors["trapezoidal"] == [None]


@pytest.mark.slow
def test_the_adiabatic_invariant_over_a_hundred_thousand():
    """The springs' energy changes by O(1/ω) (Hairer, Lubich, Wanner, XIII.6): where that holds, the
    change times ω is one number but for the motion's chaos. At ω = 100 the run comes to its end,
    with as large a change as chaos makes of the last bits: nothing is said of it."""
    changes = exchange.adiabatic(scheme_of(scenes.get("fpu"), imex))
    assert changes[50.0] is None
    scaled = [w * change for w, change in changes.items() if w >= 200]
    assert len(scaled) > 2 and max(scaled) < 2 * min(scaled)
    # what the slow springs have, half of all the energy, does not go to the stiff ones
    assert max(scaled) < 200 / 4 and changes[100.0] is not None
