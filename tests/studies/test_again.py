"""A command that is printed gives the same verdict for the same reason, or none is printed."""

import json
import shlex
import sys
from dataclasses import replace

import pytest

from discmech import black_box, check, discretisation, external, scenes
from discmech.integrators import rules
from discmech.integrators.extensions.control import scenes as control
from discmech.integrators.extensions.lattices import scenes as lattices
from discmech.integrators.rules import midpoint
from discmech.studies.command.entry import main
from discmech.studies.core import lookup, words
from discmech.studies.core.case import Case, Choice, in_chart
from discmech.studies.core.one_case import run_case
from discmech.studies.core.outcome import without_figures
from discmech.studies.core.result import StudyResult
from discmech.studies.core.shrinking import smallest
from discmech.studies.core.study import every_study
from discmech.studies.report.verdicts import of_schemes, troubles
from discmech.studies.user.checking import _command
from discmech.studies.user.verify import about_scheme
from tests.studies.as_json import read

SMALLER = True
MINE = """
from discmech import black_box, discretisation

@black_box(reversible=True)
def euler(q, p, h, system):
    dq, dp = system.f(q, p)
    return q + h * dq, p + h * dp

def family(w):
    @discretisation(order=2, name=f"at-{w}")
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, h / w), u)
    return rule

RULES = [family(3), family(4)]
"""


