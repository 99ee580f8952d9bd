"""Contact at the sites of a lattice: as of its scene, whatever the number of sites."""

import sys
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import BadInput, Lattice, Scheme, lie_group, midpoint, pair, se, trapezoidal
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.extensions.contact import ContactSteps
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.lattice_gaps import LatticeGaps
from discmech.integrators.extensions.lattices.site_velocities import velocities
from discmech.studies.lattices import contacts
from discmech.studies.systems.quantities import energies
from tests.integrators.extensions.lattices.as_scenes import assert_same


def spring(x, y, p):
    d = y - x
    return -p.k * d.dot(d) / 2


def beads(restitution=1, sites=5, seed=3, **given):
    place = np.random.default_rng(seed)
    values = {
        "on_site": lambda x, v, p: v[0] ** 2 / 2 - p.g * x[0], "on_bond": spring,
        "contact": lambda x, p: [x[0]], "x0": 0.1 + place.random((sites, 1)),
        "v0": place.normal(size=(sites, 1)),
    }  # fmt: skip
    return Lattice("table", pair(1), sites, {"k": 4, "g": 1}, restitution=restitution,
                   **values | given)  # fmt: skip


def in_a_corner(restitution, seed=5):
    """Masses in a plane between two walls that meet at an angle."""
    place = np.random.default_rng(seed)
    return Lattice(
        "corner", pair(2), 3, {"k": 3, "m": np.array([1.0, 2, 3])},
        lambda x, v, p: p.m * (v.dot(v) / 2 - x[1]), spring,
        contact=lambda x, p: [x[1], x[0] + x[1] / 2], restitution=restitution,
        x0=0.3 + place.random((3, 2)), v0=place.normal(size=(3, 2)),
    )  # fmt: skip


def discs(restitution):
    """Bodies that turn and fall, each tied to the next, one with its centre off."""
    x0 = np.array([np.eye(3)] * 3)
    x0[:, 0, 2], x0[:, 1, 2] = range(3), (1, 1.5, 1.2)
    return Lattice(
        "discs", lie_group(se(2)), 3, {"k": 2},
        lambda g, v, p: (v[0] ** 2 / 3 + v[1] ** 2 + v[2] ** 2) / 2 - g[1, 2],
        lambda g, k, p: spring(g[:2, 2] + g[:2, 0] / 4, k[:2, 2] - k[:2, 0] / 4, p),
        contact=lambda g, p: [g[1, 2] + g[1, 0] / 4 - sympy.Rational(1, 2),
                              g[1, 2] - g[1, 0] / 4 - sympy.Rational(1, 2)],
        restitution=restitution, x0=x0, v0=np.array([[1.0, 0, 0], [0, 0, -1], [-2, 0, 0]]),
    )  # fmt: skip


def balls(count=5, moving=1, slack=0.05, restitution=1, **given):
    """Balls of diameter 1 in a row, of which the first ones strike the others."""
    values = {
        "on_site": lambda x, v, p: p.m * v[0] ** 2 / 2, "parameters": {"m": np.ones(count)},
        "x0": np.arange(count)[:, None] * (1 + slack),
        "v0": 1.0 * (np.arange(count) < moving)[:, None],
        "bond_contact": lambda x, y, p: [y[0] - x[0] - 1],
    }  # fmt: skip
    return Lattice("balls", pair(1), count, restitution=restitution, **values | given)


@pytest.mark.slow
@pytest.mark.parametrize("moving", [1, 2, 3])
def test_as_many_balls_leave_as_came(moving):
    run = Scheme(balls(moving=moving), midpoint).flow("1/50").trajectory(150)
    leaving = np.arange(5) >= 5 - moving
    assert abs(run.mu[-1, :, 0] - leaving).max() < 1e-13
    assert set(run.impacts.site) == {-1} and set(run.impacts.bond) <= {0, 1, 2, 3}
    assert abs((run.mu**2).sum(axis=(1, 2)) - moving).max() < 1e-13


