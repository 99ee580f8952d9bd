"""The power of the bench: faults are caught, equivalents proved, and valid rules let through."""

from __future__ import annotations

import json
import random

import pytest
import sympy

from integrators.identities import first_violation
from studies.command import main
from studies.power.catalogue import everything
from studies.power.equivalents import proof
from studies.power.faults import NoPlace
from studies.power.measuring import of_fault, of_rule
from studies.power.operators import OPERATORS
from studies.power.sites import faulty_scheme, sound_scheme

CATALOGUE = everything()


def index(words):
    found = [i for i, fault in enumerate(CATALOGUE) if words in fault.name]
    assert len(found) == 1, [CATALOGUE[i].name for i in found]
    return found[0]


#: one of each site, and what has to say no
CAUGHT = {
    "pendulum midpoint: rule, double #0": "order 50",
    "pendulum trapezoidal: fraction, half #0": "order 50",
    "pendulum midpoint: groupoid.target, times h #0": "refused",
    "pendulum midpoint: equation.plus_at_points, sign #0": "symplecticity 50",
    "pendulum midpoint: equation.gain_at_points, factor 1.01 #0": "symplecticity 16",
    "pendulum midpoint: solver, Newton stops at the root of round-off": "symplecticity 50",
    "pendulum midpoint: solver, damped residual": "symplecticity 16",
    "rigid-body midpoint: groupoid.R, [so3-square]": "momentum 16",
    "pendulum triple-jump:trapezoidal: coefficients, the tenth digit": "order 50",
}


@pytest.mark.parametrize(("words", "study"), [
    pytest.param(*item, marks=pytest.mark.slow if item[0].startswith("rigid") else ())
    for item in CAUGHT.items()
])  # fmt: skip
def test_a_fault_is_caught_by_the_study_that_is_there_for_it(words, study):
    found = of_fault(index(words))
    assert study in found["caught"], found["found"]
    assert not found["equivalent"]


def test_an_equivalent_is_proved_and_nothing_else_is():
    assert "Newton's matrix" in proof(
        CATALOGUE[index("pendulum midpoint: equation.slope_at_points, times h #0")]
    )
    assert "-1 times" in proof(CATALOGUE[index("rigid-body midpoint: form.omega, [omega-sign]")])
    assert "−s" in proof(CATALOGUE[index("pendulum lobatto-3: path, sign #0")])
    for words in (
        "pendulum gauss-2: path, sign #0",
        "rigid-body midpoint: form.omega, [FL-transposed]",
        "pendulum midpoint: rule, sign #0",
        "pendulum midpoint: equation.gain_at_points, sign #0",
    ):
        assert proof(CATALOGUE[index(words)]) == ""


def test_names_are_unique_and_every_site_is_there():
    names = [fault.name for fault in CATALOGUE]
    assert len(set(names)) == len(names)
    assert {fault.site.split(".")[0] for fault in CATALOGUE} == {
        "rule", "fraction", "path", "velocity", "rate", "groupoid", "retraction", "equation",
        "coefficients", "solver", "form",
    }  # fmt: skip


@pytest.mark.parametrize("name", OPERATORS)
def test_an_operator_changes_what_it_is_given_or_says_that_it_cannot(name):
    x, y, h = sympy.symbols("x_0 x_1 h")
    given = sympy.Matrix([[h * x**2 + y, h * y], [sympy.sin(x) * h, 1 + h**2 * x * y]])
    changed = OPERATORS[name](given, random.Random(1), h)
    assert changed.shape == given.shape
    assert first_violation(changed - given) is not None
    assert OPERATORS[name](sympy.zeros(1, 1), random.Random(1), h) is None


def test_a_fault_that_changes_nothing_is_none():
    """On a group there is no point whose fraction could be wrong."""
    fault = CATALOGUE[index("rigid-body midpoint: fraction, half #0")]
    with pytest.raises(NoPlace):
        faulty_scheme(fault)
    assert of_fault(index(fault.name)) is None


def test_the_sound_scheme_is_left_alone():
    fault = CATALOGUE[index("pendulum midpoint: equation.minus_at_points, sign #0")]
    before = sound_scheme(fault).minus_at_points.copy()
    assert faulty_scheme(fault).minus_at_points != before
    assert sound_scheme(fault).minus_at_points == before


@pytest.mark.parametrize("seed", range(4))
def test_a_valid_rule_is_let_through(seed):
    found = of_rule(seed)
    assert not found["caught"], found["found"]


def test_the_command(tmp_path):
    file = tmp_path / "power.json"
    assert (
        main(
            [
                "power",
                "--only",
                "rigid-body midpoint: form.omega, [",
                "--jobs",
                "1",
                "--json",
                str(file),
            ]
        )
        == 0
    )
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["faults"] == 2 and found["equivalent"] == 1 and found["survivors"] == []
    assert main(["power", "--only", "no such fault"]) == 2


@pytest.mark.slow
def test_every_fault_is_caught_or_proved_to_be_none():
    found = [result for i in range(len(CATALOGUE)) if (result := of_fault(i)) is not None]
    assert len(found) >= 200
    assert not [f["name"] for f in found if not f["caught"] and not f["equivalent"]]


@pytest.mark.slow
def test_no_valid_rule_is_refused():
    assert not [rule["name"] for seed in range(200) if (rule := of_rule(seed))["caught"]]
