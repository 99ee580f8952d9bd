"""The exact motion from states of one's own, against references that come from the start."""

from fractions import Fraction

import mpmath
import pytest

from discmech.integrators import scenes
from discmech.reference import ReferenceFailure, solutions, surroundings

STEP = Fraction(3, 1000)


@pytest.mark.dear("wong", "disc")
@pytest.mark.parametrize(
    "name", ["kepler", "heavy-top", "duffing", "cartesian-pendulum", "rolling-disc", "wong"]
)
def test_a_step_from_a_reference_leads_to_the_next(name):
    scene = scenes.get(name)
    t = Fraction(1, 7)
    here, there = solutions(scene, [t, t + STEP], 60)
    (found,) = surroundings(scene).after(here.x, here.v, t, [STEP], 50)
    with mpmath.workdps(60):
        for got, wanted in ((found.x, there.x), (found.v, there.v), (found.mu, there.mu)):
            size = max(map(abs, wanted), default=1)
            assert all(abs(a - b) <= size * mpmath.mpf(10) ** -49
                       for a, b in zip(got, wanted, strict=True))  # fmt: skip
        assert all(e < mpmath.mpf(10) ** -45 for e in [*found.error_x, *found.error_mu])


def test_a_step_that_is_too_long_for_one_polynomial_is_refused():
    around = surroundings(scenes.get("kepler"))
    _, x, v = around.along(Fraction(1))[0]
    with pytest.raises(ReferenceFailure, match="too long for one local Taylor polynomial"):
        around.after(x, v, Fraction(0), [Fraction(1)], 50)


def test_conditioning_is_what_the_motion_makes_of_its_start():
    """Of the unstable equilibrium a change grows as eᵗ."""
    top = scenes.get("pendulum").with_values(x0=["3.14159265358979"], v0=[0])
    short, long = (surroundings(top).conditioning(Fraction(t)) for t in (4, 8))
    assert long / short == pytest.approx(2.718281828**4, rel=0.05)
    steady = surroundings(scenes.get("harmonic")).conditioning(Fraction(10))
    assert steady == pytest.approx(1, abs=0.6)