def test_balls_of_unequal_masses_hand_on_their_closed_form():
    m = np.array([4.0, 3, 2, 1])
    run = Scheme(balls(4, parameters={"m": m}), midpoint).flow("1/50").trajectory(120)
    v = np.cumprod(np.r_[1.0, 2 * m[:-1] / (m[:-1] + m[1:])])  # of each when it is first struck
    after = v * np.r_[(m[:-1] - m[1:]) / (m[:-1] + m[1:]), 1]
    assert abs(run.mu[-1, :, 0] / m - after).max() < 1e-13


def test_balls_that_touch_are_struck_together():
    """Moreau's law, as of a scene: one system of all gaps that are closed."""
    run = Scheme(balls(3, slack=0), midpoint).flow("1/50").trajectory(10)
    assert abs(run.mu[-1, :, 0] - np.array([-1, 2, 2]) / 3).max() < 1e-14


@pytest.mark.slow
def test_a_time_dependent_table_under_beads_runs_as_its_scene():
    shaken = beads("1/2", fixed=[1], on_site=lambda x, v, p, t: (1 + t / 9) * v[0] ** 2 / 2
                   - (p.g + sympy.sin(3 * t) / 2) * x[0])  # fmt: skip
    assert_same(shaken, midpoint, 100)


@pytest.mark.slow
def test_elastic_impacts_keep_the_energy():
    scheme = Scheme(systems.bead_chain(60), midpoint)
    elastic = Scheme(replace(scheme.lattice, restitution=1), midpoint)
    run = elastic.flow("1/50").trajectory(500)
    H, size = energies(elastic, run)
    assert len(run.impacts.t) > 100 and np.ptp(H) < 1e-13 * size


@pytest.mark.slow
@pytest.mark.dear("trapezoidal")
@pytest.mark.parametrize("rule", [midpoint, trapezoidal], ids=lambda r: r.name)
def test_the_free_steps_of_a_step_do_not_grow_with_the_sites(rule):
    asked = []
    for sites in (40, 400, 4_000):
        flow = Scheme(systems.bead_chain(sites), rule).flow("1/50")
        run = flow.trajectory(40)
        asked.append(run.newton_mean)
        defects = contacts.defects(flow, run)
        assert len(run.impacts.t) > sites and max(defects.values()) < 1e-13, defects
    assert max(asked) < 8 and asked[-1] < asked[0] + 0.1


@pytest.mark.slow
def test_fixed_sites_stay_and_meet_nothing():
    lattice = beads(fixed_ends=True, x0=[[-1.0], [0.5], [0.2], [0.4], [-1.0]])
    run = Scheme(lattice, midpoint).flow("1/50").trajectory(100)
    assert (run.x[:, [0, -1], 0] == -1).all() and not run.impulses[:, [0, -1]].any()
    assert len(run.impacts.t) and run.gaps[:, 1:-1].min() > -1e-15


BEGIN = ContactSteps.__init__


def pulling(self, W, U0, cones, start):
    return -U0 / W.diagonal()


def missing(self, m, share, *given):
    return m._replace(u=self.gaps.velocity(m.place.x, m.mu))


SOUND = LatticeGaps.impulses


def rebounding(self, gaps, h, part, restitution):
    BEGIN(self, gaps, h, part, 0.25)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("of", "name", "fault", "seen"),
    [(LatticeGaps, "impulses", pulling, "pull"),
     (ContactSteps, "_after_impacts", missing, "missed"),
     (ContactSteps, "__init__", rebounding, "restitution")],
)  # fmt: skip
def test_faults_of_contact_are_seen(of, name, fault, seen, monkeypatch):
    monkeypatch.setattr(of, name, fault)
    flow = Scheme(beads(0, v0=[[0], [0], [0], [0], [5]]), midpoint).flow("1/50")
    assert contacts.defects(flow, flow.trajectory(150))[seen] > 1e-10


