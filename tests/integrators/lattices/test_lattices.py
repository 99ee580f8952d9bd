"""A lattice runs as the ordinary scene of the same system, whatever its bonds, site and rule."""

from dataclasses import replace

import numpy as np
import pytest
from sympy import Rational

from discmech import (
    Lattice,
    Scene,
    Scheme,
    action,
    discretisation,
    lie_group,
    midpoint,
    pair,
    product,
    rectangle,
    so,
    trapezoidal,
)  # fmt: skip
from discmech.integrators.errors import BadInput, StepFailure
from discmech.integrators.rules import MAPS, compose, gauss

ROUND_OFF = 2.0**-44  # of a hundred steps at numbers of order one
N = 5
MASS = np.linspace(1, 2, N)
STIFF = np.linspace(1, 3, N - 1)
SCATTERED = [(3, 4), (1, 0), (2, 3), (2, 1)]


def spring(x, y, p):
    r = y[0] - x[0]
    return -(p.stiff * r**2 / 2 + p.alpha * r**3 / 3)


def fput(name="fput", **changes):
    given = {
        "sites": N, "parameters": {"mass": MASS, "stiff": STIFF, "alpha": "1/4"},
        "on_site": lambda x, v, p: p.mass * v[0] ** 2 / 2 - x[0] ** 2 / 7,
        "on_bond": spring,
        "x0": np.sin(np.arange(N))[:, None], "v0": np.cos(np.arange(N))[:, None],
    }  # fmt: skip
    return Lattice(name, pair(1), **{**given, **changes})


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
        return sum(
            lattice.on_site(xs[i], v[i * m : i * m + m, :], at(own, p, i))
            for i in range(lattice.sites)
        ) + sum(lattice.on_bond(xs[i], xs[j], at(of_bond, p, k)) for k, (i, j) in enumerate(bonds))

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


CHAIN = [(i, i + 1) for i in range(N - 1)]


