"""Long runs far from the identities: back to the start, 50 digits, and shrunk steps."""

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discmech.integrators import Scheme, rectangle, scenes
from tests.objects import scheme_of
from tests.test_examples import example

MASS = ("1.75", "1.25", "0.75")


@pytest.fixture(scope="module")
def scheme():
    return scheme_of(scenes.get("moser-veselov"), rectangle)


def there_and_back(scheme, g, steps, digits):
    """(change of the first step g after `steps` steps and as many back, changes of chart each way).

    The step −h goes back, for L_d is self-adjoint; it begins with the inverse of the last g.
    """
    forth, back = (scheme.flow(sign, digits, on_edge="bisect") for sign in (1, -1))
    run = forth.trajectory(steps, every=steps, element0=g)
    start, end = forth.elements(run)
    again = back.trajectory(steps, every=steps, element0=end.T)
    assert again.steps == run.steps == steps
    return np.max(abs(back.elements(again)[-1].T - start)), (run.edges, again.edges)


@pytest.mark.parametrize("steps", (100, pytest.param(10**4, marks=pytest.mark.slow)))
def test_forward_and_back_in_double_precision(scheme, steps):
    edges = 0
    for g in Rotation.random(4, random_state=11).as_matrix():
        gap, met = there_and_back(scheme, g, steps, 16)
        assert gap < 1e-6
        edges += sum(met)
    assert edges > 0


def cayley(a, b, c):
    """A rotation with rational entries, to the working precision."""
    A = mpmath.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
    return ((mpmath.eye(3) - A) ** -1 * (mpmath.eye(3) + A)).tolist()


#: first steps by their Gibbs vectors: of a run that changes charts, and of one that begins so
CHANGING, AT_FIRST = ("2", "-1.5", "1"), ("1", "4", "-2")


@pytest.mark.parametrize(("start", "steps", "least"), [
    (AT_FIRST, 20, 1),
    pytest.param(CHANGING, 10**4, 50, marks=pytest.mark.slow),
])  # fmt: skip
def test_forward_and_back_at_fifty_digits(scheme, start, steps, least):
    with mpmath.workdps(70):
        g = np.array(cayley(*map(mpmath.mpf, start)), dtype=object)
        gap, edges = there_and_back(scheme, g.tolist(), steps, 50)
        assert gap < mpmath.mpf(10) ** -38
        assert all(edges) and sum(edges) > least  # both ways change charts


def test_shrunk_steps_are_those_of_the_smaller_step():
    """At h = 80 every step of the free body is beyond the reach, and half of it is not."""
    body = Scheme(scenes.get("rigid-body"), rectangle)
    run = body.flow(80, on_edge="shrink").trajectory(20)
    halves = body.flow(40).trajectory(40, every=2)
    assert run.edges == 21
    assert np.max(abs(run.mu - halves.mu)) < 1e-12
    assert run.margin == pytest.approx(halves.margin, rel=1e-6)
    near = body.flow(1, on_edge="shrink").trajectory(20)
    assert near.edges == 0
    assert np.array_equal(near.mu, body.flow(1).trajectory(20).mu)


@pytest.mark.slow
def test_a_heavy_top_turns_by_any_angle_a_step():
    from discmech.integrators.geometry import defects, residual

    flow = Scheme(example("heavy_top_on_group").scene, rectangle).flow(1, on_edge="bisect")
    translates = set()
    for turn in (0.1, 0.3, 0.4, 0.45):
        g = Rotation.from_rotvec(2 * np.pi * turn * np.array([0.6, 0.48, 0.64])).as_matrix()
        run = flow.trajectory(40, element0=g)
        assert np.max(abs((run.x**2).sum(axis=1) - 1)) < 1e-13
        vertical = (run.x * run.mu).sum(axis=1)  # μ·Γ, the momentum about the vertical
        assert np.max(abs(vertical - vertical[0])) < 1e-12
        translates |= set(run.translates.tolist())
        for k in range(0, 40, 5):
            here, there = flow.arrow(run, k), flow.arrow(run, k + 1)
            assert residual(here, there) < 1e-13
            assert max(defects(here, there)) < 1e-13
    assert len(translates) > 1
