"""A lattice runs as the ordinary scene of the same system, whatever its bonds, sites and rule."""

import numpy as np
import pytest
import sympy

from discmech import midpoint, rectangle, trapezoidal
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.scenes.linkages import linkage, rods
from discmech.integrators.rules import compose, gauss, lobatto
from tests.integrators.extensions.lattices.as_scenes import assert_same, assert_same_in_digits, slow
from tests.integrators.extensions.lattices.test_bodies_as_sites import SITES
from tests.integrators.extensions.lattices.test_bond_constraints import LATTICES
from tests.integrators.extensions.lattices.test_contact_on_sites import (
    balls,
    beads,
    discs,
    in_a_corner,
)
from tests.integrators.extensions.lattices.test_lattices import SCATTERED, STIFF, fput
from tests.objects.rules import two_thirds

SHARED = {"alpha": "1/4", "mass": 2, "stiff": 1}
SCATTERED_STIFF = {"bonds": SCATTERED, "parameters": SHARED | {"stiff": STIFF}}


def moving(x, y, v, w, p):
    """A bond with kinetic energy of the mean velocity of its ends, as in the box scheme."""
    return (v[0] + w[0]) ** 2 / 3 + v[0] * w[0] * x[0] / 9 - (y[0] - x[0]) ** 4 / 4


def drag(x, v, p):
    return [-v[0] / 5 - v[0] ** 3 / 9 + x[0] / 7]


def damper(x, y, v, w, p):
    """A damper whose ends feel different forces, so that an exchange of the two shows."""
    return [(w[0] - v[0]) / 7 + y[0] / 3, (v[0] - w[0]) / 5]


def following(x, y, v, w, p):
    """A force that no potential has, and that is known without velocities."""
    return [p.stiff * y[0] / 3, -x[0] / 5]


def shaken(x, v, p, t):
    return p.mass * (1 + t**2 / 9) * v[0] ** 2 / 2 - x[0] ** 2 / 7 + x[0] * sympy.sin(2 * t)


def stiffening(x, y, p, t):
    return -p.stiff * (1 + sympy.cos(3 * t) / 2) * (y[0] - x[0]) ** 2 / 2


def wind(x, v, p, t):
    return [sympy.sin(t) * x[0] - v[0] / 5]


def growing(x, y, v, w, p, t):
    return [t * (w[0] - v[0]) / 7, (v[0] - w[0]) / 5 + t**2]


TIMED = {"on_site": shaken, "on_bond": stiffening, "force": wind, "bond_force": growing}
CHAINS = {
    "timed": TIMED, "timed list": {**SCATTERED_STIFF, **TIMED},
    "driven": {"on_bond": stiffening, "fixed": [0, 3]},
    "driven ring": {"bonds": "ring", "parameters": SHARED, "on_site": shaken},
    "drag": {"force": drag}, "damper": {"bond_force": damper},
    "damper list": {**SCATTERED_STIFF, "force": drag, "bond_force": damper},
    "following": {"bond_force": following}, "following ring": {
        "bonds": "ring", "parameters": SHARED, "bond_force": following, "force": drag},
    "chain": {}, "ring": {"bonds": "ring", "parameters": SHARED}, "list": SCATTERED_STIFF,
    "two fixed": {"fixed": [0, 3]}, "moving": {"on_bond": moving},
    "moving list": {"on_bond": moving, "bonds": SCATTERED},
}  # fmt: skip
#: (what a lattice is called, lattice, rule): those that are quick, and of the rest what they add
QUICK = [
    *((name, fput(**CHAINS[name]), rule) for name, rule in (
        ("chain", midpoint), ("chain", gauss(3)), ("ring", midpoint), ("list", gauss(3)),
        ("moving", midpoint), ("drag", trapezoidal), ("damper list", midpoint),
        ("driven", trapezoidal), ("timed", midpoint))),
    ("held at both ends", LATTICES["held at both ends"](), midpoint),
    ("plastic contact", beads(0), midpoint), ("elastic contact", beads(1), trapezoidal),
    ("contact on a ring", beads("1/2", bonds="ring"), midpoint),
    ("corner", in_a_corner("1/2"), midpoint), ("balls", balls(), midpoint),
    ("balls that touch", balls(moving=2, slack=0.001, restitution="3/4"), trapezoidal),
]  # fmt: skip
REST = [
    *(("chain", fput(), rule) for rule in (
        trapezoidal, rectangle, two_thirds, compose(trapezoidal, "triple-jump"),
        compose(rectangle, "blanes-moan-4"), compose(midpoint, "suzuki"), gauss(2), lobatto(4),
        gauss(8))),
    *((name, fput(**CHAINS[name]), rule) for name in ("ring", "list")
      for rule in (trapezoidal, gauss(2), lobatto(4))),
    *((name, fput(**CHAINS[name]), rule) for name, rule in (
        ("list", midpoint), ("two fixed", gauss(3)), ("moving", trapezoidal), ("moving", gauss(2)),
        ("moving", rectangle), ("moving list", midpoint))),
    *((name, fput(**CHAINS[name]), rule) for name in (
        "drag", "damper", "following ring", "timed", "timed list", "driven", "driven ring")
      for rule in (rectangle, midpoint, trapezoidal, gauss(3),
                   compose(rectangle, "blanes-moan-4"))),
    ("following", fput(**CHAINS["following"]), trapezoidal),
    *((name, make(), rule) for name, make in SITES.items()
      for rule in (rectangle, trapezoidal, midpoint)),
    *((name, LATTICES[name](), rule) for name, rule in (
        ("tree", trapezoidal), ("rods", trapezoidal), ("ring", midpoint), ("rods", midpoint),
        ("rods", rectangle), ("rods", compose(midpoint, "suzuki")), ("free", trapezoidal),
        ("ring held", trapezoidal), ("tree", midpoint), ("links", trapezoidal),
        ("links", midpoint), ("hinges", trapezoidal))),
    *(("contact", beads(restitution), rule) for restitution in (0, 1)
      for rule in (midpoint, trapezoidal, rectangle, gauss(2), rules.get("triple-jump:midpoint"))),
    ("contact on a list", beads("1/2", bonds=[(0, 1), (4, 1), (1, 3), (2, 4)]), midpoint),
    *(("discs", discs(restitution), midpoint) for restitution in (0, "1/2")),
    ("corner", in_a_corner(0), midpoint),
    *(("balls and walls", balls(
        restitution=e, contact=lambda x, p: [5 - x[0], x[0] + 1], fixed=fixed, slack=0.1,
        parameters={"m": np.array([3.0, 1, 2, 5, 1])},
        on_bond=lambda x, y, p: -((y[0] - x[0] - 1) ** 2) / 9), rule)
      for e in (0, "1/2", 1) for fixed in ((), (4,)) for rule in (midpoint, trapezoidal)),
]  # fmt: skip
CASES = [pytest.param(lattice, rule, id=f"{name}-{rule.name}", marks=marks)
         for cases, marks in ((QUICK, ()), (REST, pytest.mark.slow))
         for name, lattice, rule in cases]  # fmt: skip


