"""Programs that turn a body: their single steps are held against the motion with its attitude."""

import runpy

import pytest

from discmech import scenes
from discmech.studies.core.case import Case, scheme_of
from discmech.studies.evidence import evidence_of
from discmech.studies.evidence.order import NEAR
from discmech.studies.momentum.quantities import measured_in
from discmech.studies.momentum.sight import laws_of
from discmech.studies.symplecticity import along_run
from discmech.studies.symplecticity.places import scale_of
from tests.imports import ROOT

from . import methods

BODY = scenes.get("rigid-body")
PROGRAMS = runpy.run_path(str(ROOT / "docs/attacks/attitudes.py"))


@pytest.mark.parametrize(
    "name", ["matrix", "quaternion", pytest.param("lie_midpoint", marks=pytest.mark.slow)]
)
def test_sound_programs_are_of_order_two(name):
    found = evidence_of(scheme_of(BODY, PROGRAMS[name])).order
    assert not found.unknown and found.order > 2 - NEAR


SLOW = ("last", "in_space", "first")


@pytest.mark.parametrize(
    "name", ["fast", "casimir", "long", *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)]
)
def test_a_body_that_turns_wrongly_is_seen(name):
    found = evidence_of(scheme_of(BODY, PROGRAMS[name])).order
    assert found.order < 2 - NEAR and found.component.startswith("x")


def test_quantities_of_the_attitude_are_held_where_it_is_a_part_of_the_state():
    for program, seen in ((PROGRAMS["matrix"], True), (methods.rk4, False)):
        case = Case("momentum", BODY, program, 16)
        quantities = measured_in(case)
        assert ("spatial angular momentum" in {q.name for q in quantities}) == seen
        laws = {law.name for law in laws_of(case.scheme, quantities)}
        assert ("keeps spatial angular momentum" in laws) == seen and "keeps |μ|²" in laws


@pytest.mark.parametrize(("name", "kept"), [
    ("matrix", True), ("lossy", False), pytest.param("quaternion", True, marks=pytest.mark.slow),
    pytest.param("fast", False, marks=pytest.mark.slow),
])  # fmt: skip
def test_the_form_along_a_run_is_that_of_the_attitude_and_its_momentum(name, kept, monkeypatch):
    """A small closed curve moves some entries of R by its square, near to their round-off."""
    monkeypatch.setattr(along_run, "MOST", 2**6)
    case = Case("symplecticity", BODY, PROGRAMS[name], 16)
    found = along_run._of_run(case, scale_of(case.scheme), 0)
    assert found.steps == 64 and found.again < 1e-12
    assert (found.broken == 0 and found.seen == 64) is kept
