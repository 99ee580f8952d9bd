"""What a study asks of a system: a scene, a lattice and another's integrator answer alike."""

import numpy as np
import pytest

from discmech.integrators import rules
from discmech.studies.core import lookup
from discmech.studies.core.case import Case, silent
from discmech.studies.core.parts import SMOOTH, parts_of, why_not
from discmech.studies.systems import system_of
from tests.studies.programs.methods import verlet


@pytest.mark.parametrize(
    ("name", "rule"),
    [("pendulum", rules.midpoint), ("pendulum", verlet), ("toda", rules.midpoint)],
    ids=["scene", "program", "lattice"],
)  # fmt: skip
def test_every_system_answers(name, rule):
    scene = lookup.scene_given(name)
    assert parts_of(scene) >= SMOOTH
    system = system_of(Case("order", scene, rule, 16, 40))
    assert system.steps_for(scene.step) >= 100
    flow, end = system.flow(scene.step), system.end(scene.step, 30)
    run = flow.trajectory(1)
    assert 0 < system.error(run.x[1], run.mu[1], end)[0] < 0.01 and end.certain > 12
    assert system.error(end.x, end.mu, end)[0] == 0
    values, terms = system.energy(run)
    assert values.shape == terms.shape == (2,) and (abs(values) <= terms).all()
    along = system.long_run(40, silent)
    assert np.isclose(along.t[-1], 40 * float(scene.step)) and not system.energy_changes
    errors = system.energy_errors(along)
    assert errors[0] == 0 and 0 < abs(errors).max() < 0.1
    if rule is rules.midpoint:
        taken = run.x[1], run.mu[1]
        assert system.form_defect(flow, run.x[0], run.mu[0], run.u[0]) < 1e-13
        assert system.step_defects(flow, run.x[0], run.mu[0], taken, run.u[0])["residual"] < 1e-14


def test_what_a_system_lacks_is_said_in_a_sentence():
    beam = system_of(Case("order", lookup.scene_given("beam"), rules.trapezoidal, 16))
    assert "--thorough" in beam.lacks["form_defect"]
    assert parts_of(lookup.scene_given("bouncing-ball")) == {"contact"}
    assert why_not(lookup.scene_given("bead-chain")) == "is a lattice with contact"
