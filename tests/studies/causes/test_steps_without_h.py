"""A kick or a drift whose h is forgotten is named; another force without h is not called one."""

import pytest

from discmech import black_box, scenes
from discmech.studies.causes.one_step import of_step
from discmech.studies.core.case import Case


def kick(q, p, h, system):
    p = p - system.gradient(q, p)
    return q + h * system.velocity(q, p), p


def drift(q, p, h, system):
    q = q + system.velocity(q, p)
    return q, p - h * system.gradient(q, p)


def half(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - system.gradient(q, p) / 2


def other(q, p, h, system):
    return q + h * system.velocity(q, p), p - h * system.gradient(q, p) - 0.3


def times(q, p, h, system):
    return 1.1 * (q + h * system.velocity(q, p)), p - h * system.gradient(q, p)


@pytest.mark.dear("kepler", "-kick-", "-other-")
@pytest.mark.parametrize(("step", "words"), [
    (kick, "h is missing in the kick"), (drift, "h is missing in the drift"),
    (half, "h is missing in a half of the kick"), (other, ""), (times, ""),
])  # fmt: skip
@pytest.mark.parametrize("scene", ["pendulum", "kepler"])
def test_a_part_of_a_step_without_h_is_named(scene, step, words):
    rule = black_box(order=1)(step)
    found = of_step(Case("order", scenes.get(scene), rule, 16))
    assert found is not None and found["cause"] == "no step"
    assert (words or "look for a factor h") in found["sentence"]
    assert words or "is missing in" not in found["sentence"]
