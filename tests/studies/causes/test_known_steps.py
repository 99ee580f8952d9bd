"""Steps of known methods, told from the motion and from each other."""

import numpy as np
import pytest

from discmech import Scene, black_box, pair
from discmech.studies.causes.known_steps import known_step
from discmech.studies.core.case import scheme_of

WELL = Scene(
    "double-well", pair(1), lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2 - x[0] ** 4 / 4,
    x0=["0.4"], v0=["0.3"], duration=10, step="0.05",
)  # fmt: skip


def runge_kutta(q, p, h, parts=1):
    for _ in range(parts):
        slopes = [np.array([p, q - q**3])]
        for share in (0.5, 0.5, 1):
            x, y = np.array([q, p]) + share * h / parts * slopes[-1]
            slopes.append(np.array([y, x - x**3]))
        a, b, c, d = slopes
        q, p = np.array([q, p]) + h / parts * (a + 2 * b + 2 * c + d) / 6
    return q, p


@pytest.mark.parametrize(("parts", "known"), [(1, "the classical Runge–Kutta method"), (3, None)])
def test_a_method_is_told_from_another_that_is_as_near_to_the_motion(parts, known):
    """By a step of a thousandth both are the motion, to round-off."""
    rule = black_box(order=4)(lambda q, p, h, s: runge_kutta(q, p, h, parts))
    told = known_step(scheme_of(WELL.with_values(step="0.002"), rule))
    assert (told and told[0]) == known
