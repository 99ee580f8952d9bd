"""Steps of known methods: told from the motion, and where an iteration does not solve them."""

from fractions import Fraction

import numpy as np
import pytest

from discmech import Scene, black_box, pair
from discmech.studies.causes.known_steps import known_step, unsolved
from discmech.studies.core.case import scheme_of
from discmech.studies.symplecticity.places import looks

WELL = Scene(
    "double-well", pair(1), lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2 - x[0] ** 4 / 4,
    x0=["0.4"], v0=["0.3"], duration=10, step="0.05",
)  # fmt: skip


def midpoint(q, p, h, sweeps, stop=-1.0):
    Q, P = q, p
    for _ in range(sweeps):
        x, y = (q + Q) / 2, (p + P) / 2
        before, (Q, P) = (Q, P), (q + h * y, p + h * (x - x**3))
        if abs(np.subtract((Q, P), before)).max() <= stop:
            break
    return Q, P


def euler(q, p, h):
    return q + h * p, p + h * (q - q**3)


def runge_kutta(q, p, h, parts=1):
    for _ in range(parts):
        slopes = [np.array([p, q - q**3])]
        for share in (0.5, 0.5, 1):
            x, y = np.array([q, p]) + share * h / parts * slopes[-1]
            slopes.append(np.array([y, x - x**3]))
        a, b, c, d = slopes
        q, p = np.array([q, p]) + h / parts * (a + 2 * b + 2 * c + d) / 6
    return q, p


SOUND = {
    "80 sweeps": lambda q, p, h, s: midpoint(q, p, h, 80),
    "12 sweeps": lambda q, p, h, s: midpoint(q, p, h, 12),
    "a stop": lambda q, p, h, s: midpoint(q, p, h, 200, 1e-12),
}
WRONG = {
    "another method": lambda q, p, h, s: midpoint(q, p, h, 80) if h < 0.3 else euler(q, p, h),
    "a term": lambda q, p, h, s: tuple(np.add(midpoint(q, p, h, 200), [0 * q, 1e-11 * h**3 * p])),
    "a switch": lambda q, p, h, s: tuple(
        (1 + 1e-8 * (h > 0.3)) * e for e in midpoint(q, p, h, 200)
    ),
}


def scheme(formula):
    return scheme_of(WELL, black_box(order=2, symplectic=True)(formula))


@pytest.mark.dear("12 sweeps", "a stop")
@pytest.mark.parametrize("name", SOUND)
def test_steps_that_only_the_bench_has_chosen_end_where_an_iteration_does_not_converge(name):
    own = scheme(SOUND[name])
    z, long = np.array([1.3, 0.4]), Fraction("0.84")
    assert known_step(own) == ("the implicit midpoint rule", 2)
    assert "an iteration leaves" in unsolved(own, z, Fraction(0), long)
    assert not unsolved(own, z, Fraction(0), Fraction(WELL.step))
    for look in looks(own)[0]:
        assert look.step <= 2 * WELL.step or not unsolved(own, look.z, look.time, look.step)


@pytest.mark.dear("another method", "a switch")
@pytest.mark.parametrize("name", WRONG)
def test_a_fault_at_long_steps_is_no_iteration(name):
    """It has a power of the step that a method may have, or comes at once."""
    own, z = scheme(WRONG[name]), np.array([0.1, -0.6])
    assert known_step(own) == ("the implicit midpoint rule", 2)
    assert not any(unsolved(own, z, Fraction(0), Fraction(h)) for h in ("0.43", "0.84", "1.2"))
    assert not any(look.left_out for look in looks(own)[0])


@pytest.mark.parametrize(("parts", "known"), [(1, "the classical Runge–Kutta method"), (3, None)])
def test_a_method_is_told_from_another_that_is_as_near_to_the_motion(parts, known):
    """By a step of a thousandth both are the motion, to round-off."""
    rule = black_box(order=4)(lambda q, p, h, s: runge_kutta(q, p, h, parts))
    told = known_step(scheme_of(WELL.with_values(step="0.002"), rule))
    assert (told and told[0]) == known
