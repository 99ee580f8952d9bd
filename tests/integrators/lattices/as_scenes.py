"""Lattices as ordinary scenes: one on the product of all sites."""

import numpy as np
import pytest
from sympy import Rational

from discmech import Scene, Scheme, product

ROUND_OFF = 2.0**-44  # of a hundred steps at numbers of order one


def as_scene(lattice, bonds):
    """The same system as an ordinary scene, on the product of all sites."""
    groupoid = lattice.groupoid
    for _ in range(lattice.sites - 1):
        groupoid = product(groupoid, lattice.groupoid)
    n, m, k = lattice.groupoid.dim_x, lattice.groupoid.dim_u, lattice.matrix_size

    def at(values, shared, key):
        return type("P", (), {**vars(shared), **{k: Rational(float(v[key])) for k, v in values}})

    def lagrangian(x, v, p):
        xs = [x[i * n : i * n + n, :] for i in range(lattice.sites)]
        xs = [e.reshape(k, k) for e in xs] if k else xs
        own = lattice.split_parameters["site"].items()
        of_bond = lattice.split_parameters["bond"].items()

        def ends(i, j):
            moving = [v[k * m : k * m + m, :] for k in (i, j)]
            return (xs[i], xs[j], *(moving if lattice.bonds_move else []))

        return sum(
            lattice.on_site(xs[i], v[i * m : i * m + m, :], at(own, p, i))
            for i in range(lattice.sites)
        ) + sum(lattice.on_bond(*ends(i, j), at(of_bond, p, k)) for k, (i, j) in enumerate(bonds))

    x0, v0 = (list(a.ravel()) for a in lattice.start)
    shared = lattice.split_parameters["shared"]
    return Scene(f"{lattice.name}-scene", groupoid, lagrangian, shared, x0, v0)


def assert_same(lattice, bonds, rule, steps=60, every=20):
    run = Scheme(lattice, rule).flow("1/20").trajectory(steps, every)
    wanted = Scheme(as_scene(lattice, bonds), rule).flow("1/20").trajectory(steps, every)
    assert np.array_equal(run.t, wanted.t)
    for word in ("x", "u", "mu"):
        got = getattr(run, word).reshape(len(run.t), -1)
        assert abs(got - getattr(wanted, word)).max() < ROUND_OFF, word


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)
