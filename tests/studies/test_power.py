"""The power of the bench: faults are caught, equivalents proved, and valid rules let through."""

import json
import random
from dataclasses import replace
from types import SimpleNamespace

import pytest
import sympy

from discmech.integrators.compiler.module_text import driver_text
from discmech.integrators.numbers import first_violation, vanishes_as
from discmech.studies.command.entry import main
from discmech.studies.core.case import Choice, worst
from discmech.studies.report.page import lone_page
from discmech.tests.bench.power import STUDY, measuring
from discmech.tests.bench.power.catalogue import SOLVER, STAGED, everything
from discmech.tests.bench.power.equivalents import proof
from discmech.tests.bench.power.faults import Fault, NoPlace
from discmech.tests.bench.power.judging import judge_told
from discmech.tests.bench.power.measuring import RULES, candidate, sampled, valid_rule
from discmech.tests.bench.power.operators import OPERATORS
from discmech.tests.bench.power.sites import faulty_scheme, sound_scheme
from discmech.tests.bench.power.valid import KINDS, random_rule
from tests.studies.as_json import read, run_case

CATALOGUE = everything()


def of_fault(fault):
    """The result of a fault; None where there is none."""
    found = run_case(STUDY, candidate(fault))
    return {**found["measured"], "found": found["rows"]} if found["rows"] else None


def of_rule(seed):
    """The result of a valid rule."""
    found = run_case(STUDY, valid_rule(seed))
    return {**found["measured"], "found": found["rows"]}


def named(words, catalogue=CATALOGUE):
    (found,) = [fault for fault in catalogue if fault.name == words]
    return found


#: one of each site, and what has to say no
CAUGHT = {
    "pendulum midpoint: rule, double #0": "order 50",
    "pendulum trapezoidal: fraction, half #0": "order 50",
    "pendulum midpoint: groupoid.target, times h #0": "refused",
    "kepler midpoint: rule, index #0": "order 50",
    "pendulum midpoint: equation.plus_at_points, sign #0": "symplecticity 50",
    "pendulum midpoint: equation.gain_at_points, factor 1.01 #0": "symplecticity 16",
    "pendulum midpoint: solver, Newton stops at the root of round-off": "symplecticity 50",
    "pendulum midpoint: solver, damped residual": "symplecticity 16",
    "rigid-body midpoint: groupoid.R, [so3-square]": "momentum 16",
    "pendulum triple-jump:trapezoidal: coefficients, the tenth digit": "order 50",
    "damped-pendulum midpoint: force, flipped": "symplecticity 16",
    "duffing midpoint: force, at the time of the start": "order 16",
    "knife-edge midpoint: constraint.rows, met at the start": "symplecticity 50",
    "knife-edge trapezoidal: constraint.increment, the sign of the second multiplier": "order 16",
}
SLOW = ("rigid", "duffing", "knife-edge midpoint")


@pytest.mark.dear("knife-edge trapezoidal", "order 50", "symplecticity 16", "off-",
                  "symplecticity 50")  # fmt: skip
@pytest.mark.parametrize(("words", "study"), [
    pytest.param(*item, marks=pytest.mark.slow if item[0].startswith(SLOW) else ())
    for item in CAUGHT.items()
])  # fmt: skip
def test_a_fault_is_caught_by_the_study_that_is_there_for_it(words, study, monkeypatch):
    there = [s for s in measuring.STUDIES if study in (f"{s[0]} {s[1]}", "refused")]
    monkeypatch.setattr(measuring, "STUDIES", there)
    found = of_fault(named(words))
    assert study in found["caught"], found["found"]
    assert not found["equivalent"]


@pytest.mark.slow
@pytest.mark.parametrize("unit", [150, -150])
@pytest.mark.parametrize("words", [
    "pendulum midpoint: equation.gain_at_points, sign #0",
    "heavy-top midpoint: equation.gain_at_points, sign #0",
])  # fmt: skip
def test_a_fault_is_caught_in_any_unit_of_action(words, unit):
    found = of_fault(named(words, everything(unit)))
    assert found["caught"], found["found"]


def test_an_equivalent_is_proved_and_nothing_else_is():
    for words, said in (
        ("pendulum midpoint: equation.slope_at_points, times h #0", "Newton's matrix"),
        ("rigid-body midpoint: form.omega, [omega-sign]", "-1 times"),
        ("heavy-top midpoint: form.poisson_tensor, the bracket's sign", "-1 times"),
        ("pendulum lobatto-3: path, sign #0", "−s"),
        ("heavy-top midpoint: rule, over h #0", "O(h^3)"),  # 4/h in a denominator
        ("rigid-body gauss-2: rule, times h #0", "O(h^5)"),
    ):
        assert said in proof(named(words))
    for words in (
        "pendulum gauss-2: path, sign #0",
        "rigid-body midpoint: form.omega, [FL-transposed]",
        "pendulum midpoint: rule, sign #0",
        "pendulum midpoint: equation.gain_at_points, sign #0",
    ):
        assert proof(named(words)) == ""


