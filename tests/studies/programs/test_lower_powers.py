"""A lower power of the step is denied by a sum of higher ones that explains all errors."""

import numpy as np
import pytest

from discmech import Scheme, black_box, scenes
from discmech.studies.evidence import NEAR, evidence_of
from discmech.studies.evidence.of_programs import of_program
from discmech.studies.evidence.places import places_of
from discmech.studies.evidence.powers import powers_of

from . import methods
from .judging import judged
from .methods import kick_drift_kick

STEPS = 0.1 * 0.6 ** np.arange(28)
UNIT = np.full(28, 2.0**-53)


def local_order(scene, box):
    return evidence_of(Scheme(scenes.get(scene), box)).order


def of_first_order(size, of_x=False):
    """Return Verlet with an error of size h² in p alone, or in x alone."""

    @black_box(order=2)
    def step(q, p, h, s):
        q, p = kick_drift_kick(q, p, h, s)
        error = size * h * abs(h) * p
        return (q + error, p) if of_x else (q, p - error)

    return step


def unequal_halves(q, p, h, s):
    p = p - 0.50000001 * h * s.gradient(q, p)
    q = q + h * s.velocity(q, p)
    return q, p - 0.49999999 * h * s.gradient(q, p)


@pytest.mark.dear(but=("3e-",))
@pytest.mark.sampled
@pytest.mark.parametrize("size", [3e-5, 1e-5, 5e-6, 1e-7, 2e-8])
@pytest.mark.parametrize("of_x", [False, True])
def test_a_small_error_of_first_order_is_seen(size, of_x):
    found = local_order("pendulum", of_first_order(size, of_x))
    assert found.order == pytest.approx(1, abs=0.05)
    assert found.component == ("x[0]" if of_x else "mu[0]")


@pytest.mark.slow
def test_its_runs_of_second_order_are_denied():
    found = judged("order", "pendulum", of_first_order(1e-5), causes=False)
    assert found["verdict"] == "fail" and "one step is of order 1.00" in found["reason"]
    assert local_order("pendulum", black_box(order=2)(unequal_halves)).order < 1 + NEAR


@pytest.mark.dear(but=("pendulum",))
@pytest.mark.parametrize("scene", ["pendulum", "henon-heiles"])
@pytest.mark.parametrize(("digits", "order"), [(7, 2), (9, 4), (16, 4)])
@pytest.mark.parametrize("seed", range(2))
def test_coefficients_of_few_digits_in_all_components_together(scene, digits, order, seed):
    """Of one component from one place they may hide; those of 9 digits leave less than rounding."""
    first = round(1 / (2 - 2 ** (1 / 3)), digits)

    @black_box(order=4)
    def yoshida(q, p, h, s):
        for share in (first, 1 - 2 * first, first):
            q, p = kick_drift_kick(q, p, share * h, s)
        return q, p

    scheme = Scheme(scenes.get(scene), yoshida)
    found = of_program(scheme, places_of(scheme, seed), seed)
    assert found.order == pytest.approx(order, abs=NEAR)


@pytest.mark.dear(but=("verlet",))
@pytest.mark.sampled
@pytest.mark.parametrize("scene", ["pendulum", "kepler"])
@pytest.mark.parametrize("name", [
    "verlet", "rk4", "ruth", "yoshida", "Beeman", "ReversibleHeun",
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("newmark", "GeneralisedAlpha")),
])  # fmt: skip
def test_a_sound_program_has_no_lower_power(scene, name):
    box = next(each for each in vars(methods).values() if getattr(each, "name", "") == name)
    found = local_order(scene, box)
    assert not found.unknown and (found.order is None or found.order > box.order - NEAR)


@pytest.mark.parametrize("power", [2, 3, 5])
def test_the_first_power_of_a_sum_is_found(power):
    drawn = np.random.default_rng(power)
    for low in range(1, power + 1):
        factors = drawn.uniform(0.5, 2, 9)
        errors = sum(c * STEPS ** (power + k) for k, c in enumerate(factors))
        errors += (low < power) * 1e-3 * STEPS**low + UNIT * drawn.uniform(-1, 1, 28)
        found = powers_of(STEPS, errors, UNIT, power)
        assert found.first == low and found.hidden is None
        if low < power:
            assert found.factor == pytest.approx(1e-3, rel=0.1)


def test_what_is_no_sum_says_what_it_may_hide():
    drawn = np.random.default_rng(1)
    errors = STEPS**3 + 1e-11 * drawn.uniform(-1, 1, 28)
    found = powers_of(STEPS, errors, UNIT, 3)
    assert found.first is None and 1e-10 < (found.hidden or 0) < 1e-6


@pytest.mark.slow
def test_a_program_that_jumps_is_not_passed():
    """Its errors are of order 2 down to 10⁻¹¹, where half of a lower power could lie."""

    @black_box(order=2)
    def jumping(q, p, h, s):
        q, p = kick_drift_kick(q, p, h, s)
        return q, p + 1e-12 * np.sin(1e13 * q)

    assert judged("order", "pendulum", jumping, causes=False)["verdict"] != "pass"


def test_what_hides_a_lower_power_is_said_with_the_mend():
    @black_box(order=2, runs=True)
    def rough(q, p, h, steps, every, s):
        rows = [(q, p)]
        for _ in range(steps):
            p = p - h / 2 * s.gradient(q, p).astype(np.float32)
            q = q + h * s.velocity(q, p)
            p = p - h / 2 * s.gradient(q, p).astype(np.float32)
            rows.append((q, p))
        return tuple(map(np.array, zip(*rows[::every], strict=True)))

    why = evidence_of(Scheme(scenes.get("pendulum"), rough)).order.unknown
    assert "it may hide" in why and why.endswith("iterate until nothing changes")
