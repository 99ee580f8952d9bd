"""Steps far from the identities: bisections of SO(3) by a signature cover (paper, section 4.3)."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discmech.integrators import (
    BadInput,
    Scene,
    Scheme,
    StepFailure,
    action,
    exponential,
    lie_group,
    on_group,
    rectangle,
    scenes,
)
from discmech.integrators import rules as discretisations
from discmech.integrators.algebras import se, sl, so, sp, su
from discmech.integrators.rules import compose
from tests.objects import scheme_of

MOSER_VESELOV = scenes.get("moser-veselov")


def rotation(angle, axis):
    return Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()


@pytest.fixture(scope="module")
def attitude_flow():
    return scheme_of(MOSER_VESELOV.with_attitude(), rectangle).flow(1, on_edge="bisect")


#: a rotation by a rounded g is one to round-off only; where g is the same at every step (a steady
#: rotation) these errors have one sign and add up
ROUND_OFF = 2.0**-53


def drift(run):
    """The largest change of the spatial momentum Aμ."""
    momentum = np.einsum("rij,rj->ri", run.x.reshape(-1, 3, 3), run.mu)
    return np.max(abs(momentum - momentum[0]))


@pytest.mark.parametrize("turn", (0.1, 0.3, 0.4, 0.49, 0.7, 0.9))
@pytest.mark.slow
def test_momentum_is_kept_at_any_rotation_a_step(attitude_flow, turn):
    run = attitude_flow.trajectory(
        20000, every=100, element0=rotation(2 * np.pi * turn, [1, 0.4, 0.2])
    )
    assert drift(run) < 20000 * ROUND_OFF
    assert run.margin > 0


@pytest.mark.slow
def test_many_large_steps_change_charts_and_keep_the_momentum(attitude_flow):
    run = attitude_flow.trajectory(5000, every=100, element0=rotation(2.7, [1, 2, -2]))
    assert run.edges > 0 and set(run.translates) - {0}
    assert drift(run) < 5000 * ROUND_OFF


@pytest.mark.parametrize("algebra", (so(2), so(3), so(4), so(5), se(2), se(3), sl(2), sp(2), su(2)))
def test_some_translate_of_the_cover_holds_every_element(algebra):
    """det(e + g B⁻¹) ≥ 2 for some B, at random products of exponentials."""
    from scipy.linalg import expm

    generator = np.random.default_rng(3)
    basis = np.array(algebra.basis, dtype=complex)
    cover = [np.array(B, dtype=complex) for B in algebra.cover]
    assert np.array_equal(cover[0], np.eye(algebra.size))
    elements = expm(np.tensordot(generator.normal(0, 3, (40, algebra.dim)), basis, 1))
    one = np.eye(algebra.size)
    open_ = [abs(np.linalg.det(one + elements @ np.linalg.inv(B))) for B in cover]
    sizes = np.linalg.norm(elements, axis=(1, 2))
    assert np.all(np.max(open_, axis=0) > 2 - 1e-9 * sizes**2)


def test_other_algebras_state_no_cover():
    assert not sl(3).cover and not sp(4).cover


@pytest.mark.dear("4]")
@pytest.mark.parametrize(("rule", "order"), [("own", 2), ("triple-jump:own", 4)])
def test_compositions_of_what_is_given_on_the_group_have_their_order(rule, order):
    """Their substeps are of several sizes, and tr(gΛ) is kept by a map of one size only.

    Orders of self-adjoint maps are off by O(h²): at most 0.04 from steps of a tenth on.
    """
    scheme = scheme_of(MOSER_VESELOV, discretisations.get(rule))
    ends = [scheme.flow(Fraction(2, n), 30).trajectory(n, n).mu[-1] for n in (20, 40, 80, 160, 320)]
    gaps = [float(max(abs(a - b))) for a, b in pairwise(ends)]
    assert [np.log2(a / b) for a, b in pairwise(gaps)] == pytest.approx([order] * 3, abs=0.05)


@pytest.mark.slow
def test_a_run_from_an_element_begins_at_the_x0_that_is_given():
    """An array's truth is no question of Python's, and an empty list is no x of a top."""
    top = Scene(
        name="top-on-group", groupoid=action(so(3)), x0=[0, 0, 1], v0=["0.1", 0, 0],
        discrete_lagrangian=on_group(
            lambda x, g, h, p: (3 - g[0, 0] - g[1, 1] - g[2, 2]) / h - h * (x + g.T * x)[0]
        ),
    )  # fmt: skip
    flow = Scheme(top, rectangle).flow("0.1", on_edge="bisect")
    for given in (list, tuple, np.array):
        run = flow.trajectory(1, element0=np.eye(3), x0=given([0.6, 0.0, 0.8]))
        assert run.x[0].tolist() == [0.6, 0.0, 0.8]
        with pytest.raises(BadInput, match="a vector has 0 entries"):
            flow.trajectory(1, element0=np.eye(3), x0=given([]))


def test_what_cannot_be_done_is_said():
    flow = scheme_of(MOSER_VESELOV, rectangle).flow(1, on_edge="bisect")
    with pytest.raises(
        BadInput, match=r"is no element of group.*; give a matrix of that group, 3×3"
    ):
        flow.trajectory(1, element0=np.diag([1, 1, -1]))
    with pytest.raises(BadInput, match="on_edge is 'jump'"):
        scheme_of(MOSER_VESELOV, rectangle).flow(1, on_edge="jump")
    with pytest.raises(BadInput, match="leave these out"):
        flow.trajectory(1, element0=np.eye(3), mu0=[1, 2, 3])
    composed = Scheme(MOSER_VESELOV, compose(rectangle, "triple-jump")).flow(1)
    with pytest.raises(BadInput, match="is a composition, whose step is no one element"):
        composed.trajectory(1, element0=np.eye(3))
    with pytest.raises(BadInput, match="run is of another flow"):
        flow.elements(Scheme(scenes.get("pendulum"), rectangle).flow(1).trajectory(1))
    given = on_group(lambda x, g, h, p: g[0, 0] / h)
    with pytest.raises(BadInput, match="such as su"):
        Scheme(Scene("c", lie_group(su(2)), discrete_lagrangian=given, v0=[1, 1, 1]), rectangle)
    turning = MOSER_VESELOV.with_retraction(exponential)
    with pytest.raises(BadInput, match="write retraction=cayley"):
        Scheme(turning, rectangle).flow(1).trajectory(1)
    with pytest.raises(BadInput, match="given on the group"):
        Scheme(scenes.get("rigid-body"), rectangle).flow(1, on_edge="bisect").trajectory(1)
    with pytest.raises(StepFailure):  # |hμ| beyond every gΛ − Λgᵀ
        flow.trajectory(1, mu0=[5, 5, 5])