@pytest.mark.parametrize("order", range(6))
def test_an_expression_vanishes_as_its_lowest_power_of_h(order):
    h, x = sympy.symbols("h x")
    term = h**3 * (sympy.sin(x) + h / (x + 4 / h))
    large = h * sympy.cos(x) * (1 + h) - h * sympy.cos(x) - h**2 * sympy.cos(x)
    assert vanishes_as(large + term, h, order) is (order <= 3)
    assert vanishes_as(large, h, order) and not vanishes_as(sympy.sin(x / h), h, order + 1)


def test_names_are_unique_and_every_site_is_there():
    names = [fault.name for fault in CATALOGUE]
    assert len(set(names)) == len(names)
    assert {fault.site.split(".")[0] for fault in CATALOGUE} == {
        "rule", "fraction", "path", "velocity", "rate", "groupoid", "retraction", "equation",
        "coefficients", "solver", "form", "force", "constraint",
    }  # fmt: skip


def test_what_a_fault_of_the_solver_changes_stands_in_the_driver():
    """Else the fault would have no place and be left out without a word."""
    text = driver_text()
    for words, (old, new) in SOLVER.items():
        assert old in text and old != new, words
    stale = [f for f in CATALOGUE if f.words in ("stale stages", "a stale velocity")]
    assert {(f.scene, f.rule) for f in stale} == set(STAGED)
    for fault in stale:
        assert fault.operate(text, None) != text


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
    fault = named("rigid-body midpoint: fraction, half #0")
    with pytest.raises(NoPlace):
        faulty_scheme(fault)
    assert of_fault(fault) is None
    (case,) = measuring.cases(Choice(own=(("only", fault.name),)))
    assert run_case(STUDY, case)["rows"] == []  # and so it is left out


def test_the_sound_scheme_is_left_alone():
    fault = named("pendulum midpoint: equation.minus_at_points, sign #0")
    before = sound_scheme(fault).arrows.minus.copy()
    assert faulty_scheme(fault).arrows.minus != before
    assert sound_scheme(fault).arrows.minus == before


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_valid_rule_is_let_through(seed):
    found = of_rule(seed)
    assert not found["caught"], found["found"]


@pytest.mark.slow
def test_of_several_next_arrows_the_runs_own_is_taken(monkeypatch):
    """At its largest stable step Newton does not find one from the arrow before."""
    monkeypatch.setattr(measuring, "STUDIES", [("symplecticity", 16, 24)])
    assert not of_rule(915000014)["caught"]


@pytest.mark.slow
def test_the_command(tmp_path, capsys):
    file = tmp_path / "power.json"
    words = ["power", "--only", "rigid-body midpoint: form.omega, [", "--jobs", "1"]
    assert main([*words, "--json", str(file)]) == 0
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["faults"] == 2 and found["equivalent"] == 1 and found["survivors"] == []
    assert found["command"] == "discmech power --only 'rigid-body midpoint: form.omega, ['"
    caught, equivalent = sorted(found["cases"], key=lambda c: c["measured"]["equivalent"])
    assert caught["measured"]["caught"] and caught["control"] and caught["verdict"] == "pass"
    assert {row["study"] for row in caught["rows"]} >= set(caught["measured"]["caught"])
    assert "-1 times" in equivalent["reason"]
    assert "-1 times" in capsys.readouterr().out
    for said in ("saved as the baseline then (there was none)", ": 2 equal"):
        assert main([*words, "--baseline", "then"]) == 0
        assert said in capsys.readouterr().out
    assert main(["power", "--only", "no such fault"]) == 2
    for word in ("--seed", "--unit"):
        assert main(["power", word, "-999"]) == 2
        assert f"{word} is '-999': give a whole number" in capsys.readouterr().err


def made(name, caught=(), equivalent="", site="rule", command=""):
    """The case of a fault or a rule, by hand."""
    scene, rule = name.split()
    fault = Fault(scene, rule, site, "sign") if site != "valid rule" else None
    case = SimpleNamespace(control=fault and site, digits=16)
    rows = [{"study": k, "verdict": "fail" if k in caught else "pass", "reason": f"{k}!",
             "seconds": 1.0} for k in ("order 50", "energy 16")]  # fmt: skip
    found = {"site": site, "what": "sign #0", "caught": list(caught), "equivalent": equivalent}
    said = judge_told(case, found, rows)
    return {"scene": scene, "rule": rule, "retraction": None, "digits": 16, "seconds": 2.0,
            "command": command or f"discmech power --only '{name}'", "control": fault is not None,
            "verdict": said.verdict, "reason": said.reason, "expected": said.expected,
            "measured": found, "rows": rows, "measured_at": {}}  # fmt: skip


def result(*cases):
    (whole,) = read({
        "schema": 1, "study": "power", "command": "discmech power", "record": {}, "notes": [],
        "verdict": worst(case["verdict"] for case in cases), "cases": list(cases),
    })  # fmt: skip
    return STUDY.completed(whole)


