"""Faults of a lattice's own machinery, which its scene does not share, are seen by studies."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import Lattice, midpoint, pair, trapezoidal
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import lattice_equations
from discmech.integrators.extensions.lattices.lattice_equations import LatticeEquations
from discmech.integrators.groupoids import clock
from discmech.studies import get
from discmech.studies.core.case import Case, Choice
from tests.integrators.extensions.lattices.test_lattices import fput
from tests.laws.test_lattices_as_scenes import CHAINS
from tests.studies.as_json import run_case

KICKS, FORCE = LatticeEquations._kicks, lattice_equations._force_of


def twice(s):
    """The force of a bond, counted twice."""
    once = FORCE(s)
    graph = once[0].graph
    return graph.plus(once, graph.column(s.force))


def at_the_start(self, name, s, force, own):
    """The forces at the end of a step, at the time of its start."""
    kicks = KICKS(self, name, s, force, own)
    graph = kicks.plus[0].graph
    t, h = graph.letters([clock(), s.h])
    plus = graph.rebuilt(kicks.plus, {t.index: t - h})
    others = graph.minus(kicks.whole, kicks.plus)
    return replace(kicks, plus=plus, whole=graph.plus(others, plus))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "place", "word", "fault"), [
    ("following", lattice_equations, "_force_of", twice),
    ("driven", LatticeEquations, "_kicks", at_the_start)])  # fmt: skip
@pytest.mark.parametrize("digits", [16, pytest.param(50, marks=pytest.mark.slow)])
def test_a_fault_of_the_machinery_is_seen(monkeypatch, name, place, word, fault, digits):
    study = get("order")
    sound = Case("order", fput(name, step="1/10", **CHAINS[name]), trapezoidal, digits)
    assert run_case(study, sound)["verdict"] == "pass"
    monkeypatch.setattr(place, word, fault)
    wrong = Case("order", fput(name, step="1/10", **CHAINS[name]), trapezoidal, digits)
    assert run_case(study, wrong)["verdict"] == "fail"


def damper(off=0):
    """A bond's friction, whose impulse at its second end is too small by a share."""
    return {"bond_force": lambda x, y, v, w, p: [
        (w[0] - v[0]) / 9, (1 - sympy.Rational(off)) * (v[0] - w[0]) / 9]}  # fmt: skip


def drag(off=0):
    """A friction of each site, which is too large by a share."""
    return {"force": lambda x, v, p: [-(v[0] + v[0] ** 3 / 9) * (1 + sympy.Rational(off)) / 7]}


def damped(**forces):
    given = {"on_bond": lambda x, y, p: -((y[0] - x[0]) ** 2) / 2 - (y[0] - x[0]) ** 3 / 9,
             "on_site": lambda x, v, p: v[0] ** 2 / 2, "step": "1/10"} | forces  # fmt: skip
    return Lattice("damped", pair(1), 6, x0=np.sin(np.arange(6.0))[:, None],
                   v0=np.cos(np.arange(6.0))[:, None], symmetries={"shift": lambda x, p: [1]},
                   **given)  # fmt: skip


BENT = {"on_site": lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 10**7}
TIMED = {"on_bond": lambda x, y, p, t: -((y[0] - x[0]) ** 2) * (1 + sympy.sin(t) / 3) / 2}


DAMPED = [
    (damper(), None, "pass"), (damper(), damper("1e-6"), "fail"),
    (drag(), None, "pass"), (drag(), drag("1e-6"), "fail"),
    (damper() | drag(), damper("1e-6") | drag(), "fail"), (damper(1) | drag(), None, "pass"),
    (damper() | BENT, None, "fail"), (TIMED, None, "pass"),
]  # fmt: skip


@pytest.mark.parametrize(("rule", "forces", "taken", "verdict"), [
    *((rule, *row) for rule in ("midpoint", "trapezoidal") for row in DAMPED),
    *(pytest.param(rule, *row, marks=pytest.mark.slow)
      for rule in ("gauss-2", "suzuki:rectangle") for row in DAMPED
      if rule != "gauss-2" or row[1] is None),  # its kernels are made elsewhere
])  # fmt: skip
def test_momenta_change_by_the_work_of_forces(rule, forces, taken, verdict, monkeypatch):
    """taken: the forces that the kernels have, if they are others than the lattice's."""
    if taken is not None:
        honest = LatticeEquations.system.func

        def faulty(self):
            return honest(LatticeEquations(replace(self.lattice, **taken), self.rule))

        monkeypatch.setattr(LatticeEquations, "system", property(faulty))
    case = Case("momentum", damped(**forces), rules.get(rule), 16, 200)
    assert get("momentum").cases(Choice((case.scene,), (case.rule,)))
    found = run_case(get("momentum"), case)
    assert found["verdict"] == verdict, found["reason"]


@pytest.mark.parametrize(("more", "rule", "verdict"), [
    ({}, midpoint, "pass"), (BENT, midpoint, "fail"),
    ({"contact": lambda x, p: [x[0] + 1]}, midpoint, None), (drag(), midpoint, None),
])  # fmt: skip
def test_a_momentum_goes_through_impacts_on_bonds(more, rule, verdict):
    """One that the gaps or a force change is not judged: where impulses act no row tells."""
    balls = replace(damped(**more), on_bond=lambda x, y, p: 0 * x[0], restitution="9/10",
                    bond_contact=lambda x, y, p: [y[0] - x[0] - 1], duration=4, step="1/50",
                    x0=1.05 * np.arange(6.0)[:, None], v0=np.eye(6)[:, :1])  # fmt: skip
    case = Case("momentum", balls, rule, 16)
    if verdict is None:
        assert not get("momentum").cases(Choice((balls,), (rule,)))
        return
    found = run_case(get("momentum"), case)
    assert found["verdict"] == verdict and case.scheme.flow("1/50").trajectory(200).impacts.t.size
