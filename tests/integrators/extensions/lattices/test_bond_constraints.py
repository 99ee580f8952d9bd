"""Bonds with constraints: a lattice of jointed bodies runs as the ordinary constrained scene."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from discmech import Lattice, Scheme, discretisation, midpoint, pair, trapezoidal
from discmech.integrators.errors import BadInput, CannotMeasure, StepFailure
from discmech.integrators.extensions.lattices import DualStep, RestrictedStep
from discmech.integrators.extensions.lattices.scenes import linkages
from discmech.integrators.rules import compose, gauss
from tests.integrators.extensions.lattices.as_scenes import ROUND_OFF

SPRING = {"on_bond": lambda x, y, p: -((x[0] - y[0]) ** 2) / 3}
ROD = {"constraint": lambda x, y, p: [((y - x).dot(y - x) - p.length**2) / 2]}


def masses(name, x0, v0=None, **given):
    """Unit masses on rods of length 1 in the plane."""
    x0 = np.array(x0, dtype=float)
    v0 = np.zeros_like(x0) if v0 is None else np.array(v0, dtype=float)
    own = {"on_site": lambda x, v, p: v.dot(v) / 2 - p.gravity * x[1], **ROD, **given}
    return Lattice(name, pair(2), len(x0), {"length": 1, "gravity": 1}, x0=x0, v0=v0, **own)


HUNG = [[0, 0], [0.6, -0.8], [1.6, -0.8], [2.2, 0]]  # held at both ends
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
TREE = [[0, 0], [0, -1], [-1, -1], [1, -1]]
LATTICES = {
    "rods": lambda: linkages.rods(3),
    "held at both ends": lambda: masses("hung", HUNG, fixed_ends=True, **SPRING),
    "free": lambda: masses("free", HUNG, [[0.3, 0.1]] * 4),
    "ring": lambda: masses("square", SQUARE, [[0.2, 0], [0.2, 0.5], [0, 0.5], [0, 0]],
                           bonds="ring"),
    "tree": lambda: masses("tree", TREE, bonds=[(0, 1), (1, 2), (1, 3)], fixed=[0], **SPRING),
    "ring held": lambda: masses("held", SQUARE, bonds="ring", fixed=[0, 1]),
    "links": lambda: linkages.linkage(2),
    "hinges": lambda: linkages.linkage(2, "revolute"),
}  # fmt: skip


@cache
def scheme(name):
    """A lattice with the trapezoidal rule, derived once."""
    return Scheme(LATTICES[name](), trapezoidal)


LOOSE = [[0, 0], [0.6, -0.8], [1.6, -0.9]]
LENGTHS = [[0, 0], [0.5, 0], [1, 0], [2, 0]]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"x0": LOOSE, "v0": [[0, 0]] * 3, "sites": 3, "fixed_ends": False},
         r"φ of the constraint of bond 1, between the sites 1 and 2, is 0\.005 at the start"),
        ({"v0": [[0, 0], [1, 0], [0, 0], [0, 0]]}, r"A v of the constraint of bond 0.*change v0"),
        ({"constraint": 3}, r"constraint= is 3; give a function of \(x, y, p\)"),
        ({"constraint": lambda x, y, p: x[0] - y[0]}, r"φ of the constraint of bond 0.*is -0\.6"),
        ({"constraint": lambda x, y, p: []}, "must give a list of expressions φ"),
        ({"constraint": lambda x, y, p: [x - y]}, "must give a list of expressions φ"),
        ({"constraint": lambda x, y, p: [p.none]}, "its constraint asks for what is not there"),
        ({"constraint": lambda x, y, p: [p.length - 1]}, "bond 0 restricts no velocity"),
        ({"constraint": lambda x, y, p: 2 * ROD["constraint"](x, y, p)}, "are redundant"),
        ({"x0": [[0, 0], [1, 0], [2, 0], [3, 0]]}, "are redundant: at x0 a row of bond"),
        ({"bonds": [(0, 1), (2, 1), (2, 3)], "fixed_ends": False},
         "site 1 is the second one of 2 bonds with a constraint, and can have one"),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_a_sentence(changes, said):
    with pytest.raises(BadInput, match=said) as told:
        Scheme(replace(LATTICES["held at both ends"](), **changes), trapezoidal)
    assert "\n" not in str(told.value)


@pytest.mark.slow
def test_a_start_of_a_run_that_is_off_is_refused():
    flow = scheme("held at both ends").flow("1/50")
    with pytest.raises(BadInput, match="φ of the constraint of bond 0"):
        flow.trajectory(1, x0=flow.lattice.start[0] * 1.1)
    with pytest.raises(BadInput, match="from momenta that the constraints admit"):
        flow.trajectory(1, mu0=np.ones((4, 2)))


def test_what_constraints_cannot_do_is_told():
    @discretisation()
    def aside(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), 2 * u) / 4

    lattice, flow = scheme("rods").lattice, scheme("rods").flow("1/50")
    with pytest.raises(CannotMeasure, match="has constraints, which are met at points of a str"):
        Scheme(lattice, gauss(2))
    with pytest.raises(CannotMeasure, match="constraints need a rule without stages"):
        Scheme(lattice, aside)
    with pytest.raises(CannotMeasure, match="the form is defined on the vectors that they admit"):
        DualStep(flow, *lattice.start)
    with pytest.raises(CannotMeasure, match="several substeps"):
        RestrictedStep(Scheme(lattice, compose(midpoint, "suzuki")).flow("1/50"), None, None)


@pytest.mark.slow
def test_a_pivot_of_0_is_named_and_a_list_gets_past_it():
    """The mass matrix is indefinite, with zeros on its diagonal."""
    lattice = masses("indefinite", HUNG[:3], constraint=lambda x, y, p: [(y - x).dot(y - x) - 1],
                     on_site=lambda x, v, p: v[0] * v[1] - x[1], fixed=[0])  # fmt: skip
    with pytest.raises(StepFailure, match="pivot is 0 in the fixed order of a chain"):
        Scheme(lattice, trapezoidal).flow("1/50").trajectory(5)
    listed = replace(lattice, bonds=lattice.pairs)
    run = Scheme(listed, trapezoidal).flow("1/50").trajectory(5)
    assert abs((np.diff(run.x, axis=1) ** 2).sum(axis=2) - 1).max() < ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize("bonds", ["chain", [(0, 1)]], ids=str)
def test_a_step_without_a_solution_is_told(bonds):
    """A rod of length 1 cannot span what the second end has moved away by in one step."""
    lattice = masses("torn", [[0, 0], [0, -1]], [[0, 0], [3, 0]], bonds=bonds, fixed=[0])
    with pytest.raises(StepFailure, match=r"torn.*(converge|singular)"):
        Scheme(lattice, trapezoidal).flow(1).trajectory(2)