def test_a_survivor_fails_and_so_does_a_false_alarm():
    caught, equal = made("pendulum midpoint", ["order 50"]), made("kepler midpoint", (), "it is")
    valid = made("kepler random-1", site="valid rule")
    assert result(caught, equal, valid).verdict == "pass"
    survivor = result(caught, made("kepler midpoint"), valid)
    assert survivor.more["survivors"] == ["kepler midpoint: rule, sign #0"]
    assert "order 50 pass, energy 16 pass" in survivor.cases[1].reason
    alarm = result(caught, made("kepler random-1", ["energy 16"], site="valid rule"))
    assert alarm.verdict == "fail" and alarm.cases[1].reason == "energy 16: energy 16!"
    assert alarm.more["false_alarms"] == ["kepler random-1"]


def test_commands_have_the_unit_and_the_seed():
    asked = Choice(own=(("unit", -150), ("seed", 3), ("only", "pendulum midpoint: rule, sign")))
    (case,) = measuring.cases(asked)
    name = "'pendulum midpoint: rule, sign #3'"
    assert case.command == f"discmech power --only {name} --unit -150 --seed 3"


@pytest.mark.slow
def test_kernels_of_a_fault_are_left_nowhere(tmp_path, monkeypatch):
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path / "users"))
    monkeypatch.setattr(measuring, "STUDIES", [("energy", 16, 100)])
    asked = (("seed", 3), ("only", "pendulum midpoint: rule, sign"))
    (case,) = measuring.cases(Choice(own=asked))
    assert run_case(STUDY, case)["rows"] and not (tmp_path / "users").exists()


def test_the_tables_say_which_study_caught_what_and_which_did_not():
    faults = [made("a b", ["order 50"]), made("c d", ["order 50", "energy 16"]),
              made("e f", (), "it is"), made("g h", site="groupoid.L")]  # fmt: skip
    by_site, by_study = result(*faults).tables
    assert by_site["lines"] == [["rule", "2", "1", "0"], ["groupoid", "0", "0", "1"],
                                ["all", "2", "1", "1"]]  # fmt: skip
    assert by_study["lines"] == [
        ["energy 16", "1", "0", "1", "0"],
        ["order 50", "2", "1", "0", "0"],
    ]


def test_the_page_has_the_tables_the_command_and_the_survivor_first():
    found = result(made("a b", ["order 50"]), made("c d"), made("e f", (), "it is"),
                   made("g h", site="valid rule"))  # fmt: skip
    page = lone_page([found], [], "discmech power")
    assert "1 of 2 controls was caught" in page  # the equivalent one is none
    assert "no study says no" in page and "Caught by" in page and ">equivalent</b>" in page
    assert "Faults, by the study that caught them" in page
    assert page.index("no study says no") < page.index("it is")


def test_the_sample_has_faults_of_every_site_and_rules_of_every_kind():
    """Every twelfth seed would be of one kind: kinds take turns."""
    sites = [f.site.split(".")[0] for f in CATALOGUE]
    chosen = sampled(range(len(CATALOGUE)), lambda i: sites[i])
    assert {sites[i] for i in chosen} == set(sites) and len(chosen) < len(sites) / 8
    kinds = [random_rule(seed).name.rpartition("-")[0] for seed in range(RULES)]
    some = sampled(range(RULES), lambda seed: kinds[seed])
    assert {kinds[seed] for seed in some} == set(KINDS) and len(some) == 3 * len(KINDS)
    assert some == sampled(range(RULES), lambda seed: kinds[seed])
    assert some != sampled(range(RULES), lambda seed: kinds[seed], 1)


def test_another_seed_has_other_places_and_other_rules():
    x = sympy.Matrix(sympy.symbols("x_:9"))
    h = sympy.Symbol("h")
    signed = [f for f in CATALOGUE if f.operator == "sign"]
    places = {seed: [replace(f, seed=seed).changed(x, h) for f in signed] for seed in (0, 1)}
    assert len({tuple(p) for p in places[0]}) > 1 and places[0] != places[1]
    for seed in (0, 1, 20261123):
        chosen = (("thorough", True), ("only", "valid rule"), ("seed", seed))
        asked = measuring.cases(Choice(own=chosen))
        assert [case.number for case in asked] == list(range(200 * seed, 200 * seed + 200))
        assert not any(case.fault for case in asked)
    names = {f.name for f in everything(0, 7)}
    assert not names & {f.name for f in CATALOGUE if not f.words}
    assert {f.name for f in CATALOGUE if f.words} < names


@pytest.mark.slow
def test_every_fault_is_caught_or_proved_to_be_none():
    found = {f.name: result for f in CATALOGUE if (result := of_fault(f)) is not None}
    assert len(found) >= 200
    assert not [name for name, f in found.items() if not f["caught"] and not f["equivalent"]]


@pytest.mark.slow
def test_no_valid_rule_is_refused():
    assert not [seed for seed in range(200) if of_rule(seed)["caught"]]
