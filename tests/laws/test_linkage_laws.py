"""What a step of jointed bodies keeps: joints, the velocities that they allow, momentum, energy."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices.bond_constraints import BondConstraints
from discmech.integrators.extensions.lattices.scenes import linkages

EPS, STEPS = 2.0**-53, 20_000


def long_run(lattice, rule):
    return Scheme(lattice, rule).flow("1/100").trajectory(STEPS, 200)


def drifts(momentum, size):
    """How far a momentum walks in a long run, as a part of what random roundings make of it."""
    return abs(momentum - momentum[0]).max() / (size * EPS * 4 * np.sqrt(STEPS))


def of_rods(run):
    """(about the vertical, the size of its terms)."""
    turning = run.x[..., 0] * run.mu[..., 1] - run.x[..., 1] * run.mu[..., 0]
    return turning.sum(axis=1), abs(run.x).max() * abs(run.mu).max()


def of_links(run):
    """The same of bodies: spatial momenta are Ad*: R Π + r × R P."""
    place = run.x.reshape(*run.x.shape[:2], 4, 4)
    R, r = place[..., :3, :3], place[..., :3, 3]
    spin, push = (np.einsum("kiab,kib->kia", R, part) for part in np.split(run.mu, 2, axis=2))
    about = (spin + np.cross(r, push))[..., 2].sum(axis=1)
    return about, abs(r).max() * abs(run.mu).max()


@pytest.mark.parametrize("rule", [trapezoidal, pytest.param(midpoint, marks=pytest.mark.slow)],
                         ids=lambda r: r.name)  # fmt: skip
def test_rods_keep_their_lengths_and_what_their_motion_keeps(rule):
    """|r|² = 1 and r·ṙ = 0 as places up to 8 and their momenta are rounded, at every row."""
    run = long_run(linkages.rods(8), rule)
    r, speed = np.diff(run.x, axis=1), np.diff(run.mu, axis=1)
    assert abs((r**2).sum(axis=2) - 1).max() < 2 * 3 * 8 * EPS
    assert abs((r * speed).sum(axis=2)).max() < 2 * 3 * abs(run.mu).max() * EPS
    assert drifts(*of_rods(run)) < 1
    energy = (run.mu**2).sum(axis=(1, 2)) / 2 + run.x[..., 2].sum(axis=1)
    errors = abs(energy / energy[0] - 1)
    assert errors.max() < 2 * errors[:10].max()  # a drift would be ten times as large


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["spherical", "revolute"])
@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_links_stay_joined_and_keep_their_momentum(joint, rule):
    run = long_run(linkages.linkage(6, joint), rule)
    place = run.x.reshape(*run.x.shape[:2], 4, 4)
    R, r = place[..., :3, :3], place[..., :3, 3]
    ends = r + R[..., 0] / 2, r - R[..., 0] / 2
    assert abs(ends[0][:, :-1] - ends[1][:, 1:]).max() < 2 * 6 * 8 * EPS
    momentum, size = of_links(run)
    assert (drifts(momentum, size) < 1) == (joint == "spherical")  # the first hinge is inclined


@pytest.mark.slow
@pytest.mark.parametrize("rule", [trapezoidal], ids=lambda r: r.name)
def test_a_wrong_reaction_is_seen(monkeypatch, rule):
    """A control: one end of a bond gains a millionth less than the other loses."""
    right = BondConstraints.step

    def wrong(self):
        site, bond = right(self)
        less = sympy.Rational(10**6 - 1, 10**6)
        gain = [*(e * less for e in bond.gain[: self.m]), *bond.gain[self.m :]]
        return site, replace(bond, gain=gain)

    monkeypatch.setattr(BondConstraints, "step", wrong)
    assert drifts(*of_rods(long_run(linkages.rods(8), rule))) > 100