@pytest.mark.dear(but=("chain-midpoint",))
@pytest.mark.parametrize(("lattice", "rule"), CASES)
def test_a_lattice_runs_as_its_scene(lattice, rule):
    steps = {"table": 120, "corner": 70, "discs": 70, "balls": 150}.get(lattice.name, 60)
    assert_same(lattice, rule, 30 if lattice.constraint else steps)


IN_DIGITS = [
    ("damper list", fput(**CHAINS["damper list"]), midpoint),
    ("timed", fput(**CHAINS["timed"]), trapezoidal), ("tree", LATTICES["tree"](), trapezoidal),
    ("balls", balls(), midpoint),
]  # fmt: skip


@pytest.mark.dear("tree")
@pytest.mark.parametrize(("lattice", "rule"), [pytest.param(*e[1:], id=e[0]) for e in IN_DIGITS])
def test_a_lattice_runs_as_its_scene_in_any_digits(lattice, rule):
    assert_same_in_digits(lattice, rule)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rule"), [
    *((name, rule) for name in CHAINS
      for rule in (rectangle, midpoint, gauss(3), compose(midpoint, "suzuki"))),
    *((name, rule) for name in SITES for rule in (trapezoidal, midpoint, gauss(2)))])  # fmt: skip
def test_every_lattice_runs_as_its_scene_in_any_digits(name, rule):
    assert_same_in_digits(SITES[name]() if name in SITES else fput(**CHAINS[name]), rule)


@pytest.mark.slow
@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda rule: rule.name)
@pytest.mark.parametrize("lattice", [
    beads("1/2", bonds="ring"), in_a_corner("1/2"), discs("1/2"),
    systems.cradle(4), balls(restitution=0, fixed=[4], contact=lambda x, p: [x[0] + 1]),
    beads(1, on_site=lambda x, v, p, t: (1 + t / 9) * v[0] ** 2 / 2 - (p.g + t) * x[0]),
], ids=lambda lattice: lattice.name)  # fmt: skip
def test_a_lattice_with_contact_runs_as_its_scene_in_any_digits(lattice, rule):
    assert_same_in_digits(lattice, rule, steps=90)


#: every built-in lattice, small
BUILT_IN = {
    "fput": systems.fput(5), "toda": systems.toda(np.sin(np.arange(4.0)), np.cos(np.arange(4.0))),
    "rotors": systems.rotors(4), "breather": systems.breather(8),
    "breather-box": systems.breather(8, box=True), "kink": systems.kink(8),
    "membrane": systems.membrane(3, 4), "bodies": systems.bodies(3), "beam": systems.beam(2),
    "spaghetti": systems.spaghetti(2), "bead-chain": systems.bead_chain(4),
    "cradle": systems.cradle(4, 2), "rods": rods(2), "links-spherical": linkage(1),
    "links-revolute": linkage(1, "revolute"),
}  # fmt: skip
MANY = {"bead-chain": 60, "cradle": 400}  # steps until sites have struck
DEAR = (
    "bodies",
    "toda",
    "kink",
    "membrane",
    "beam",
    "spaghetti",
    "links-spherical",
    "links-revolute",
    "rods",
    "breather-box",
)


def test_every_built_in_lattice_is_in_the_law():
    assert set(BUILT_IN) == set(systems.NAMES)


@pytest.mark.dear(but=("fput",))
@pytest.mark.sampled
@pytest.mark.parametrize("rule", [trapezoidal, midpoint], ids=lambda rule: rule.name)
@pytest.mark.parametrize("name", [slow(e) if e in DEAR else e for e in BUILT_IN])
def test_every_built_in_lattice_runs_as_its_scene(name, rule):
    lattice = BUILT_IN[name]
    if name != "spaghetti":  # two elements of so soft a beam amplify round-off by thousands
        assert_same(lattice, rule, MANY.get(name, 20), lattice.step)
    if not lattice.has_contact:
        assert_same_in_digits(lattice, rule, steps=3, step=lattice.step)
