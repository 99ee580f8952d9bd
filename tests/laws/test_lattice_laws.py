"""What a rule keeps on a lattice: the Poisson form, momentum, energy, and its order of accuracy."""

from functools import partial

import numpy as np
import pytest

from discmech import Scheme, midpoint, rectangle, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices import velocities
from discmech.integrators.extensions.lattices.dual_step import DualStep
from discmech.integrators.rules import compose, gauss
from discmech.reference.closed_forms.lattice_waves import (
    sine_gordon_breather,
    sine_gordon_kink,
    toda_places,
    toda_shift,
    toda_solitons,
    toda_traces,
)
from discmech.studies.lattices.patches import patch_defects
from tests.integrators.extensions.lattices.test_bodies_as_sites import SITES

EPS = 2.0**-53
#: the defect is a sum of terms over their absolute sum: a bond's and a site's terms are sums of a
#: few dozen products, each rounded once
POISSON = 2**6 * EPS


@pytest.mark.dear("membrane-trapezoidal", "rectangle", "membrane")
@pytest.mark.parametrize(
    ("lattice", "rule"),
    [(systems.fput(40), rectangle), (systems.rotors(40), midpoint),
     (systems.membrane(6, 7), trapezoidal), (systems.membrane(6, 7), midpoint),
     pytest.param(systems.rotors(40), gauss(2), marks=pytest.mark.slow),
     (SITES["action"](), rectangle),
     pytest.param(SITES["product"](), trapezoidal, marks=pytest.mark.slow),
     pytest.param(SITES["group"](), midpoint, marks=pytest.mark.slow)],
    ids=lambda e: e.name,
)  # fmt: skip
def test_a_step_is_a_poisson_map(lattice, rule):
    flow = Scheme(lattice, rule).flow("1/20")
    end = flow.trajectory(20, 20)
    assert flow.poisson_defect(end.x[-1], end.mu[-1]) < POISSON
    if lattice.groupoid.kind != "pair":  # a control; no bracket of momenta on pairs
        assert flow.poisson_defect(end.x[-1], end.mu[-1], bracket_sign=-1) > 1e-4


def test_a_wrong_derivative_is_seen(monkeypatch):
    """A control on pairs: forces that change by one part in a million less."""
    flow = Scheme(systems.rotors(12), midpoint).flow("1/20")
    end = flow.trajectory(20, 20)
    right = DualStep.__init__

    def wrong(self, *given):
        right(self, *given)
        self._parts["gx"] *= 1 - 1e-6

    monkeypatch.setattr(DualStep, "__init__", wrong)
    assert flow.poisson_defect(end.x[-1], end.mu[-1]) > 1e-12


def wedge(one, other):
    """ω_i of two variations, (N,)."""
    return (one[0] * other[1] - other[0] * one[1]).sum(axis=1)


@pytest.mark.parametrize(
    "rule", [trapezoidal, midpoint, pytest.param(gauss(2), marks=pytest.mark.slow)],
    ids=lambda r: r.name,
)  # fmt: skip
def test_what_enters_a_patch_of_space_and_time_stays_or_leaves(rule):
    """The multisymplectic law of the sine-Gordon field on a patch; a control misses one bond."""
    start = sine_gordon_breather(PLACES, 0, 0.6)
    flow = Scheme(systems.sine_gordon(*start, 0.25), rule).flow("1/10")
    x, mu = flow._start(None, None)
    random, inside = np.random.default_rng(1), slice(60, 90)  # sites; bond k joins k and k + 1
    free = flow.lattice.free[:, None]
    pair = [tuple(random.normal(size=x.shape) * free for _ in "xm") for _ in range(2)]
    held, through, wrong, size = wedge(*pair)[inside].sum(), 0.0, 0.0, 0.0
    for _ in range(8):
        step = DualStep(flow, x, mu)
        flux = step.fluxes(*pair)
        size += abs(flux).sum()
        assert abs(flux.sum(axis=1)).max() < POISSON * abs(flux).max()  # what one end loses
        through += flux[inside.start - 1, 1] + flux[inside.stop - 1, 0]
        wrong += flux[inside.start - 1, 1]
        pair = [step.applied(v)[:2] for v in pair]
        x, mu = step.after
    gained = wedge(*pair)[inside].sum() - held
    assert abs(gained - through) < POISSON * size < abs(gained - wrong)


def mean(x, axis):
    """Of two neighbours in time (0) or in space (1)."""
    return x.take(range(1, x.shape[axis]), axis) - np.diff(x, axis=axis) / 2


def test_the_box_scheme_is_that_of_preissmann_and_multisymplectic():
    """Its nine points: δ_t² μ_x² φ/h² − δ_x² μ_t² φ/a² + μ_t μ_x sin(μ_t μ_x φ) = 0."""
    lattice, h, a = systems.breather(box=True), 1 / 20, 1 / 4
    flow = Scheme(lattice, midpoint).flow("1/20")
    run = flow.trajectory(6)

    field = run.x[:, :, 0]
    left = np.diff(mean(mean(field, 1), 1), 2, axis=0) / h**2
    left -= np.diff(mean(mean(field, 0), 0), 2, axis=1) / a**2
    left += mean(mean(np.sin(mean(mean(field, 0), 1)), 0), 1)
    assert abs(left).max() < 64 * EPS * abs(field).max() / h**2
    found = patch_defects([partial(DualStep, flow)], lattice, run.x[-1], run.mu[-1])
    assert found["patch"] < POISSON and found["bond"] < 1e-13
    assert flow.poisson_defect(run.x[-1], run.mu[-1]) < POISSON
    v = velocities(flow, run.x, run.mu, run.u)
    assert abs(flow.momenta(run.x[-1], v[-1]) - run.mu[-1])[1:-1].max() < POISSON


