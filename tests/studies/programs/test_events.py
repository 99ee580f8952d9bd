"""Programs that do something else in the steps in which the motion meets an event."""

import numpy as np
import pytest

from discmech import black_box

from .judging import judged
from .methods import kick_drift_kick


def eventful(change, order=2):
    """Return Verlet that changes the momentum in the steps in which it has changed its sign."""

    def step(q, p, h, system):
        before = p
        q, p = kick_drift_kick(q, p, h, system)
        return q, np.where(before * p < 0, change(p, h), p)

    return black_box(order=order, name="eventful")(step)


@pytest.mark.dear("0]", "1]", "2]")
@pytest.mark.parametrize("change", [
    lambda p, h: 0 * p, lambda p, h: 0.7 * p, lambda p, h: 0.99 * p, lambda p, h: p + h / 1000,
])  # fmt: skip
def test_a_step_that_is_wrong_where_it_meets_an_event_has_the_order_of_its_runs(change):
    """It is right at all short steps from any one place, and wrong in some of each run."""
    found = judged("order", "pendulum", eventful(change))
    assert found["verdict"] == "fail" and "unlike those beside it" in found["reason"]
    assert found["diagnosis"]["cause"] == "event"


@pytest.mark.dear("0]", "2]")
@pytest.mark.parametrize("change", [
    lambda p, h: p, lambda p, h: p + h**2 / 10, lambda p, h: p + h**3,
    lambda p, h: p * (1 + 1e-15),
])  # fmt: skip
def test_an_event_of_the_size_that_its_order_may_leave_is_none(change):
    """So is one that is lost in the rounding of the state."""
    assert judged("order", "pendulum", eventful(change), causes=False)["verdict"] == "pass"


@pytest.mark.slow
def test_a_step_that_is_wrong_by_a_count_of_calls_is_no_event():
    """In the same run, made again, it is another step."""
    calls = []

    @black_box(order=2)
    def counting(q, p, h, s):
        calls.append(1)
        share = (1.01 if len(calls) % 997 == 0 else 1) / 2
        p = p - share * h * s.gradient(q, p)
        q = q + h * s.velocity(q, p)
        return q, p - share * h * s.gradient(q, p)

    assert judged("order", "pendulum", counting)["diagnosis"]["cause"] == "unlike steps"
