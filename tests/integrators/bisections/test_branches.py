"""Several solutions of one step (Moser–Veselov): the branch is kept, in whichever translate."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from discmech.integrators import BadInput, Scene, StepFailure, rectangle, scenes
from discmech.integrators.algebras import se
from discmech.integrators.flows import first_u
from discmech.integrators.groupoids import GroupChart, lie_group
from discmech.integrators.scene import on_group
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
            assert np.max(abs(next(iter(edge.elements([found], J))) - after)) < 1e-12
            solved += 1
    assert solved > 16


@pytest.mark.slow
def test_a_number_of_the_branch_without_a_value_at_some_half_turn_does_without_it():
    """log(1 + tr g), as in Bobenko and Suris's tops, is −∞ at all three half turns of the cover."""

    def logarithm(x, g, h, p):
        return -2 * sympy.log(1 + g.trace()) / h

    body = scenes.get("moser-veselov").with_values(discrete_lagrangian=on_group(logarithm))
    flow = scheme_of(body, rectangle).flow("1/10", on_edge="bisect")
    assert flow.edge.scale == pytest.approx(20 * np.log(4))
    run = flow.trajectory(20)
    assert np.allclose(np.linalg.norm(run.mu, axis=1), np.linalg.norm(run.mu[0]), rtol=1e-14)


@pytest.mark.parametrize("size", [1e10, 1e17])  # g has a few right digits, or is none at all
def test_a_solution_at_the_edge_of_its_chart_is_none(moser_veselov, monkeypatch, size):
    flow = moser_veselov.flow("1/10", on_edge="bisect")
    mu = flow.trajectory(0).mu[0]
    assert flow.solutions([], mu)
    sound = type(flow.edge.machine).solve

    def at_the_edge(machine, x, mu, c, u):
        found = sound(machine, x, mu, c, u)
        return found and (size * np.array([2, -1, -1]), found[1])

    monkeypatch.setattr(type(flow.edge.machine), "solve", at_the_edge)
    assert flow.solutions([], mu) == []


def planar_body(unit):
    """A planar body whose turns have two solutions, in other units of length."""

    def smooth(x, v, p):
        return (v[0] ** 2 + (v[1] ** 2 + v[2] ** 2) / unit**2) / 2

    def kinetic(x, g, h, p):
        return ((2 - g[0, 0] - g[1, 1]) + g[:2, 2].dot(g[:2, 2]) / unit**2) / (2 * h)

    return Scene(
        "planar-body", lie_group(se(2)), smooth,
        discrete_lagrangian=on_group(kinetic), v0=["7/10", unit / 2, -unit / 3],
        duration=1, step=1,
    )  # fmt: skip


@pytest.mark.dear(but=("unit2",))
@pytest.mark.parametrize("unit", [Fraction(10) ** n for n in (0, -9, 9)])
def test_the_solutions_on_the_plane_are_as_many_in_any_unit_of_length(unit):
    flow = scheme_of(planar_body(unit), rectangle).flow(1, on_edge="bisect")
    found = flow.solutions([], flow.trajectory(0).mu[0])
    assert len(found) == 2
    for one in found:  # sin ϑ = 7/10 and a translation by |(1/2, 1/3)| units
        assert one.element[1, 0] == pytest.approx(0.7)
        moved = np.linalg.norm(one.element[:2, 2]) / float(unit)
        assert moved == pytest.approx(13**0.5 / 6)
    assert not flow.edge.chart.alike(found[0].element, found[1].element, 1e-8)
