"""Maps and arrows that are kept: with all digits, and nobody who is handed them changes them."""

import numpy as np
import pytest

from discmech.integrators.flows.newton_step import arrow_from
from tests.objects import scheme


def step_of(rule, digits):
    """(context, x, μ, u) of a step of the heavy top."""
    context = scheme("heavy-top", rule).flow("1/10", digits).context
    with context.numbers.working():
        x, u = context.vectors(context.scene.x0, context.scene.v0)
        mu = context.geometry.at(x, u)["minus"] / context.h
    context.geometry._kept.clear()
    return context, x, mu, u


@pytest.mark.dear("2]")
@pytest.mark.parametrize("rule", ["midpoint", "gauss-2"])  # without stages and with
def test_what_was_asked_first_outside_the_arithmetic_has_all_digits(rule):
    context, x, mu, u = step_of(rule, 50)
    maps, arrow = context.geometry.at(x, u), arrow_from(context, x, mu, u * 1.01)
    with context.numbers.working():
        again = context.geometry.at(x, u)
        assert all(np.all(again[name] == maps[name]) for name in maps)
        context.geometry._kept.clear()
        fresh = context.geometry.at(x, u)
        assert all(np.all(abs(fresh[name] - maps[name]) <= 1e-58) for name in maps)
        assert max(abs(arrow - u)) < 1e-58


def test_a_caller_cannot_change_what_is_kept():
    context, x, mu, u = step_of("midpoint", 16)
    maps = context.geometry.at(x, u)
    for array in maps.values():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    maps.clear()
    assert context.geometry.at(x, u)["minus"] @ mu > 0
    arrow_from(context, x, mu, u)[:] = 0
    assert np.allclose(arrow_from(context, x, mu, u), u)
