"""A lattice runs as the ordinary scene of the same system, whatever its bonds, site and rule."""

from dataclasses import replace

import numpy as np
import pytest
from sympy import Integer

from discmech import (
    Lattice,
    Scheme,
    discretisation,
    lie_group,
    midpoint,
    pair,
    rectangle,
    so,
    trapezoidal,
)  # fmt: skip
from discmech.integrators.errors import BadInput, CannotMeasure, StepFailure
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices import velocities
from discmech.integrators.extensions.lattices.scenes import linkages
from discmech.integrators.rules import MAPS
from tests.integrators.extensions.lattices.as_scenes import ROUND_OFF, slow

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


CHAIN = [(i, i + 1) for i in range(N - 1)]


def test_chains_and_rings_have_these_bonds():
    for bonds, pairs in (("chain", CHAIN), ("ring", [*CHAIN, (N - 1, 0)]), (SCATTERED, SCATTERED)):
        assert np.array_equal(fput(bonds=bonds, parameters={}).pairs, pairs)


def test_momenta_that_do_not_tell_velocities_are_named():
    """Between free ends the means of neighbours' velocities leave out those that alternate."""
    loose = fput(
        on_site=None, on_bond=lambda x, y, v, w, p: (v[0] + w[0]) ** 2 - (x[0] - y[0]) ** 2
    )
    flow = Scheme(loose, midpoint).flow("1/20")
    run = flow.trajectory(4)
    assert np.isfinite(run.x).all()  # steps are to be had: potentials make FL regular
    with pytest.raises(CannotMeasure, match="its momenta do not tell its velocities"):
        velocities(flow, run.x, run.mu, run.u)
    # whatever the bonds weigh, and where no pivot comes out as 0
    uneven = fput(
        sites=6, parameters={}, on_site=None, bonds="ring", x0=np.zeros((6, 1)), v0=np.ones((6, 1)),
        on_bond=lambda x, y, v, w, p: (
            (v[0] + w[0]) ** 2 * (1 + x[0] ** 2 / 3 + y[0] ** 2 / 7) - (x[0] - y[0]) ** 2
        ),
    )  # fmt: skip
    flow, random = Scheme(uneven, midpoint).flow("1/20"), np.random.default_rng(5)
    for unit in (1.0, 1e-9, 1e9):
        x, mu = random.normal(size=(2, 6, 1, 6, 1))
        for one, other in zip(x, mu, strict=True):
            with pytest.raises(CannotMeasure, match="its momenta do not tell its velocities"):
                velocities(flow, one, unit * other, 0 * other)


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1000, slow(10_000)])
def test_a_list_of_stiff_bonds_solves_each_step_as_the_chain(stiffness):
    """Also the one in which the fixed point gives way to the factorisation."""
    bend = np.sin(np.arange(40) * 2 * np.pi / 40)[:, None]
    chain = Lattice(
        "stiff", pair(1), 40, {"k": stiffness}, lambda x, v, p: v[0] ** 2 / 2,
        lambda x, y, p: -p.k * ((y[0] - x[0]) ** 2 / 2 + (y[0] - x[0]) ** 4 / 40),
        x0=bend, v0=0 * bend,
    )  # fmt: skip
    one, other = (Scheme(lattice, midpoint).flow("1/20").trajectory(1)
                  for lattice in (chain, replace(chain, bonds=chain.pairs)))  # fmt: skip
    assert abs(one.x - other.x).max() < ROUND_OFF
    assert abs(one.mu - other.mu).max() < ROUND_OFF * abs(one.mu).max()


def test_sites_are_solved_by_themselves_where_bonds_are_asked_for_at_ends_only():
    for rule, alone in ((rectangle, True), (trapezoidal, True), (midpoint, False)):
        assert Scheme(fput(), rule).local is alone


