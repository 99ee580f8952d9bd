"""Lattices as they are asked for: by name, from a file, beside other studies."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from typing import ClassVar

import numpy as np
import pytest

from discmech import BadInput, Lattice, Scheme, discretisation, pair
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies import Study, check, get, system_of
from discmech.studies.command.entry import main
from discmech.studies.core import lookup
from discmech.studies.core.case import Case, Choice, Measurement
from discmech.studies.core.fingerprint import of_case
from discmech.studies.core.result import result_of
from discmech.studies.user.assertions import NotApplicable, assert_reversible
from tests.studies.as_json import run_case

STUDY = get("lattices")


@pytest.mark.slow
def test_what_lattices_lack_other_studies_say(ask):
    for study in ("contact", "optimality", "stability"):
        with pytest.raises(BadInput, match=r"judged by `discmech order`, .*`discmech lattices`"):
            check(study, ["fput"], ["midpoint"], [16], 20)
    found = check("energy", ["fput", "harmonic"], ["midpoint"], [16], 200)
    assert [c["scene"] for c in found["cases"]] == ["harmonic", "fput"]
    found = check("stability", ["fput", "harmonic"], ["midpoint"], [16])
    assert [c["scene"] for c in found["cases"]] == ["harmonic"]
    assert any("judged by `discmech order`" in note for note in found["notes"])
    with pytest.raises(BadInput, match="it needs a lattice"):
        check("lattices", ["harmonic"], ["midpoint"])
    assert ask("lattices", "harmonic")[0] == 2
    for study in ("lattices", "order"):
        assert "not by one-step maps" in ask(study, "fput", "--rule", "runge-kutta-4")[2]
    assert "are measured in double precision" in ask("lattices", "fput", "--digits", "50")[2]
    note = " ".join(check("order", ["fput", "harmonic"], ["heun"], [16], 16)["notes"])
    assert "fput: lattices run by rules" in note
    code, _, err = ask("explain", "fput", "midpoint")
    assert code == 2 and "fput is a lattice" in err
    assert "fput" in ask("lattices", "fputt")[2]


def test_controls_by_name():
    (found,) = STUDY.cases(Choice(own=(("control", ("flipped bracket",)),)))
    assert (found.scene.name, found.control) == ("bodies", "flipped bracket")
    with pytest.raises(BadInput, match="bodies"):
        STUDY.cases(Choice(scenes=(lookup.scene_given("fput"),),
                           own=(("control", ("flipped bracket",)),)))  # fmt: skip


MINE = """
import json
from typing import ClassVar

import numpy as np
from discmech import Lattice, pair

chain = Lattice("springs", pair(1), 12, {{"k": {k}}}, lambda x, v, p: v[0] ** 2 / 2,
                lambda x, y, p: -p.k * (y[0] - x[0]) ** 2 / 2,
                x0=np.sin(np.arange(12.0))[:, None], v0=np.zeros((12, 1)), fixed_ends=True,
                step="1/20")
"""


def test_a_lattice_of_one_s_own_is_judged_by_its_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE.format(k=1))
    (tmp_path / "stiff.py").write_text(MINE.format(k="np.linspace(1, 2, 11)"))
    words = ["mine.py:chain", "--rule", "midpoint", "--steps", "100"]
    assert main(["lattices", *words]) == 0
    assert "springs" in capsys.readouterr().out
    asked = [Case("lattices", lookup.scene_given(f"{name}.py:springs"), rules.get("midpoint"), 16)
             for name in ("mine", "stiff")]  # fmt: skip
    assert len({of_case(STUDY, c, timed=False) for c in asked}) == 2
    assert asked[0].command == "discmech lattices mine.py:springs --rule midpoint --digits 16"
    assert main(["verify", "mine.py", "--study", "order", "--study", "lattices"]) == 0
    said = capsys.readouterr().out
    assert "order: springs, midpoint" in said and "lattices: springs, midpoint" in said


@pytest.mark.parametrize(("part", "words"), [("1/2", None), ("1/3", "lies at 1/3 of the step")])
def test_a_low_order_on_a_lattice_has_the_cause_of_two_of_its_sites(part, words):
    @discretisation(order=2)
    def shifted(L, G, x, u, h):
        return h * L(G.target(x, u, Fraction(part) * h), u)

    told = get("order").diagnose(Case("order", systems.toda(), shifted, 16), Measurement({}))
    assert told is None if words is None else words in told["sentence"]


def test_what_is_wanted_of_a_lattice_with_a_force_is_what_was_measured():
    """Under a force variations have no law on patches."""
    rubbed = replace(systems.fput(4), name="rubbed", force=lambda x, v, p: [-v[0] / 9])
    found = run_case(STUDY, Case("lattices", rubbed, rules.get("midpoint"), 16, 50))
    assert found["verdict"] == "pass", found["reason"]
    assert STUDY.view.wanted(result_of("lattices", found)) == "residual ≤ 7.1×10⁻¹⁵"


@pytest.mark.slow
def test_arrays_of_a_lattice_are_in_its_fingerprint():
    def chain(mass):
        return Lattice("springs", pair(1), 3, {"m": mass}, lambda x, v, p: p.m * v[0] ** 2 / 2,
                       lambda x, y, p: -((y[0] - x[0]) ** 2), x0=np.zeros((3, 1)),
                       v0=np.ones((3, 1)))  # fmt: skip

    masses = (np.ones(3), np.array([1, 1, 2.0]), 1, 2)
    keys = {of_case(STUDY, Case("lattices", chain(m), rules.get("midpoint"), 16), timed=False)
            for m in masses}  # fmt: skip
    assert len(keys) == len(masses)


def test_a_lattice_and_a_problem_of_control_run_as_a_scene_does(ask):
    code, out, _ = ask("run", "toda", "--rule", "midpoint", "--steps", "4", "--json", "-")
    found = json.loads(out)
    run = Scheme(systems.get("toda"), rules.get("midpoint")).flow(systems.get("toda").step)
    assert code == 0 and found["x"] == run.trajectory(4).x.tolist()
    assert 0 < found["energy_error"] < 1e-2
    assert ask("run", "toda", "--on-edge", "bisect")[0] == 2
    steered, solved = (ask(word, "oscillator", "--steps", "9", "--json", "-")[1]
                       for word in ("run", "control"))  # fmt: skip
    assert json.loads(steered)["cost"] == json.loads(solved)["cost"]
    free = json.loads(ask("run", "oscillator", "--step", "1/9", "--steps", "3", "--json", "-")[1])
    assert free["steps"] == 3 and "cost" not in free


class Spread(Study):
    """A study of a user's, of whatever has an energy."""

    name, title, asks_for = "spread", "Spread of the energy", "energy"
    limits: ClassVar = {"spread": 0.1}

    def measure(self, case, progress):
        system = system_of(case)
        values, terms = system.energy(system.flow(case.scene.step).trajectory(50))
        return {"measured": {"spread": np.ptp(values) / terms.max()}}


def test_a_study_of_one_s_own_measures_lattices_as_scenes():
    found = check(Spread(), ["toda", "kepler"], ["midpoint"])
    assert {c["scene"]: c["verdict"] for c in found["cases"]} == {"toda": "pass", "kepler": "pass"}


def test_an_assertion_of_what_a_lattice_lacks_says_so():
    with pytest.raises(NotApplicable, match="not by reversibility"):
        assert_reversible("midpoint", systems.get("toda"))
