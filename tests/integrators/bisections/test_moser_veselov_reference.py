"""Moser–Veselov against its independent factorisation, at rotations spread over the group."""

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discmech.integrators import rectangle, scenes
from discmech.integrators.geometry import regularity
from discmech.reference.closed_forms.moser_veselov import step
from tests.objects import scheme_of

MASS = ("1.75", "1.25", "0.75")


@pytest.fixture(scope="module")
def scheme():
    return scheme_of(scenes.get("moser-veselov"), rectangle)


def test_each_step_is_the_factorisations(scheme):
    """To 1e-13, and beside the singular set of FL to what that makes of round-off there."""
    flow = scheme.flow(1, on_edge="bisect")
    steps = well = 0
    for g in Rotation.random(30, random_state=4).as_matrix():
        run = flow.trajectory(30, element0=g)
        found = flow.elements(run)
        for k, (a, b) in enumerate(pairwise(found)):
            regular = regularity(flow.arrow(run, k + 1))
            steps, well = steps + 1, well + (regular >= 1e-2)
            gap = np.max(abs(step(a, [float(e) for e in MASS]) - b))
            assert gap < 1e-13 if regular >= 1e-2 else gap * regular < 1e-14
    assert steps == 900 and well > 800


def test_fifty_digits_agree_with_the_factorisation_in_mpmath(scheme):
    flow = scheme.flow(1, digits=50, on_edge="bisect")
    with mpmath.workdps(60):
        a = mpmath.matrix([[0, 1, -2], [-1, 0, mpmath.mpf("1.5")], [2, mpmath.mpf("-1.5"), 0]])
        g = (mpmath.eye(3) - a) ** -1 * (mpmath.eye(3) + a)  # a rotation by 139 degrees
        run = flow.trajectory(10, element0=g.tolist())
        found = flow.elements(run)
        for here, after in pairwise(found):
            wanted = step(here.tolist(), list(map(mpmath.mpf, MASS)), 50)
            gap = np.max(abs(np.array(wanted.tolist()) - after))
            assert gap < mpmath.mpf(10) ** -45