@pytest.mark.slow
@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda r: r.name)
def test_fixed_ends_stay(rule):
    run = Scheme(fput(fixed_ends=True), rule).flow("1/20").trajectory(40)
    assert np.array_equal(run.x[:, [0, -1]], np.broadcast_to(run.x[0, [0, -1]], (41, 2, 1)))
    assert not run.mu[:, [0, -1]].any()
    assert not run.u[:, [0, -1]].any()
    listed = fput("listed", bonds=CHAIN, fixed=(0, N - 1))
    other = Scheme(listed, rule).flow("1/20").trajectory(40)
    assert abs(other.x - run.x).max() < ROUND_OFF


@pytest.mark.parametrize("length", [N, N - 1, 3])
def test_lists_are_shared_and_arrays_have_an_entry_each(length):
    given = list(range(1, length + 1))
    arm = fput(parameters={"arm": given}).split_parameters
    assert (arm["shared"], arm["site"], arm["bond"]) == ({"arm": tuple(given)}, {}, {})
    if length == 3:
        with pytest.raises(BadInput, match=r"arm is an array of 3; .* a shared value is a list"):
            fput(parameters={"arm": np.array(given)})
    else:
        (where,) = (w for w, a in fput(parameters={"arm": np.array(given)})
                    .split_parameters.items() if a)  # fmt: skip
        assert where == {N: "site", N - 1: "bond"}[length]


def test_a_mask_says_which_sites_are_fixed():
    mask = np.arange(N) % 2 == 0
    assert np.array_equal(fput(fixed=mask).free, ~mask)


@pytest.mark.dear("bead_chain")
@pytest.mark.parametrize(
    ("make", "rule"), [(fput, trapezoidal), (fput, midpoint), (linkages.rods, trapezoidal),
                       (systems.bead_chain, midpoint)],
)  # fmt: skip
def test_rows_do_not_change_a_run_which_goes_on_from_any_of_them_and_back(make, rule):
    scheme = Scheme(make(), rule)
    flow, most = scheme.flow("1/50"), 1e-12 if scheme.lattice.contact else ROUND_OFF
    run, few = flow.trajectory(40), flow.trajectory(40, 10)
    for word in ("x", "u", "mu", "multipliers"):
        assert np.array_equal(getattr(run, word)[::10], getattr(few, word)), word
    rest = flow.trajectory(20, x0=run.x[20], mu0=run.mu[20])
    assert abs(rest.x - run.x[20:]).max() < most and abs(rest.mu - run.mu[20:]).max() < most
    if not scheme.lattice.contact:  # these rules are self-adjoint
        back = scheme.flow("-1/50").trajectory(40, 40, x0=run.x[-1], mu0=run.mu[-1])
        assert abs(back.x[-1] - run.x[0]).max() < most
        assert abs(back.mu[-1] - run.mu[0]).max() < most


def test_blocks_hold_the_rows_of_a_run():
    flow = Scheme(systems.rotors(5), midpoint).flow("1/20")
    run, blocks = flow.trajectory(11, 2), list(flow.blocks(11, 2, size=4))
    assert [len(block.t) for block in blocks] == [4, 2]
    for word in ("t", "x", "u", "mu"):
        parts = [getattr(block, word) for block in blocks]
        assert np.array_equal(np.concatenate(parts), getattr(run, word)), word
    with pytest.raises(BadInput, match="size"):
        next(flow.blocks(3, size=0))


