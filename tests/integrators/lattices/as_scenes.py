"""Lattices as ordinary scenes: one on the product of all sites that move."""

import numpy as np
import pytest
from sympy import Matrix, Rational

from discmech import Scene, Scheme, product

ROUND_OFF = 2.0**-44  # of a hundred steps at numbers of order one; of λ 2/h more


def as_scene(lattice):
    """The same system as an ordinary scene, on the product of all sites that move."""
    free = np.flatnonzero(lattice.free)
    place = {i: row for row, i in enumerate(free)}
    groupoid = lattice.groupoid
    for _ in free[1:]:
        groupoid = product(groupoid, lattice.groupoid)
    n, m, k = lattice.groupoid.dim_x, lattice.groupoid.dim_u, lattice.matrix_size

    def site(x, i):
        held = Matrix([Rational(float(e)) for e in lattice.start[0][i]])
        at = x[place[i] * n : place[i] * n + n, :] if i in place else held
        return at.reshape(k, k) if k else at

    def own(v, i):
        return v[place[i] * m : place[i] * m + m, :] if i in place else Matrix([0] * m)

    def values(p, kind, at):
        def exact(value):
            entries = [Rational(float(e)) for e in np.ravel(value)]
            return Matrix(entries) if np.ndim(value) else entries[0]

        given = lattice.split_parameters[kind].items()
        return type("P", (), {**vars(p), **{word: exact(a[at]) for word, a in given}})

    def lagrangian(x, v, p):
        def bond(b, i, j):
            moving = (own(v, i), own(v, j)) if lattice.bonds_move else ()
            return lattice.on_bond(site(x, i), site(x, j), *moving, values(p, "bond", b))

        of_sites = (lattice.on_site(site(x, i), own(v, i), values(p, "site", i)) for i in place)
        return sum(of_sites) + sum(bond(b, *ends) for b, ends in enumerate(lattice.pairs))

    def holonomic(x, p):
        return [e for b, (i, j) in enumerate(lattice.pairs) if i in place or j in place
                for e in lattice.constraint(site(x, i), site(x, j), values(p, "bond", b))
                ]  # fmt: skip

    def contact(x, p):
        return [phi for i in place for phi in lattice.contact(site(x, i), p)]

    more = {"holonomic": holonomic} if lattice.constraint else {}
    if lattice.contact:
        more = {"contact": contact, "restitution": lattice.restitution}
    x0, v0 = (list(a[free].ravel()) for a in lattice.start)
    shared = lattice.split_parameters["shared"]
    return Scene(f"{lattice.name}-scene", groupoid, lagrangian, shared, x0, v0, **more)


def assert_same(lattice, rule, steps=60):
    """The lattice runs as its scene, with multipliers and impacts, where there are any."""
    step, every = ("1/20", 20) if not (lattice.contact or lattice.constraint) else ("1/50", 10)
    run, wanted = (Scheme(of, rule).flow(step).trajectory(steps, 1 if lattice.contact else every)
                   for of in (lattice, as_scene(lattice)))  # fmt: skip
    most = 50 * ROUND_OFF if lattice.contact else ROUND_OFF  # a round-off of x over the step

    def difference(got, wanted):
        return abs(got.reshape(len(run.t), -1) - wanted.reshape(len(run.t), -1)).max(initial=0)

    assert np.array_equal(run.t, wanted.t)
    for word in ("x", "u", "mu"):
        assert difference(getattr(run, word)[:, lattice.free], getattr(wanted, word)) < most, word
    if lattice.constraint:
        tied = run.multipliers[:, lattice.free[lattice.pairs].any(axis=1)]
        assert difference(tied, wanted.multipliers) < ROUND_OFF * 2 * 50**2
    if lattice.contact:
        assert difference(run.gaps, wanted.gaps) < most
        assert difference(run.impulses, wanted.impulses[:, :, 0]) < most
        found, there = run.impacts, wanted.impacts
        assert len(found.t) and set(np.round(found.t, 9)) == set(np.round(there.t, 9))
        assert found.impulse.sum() == pytest.approx(there.impulses[:, :, 0].sum(), rel=1e-9)


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)
