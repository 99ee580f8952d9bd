"""Runs whose every step is proven: the exact discrete run lies within their radius."""

import pickle

import numpy as np
import pytest

from discmech.integrators import (
    BadInput,
    Scheme,
    StepFailure,
    exponential,
    midpoint,
    one_step,
    rules,
    scenes,
)
from discmech.integrators.extensions.proven import ProvenFlow
from discmech.integrators.flows import Start
from tests.objects import SCENES

FEW = 5
CASES = [
    ("pendulum", "trapezoidal"), ("heavy-top", "midpoint"), ("cartesian-pendulum", "midpoint"),
    ("kepler", "gauss-2"), ("suslov", "midpoint"), ("pendulum", "kahan-li-6:trapezoidal"),
    ("henon-heiles", "runge-kutta-4"), ("lotka-volterra", "midpoint"),
    ("driven-heavy-top", "midpoint"), ("bead-on-hoop", "midpoint"),
]  # fmt: skip


def apart(run, other):
    """The distance of each row's (x, μ) from that of another run, as floats."""
    rows = (np.hstack([run.base, run.mu]), np.hstack([other.base, other.mu]))
    return abs(rows[0] - rows[1]).astype(float)


def runs(scheme, steps=FEW):
    """(the proven run to 20 digits, a run of 80 from the same row, the radius)."""
    proven = scheme.flow("1/40", 20, proven=True).trajectory(steps)
    return proven, from_its_start(scheme.flow("1/40", 80), proven, steps), proven.proof.radius


def from_its_start(flow, run, steps, every=1):
    """The flow's run from the first row of another one, which is on constraints to its digits."""
    with flow.numbers.working():
        x, mu, near = (np.array([flow.numbers.number(e) for e in row])
                       for row in (run.base[0], run.mu[0], run.u[0]))  # fmt: skip
        start = Start(x, mu, flow.context.start(x, mu, near))
    return flow.trajectory(steps, every, x0=start)


def check(scheme):
    proven, again, radius = runs(scheme)
    assert (apart(proven, again) <= radius).all() and not radius[0].any()
    for part, values in ((radius[:, : proven.base.shape[1]], proven.base), (radius, proven.mu)):
        if values.size:
            assert part[:, : values.shape[1]].max() <= 1e-20 * float(abs(values).max())
    assert proven.proof.unique == 1e-3 and proven.steps == FEW and len(proven.t) == FEW + 1
    assert apart(proven, again).shape == radius.shape
    for name in ("u", "multipliers", "t"):
        gap = abs(getattr(proven, name) - getattr(again, name)).astype(float)
        assert (gap <= 1e-18 * (1 + abs(getattr(again, name)).astype(float))).all(), name


@pytest.mark.parametrize(("scene", "rule"), CASES)
def test_the_exact_run_is_within_the_radius(scene, rule):
    check(Scheme(scenes.get(scene), rules.get(rule)))


@pytest.mark.slow
@pytest.mark.parametrize("scene", sorted({*SCENES} - {"moser-veselov"}))
def test_so_it_is_on_every_scene(scene):
    check(Scheme(SCENES[scene], midpoint))


@pytest.mark.parametrize("change", ["step", "parameter", "start"])
def test_another_run_is_outside(change):
    """What differs by 1e-24 is outside: a radius that held everything would prove nothing."""
    scheme = Scheme(scenes.get("pendulum"), midpoint)
    proven, _, radius = runs(scheme)
    start, step, other = proven.base[0], "1/40", scheme
    if change == "step":
        step = "0.025000000000000000000000001"
    elif change == "parameter":
        other = scheme.at(parameters={"length": "1.000000000000000000000001"})
    else:
        start = ["2.000000000000000000000001"]
    again = other.flow(step, 80).trajectory(FEW, x0=start, mu0=proven.mu[0])
    assert (apart(proven, again)[-1] > radius[-1]).all()


def test_a_radius_too_small_for_a_double_is_not_0():
    run = Scheme(scenes.get("pendulum"), midpoint).flow("1/40", 300, proven=True).trajectory(3)
    assert run.proof.radius[1:].min() > 0


def test_balls_do_not_grow_with_their_corners():
    """On a periodic motion a run of eight turns loses less than six digits."""
    scheme = Scheme(scenes.get("harmonic"), midpoint)
    run = scheme.flow("1/4", 20, proven=True).trajectory(200, every=200)
    assert run.proof.radius[-1].max() < 1e-26


def test_more_digits_are_taken_where_balls_grow():
    """A double pendulum loses more than the twelve digits that are kept beside."""
    scheme = Scheme(scenes.get("double-pendulum"), midpoint)
    flow = scheme.flow("1/10", 17, proven=True)
    run = flow.trajectory(150, every=50)
    again = from_its_start(scheme.flow("1/10", 80), run, 150, 50)
    assert (apart(run, again) <= run.proof.radius).all()
    assert run.proof.radius.max() <= 1e-17 * float(abs(run.mu).max())


@one_step(implicit=True)
def growing(s, z, Z, h):
    """x′ = x² by the implicit Euler method, which has no real step from x > 1/(4h)."""
    return [Z[0] - z[0] - h * Z[0] ** 2, Z[1] - z[1]]


def test_a_step_without_solution_ends_the_run_with_its_rows():
    scheme = Scheme(scenes.get("harmonic").with_values(x0=[1]), growing)
    with pytest.raises(StepFailure, match="prove no solution of the step") as caught:
        scheme.flow("1/8", 20, proven=True).trajectory(20)
    xs = caught.value.trajectory.x[:, 0]
    assert 1 < len(xs) < 20 and (xs < 2).all()


@pytest.mark.parametrize(("scene", "how", "words"), [
    ("pendulum", {"digits": 16}, "17 to 300 digits"),
    ("pendulum", {"digits": 301}, "17 to 300 digits"),
    ("pendulum", {"step": None, "tolerance": 1e-3}, "give a step, no tolerance"),
    ("pendulum", {"on_edge": "bisect"}, "leave on_edge= out"),
    ("bouncing-ball", {}, "in balls, without impulses"),
    ("moser-veselov", {}, "function of the group element"),
])  # fmt: skip
def test_what_has_no_proof_is_refused(scene, how, words):
    scheme = Scheme(scenes.get(scene), midpoint)
    with pytest.raises(BadInput, match=words):
        scheme.flow(**{"step": "1/40", "digits": 30, **how}, proven=True).trajectory(1)


def test_a_retraction_by_a_series_and_a_checkpoint_are_refused(tmp_path):
    turning = Scheme(scenes.get("rigid-body").with_retraction(exponential), midpoint)
    with pytest.raises(BadInput, match="take cayley"):
        turning.flow("1/40", 30, proven=True).trajectory(1)
    flow = Scheme(scenes.get("pendulum"), midpoint).flow("1/40", 30, proven=True)
    with pytest.raises(BadInput, match="has no checkpoint"):
        flow.trajectory(1, checkpoint=tmp_path / "run")


def test_a_pickled_flow_is_proven_too():
    flow = Scheme(scenes.get("pendulum"), midpoint).flow("1/40", 30, proven=True)
    again = pickle.loads(pickle.dumps(flow))
    assert isinstance(again, ProvenFlow) and again.digits == 30
    assert (again.trajectory(1).proof.radius == flow.trajectory(1).proof.radius).all()