def test_a_block_that_fails_has_its_rows():
    edge = Lattice("edge", pair(1), 3, {}, lambda x, v, p: v[0] ** 2 / 2,
                   lambda x, y, p: -((x[0] - y[0]) ** 6), x0=[[1.0], [-1.0], [1.0]],
                   v0=np.zeros((3, 1)))  # fmt: skip
    flow = Scheme(edge, trapezoidal).flow(1)
    with np.errstate(all="ignore"):
        with pytest.raises(StepFailure) as told:
            list(flow.blocks(40, size=3))
        with pytest.raises(StepFailure) as whole:
            flow.trajectory(40)
    rows, wanted = told.value.trajectory, whole.value.trajectory
    first = len(wanted.t) - len(rows.t)
    assert first % 3 == 0 and np.array_equal(rows.x, wanted.x[first:])
    assert np.array_equal(rows.t, wanted.t[first:])


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
        ({"x0": np.zeros(N)}, r"x0 has the shape \(5,\); give one row per site, \(5, 1\)"),
        ({"v0": np.zeros((N, 2))}, "v0 has the shape"),
        ({"v0": None}, "v0"),
        ({"x0": np.full((N, 1), np.nan)}, "not finite"),
        ({"parameters": {"mass": np.ones(N + 1)}}, "array of 6; give 5 entries, one per site"),
        ({"sites": 1}, "whole number from 2"),
        ({"sites": 999_999_999}, "v0 has the shape .* one row per site"),
        ({"parameters": {"__class__": 1}}, "'__class__' begins with __"),
        ({"on_bond": None}, "on_bond= is None"),
        ({"fixed": [N]}, "fixed names the site 5"),
        ({"bonds": "ring", "fixed_ends": True}, "only a chain has ends"),
        ({"fixed": [True, False]}, "fixed holds True or False; give numbers of sites, or one"),
        ({"fixed": [3, True]}, "fixed holds True or False"),
        ({"x0": np.full((N, 1), 1 + 1j)}, "x0 holds complex numbers; give real ones"),
        ({"parameters": {"lambda": 1}}, "'lambda' is a word of Python's"),
        ({"site": lie_group(so(3)), "on_site": 1}, "on_site= is 1"),
        ({"on_site": None}, "on_site= is None"),
        ({"symmetries": {"turn": 1}}, "give a dictionary of functions ξ"),
        (
            {"on_bond": lambda x, y, v, w, p: v[0] * w[0], "constraint": lambda x, y, p: [x[0]]},
            "constraints and velocities in bonds, which no step takes together",
        ),
    ],
    ids=lambda given: given if isinstance(given, str) else ", ".join(given),
)
def test_bad_input_is_told_in_a_sentence(changes, said):
    with pytest.raises(BadInput, match=said) as told:
        replace(fput(), **changes)
    assert "\n" not in str(told.value)


def test_too_many_sites_are_told(monkeypatch):
    def full(*_):
        raise MemoryError

    monkeypatch.setattr("discmech.integrators.extensions.lattices.lattice.floats", full)
    with pytest.raises(BadInput, match="5 sites do not fit into memory; give fewer"):
        fput()


def test_what_a_lattice_cannot_do_is_told():
    with pytest.raises(BadInput, match="one-step map"):
        Scheme(fput(), MAPS["implicit-midpoint"])
    with pytest.raises(BadInput, match="step is 0"):
        Scheme(fput(), midpoint).flow(0)
    with pytest.raises(BadInput, match="x0 is no array of numbers"):
        Scheme(fput(), midpoint).flow("1/20").trajectory(1, x0="a")
    with pytest.raises(BadInput, match="mu0 must be of the shape"):
        Scheme(fput(), midpoint).flow("1/20").trajectory(1, mu0=np.zeros(3))
    without = fput(on_site=lambda x, v, p: -(x[0] ** 2) * p.mass)
    with pytest.raises(BadInput, match="kinetic"):
        Scheme(without, midpoint)

    for on_bond in (lambda x, y, p: float("nan"), lambda x, y, p: x[0] / Integer(0)):
        with pytest.raises(BadInput, match="a bond of fput: on_bond is not finite and real"):
            Scheme(fput(on_bond=on_bond), midpoint)
    with pytest.raises(BadInput, match="fput: on_site is not finite and real"):
        Scheme(fput(on_site=lambda x, v, p: v[0] ** 2 + float("inf")), midpoint)

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