def test_an_impulse_of_the_wrong_sign_between_balls_is_seen(monkeypatch):
    flow = Scheme(balls(restitution=0), midpoint).flow("1/50")
    assert max(contacts.defects(flow, flow.trajectory(60)).values()) < 1e-13
    monkeypatch.setattr(LatticeGaps, "impulses", lambda *given: -SOUND(*given))
    with suppress(StepFailure):
        assert max(contacts.defects(flow, flow.trajectory(60)).values()) > 1e-10


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"restitution": 2}, "a restitution from 0 to 1"),
        ({"bond_contact": lambda x, p: [x[0]]}, r"bond_contact= is a function of \(x, p\)"),
        (
            {"bond_contact": lambda x, y, p: [y[0] - x[0] + 10, x[0] - y[0] - 1]},
            "x0 of bond 0 is inside the obstacle: its gap 1 is",
        ),
        ({"contact": None}, "restitution=1 needs contact="),
        ({"contact": 1}, "contact= is 1; give a function of"),
        ({"constraint": lambda x, y, p: [x[0] - y[0]]}, "constraints and contact, which no step"),
        ({"contact": lambda x, p: x[0]}, "must give a list of gaps"),
        ({"bond_contact": lambda x, y, p: [1]}, "a bond of table: gap 0 is 1, which no motion"),
        ({"contact": lambda x, p: [(x[0], [x[0]])]}, "the contact of a lattice has no friction"),
        ({"contact": lambda x, p: [p.g]}, "gap 0 is p.g, which no motion changes"),
        ({"x0": [[1], [1], [-0.5], [1], [1]]}, "site 2 is inside the obstacle: its gap 0 is -0.5"),
        ({"contact": lambda x, p: [x[0] ** 2], "x0": np.zeros((5, 1))}, "site 0 is closed at x0"),
        ({"contact": lambda x, p: [x[0], -x[0]], "x0": np.zeros((5, 1))}, "contradict each other"),
    ],
)
def test_bad_input_is_told_in_a_sentence(changes, said):
    with pytest.raises(BadInput, match=said):
        Scheme(beads(**changes), midpoint).flow("1/50")


def test_what_contact_cannot_do_is_told():
    flow = Scheme(beads(), midpoint).flow("1/50")
    with pytest.raises(BadInput, match="site 0 is inside"):
        flow.trajectory(1, x0=-np.ones((5, 1)))
    with pytest.raises(BadInput, match="positive steps only"):
        Scheme(beads(), midpoint).flow("-1/50")
    for refused in (lambda: flow.poisson_defect(*beads().start), lambda: flow.blocks(3)):
        with pytest.raises(CannotMeasure, match="forms are not defined"):
            refused()
    fast = beads(on_site=lambda x, v, p: -sympy.sqrt(1 - v[0] ** 2 / 100) - x[0])
    with pytest.raises(CannotMeasure, match="quadratic in the velocity"):
        Scheme(fast, midpoint).flow("1/50")


def test_a_step_that_is_not_found_has_the_rows_so_far():
    wild = beads(on_bond=lambda x, y, p: -sympy.exp(20 * (y[0] - x[0]) ** 2))
    with pytest.raises(StepFailure, match="table with midpoint") as failure:
        Scheme(wild, midpoint).flow("1/2").trajectory(50)
    assert len(failure.value.trajectory.t) == failure.value.step_index


def test_velocities_of_many_rows_have_each_its_own_mass(monkeypatch):
    """Rows are solved for in parts, whose parameters are those of the part's sites."""
    module = sys.modules["discmech.integrators.equations.legendre_inverse"]
    monkeypatch.setattr(module, "ENTRIES", 3)
    mass = np.array([1.0, 2.0, 3.0, 5.0])
    chain = Lattice("masses", pair(1), 4, {"m": mass}, lambda x, v, p: p.m * v[0] ** 2 / 2,
                    lambda x, y, p: -((y[0] - x[0]) ** 2) / 2, x0=np.zeros((4, 1)),
                    v0=np.zeros((4, 1)), step="1/10")  # fmt: skip
    flow = Scheme(chain, midpoint).flow("1/10")
    mu = np.arange(1.0, 13.0).reshape(3, 4, 1)
    found = velocities(flow, np.zeros((3, 4, 1)), mu, np.zeros((3, 4, 1)))
    assert np.array_equal(found[:, :, 0], mu[:, :, 0] / mass)