@discretisation()
def two_thirds(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize("rule", [trapezoidal, midpoint, slow(rectangle), slow(two_thirds),
                                  slow(compose(trapezoidal, "triple-jump")),
                                  slow(compose(rectangle, "blanes-moan-4")),
                                  slow(compose(midpoint, "suzuki")), slow(gauss(2))],
                         ids=lambda r: r.name)  # fmt: skip
def test_a_chain_runs_as_its_scene(rule):
    assert_same(fput(), CHAIN, rule)


@pytest.mark.parametrize("rule", [midpoint, slow(trapezoidal), slow(gauss(2))],
                         ids=lambda r: r.name)  # fmt: skip
@pytest.mark.parametrize("bonds", ["ring", "scattered"])
def test_rings_and_lists_run_as_their_scenes(rule, bonds):
    parameters = {"alpha": "1/4", "mass": 2, "stiff": 1}
    if bonds == "ring":
        assert_same(fput("ring", bonds="ring", parameters=parameters), [*CHAIN, (N - 1, 0)], rule)
    else:
        lattice = fput("scattered", bonds=SCATTERED, parameters={**parameters, "stiff": STIFF})
        assert_same(lattice, SCATTERED, rule)


INERTIA = (1, 2, 3)
TOPS = np.array([[0.6, 0, 0.8], [0, 1, 0], [0, 0.6, -0.8]])
V0 = np.array([[0.5, 0.3, -0.2], [-0.4, 0.1, 0.7], [0.2, -0.6, 0.3]])


def turning(v):
    return sum(a * e**2 for a, e in zip(INERTIA, v, strict=True)) / 2


SITES = {
    "action": lambda: Lattice(
        "tops", action(so(3)), 3, {"k": 2}, lambda x, v, p: turning(v) - x[2],
        lambda x, y, p: p.k * x.dot(y), x0=TOPS, v0=V0,
    ),
    "product": lambda: Lattice(
        "carried-tops", product(pair(1), action(so(3))), 3, {"k": 2},
        lambda x, v, p: v[0] ** 2 / 2 + turning(v[1:]) - x[3],
        lambda x, y, p: p.k * x[1:, :].dot(y[1:, :]) - (x[0] - y[0]) ** 2 / 2,
        x0=np.c_[[0.0, 1, 2], TOPS], v0=np.c_[[1.0, 0, 0], V0],
    ),
    "group": lambda: Lattice(
        "bodies", lie_group(so(3)), 3, {"k": 2}, lambda A, v, p: turning(v),
        lambda A, B, p: p.k * (A.T * B).trace(), v0=V0,
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("site", "rule"),
    [slow(site, rule) for site in SITES for rule in (rectangle, trapezoidal, midpoint)],
    ids=lambda e: getattr(e, "name", e),
)
def test_bodies_run_as_their_scene(site, rule):
    assert_same(SITES[site](), [(0, 1), (1, 2)], rule)


def test_sites_are_solved_by_themselves_where_bonds_are_asked_for_at_ends_only():
    for rule, alone in ((rectangle, True), (trapezoidal, True), (midpoint, False)):
        assert Scheme(fput(), rule).local is alone


@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_fixed_ends_stay(rule):
    run = Scheme(fput(fixed_ends=True), rule).flow("1/20").trajectory(40)
    assert np.array_equal(run.x[:, [0, -1]], np.broadcast_to(run.x[0, [0, -1]], (41, 2, 1)))
    assert not run.mu[:, [0, -1]].any()
    assert not run.u[:, [0, -1]].any()
    listed = fput("listed", bonds=CHAIN, fixed=(0, N - 1))
    other = Scheme(listed, rule).flow("1/20").trajectory(40)
    assert abs(other.x - run.x).max() < ROUND_OFF


@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_rows_do_not_change_the_run(rule):
    flow = Scheme(fput(), rule).flow("1/20")
    all_rows, few = flow.trajectory(48), flow.trajectory(48, 12)
    assert np.array_equal(all_rows.x[::12], few.x)
    assert np.array_equal(all_rows.mu[::12], few.mu)
    assert np.array_equal(all_rows.u[::12], few.u)


@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_self_adjoint_rules_run_back(rule):
    scheme = Scheme(fput(), rule)
    there = scheme.flow("1/20").trajectory(50, 50)
    back = scheme.flow("-1/20").trajectory(50, 50, x0=there.x[-1], mu0=there.mu[-1])
    assert abs(back.x[-1] - there.x[0]).max() < ROUND_OFF
    assert abs(back.mu[-1] - there.mu[0]).max() < ROUND_OFF


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bonds": [(0, N)]}, r"bond 0 joins \(0, 5\), but the sites are 0 to 4"),
        ({"bonds": [(0, 1), (2, 2)]}, r"bond 1 is the loop \(2, 2\)"),
        ({"bonds": [(0, -1)]}, "the sites are 0 to 4"),
        ({"bonds": "star"}, 'say "chain" or "ring"'),
        ({"bonds": []}, "bonds must be pairs"),
        ({"bonds": [(0, 1, 2)]}, "bonds must be pairs"),
        ({"bonds": [(0.5, 1)]}, "whole numbers"),
        ({"x0": np.zeros(N)}, r"x0 has the shape \(5,\); give one row a site, \(5, 1\)"),
        ({"v0": np.zeros((N, 2))}, "v0 has the shape"),
        ({"v0": None}, "v0"),
        ({"x0": np.full((N, 1), np.nan)}, "not finite"),
        ({"parameters": {"mass": np.ones(N + 1)}}, "is an array of 6; give 5 entries, one a site"),
        ({"sites": 1}, "whole number from 2"),
        ({"on_bond": None}, "on_bond is None"),
        ({"fixed": [N]}, "fixed names the site 5"),
        ({"bonds": "ring", "fixed_ends": True}, "only a chain has ends"),
        ({"site": lie_group(so(3)), "on_site": 1}, "on_site is 1"),
    ],
    ids=str,
)
def test_bad_input_is_told_in_a_sentence(changes, said):
    with pytest.raises(BadInput, match=said) as told:
        replace(fput(), **changes)
    assert "\n" not in str(told.value)


def test_what_a_lattice_cannot_do_is_told():
    with pytest.raises(BadInput, match="one-step map"):
        Scheme(fput(), MAPS["implicit-midpoint"])
    with pytest.raises(BadInput, match="double precision"):
        Scheme(fput(), midpoint).flow("1/20", digits=50)
    with pytest.raises(BadInput, match="step is 0"):
        Scheme(fput(), midpoint).flow(0)
    with pytest.raises(BadInput, match="x0 is no array of numbers"):
        Scheme(fput(), midpoint).flow("1/20").trajectory(1, x0="a")
    with pytest.raises(BadInput, match="mu0 must be of the shape"):
        Scheme(fput(), midpoint).flow("1/20").trajectory(1, mu0=np.zeros(3))
    without = fput(on_site=lambda x, v, p: -(x[0] ** 2) * p.mass)
    with pytest.raises(BadInput, match="kinetic"):
        Scheme(without, midpoint)

    @discretisation()
    def squared(L, G, x, u, h):
        return h * L(x, u) ** 2

    with pytest.raises(BadInput, match="no weighted sum"):
        Scheme(fput(), squared)


@pytest.mark.parametrize("bonds", ["chain", "ring", [(0, 1), (1, 2)]], ids=str)
def test_a_singular_factorisation_is_told(bonds):
    """At h = 2 a potential with V″ = −1 leaves no u in F⁻, as long as no bond is stretched."""
    lattice = Lattice(
        "flat", pair(1), 3, {}, lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2,
        lambda x, y, p: -((x[0] - y[0]) ** 4), bonds, np.ones((3, 1)), np.zeros((3, 1)),
    )  # fmt: skip
    with pytest.raises(StepFailure, match="singular"):
        Scheme(lattice, midpoint).flow(2).trajectory(1)
