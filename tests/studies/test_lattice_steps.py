"""Single steps of whole lattices: each site and bond is judged by what runs ask of the rule."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import Lattice, Scheme, discretisation, pair
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies import check
from discmech.studies.core.case import Case
from discmech.studies.evidence import evidence_of
from discmech.studies.evidence.of_lattices import MOST, sample_of
from discmech.studies.symplecticity.measuring import measure

HALF, OFF = sympy.Rational(1, 2), sympy.Rational(1, 10**6)
N = 12
MASS = np.where(np.arange(N) == 7, 2.0, 1.0)
#: beads of one mass, but for one
CHAIN = Lattice(
    "odd-one", pair(1), N, {"mass": MASS},
    on_site=lambda x, v, p: p.mass * v[0] ** 2 / 2 - sympy.sin(x[0]) ** 2 / 2,
    on_bond=lambda x, y, p: -((y[0] - x[0]) ** 2) / 2 - (y[0] - x[0]) ** 4 / 4,
    x0=0.7 * np.sin(1.3 * np.arange(N))[:, None], v0=0.3 * np.cos(2.1 * np.arange(N))[:, None],
)  # fmt: skip


def beside(where):
    """The midpoint rule with its point beside the middle by 10⁻⁶ of the step in some calls."""

    @discretisation(order=2)
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, h * (HALF + OFF * where(L, x))), u)

    return rule


WRONG = {
    "sites": lambda L, x: int(len(x) == 1),
    "bonds": lambda L, x: int(len(x) == 2),
    "one site": lambda L, x: L.parameters.mass - 1 if len(x) == 1 else 0,
    "one place": lambda L, x: sum(sympy.exp(-100 * (z + HALF) ** 2) for z in x),
}


@pytest.mark.dear("one")
@pytest.mark.parametrize("where", WRONG)
def test_a_rule_that_is_wrong_in_some_of_its_calls_is_of_order_1(where):
    found = evidence_of(Scheme(CHAIN, beside(WRONG[where]))).order
    assert found.order == pytest.approx(1, abs=1e-3)
    assert "of site" in found.component
    if where == "one site":
        assert found.component.endswith("site 7")


@pytest.mark.parametrize(
    "name", [pytest.param(e, marks=() if e in ("fput", "rotors") else pytest.mark.slow)
             for e in systems.NAMES],
)  # fmt: skip
@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["midpoint", "trapezoidal", "gauss-2", "triple-jump:rectangle"])
def test_every_lattice_has_the_order_of_the_rule_at_every_site(name, rule):
    lattice = systems.get(name)
    if lattice.constraint is not None and rule == "gauss-2":
        pytest.skip("rules with stages do not meet constraints")
    scheme = Scheme(lattice, rules.get(rule))
    found = evidence_of(scheme).order
    assert found.order == pytest.approx(scheme.order, abs=0.02)


def test_of_many_sites_those_of_each_kind_are_taken_with_their_neighbours():
    mass, stiff = np.ones(5000), np.ones(4999)
    mass[3210], stiff[1234] = 2, 3
    chain = replace(
        CHAIN, sites=5000, parameters={"mass": mass, "stiff": stiff}, fixed=[17],
        on_bond=lambda x, y, p: -p.stiff * (y[0] - x[0]) ** 2 / 2,
        x0=np.zeros((5000, 1)), v0=np.ones((5000, 1)),
    )  # fmt: skip
    sample, sites = sample_of(chain, 1)
    assert len(sites) == sample.sites <= MOST
    assert {0, 1, 16, 17, 18, 1233, 1234, 1235, 3209, 3210, 3211, 4998, 4999} <= {*sites}
    given = sample.split_parameters
    assert given["site"]["mass"][sites.index(3210)] == 2 and 3 in given["bond"]["stiff"]
    free = {site for site, free in zip(sites, sample.free, strict=True) if free}
    assert {0, 1234, 3210, 4999} <= free and not {17, 3209, 3211} & free
    assert evidence_of(Scheme(chain, rules.midpoint)).order.order == pytest.approx(2, abs=1e-3)


def test_arrays_of_sites_and_bonds_at_once_are_so_in_a_sample():
    ring = replace(
        CHAIN, sites=200, bonds="ring", parameters={"mass": np.where(np.arange(200) == 70, 2, 1.0)},
        x0=np.zeros((200, 1)), v0=np.ones((200, 1)),
    )  # fmt: skip
    sample, sites = sample_of(ring, 1)
    assert len(sample.pairs) == sample.sites >= len(sites) and 70 in sites
    found = evidence_of(Scheme(ring, beside(WRONG["one site"]))).order
    assert found.order == pytest.approx(1, abs=1e-3) and found.component.endswith("of site 70")


@pytest.mark.dear("midpoint")
@pytest.mark.parametrize("rule", ["triple-jump:midpoint", "triple-jump:rectangle"])
def test_the_substeps_of_a_composition_keep_the_form_and_are_those_of_the_equations(rule):
    case = Case("symplecticity", CHAIN, rules.get(rule), 16, 20)
    defects = measure(case).measured
    assert 0 < defects["poisson"] < 1e-15 and 0 < defects["residual"] < 1e-14


def test_a_short_time_in_which_a_rule_is_wrong_is_seen():
    driven = replace(
        CHAIN, parameters={"mass": 1}, duration=8,
        on_site=lambda x, v, p, t: v[0] ** 2 / 2 - (1 + sympy.sin(3 * t) / 3) * x[0] ** 2 / 2,
    )  # fmt: skip

    @discretisation(order=2)
    def late(L, G, x, u, h):
        off = sympy.exp(-((100 * x[-1] - 530) ** 2)) / 100
        return h * L(G.target(x, u, h * (HALF + off)), u)

    found = evidence_of(Scheme(driven, late)).order
    assert found.order == pytest.approx(1, abs=1e-3) and abs(found.place.t - 5.3) < 0.05
    assert evidence_of(Scheme(driven, rules.midpoint)).order.order == pytest.approx(2, abs=1e-3)


def test_a_hub_is_no_part_of_a_sample_and_stays():
    hub = replace(
        CHAIN, sites=200, bonds=[(0, i) for i in range(1, 200)], parameters={"mass": 1},
        x0=np.zeros((200, 1)), v0=np.ones((200, 1)),
    )  # fmt: skip
    sample, sites = sample_of(hub, 1)
    assert 0 in sites and not sample.free[sites.index(0)] and len(sites) > 50
    middle = replace(hub, bonds=[(100, i) for i in range(200) if i != 100])
    assert len(sample_of(middle, 1)[1]) > 50
    assert evidence_of(Scheme(hub, rules.midpoint)).order.order == pytest.approx(2, abs=1e-3)


def test_rods_that_are_straight_have_a_sample():
    rods = Lattice(
        "rods-in-a-row", pair(2), 60, on_site=lambda x, v, p: v.dot(v) / 2 - x[1],
        constraint=lambda x, y, p: [((y - x).dot(y - x) - 1) / 2], fixed=[0],
        x0=np.c_[np.arange(60.0), np.zeros(60)], v0=np.zeros((60, 2)),
    )  # fmt: skip
    assert Scheme(sample_of(rods, 1)[0], rules.midpoint).order == 2


def test_a_site_between_sites_that_stay_is_judged():
    alone = replace(CHAIN, fixed=[k for k in range(N) if k != 5], parameters={"mass": 1})
    assert evidence_of(Scheme(alone, rules.midpoint)).order.order == pytest.approx(2, abs=1e-3)
    found = evidence_of(Scheme(alone, beside(lambda L, x: 1))).order
    assert found.order == pytest.approx(1, abs=1e-3) and found.component.endswith("of site 5")


def test_a_contact_is_left_out_and_the_rest_is_judged():
    table = replace(CHAIN, contact=lambda x, p: [x[0] + 2], restitution="1/2")
    assert evidence_of(Scheme(table, beside(WRONG["sites"]))).order.order == pytest.approx(
        1, abs=1e-3
    )


def test_a_momentum_that_no_fault_moves_is_no_pass():
    for xi, verdict in ((0, "inconclusive"), (1, "pass")):
        free = replace(
            CHAIN, on_site=lambda x, v, p: p.mass * v[0] ** 2 / 2,
            symmetries={"shift": lambda x, p, xi=xi: [xi]},
        )  # fmt: skip
        found = check("momentum", [free], [rules.midpoint], steps=100)
        assert found["verdict"] == verdict
        assert ("nothing could fail" in str(found)) == (xi == 0)
