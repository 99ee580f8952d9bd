"""Rules with stages on lattices: a fixed point of all stages, or Newton's method."""

from dataclasses import replace

import numpy as np
import pytest

from discmech import Lattice, Scheme, midpoint, pair
from discmech.integrators.errors import StepFailure
from discmech.integrators.extensions.lattices import LatticeRun
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.rules import compose, gauss, lobatto
from discmech.integrators.runs import checkpoint as checkpoints
from tests.integrators.extensions.lattices.as_scenes import ROUND_OFF, slow
from tests.integrators.extensions.lattices.test_bodies_as_sites import SITES
from tests.integrators.extensions.lattices.test_lattices import MASS, fput

LIST = {"alpha": "1/4", "mass": 2, "stiff": 1}


def newton(flow):
    """The same flow, which begins with Newton's method."""
    other = flow.scheme.flow(flow.step)
    other.of_stages = None
    return other


def both(lattice, rule, step="1/20"):
    flow = Scheme(lattice, rule).flow(step)
    assert flow.of_stages
    return flow, newton(flow)


@pytest.mark.slow
@pytest.mark.dear("action", "product")
@pytest.mark.parametrize("kind", [*SITES])
@pytest.mark.parametrize("rule", [gauss(2), slow(gauss(3))], ids=lambda r: r.name)
def test_bodies_run_by_stages_as_by_newton(kind, rule):
    """On groups and actions π₀ is not μ; w, which other kernels go on from, is that of Newton."""
    flow, other = both(SITES[kind](), rule)
    run, wanted = (f.trajectory(40, 10) for f in (flow, other))
    for word in ("x", "u", "mu"):
        assert abs(getattr(run, word) - getattr(wanted, word)).max() < ROUND_OFF, word
    one, two = (LatticeRun(f, run.x[1].copy(), run.mu[1].copy()) for f in (flow, other))
    assert one.by_stages and not two.by_stages
    assert one.past[0].shape == two.past[0].shape
    assert abs(one.past[0] - two.past[0]).max() < ROUND_OFF


@pytest.mark.parametrize(
    ("lattice", "rule"),
    [(fput(), gauss(2)), (systems.rods(3), midpoint), (SITES["group"](), lobatto(3)),
     (SITES["group"](), compose(gauss(2), "triple-jump")),
     (fput(on_bond=lambda x, y, v, w, p: v[0] * w[0] / 9 - (y[0] - x[0]) ** 2), gauss(3))],
    ids=["two unknowns", "constraints", "no collocation", "composition", "moving bonds"],
)  # fmt: skip
def test_newton_does_what_is_no_fixed_point_of_stages(lattice, rule):
    assert not Scheme(lattice, rule).flow("1/20").of_stages


def stiff(k, sites=8):
    return Lattice(
        "stiff", pair(1), sites, {"k": k}, lambda x, v, p: v[0] ** 2 / 2,
        lambda x, y, p: -p.k * ((y[0] - x[0]) ** 2 / 2 + (y[0] - x[0]) ** 4),
        x0=np.sin(np.arange(sites))[:, None], v0=np.zeros((sites, 1)),
    )  # fmt: skip


@pytest.mark.slow
def test_newton_takes_over_where_bonds_are_stiff():
    """No fixed point contracts at hω = 20; it is the same run."""
    flow, other = both(stiff(10**4), gauss(3), "1/10")
    run, wanted = (f.trajectory(20, 5) for f in (flow, other))
    assert run.newton_since == 0 and wanted.newton_since is None
    assert np.array_equal(run.x, wanted.x) and np.array_equal(run.mu, wanted.mu)
    assert run.newton_max >= wanted.newton_max


@pytest.mark.slow
def test_newton_does_what_it_does_faster():
    """Of three unknowns a site along a chain, where the first step takes many sweeps."""
    lattice = stiff(1)
    slow_, fast = (both(lattice, gauss(3), h)[0].trajectory(20) for h in ("1/2", "1/10"))
    assert slow_.newton_since == 0 and fast.newton_since is None
    as_list = replace(lattice, bonds=[(i, i + 1) for i in range(7)])
    run = both(as_list, gauss(3), "1/2")[0].trajectory(20)
    assert run.newton_since is None and abs(run.x - slow_.x).max() < ROUND_OFF


