"""Lattices as ordinary scenes: a lattice runs as the scene of all its sites that move."""

import numpy as np
import pytest

from discmech import Scheme
from discmech.integrators.extensions.lattices import scene_of

ROUND_OFF = 2.0**-44  # of a hundred steps at numbers of order one; of λ 2/h more


def begins(lattice):
    """The time of the start, in whose fractions a wrong time shows where it matters."""
    return "1/3" if lattice.timed else 0


def assert_same_in_digits(lattice, rule, digits=50, steps=6, step="1/50"):
    """In 50 digits, too, the lattice runs as its scene; in 7 nearly as in 16."""
    t0 = begins(lattice)
    run, wanted = (Scheme(of, rule).flow(step, digits=digits).trajectory(steps, 3, t0=t0)
                   for of in (lattice, scene_of(lattice)))  # fmt: skip
    for word in ("x", "u", "mu"):
        got = getattr(run, word)[:, lattice.free].reshape(len(run.t), -1)
        assert abs(got - getattr(wanted, word)).max() < 10.0 ** (4 - digits), word
    if lattice.constraint:
        tied = run.multipliers[:, lattice.free[lattice.pairs].any(axis=1)]
        assert abs(tied.reshape(len(run.t), -1) - wanted.multipliers).max() < 10.0 ** (6 - digits)
    if lattice.has_contact:
        assert_same_contacts(lattice, run, wanted, 10.0 ** (6 - digits))
    single = Scheme(lattice, rule).flow(step, digits=7).trajectory(steps, 3, t0=t0)
    assert single.x.dtype == np.float32
    assert abs(single.x - run.x.astype(float)).max() < 2.0**-17


def apart(got, wanted):
    """The largest difference of two tables of rows, however each is shaped."""
    return abs(got.reshape(len(got), -1) - wanted.reshape(len(wanted), -1)).max(initial=0)


def assert_same_contacts(lattice, run, wanted, most):
    """Gaps, impulses and impacts are those of the scene."""
    both = ((run.gaps, run.bond_gaps), (run.impulses, run.bond_impulses))
    moving = lattice.free, lattice.free[lattice.pairs].any(axis=1)
    for got, there in zip(both, (wanted.gaps, wanted.impulses[:, :, 0]), strict=True):
        flat = [e[:, which].reshape(len(e), -1) for e, which in zip(got, moving, strict=True)
                if e is not None]  # fmt: skip
        assert apart(np.hstack(flat), there) < most
    found, there = run.impacts, wanted.impacts
    # what is round-off of 0 may push or not
    struck, at = (t[P.reshape(len(t), -1).max(axis=1) > ROUND_OFF].astype(float) for t, P in
                  ((found.t, found.impulse), (there.t, there.impulses)))  # fmt: skip
    assert len(struck) and set(np.round(struck, 9)) == set(np.round(at, 9))
    pushed = there.impulses[:, :, 0].astype(float).sum()
    assert found.impulse.astype(float).sum() == pytest.approx(pushed, rel=1e-9)


def assert_same(lattice, rule, steps=60, step=None):
    """The lattice runs as its scene, with multipliers and impacts, where there are any."""
    usual, every = ("1/20", 20) if not (lattice.has_contact or lattice.constraint) else ("1/50", 10)
    step = step or usual
    every = 1 if lattice.has_contact else every
    run, wanted = (Scheme(of, rule).flow(step).trajectory(steps, every, t0=begins(lattice))
                   for of in (lattice, scene_of(lattice)))  # fmt: skip
    most = 50 * ROUND_OFF if lattice.has_contact else ROUND_OFF  # a round-off of x over the step
    assert np.array_equal(run.t, wanted.t)
    for word in ("x", "u", "mu"):
        assert apart(getattr(run, word)[:, lattice.free], getattr(wanted, word)) < most, word
    if lattice.constraint:
        tied = run.multipliers[:, lattice.free[lattice.pairs].any(axis=1)]
        assert apart(tied, wanted.multipliers) < ROUND_OFF * 2 * 50**2
    if lattice.has_contact:
        assert_same_contacts(lattice, run, wanted, most)


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)
