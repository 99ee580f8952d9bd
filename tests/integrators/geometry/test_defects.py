"""Defects are judged by bounds of round-off, and a bound that is not finite excuses nothing."""

import numpy as np
import pytest

from discmech.integrators.geometry import in_round_offs


@pytest.mark.parametrize("bound", [np.inf, np.nan])
def test_a_bound_that_is_not_finite_excuses_no_gap(bound):
    assert np.isnan(in_round_offs(np.array([1.0, 2.0]), np.array([bound, 4.0])))
    assert in_round_offs(np.array([0.0, 2.0]), np.array([bound, 4.0])) == 0.5
