"""Faults of a lattice's own machinery, which its scene does not share, are seen by studies."""

from dataclasses import replace

import pytest

from discmech import trapezoidal
from discmech.integrators.extensions.lattices import lattice_equations
from discmech.integrators.extensions.lattices.lattice_equations import LatticeEquations
from discmech.integrators.groupoids import clock
from discmech.studies import get
from discmech.studies.core.case import Case
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