@pytest.mark.parametrize("far", [0, 1000])
@pytest.mark.parametrize("k", [1, 100])
def test_round_off_is_solved_for_at_rest(k, far):
    """What is left of springs at their length moves no x, and no method has to be changed."""
    at_rest = replace(stiff(k), x0=far + np.arange(8)[:, None] * 1.1, on_bond=lambda x, y, p: (
        -p.k * (y[0] - x[0] - 1.1) ** 2 / 2))  # fmt: skip
    run = both(at_rest, gauss(4), "1/10")[0].trajectory(200)
    assert run.newton_since is None
    assert abs(run.x - at_rest.x0).max() < 64 * 2.0**-53 * abs(at_rest.x0).max()


def colliding():
    """Two sites that meet: their bond is soft until then."""
    return Lattice(
        "colliding", pair(1), 2, {}, lambda x, v, p: v[0] ** 2 / 2,
        lambda x, y, p: -1 / (1000 * (y[0] - x[0]) ** 8), x0=np.array([[0.0], [3]]),
        v0=np.array([[0.8], [-0.8]]),
    )  # fmt: skip


@pytest.mark.slow
def test_newton_takes_over_on_the_way(tmp_path, monkeypatch):
    """Rows before it are of the fixed point; a run goes on from a file as it would have gone on."""
    monkeypatch.setattr(checkpoints, "SECONDS", 0)
    flow, other = both(colliding(), gauss(3), "1/4")
    run = flow.trajectory(24)
    start = LatticeRun(flow, *flow._start(None, None))
    steps = 0
    while start.by_stages and steps < 24:
        start.checked(start.advance(1))
        steps += 1
    assert 4 < steps < 24 and run.newton_since == steps
    rest = other.trajectory(24 - steps, x0=run.x[steps], mu0=run.mu[steps])
    assert abs(rest.x - run.x[steps:]).max() < ROUND_OFF
    path, stop = tmp_path / "run.npz", steps + 2

    def interrupt(done):
        if done == stop:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flow.trajectory(24, checkpoint=path, progress=interrupt)
    again = flow.trajectory(24, checkpoint=path)
    assert np.array_equal(again.x, run.x) and np.array_equal(again.mu, run.mu)
    assert again.newton_since == run.newton_since


@pytest.mark.slow
def test_rows_do_not_tell_how_a_run_goes_on():
    flow, _ = both(colliding(), gauss(3), "1/4")
    ends = [flow.trajectory(24, every).x[-1] for every in (1, 3, 24)]
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


@pytest.mark.slow
def test_energy_does_not_drift_where_sweeps_end_too_early():
    """With a lax end of the sweeps 2e-13 of it goes astray in 60,000 steps."""
    flow, _ = both(fput(parameters={"mass": 1, "stiff": 1, "alpha": "1/4"}), gauss(4))
    run = flow.trajectory(60_000, 6_000)
    r = np.diff(run.x[..., 0], axis=1)
    energies = ((run.mu[..., 0] ** 2 / 2 + run.x[..., 0] ** 2 / 7).sum(axis=1)
                + (r**2 / 2 + r**3 / 12).sum(axis=1))  # fmt: skip
    assert abs(energies - energies[0]).max() < 2.0**-44 * energies[0]


def test_a_step_that_nothing_finds_keeps_its_rows():
    flow, _ = both(colliding(), gauss(3), "1/2")
    with pytest.raises(StepFailure) as failure:
        flow.trajectory(24)
    assert failure.value.trajectory.newton_max > 10
    assert len(failure.value.trajectory.t) == 3


@pytest.mark.slow
def test_a_parameter_may_have_any_name():
    for name, value in (("force_of_bonds", 3), ("force_of_bonds_0", 3), ("h", MASS), ("ww0_0", 2)):
        named = fput(parameters={"stiff": 1, "alpha": 0, name: value},
                     on_site=lambda x, v, p, w=name: getattr(p, w) * v[0] ** 2 / 2)  # fmt: skip
        run, wanted = (f.trajectory(20).x for f in both(named, gauss(3)))
        assert abs(run - wanted).max() < ROUND_OFF
