"""Several solutions of one step (Moser–Veselov): the branch is kept, in whichever translate."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from discmech.integrators import BadInput, StepFailure, rectangle, scenes
from discmech.integrators.bisections.translates import GroupChart
from discmech.integrators.flows import first_u
from tests.objects import scheme_of


@pytest.fixture(scope="module")
def moser_veselov():
    return scheme_of(scenes.get("moser-veselov"), rectangle)


def test_the_evolution_operator_stays_on_the_branch(moser_veselov):
    """Newton from the last step may find the other solution; Ψ is the run's step all the same."""
    flow = moser_veselov.flow(1, on_edge="bisect")
    chart = GroupChart(flow.scheme.scene.groupoid, flow.numbers)
    for g in Rotation.random(40, random_state=3).as_matrix():
        _, after = flow.elements(flow.trajectory(1, element0=g))
        _, v = flow.evolve([], chart.coordinates(g))
        assert np.max(abs(chart.element(v) - after)) < 1e-9
        assert flow.pullback_defect([], chart.coordinates(g)) < 1e-13


def test_an_arrow_that_has_no_u_is_said(moser_veselov):
    flow = moser_veselov.flow(1, on_edge="bisect")
    start = flow.starting.at(None, None, element0=np.diag([-1.0, -1.0, 1.0]))
    with pytest.raises(BadInput, match="edge of its chart"):
        first_u(flow.edge, start)


def test_one_chart_says_so_where_it_would_go_on_along_another_branch(moser_veselov):
    """The map keeps tr(gΛ): in one chart too a run keeps it, or stops."""
    refuse, bisect = (moser_veselov.flow(1, on_edge=e) for e in ("refuse", "bisect"))
    mass, stopped = np.diag([1.75, 1.25, 0.75]), 0
    for g in Rotation.random(60, random_state=5).as_matrix():
        try:
            run = refuse.trajectory(30, element0=g)
        except StepFailure as failure:
            stopped += "another branch" in failure.cause
            continue
        elements = refuse.elements(run)
        kept = np.trace(elements @ mass, axis1=1, axis2=2)
        assert np.max(abs(kept - kept[0])) < 1e-6
        assert np.max(abs(elements - bisect.elements(bisect.trajectory(30, element0=g)))) < 1e-6
    assert stopped


def test_several_solutions_are_reported_when_asked(moser_veselov):
    flow = moser_veselov.flow(1, on_edge="bisect")
    mu = flow.trajectory(0, element0=expm(np.array([[0, -1.2, 0.3], [1.2, 0, 0], [-0.3, 0, 0]]))).mu
    found = flow.solutions([], mu[0])
    assert len(found) > 1
    mass = np.diag([1.75, 1.25, 0.75])
    m = np.array([[0, -mu[0, 2], mu[0, 1]], [mu[0, 2], 0, -mu[0, 0]], [-mu[0, 1], mu[0, 0], 0]])
    for one in found:  # hμ̂⁻ = gΛ − Λgᵀ
        assert np.max(abs(one.element @ mass - mass @ one.element.T - m)) < 1e-13
        assert one.branch == pytest.approx(np.trace(one.element @ mass), abs=1e-12)
    with pytest.raises(BadInput, match='take on_edge="bisect"'):
        moser_veselov.flow(1).solutions([], mu[0])


def test_each_step_is_the_same_in_every_translate_that_holds_it(moser_veselov):
    """Solved from nearby in the chart of each B: the bisection chosen does not matter."""
    flow = moser_veselov.flow(1, on_edge="bisect")
    edge, solved = flow.edge, 0
    for g in Rotation.random(8, random_state=6).as_matrix():
        run = flow.trajectory(1, element0=g)
        after = flow.elements(run)[1]
        for J in range(4):
            if edge.chart.openness(after, J) < 0.1:
                continue
            u = edge.chart.coordinates(after, J)
            found, _ = flow.machine.solve(run.x[1], run.mu[1], edge.coefficients(J), u * 1.001)
            assert np.max(abs(edge.element(found, J) - after)) < 1e-12
            solved += 1
    assert solved > 16
