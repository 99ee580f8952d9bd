"""Steps on the cut locus det(e + g) = 0 of Cayley's chart, and beside it: right or an error.

Every group with a cover has a discrete Lagrangian of its own elements here, and elements with
det(e + g) = 0 exactly.
"""

from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from discmech.integrators import (
    BadInput,
    Scene,
    Scheme,
    StepFailure,
    lie_group,
    rectangle,
    scenes,
    so,
)
from discmech.integrators.algebras import se, sl, sp, su
from discmech.integrators.geometry import defects, residual
from discmech.integrators.groupoids import GroupChart
from discmech.integrators.scene import on_group
from tests.objects import scheme_of


def chordal(weights):
    """Σ w_ij (g − e)²_ij / 2h: the distance from e in the matrices, weighed."""

    def formula(x, g, h, p):
        entries = ((i, j) for i in range(g.rows) for j in range(g.cols))
        return sum(weights(i, j) * (g[i, j] - int(i == j)) ** 2 for i, j in entries) / (2 * h)

    return formula


def weights(i, j):
    """No symmetry, nothing vanishes: so FL is regular on most of the group."""
    return 1 + Fraction((3 * i + 5 * j) % 7, 10)


def turned(size, angles):
    """Half-turns and others in planes (0, 1), (2, 3), …"""
    g = np.eye(size)
    for k, angle in enumerate(angles):
        c, s = (-1.0, 0.0) if angle == 1 else (np.cos(np.pi * angle), np.sin(np.pi * angle))
        g[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[c, -s], [s, c]]
    return g


def moved(g, by):
    g = g.copy()
    g[: len(by), -1] = by
    return g


GROUPS = {
    "so(2)": (so(2), [turned(2, [1])]),
    "so(3)": (so(3), [turned(3, [1])]),
    "so(4)": (so(4), [turned(4, [1, 0.3]), -np.eye(4)]),
    "se(2)": (se(2), [moved(turned(3, [1]), [0.5, -2.0])]),
    "se(3)": (se(3), [moved(turned(4, [1]), [0.5, -2.0, 1.0])]),
    "sl(2)": (sl(2), [-np.eye(2), np.array([[-1.0, 0.5], [0.0, -1.0]])]),
    "sp(2)": (sp(2), [-np.eye(2), np.array([[-1.0, 0.0], [-0.5, -1.0]])]),
    "su(2)": (su(2).real, [-np.eye(4)]),
}


@cache
def scheme(name):
    """A scene of its own a group; SO(3)'s is moser-veselov."""
    if name == "so(3)":
        return scheme_of(scenes.get("moser-veselov"), rectangle)
    algebra = GROUPS[name][0]
    given = on_group(chordal(weights))
    start = [Fraction(1, 5 + k) for k in range(algebra.dim)]
    scene = Scene(f"chordal-{algebra.name[:2]}", lie_group(algebra), discrete_lagrangian=given,
                  v0=start)  # fmt: skip
    return Scheme(scene, rectangle)


SOME = [pytest.param(n, marks=() if n in ("so(3)", "sl(2)") else pytest.mark.slow) for n in GROUPS]


@pytest.mark.sampled
@pytest.mark.parametrize("away", (0, 1e-8, -1e-8))
@pytest.mark.parametrize("name", SOME)
def test_a_step_on_the_cut_locus_is_right_or_an_error(name, away):
    flow = scheme(name).flow(1, on_edge="bisect")
    chart = GroupChart(flow.scheme.scene.groupoid, flow.numbers)
    went = 0
    for on in GROUPS[name][1]:
        assert abs(np.linalg.det(np.eye(len(on)) + on)) < 1e-30
        g = chart.element(away * np.arange(1.0, 1 + chart.m)) @ on
        try:
            run = flow.trajectory(4, element0=g)
        except StepFailure as failure:
            run = failure.trajectory
            assert "step" in str(failure)
        if run is None or not len(run.t):
            continue
        elements = flow.elements(run)
        assert np.max(abs(elements[0] - g)) < 1e-13  # it is the g that was given
        arrows = [flow.arrow(run, k) for k in range(len(run.t))]
        for here, there in pairwise(arrows):
            went += 1
            assert residual(here, there) < 1e-13
            assert max(defects(here, there)) < 1e-13
    if name in ("so(3)", "sl(2)"):
        assert went


@pytest.mark.parametrize("away", (1e-8, 1e-7, 1e-5, 1e-3))
@pytest.mark.parametrize("name", SOME)
def test_one_chart_goes_on_rightly_from_beside_its_edge(name, away):
    """u is 10⁸ there, and 100 a step later: what was round-off of the one is none of the other."""
    flow = scheme(name).flow(1)
    chart = GroupChart(flow.scheme.scene.groupoid, flow.numbers)
    for on in GROUPS[name][1]:
        g = chart.element(away * np.arange(1.0, 1 + chart.m)) @ on
        try:
            run = flow.trajectory(4, element0=g)
        except (BadInput, StepFailure) as failure:
            run = getattr(failure, "trajectory", None)
        if run is not None:
            arrows = [flow.arrow(run, k) for k in range(len(run.t))]
            for here, there in pairwise(arrows):
                assert residual(here, there) < 1e-13


@pytest.mark.parametrize("name", ("so(3)", "sl(2)"))
def test_one_chart_refuses_its_own_edge(name):
    """In the chart of e alone such an element has no coordinates, and that is said."""
    flow = scheme(name).flow(1)
    for on in GROUPS[name][1]:
        with pytest.raises(BadInput, match="edge of its chart"):
            flow.trajectory(2, element0=on)


def test_just_beside_the_edge_one_chart_refuses():
    flow = scheme("so(3)").flow(1)
    chart = GroupChart(flow.scheme.scene.groupoid, flow.numbers)
    g = chart.element([1e-9, 2e-9, 1e-9]) @ GROUPS["so(3)"][1][0]
    with pytest.raises((BadInput, StepFailure), match="edge of its chart"):
        flow.trajectory(2, element0=g)
