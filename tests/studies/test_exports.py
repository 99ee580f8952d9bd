"""Exported files beside their originals: they are alike to round-off, and a wrong one is caught."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sympy

from discmech import Scene, Scheme, pair, rectangle, scenes
from discmech.integrators import BadInput, StepFailure
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies.command.entry import main
from discmech.studies.core import lookup
from discmech.studies.user import exports

#: of each kind of step one: explicit, Newton's, stages, compositions with and without the adjoint,
#: forces and time, constraints, groups, actions, products, branches, one-step maps, one-forms
KINDS = [
    ("pendulum", "rectangle"), ("double-pendulum", "midpoint"), ("kepler", "gauss-2"),
    ("henon-heiles", "kahan-li-6:trapezoidal"), ("pendulum", "suzuki:rectangle"),
    ("driven-heavy-top", "midpoint"), ("duffing", "trapezoidal"), ("rolling-disc", "midpoint"),
    ("cartesian-pendulum", "trapezoidal"), ("rigid-body", "lobatto-3"), ("rotor-body", "midpoint"),
    ("moser-veselov", "own"), ("rigid-body", "rkmk-4"), ("heavy-top", "implicit-midpoint"),
    ("lotka-volterra-half", "midpoint"), ("lotka-volterra", "implicit-midpoint"),
    ("heavy-top", "gauss-3"), ("kepler", "lobatto-4"), ("charged-particle", "gauss-2"),
]  # fmt: skip


def made(text, language, folder, scheme):
    """The box of a file, or a skip where its language is not here."""
    if why := exports.missing(language):
        pytest.skip(why)
    return exports.boxed(scheme, exports.built(text, language, folder))


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), KINDS, ids=map(" ".join, KINDS))
def test_a_file_runs_as_its_scheme(scene, rule, tmp_path):
    scheme = Scheme(scenes.get(scene), lookup.rule(rule))
    for language in "numpy", "c":
        box = made(scheme.export(language, True), language, tmp_path, scheme)
        found = exports.beside(scheme, box, 150)
        assert found.verdict == "pass", (language, found)
        assert found.steps > exports.FEWEST


@pytest.mark.slow
def test_a_stiff_lattice_runs_as_its_flow(tmp_path):
    """A beam's forces are differences of nearly equal bends, which round otherwise in each file."""
    scheme = Scheme(systems.get("beam"), lookup.rule("midpoint"))
    found = exports.beside(
        scheme, made(scheme.export("numpy", True), "numpy", tmp_path, scheme), 150
    )
    assert found.verdict == "pass" and found.bound < 1e-11, found


def spoiled(text):
    """A file whose increments are wrong by 10⁻¹¹ of themselves."""
    new = text.replace("+ dx_0", "+ dx_0*(1.0 + 1e-11)")
    assert new != text
    return new


@pytest.mark.parametrize("language", ["c", "numpy"])
def test_a_wrong_file_is_caught(language, tmp_path):
    scheme = Scheme(scenes.get("kepler"), lookup.rule("midpoint"))
    box = made(spoiled(scheme.export(language, True)), language, tmp_path, scheme)
    found = exports.beside(scheme, box, 150)
    assert found.verdict == "fail"
    assert "differs by" in found.reason


@pytest.mark.slow
def test_nothing_is_told_of_a_motion_that_multiplies_round_off(tmp_path):
    """The standard map with K = 50 multiplies it by 25 in each step."""
    kicked = Scene(name="kicked", groupoid=pair(1), step=1, duration=150, x0=[1], v0=[0],
                   lagrangian=lambda x, v, p: v[0] ** 2 / 2 + 50 * sympy.cos(x[0]))  # fmt: skip
    scheme = Scheme(kicked, rectangle)
    box = made(scheme.export("numpy", True), "numpy", tmp_path, scheme)
    assert exports.beside(scheme, box, 150).verdict == "inconclusive"


def test_a_scene_at_rest_tells_nothing_and_a_file_that_moves_is_still_wrong(tmp_path):
    rest = scenes.get("rigid-body").with_values(name="rest", v0=[0, 0, 0])
    scheme = Scheme(rest, lookup.rule("midpoint"))
    box = made(scheme.export("numpy", True), "numpy", tmp_path, scheme)
    found = exports.beside(scheme, box, 150)
    assert found.verdict == "inconclusive" and "stays at rest" in found.reason
    box.formula.program.run = lambda *start: (np.zeros((151, 0)), np.full((151, 3), 1e-9))
    assert exports.beside(scheme, box, 150).verdict == "fail"


@pytest.mark.slow
@pytest.mark.parametrize("scene", scenes.every_name())
def test_every_scene_by_every_kind_of_rule(scene, tmp_path):
    """What a flow runs and no contact breaks is exported, and alike to round-off.

    Each prints its rows of a table (pytest -s): scene, rule, what C and numpy say, or why not.
    """
    exported = 0
    for i, word in enumerate(
        ("midpoint", "gauss-2", "gauss-3", "triple-jump:trapezoidal", "implicit-midpoint")
    ):
        try:
            scheme = Scheme(lookup.scene(scene), lookup.rule(word))
            texts = {language: scheme.export(language, True) for language in ("c", "numpy")}
        except BadInput as refused:  # the rule does not apply, or a gap may close
            assert str(refused).endswith((".", "?"))
            print(f"| {scene} | {word} | not exported | {refused} |")
            continue
        said = {}
        for language, text in texts.items():
            (folder := tmp_path / f"{language}{i}").mkdir()
            try:
                box = made(text, language, folder, scheme)
                said[language] = exports.beside(scheme, box, 150)
            except StepFailure as failure:  # of the original, before a first step
                print(f"| {scene} | {word} | no run | {failure} |")
                break
        verdicts = [found.verdict for found in said.values()]
        print(f"| {scene} | {word} | {' | '.join(verdicts)} |", flush=True)
        assert "fail" not in verdicts, (word, said)
        exported += 1
    assert exported or lookup.scene(scene).contact is not None