@pytest.fixture
def mine(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    return str(file)


def asked(command, capsys):
    code = main([*shlex.split(command)[1:], "--json", "-"])
    return code, json.loads(capsys.readouterr().out)["cases"]


@pytest.mark.slow
@pytest.mark.parametrize(("study", "scene", "rule", "digits"), [
    ("order", "kepler", "at-3", 50), ("reversibility", "pendulum", "euler", 16),
])  # fmt: skip
def test_the_printed_commands_of_a_failure_fail_for_its_reason(
    study, scene, rule, digits, mine, capsys
):
    def kind(found):
        return without_figures(found["reason"].partition(" Cause: ")[2] or found["reason"])

    command = f"discmech {study} {scene} --rule {mine}:{rule} --digits {digits}"
    code, (first,) = asked(command, capsys)
    assert code == 1 and first["command"] == command
    for again in (first["command"], first["smallest"]["command"]):
        code, (found,) = asked(again, capsys)
        assert code == 1 and kind(found) == kind(first), again


def test_verify_takes_every_study_that_its_commands_name(mine, capsys):
    words = ["verify", f"{mine}:euler", "--scene", "pendulum", "--study", "reversibility"]
    assert main(words) == 1
    told = capsys.readouterr().out
    assert f"again: discmech reversibility pendulum --rule {mine}:euler --digits 16" in told
    assert "self-adjoint" not in told.split("Cause: ")[0]


@pytest.mark.parametrize("claim", [True, False, None])
def test_a_claim_is_never_printed_as_an_answer(claim):
    @black_box(reversible=claim)
    def euler(q, p, h, system):
        dq, dp = system.f(q, p)
        return q + h * dq, p + h * dp

    about = about_scheme(euler.discretise(scenes.get("pendulum")))
    assert about["self_adjoint"] is None
    said = "its steps are those of the explicit Euler method (order 1 by design) on pendulum."
    assert of_schemes(StudyResult(schemes=[about])) == [f"euler: {said}"]


RULES = [*rules.names(), "gauss-3", "kahan-li-8:midpoint", "triple-jump:gauss-2", "own",
         "reversible:midpoint", "poincare:kahan-li-8:midpoint"]  # fmt: skip


def test_every_built_in_object_is_found_by_its_word():
    things = [*map(lookup.rule, RULES[:-1]), *map(scenes.get, scenes.every_name())]
    things += [*map(lattices.get, lattices.NAMES), in_chart(scenes.get("heavy-top"), "exponential")]
    things += [control.get(name).scene for name in control.NAMES]
    assert [thing.name for thing in things if not words.is_found(thing)] == []


@pytest.mark.slow
def test_what_no_word_finds_has_no_command():
    @discretisation(order=2)
    def inside(L, G, x, u, h):
        return h * L(x, u)

    short = scenes.get("harmonic").with_values(x0=["1/3"])
    for scene, rule in ((short, "midpoint"), ("harmonic", inside)):
        (case,) = check("order", [scene], [rule], [16], steps=4)["cases"]
        assert case["command"] == ""
    top = in_chart(scenes.get("heavy-top"), "exponential")
    assert _command(every_study()["order"], Choice((top,), (midpoint,))) == (
        "discmech order heavy-top --rule midpoint --retraction exponential"
    )
    assert _command(every_study()["order"], Choice((scenes.get("heavy-top"), top))) == ""
    told = troubles(*read({"study": "order", "verdict": "fail", "cases": [case]}))
    assert "again: by no command: its rule or its scene is no variable of a file" in told[0]
    assert not words.is_found(rules.compose(inside, "triple-jump"))


def test_the_rules_of_a_list_have_words(mine):
    found = lookup.rules([f"{mine}:RULES"])
    assert [rule.name for rule in found] == ["at-3", "at-4"]
    assert [lookup.rule(f"{mine}:at-4")] == [*found[1:]]
    assert len(lookup.rules([mine])) == 3 and all(map(words.is_found, found))
    assert words.address_of(found[0]) == f"{mine}:at-3"


def test_scenes_of_one_name_are_told_apart_by_the_values_in_their_words(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(MAKER)
    asked = [
        "rigid-body:duration=2",
        "rigid-body:duration=3",
        f"{file}:made:k=1",
        f"{file}:made:k=1/4",
    ]
    several = lookup.scenes_of(asked)
    told = ["rigid-body-duration-2", "rigid-body-duration-3", "spring-k-1", "spring-k-1-4"]
    assert [scene.name for scene in several] == told
    assert [words.address_of(scene) for scene in several] == asked


MAKER = """
from discmech import Scene, pair

def made(k):
    return Scene("spring", pair(1), lambda x, v, p: (v[0] ** 2 - k * x[0] ** 2) / 2, x0=[1], v0=[0],
                 duration=6)
"""


def test_objects_of_one_name_are_told_apart_by_their_variables(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(MINE + """
from discmech import midpoint, scenes
few = [scenes.get("pendulum").with_values(duration=k) for k in (1, 2)]
later = few[0].with_values(duration=3)
BOTH = {"ours": midpoint, "mine": RULES[0]}
""")  # fmt: skip
    assert [scene.name for scene in lookup.named(str(file))[1]] == ["pendulum", "few-1", "few-2"]
    assert [scene.duration for scene in lookup.scenes_of([f"{file}:few"])] == [1, 2]
    assert lookup.rules([f"{file}:BOTH"]) == (midpoint, lookup.rule(f"{file}:at-3"))
    assert lookup.scene(f"{file}:later").duration == 3


@pytest.mark.slow
def test_a_rule_of_a_list_in_a_module_is_named_by_its_file(tmp_path, monkeypatch):
    tmp_path.joinpath("family_of_mine.py").write_text(MINE)
    monkeypatch.syspath_prepend(tmp_path)
    import family_of_mine  # type: ignore[import-not-found]

    monkeypatch.delitem(sys.modules, "family_of_mine")  # only a module that is loaded is searched
    assert not words.is_found(family_of_mine.RULES[0])
    monkeypatch.setitem(sys.modules, "family_of_mine", family_of_mine)
    found = check("order", ["harmonic"], family_of_mine.RULES[:1], [16], steps=4)
    word = f"{tmp_path}/family_of_mine.py:at-3"
    whole = f"discmech order harmonic --rule {word} --digits 16 --steps 4"
    assert [case["command"] for case in found["cases"]] == [whole] == [found["command"]]


@black_box(order=2)
def of_the_scene(q, p, h, system):
    return q + h * system.velocity(q, p), p


@black_box(order=2)
def of_its_own(q, p, h):
    return q + 2 * h * p, p - h * q


@black_box(order=2)
def of_parameters(q, p, h, system):
    return q, p - h * float(system.parameters.length) * q


@black_box(order=2)
class Slow:
    def start(self, q, p, h, system):
        return q, p

    def step(self, state, h, system):
        return state

    def read(self, state, system):
        return state


@pytest.mark.parametrize(("box", "asks"), [
    (of_the_scene, True), (of_its_own, False), (of_parameters, False), (Slow, False),
    (external([sys.executable, "-c", "raise SystemExit"], order=2, name="ends"), False),
])  # fmt: skip
def test_whether_a_program_asks_the_scene_for_its_equations(box, asks):
    assert box.discretise(scenes.get("pendulum")).flow("0.1").questions() == asks


def test_a_program_that_asks_no_scene_stays_on_its_scene():
    study, case = every_study()["order"], Case("order", scenes.get("pendulum"), of_its_own, 16, 8)
    told = run_case(study, case)
    small = smallest(study, case, replace(told, seconds=60.0))
    assert told.verdict == "fail" and (small is None or small.scene == "pendulum")
