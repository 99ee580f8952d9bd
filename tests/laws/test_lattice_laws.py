"""What a rule keeps on a lattice: the Poisson form, momentum, energy, and its order of accuracy."""

import numpy as np
import pytest

from discmech import Scheme, midpoint, rectangle, trapezoidal
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.lattices import systems
from discmech.integrators.lattices.dual_step import DualStep
from discmech.integrators.rules import compose, gauss
from discmech.reference.closed_forms.lattice_waves import (
    sine_gordon_breather,
    sine_gordon_kink,
    toda_solitons,
)
from tests.integrators.lattices.test_lattices import SITES

EPS = 2.0**-53
#: the defect is a sum of terms over their absolute sum: a bond's and a site's terms are sums of a
#: few dozen products, each rounded once
POISSON = 2**6 * EPS


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
    right = DualStep._assembled

    def wrong(self, x, w, h):
        right(self, x, w, h)
        self._parts["gx"] *= 1 - 1e-6

    monkeypatch.setattr(DualStep, "_assembled", wrong)
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


def test_compositions_have_no_single_step():
    flow = Scheme(systems.rotors(12), compose(midpoint, "suzuki")).flow("1/20")
    with pytest.raises(CannotMeasure, match="several substeps"):
        flow.poisson_defect(None, None)


@pytest.mark.parametrize("rule", [rectangle, trapezoidal, midpoint], ids=lambda r: r.name)
def test_a_ring_keeps_its_momentum(rule):
    """Each force is added to one rotor and taken from its neighbour, so only sums are rounded."""
    steps = 2000
    run = Scheme(systems.rotors(50), rule).flow("1/20").trajectory(steps, 100)
    total, size = run.mu.sum(axis=(1, 2)), abs(run.mu).sum(axis=(1, 2)).max()
    assert abs(total - total[0]).max() < size * EPS * 4 * np.sqrt(steps)  # random roundings


def energy_of_fput(x, mu, alpha=0.25, beta=0.1):
    r = np.diff(x[..., 0])
    spring = r**2 / 2 + alpha * r**3 / 3 + beta * r**4 / 4
    return (mu**2).sum(axis=(1, 2)) / 2 + spring.sum(axis=1)


@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_energy_does_not_drift(rule):
    """In ten times the time a drift would be ten times as large, a random walk √10 times."""
    run = Scheme(systems.fput(64, mode=3), rule).flow("1/10").trajectory(50_000, 20)
    energy = energy_of_fput(run.x, run.mu)
    errors = abs(energy / energy[0] - 1)
    assert errors.max() < 2 * errors[: len(errors) // 10].max()


PLACES = np.linspace(-20, 20, 161)


def breather(rule, h, refined=1):
    places = np.linspace(-20, 20, 160 * refined + 1)
    start = sine_gordon_breather(places, 0, 0.6)
    lattice = systems.sine_gordon(*start, (places[1] - places[0]).item())
    steps = round(5 / h)
    return Scheme(lattice, rule).flow(h).trajectory(steps, steps).x[-1, ::refined, 0]


def order(errors):
    return np.diff(-np.log2(errors))


def test_a_breather_is_followed_in_space_to_second_order():
    exact = sine_gordon_breather(PLACES, 5, 0.6)[0]
    errors = [abs(breather(gauss(2), 1 / 16, k) - exact).max() for k in (1, 2, 4)]
    assert np.allclose(order(errors), 2, atol=0.05)


@pytest.mark.parametrize(("rule", "wanted"), [(trapezoidal, 2), (gauss(2), 4),
                                              (compose(trapezoidal, "triple-jump"), 4)],
                         ids=lambda r: getattr(r, "name", r))  # fmt: skip
def test_a_breather_is_followed_in_time_to_the_order_of_the_rule(rule, wanted):
    best = breather(gauss(3), 1 / 16)
    errors = [abs(breather(rule, h) - best).max() for h in (1 / 8, 1 / 16, 1 / 32)]
    assert np.allclose(order(errors), wanted, atol=0.2)


def test_a_kink_moves_at_its_speed():
    x, v = sine_gordon_kink(PLACES, 0, 0.5)
    lattice = systems.sine_gordon(x, v, (PLACES[1] - PLACES[0]).item())
    run = Scheme(lattice, trapezoidal).flow("1/10").trajectory(100, 100)
    assert abs(run.x[-1, :, 0] - sine_gordon_kink(PLACES, 10, 0.5)[0]).max() < 0.05


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