def test_substeps_of_a_composition_keep_the_form():
    """On a group midpoint and its adjoint take turns."""
    lattice, rule = systems.bodies(3), compose(midpoint, "triple-jump")
    flow = Scheme(lattice, rule).flow("1/20")
    x, mu = flow.own_start
    assert len(flow.parts) == 6 and flow.poisson_defect(x, mu) < POISSON
    assert flow.poisson_defect(x, mu, bracket_sign=-1) > 1e-3
    for part in flow.parts:
        x, mu = DualStep(part, x, mu).after
    end = flow.trajectory(1)
    assert abs(x - end.x[-1]).max() < POISSON and abs(mu - end.mu[-1]).max() < POISSON


PLACES = np.linspace(-20, 20, 161)


def breather(rule, h):
    steps = round(5 / h)
    return Scheme(systems.get("breather"), rule).flow(h).trajectory(steps, steps).x[-1, :, 0]


def order(errors):
    return np.diff(-np.log2(errors))


@pytest.mark.slow
def test_a_breather_is_followed_by_a_composition_to_its_order():
    """In time; rules of one step, and the order in space, are the study's (`discmech lattices`)."""
    best, rule = breather(gauss(3), 1 / 16), compose(trapezoidal, "triple-jump")
    errors = [abs(breather(rule, h) - best).max() for h in (1 / 8, 1 / 16, 1 / 32)]
    assert np.allclose(order(errors), 4, atol=0.2)


def test_a_kink_moves_at_its_speed():
    x, v = sine_gordon_kink(PLACES, 0, 0.5)
    lattice = systems.sine_gordon(x, v, (PLACES[1] - PLACES[0]).item())
    run = Scheme(lattice, trapezoidal).flow("1/10").trajectory(100, 100)
    assert abs(run.x[-1, :, 0] - sine_gordon_kink(PLACES, 10, 0.5)[0]).max() < 0.05


@pytest.mark.parametrize("kappa", [(1.0, -0.8), (1.3, 0.5)])
def test_two_solitons_are_moved_by_their_crossing_as_the_shift_says(kappa):
    """In the closed form of both, before and after; the faster is moved forward."""
    speeds = np.sinh(kappa) / np.abs(kappa)
    before, after = ((t, toda_solitons(np.arange(-400.0, 400), t, kappa, (0, 0))[0])
                     for t in (-60 / np.ptp(speeds), 60 / np.ptp(speeds)))  # fmt: skip
    forward = np.sign(kappa) if kappa[1] < 0 else np.array([1, -1])
    moved = forward * [toda_shift(kappa[i], [kappa[1 - i]])[0] for i in (0, 1)]
    ends = [toda_places(x, kappa, 400 + speeds * t + s * moved / 2)
            for (t, x), s in ((before, -1), (after, 1))]  # fmt: skip
    travelled = ends[1] - ends[0] - speeds * (after[0] - before[0])
    assert np.allclose(travelled, moved, atol=1e-9)


def test_traces_are_those_of_lax_s_matrix():
    x, p = np.random.default_rng(5).normal(size=(2, 20))
    a = np.exp((x - np.roll(x, -1)) / 2) / 2
    L = np.diag(p / 2) + np.diag(a[:-1], 1) + np.diag(a[:-1], -1)
    L[0, -1] = L[-1, 0] = a[-1]
    wanted = [np.trace(np.linalg.matrix_power(L, m)) / 20 for m in range(1, 8)]
    assert np.allclose(toda_traces(x, p, 7), wanted, rtol=1e-13)


def test_solitons_of_toda_pass_through_each_other():
    """Three solitons, one from the other side: they meet, and are where the closed form says."""
    sites, solitons = np.arange(160.0), ([0.9, -0.6, 0.5], [40, 110, 70])
    lattice = systems.toda(*toda_solitons(sites, 0, *solitons))
    exact, inner = toda_solitons(sites, 30, *solitons)[0], slice(20, -20)
    errors = []
    for h in (0.2, 0.1, 0.05):
        steps = round(30 / h)
        x = Scheme(lattice, trapezoidal).flow(h).trajectory(steps, steps).x[-1, :, 0]
        errors.append(abs(x - exact)[inner].max())
    assert np.allclose(order(errors), 2, atol=0.1)


@pytest.mark.parametrize("digits", [7, 34])
def test_forms_of_a_run_in_other_digits_are_measured_in_double_precision(digits):
    """Newton's method had numbers of two kinds, and did not converge."""
    flow = Scheme(systems.fput(4), midpoint).flow("1/20", digits=digits)
    run = flow.trajectory(2)
    assert flow.poisson_defect(run.x[1], run.mu[1]) < POISSON
    assert DualStep(flow, run.x[1], run.mu[1]).before[0].dtype == float
    momenta = flow.momenta(run.x[1], run.mu[1])  # masses of 1
    assert np.array_equal(momenta.astype(float), run.mu[1].astype(float))