def test_both_are_judged_alike(tmp_path):
    scheme = Scheme(scenes.get("pendulum"), lookup.rule("midpoint"))
    box = made(scheme.export("c", True), "c", tmp_path, scheme)
    (found,) = exports.verdicts(scheme, box, studies=["order"])
    assert (found.original, found.exported, found.alike) == ("pass", "pass", True)


@pytest.mark.slow
def test_c_compiles_without_a_word_with_and_without_its_harness(tmp_path):
    scheme = Scheme(scenes.get("rigid-body"), lookup.rule("gauss-2"))
    for harness in (False, True):
        text = scheme.export("c", harness)
        assert ("int main" in text) == harness
        if harness:
            made(text, "c", tmp_path, scheme)


#: lines that ask for no run of the harness
ASKED_WRONGLY = (
    "garbage", '{"x": [2.0], "mu": [0, 0], "h": 0.1, "steps": 2}',
    '{"h": 0.1, "steps": 2, "every": 0}',
    '{"mu": [0, 0, 0, 0], "h": 0.1, "steps": 2}', '{"h": "a", "steps": 2}', '{"h": 0.1}',
    '{"steps": 2}',
    '{"h": 0.1, "steps": 2, "parameters": {"inertia": [1, 2]}}',
)  # fmt: skip


def test_the_harness_in_c_answers_only_what_it_was_asked(tmp_path):
    """After each line that asks wrongly it answers one that does not."""
    if why := exports.missing("c"):
        pytest.skip(why)
    scheme = Scheme(scenes.get("heavy-top"), lookup.rule("midpoint"))
    command = exports.built(scheme.export("c", True), "c", tmp_path)
    asked = "".join(f'{line}\n{{"h": 0.1, "steps": 1}}\n' for line in ASKED_WRONGLY)
    told = subprocess.run(command, input=asked, capture_output=True, text=True, check=True).stdout
    answers = [json.loads(line) for line in told.splitlines()]
    for line, wrong, right in zip(ASKED_WRONGLY, answers[::2], answers[1::2], strict=True):
        assert "is missing, or has other numbers" in wrong["error"], line
        assert len(right["x"]) == 2, line


def test_the_command_writes_a_file_that_says_what_was_verified(tmp_path, capsys):
    if why := exports.missing("c"):
        pytest.skip(why)
    file = tmp_path / "pendulum.c"
    words = ["export", "pendulum", "rectangle", "--language", "c", "--out", str(file)]
    assert main(words) == 0
    assert "trajectory: pass over 10000 steps" in capsys.readouterr().err
    text = " ".join(file.read_text("utf-8").replace("*", " ").split())
    assert "Command: discmech export pendulum rectangle --language c Verified" in text
    assert "Order in (x, mu): 1." in text
    assert main([*words, "--no-check"]) == 0  # it is as it was written
    changed = file.read_text("utf-8").replace("sin(", "cos(")
    file.write_text(changed, "utf-8")
    assert main([*words, "--no-check"]) == 2
    assert file.read_text("utf-8") == changed


@pytest.mark.parametrize(("words", "said"), [
    (["bouncing-ball", "midpoint", "--language", "c"], "has contact"),
    (["pendulum", "midpoint", "--language", "c", "--digits", "50"], "computes with doubles"),
    (["own.py:turn", "midpoint", "--language", "c"], "a problem of optimal control"),
    (["own.py:kick", "midpoint", "--language", "numpy"], "holds the states of a map"),
], ids=["contact", "digits", "control", "map"])  # fmt: skip
def test_what_cannot_be_exported_is_one_sentence(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(
        "from discmech import Control, black_box, scenes\n"
        "turn = Control(scenes.get('pendulum'), lambda x, v, f, p: f[0] ** 2, end=([0], [0]))\n"
        "@black_box(step=1, symplectic=True, states=([-1, -1], [1, 1]))\n"
        "def kick(q, p):\n    return q, p - q\n",
        "utf-8",
    )
    assert main(["export", *words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert lines[0].endswith(".")


@pytest.mark.slow
def test_an_entry_that_is_round_off_alone_hides_nothing(tmp_path):
    """The second momentum of a motion on a line is 0; a wrong first one is still seen."""
    line = Scene(name="line", groupoid=pair(2), step="0.1", duration=20, x0=[1, 0], v0=[0, 0],
                 lagrangian=lambda x, v, p: v.dot(v) / 2 - (x[0] + x[1]) ** 2 / 2
                 - (x[0] - x[1]) ** 2 / 3 + x[0] * x[1] / 3)  # fmt: skip
    scheme = Scheme(line, lookup.rule("midpoint"))
    text = scheme.export("numpy", True)
    assert exports.beside(scheme, made(text, "numpy", tmp_path, scheme), 150).verdict == "pass"
    box = made(spoiled(text), "numpy", tmp_path, scheme)
    assert exports.beside(scheme, box, 150).verdict == "fail"
