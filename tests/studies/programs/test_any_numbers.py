"""A program that runs in numbers of any kind is judged in each that is run."""

import numpy as np
import pytest

from discmech import Scheme, black_box, scenes
from discmech.studies.evidence import evidence_of


def verlet_off_in_doubles(off):
    """Verlet whose potential is off by a share of it, in doubles alone."""

    @black_box(order=2, numbers="any", name=f"off-by-{off}")
    def step(q, p, h, system):
        strength = 1 + off * (np.asarray(q).dtype == float)
        p = p - h / 2 * strength * system.gradient(q, p)
        q = q + h * system.velocity(q, p)
        return q, p - h / 2 * strength * system.gradient(q, p)

    return step


@pytest.mark.dear("0.0001")
@pytest.mark.parametrize("off", [1e-4, 1e-7])
def test_another_potential_in_doubles_alone_is_seen(off):
    """Fifty digits show the right one, and call what doubles do their round-off."""
    order = evidence_of(Scheme(scenes.get("pendulum"), verlet_off_in_doubles(off))).order
    assert order.order is not None and order.order < 0.1
    assert order.component == "mu[0] in double precision"


@pytest.mark.slow
def test_the_same_method_in_both_kinds_has_its_order():
    order = evidence_of(Scheme(scenes.get("pendulum"), verlet_off_in_doubles(0))).order
    assert order.order == pytest.approx(2, abs=1e-6) and "double" not in order.component
