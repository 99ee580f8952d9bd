"""What the command says to bad input: one sentence, exit code 2, and nothing half-written."""

import json
import os
import sys
from contextlib import redirect_stdout
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from discmech.studies import get
from discmech.studies.command.entry import main

BAD = [
    ("run pendulm", 'there is no scene "pendulm": did you mean pendulum?'),
    ("order nothing-like-it", "there are harmonic, pendulum, double-pendulum"),
    ("run pendulum --rule midpont", 'there is no rule "midpont": did you mean midpoint?'),
    ("energy pendulum --rule Velocity_Verlet", "it is called trapezoidal here."),
    ("run pendulum --rule triple-jump:implicit-euler", "it returns Z - z - h*s.f(Z) under @one_st"),
    ("run pendulum --rule zzz", "there are rectangle, midpoint, trapezoidal"),
    ("run pendulum --retraction caylee", 'there is no retraction "caylee": did you mean cayley?'),
    ("order pendulum --retraction exp", 'there is no retraction "exp"'),
    ("lattices brether", 'there is no scene "brether": did you mean breather?'),
    ("explain midpoint kepler", "midpoint is a rule, where a scene is asked for: swap the two"),
    ("order midpoint", "; a study is asked by `discmech order pendulum --rule midpoint`."),
    ("verify examples/two_thirds.py --scene mine", "say examples/two_thirds.py:mine."),
    ("explain cradle midpoint", "runs it, and `discmech lattices cradle` judges it."),
    ("order --rule triple-jump:kepler", "kepler is a scene, where a rule is asked for: swap"),
    ("verify kepler", "or name a rule such as midpoint."),
    ("symplecticity --control Huen", 'there is no control "Huen": did you mean Heun?'),
    ("run pendulum --step 0", "a step of 0 goes nowhere"),
    ("run pendulum --step nan", '--step is "nan", which is no number'),
    ("run pendulum --step inf", '--step is "inf", which is no number'),
    ("run pendulum --step a", 'write a decimal ("0.1") or a fraction ("1/3")'),
    ("run pendulum --step 1/0", '--step is "1/0", which is no number'),
    ("run pendulum --step __import__('os')", "which is no number"),
    ("run pendulum --steps 0", "--steps is '0': give a whole number from 1"),
    ("run pendulum --steps -3", "--steps is '-3'"),
    ("run pendulum --steps 1.5", "--steps is '1.5'"),
    ("run pendulum --steps abc", "--steps is 'abc'"),
    ("run pendulum --every 0", "--every is '0'"),
    (f"run pendulum --every {10**20} --steps 3", "give a whole number from 1 to 9007199254740992"),
    (f"order pendulum --steps {10**20}", "give a whole number from 1 to 9007199254740992"),
    ("run pendulum --step 1e999999999", "--step is 1e999999999: choose units"),
    (f"order kepler --json {300 * 'a'}", "cannot be written (File name too long)"),
    ("run pendulum --digits 5", "--digits is 5: give 16 (double precision) up to 10000"),
    ("run pendulum --digits many", "--digits is 'many'"),
    ("order pendulum --digits 15", "--digits is 15"),
    ("momentum harmonic", "applies to none of the chosen scenes (harmonic)"),
    ("work-precision pendulum --peer lsode", 'there is no peer "lsode": did you mean LSODA?'),
    ("work-precision pendulum --x hours", '--x is "hours": choose seconds, steps'),
    ("work-precision pendulum --y speed", '--y is "speed": choose error, error-x'),
    ("work-precision pendulum --periods -1", "--periods is '-1'"),
    ("work-precision pendulum --periods 9999999999999", "from 1 to 1000000000000"),
    ("work-precision pendulum --peer none --peer DOP853", "name no other beside it"),
    ("work-precision pendulum --rule imex", "imex can be used on none of the chosen"),
    ("work-precision pendulum --rule midpoint --peer none --y momentum", "--y momentum does not"),
    ("stability kepler --control Heun", "there are explicit Euler, classical Runge-Kutta"),
    ("stability kepler --control explicit_Euler", 'did you mean explicit Euler?'),
    ("stability rigid-body --control explicit-Euler", 'did you mean explicit Euler?'),
    ("extremes pendulum --extreme sleeping", 'pendulum has no extreme "sleeping": it has "mass'),
    ("extremes --extreme foo", 'there is no extreme "foo": there are "mass 1e100"'),
    ("work-precision pendulum --budget 0", "--budget is '0': give seconds"),
    ("work-precision pendulum --budget inf", "--budget is 'inf': give seconds"),
    ("work-precision pendulum --digits 50", "double precision"),
    ("report nowhere", 'there is no scene "nowhere"'),
]  # fmt: skip


@pytest.mark.dear("work-precision pendulum")
@pytest.mark.parametrize(("line", "message"), BAD)
def test_bad_input_is_one_sentence_on_standard_error(ask, line, message):
    code, out, err = ask(*line.split())
    assert (code, out) == (2, "")
    assert message in err and err.startswith("discmech: ")
    assert err.count("\n") == 1 and err.rstrip()[-1] in ".?)"


@pytest.mark.parametrize(
    ("line", "message"),
    [("ordr", 'there is no command "ordr": did you mean order?'), ("", "required: COMMAND"),
     ("foo", 'there is no command "foo": there are list, run, '),
     ("new rul mine", 'there is no kind "rul": did you mean rule?'),
     ("verify midpoint --study symplectic", "did you mean symplecticity?"),
     ("run pendulum --setp=5", "unrecognized arguments: --setp=5; did you mean --step?"),
     ("run", "required: scene"), ("list --jsn x", "unrecognized arguments: --jsn"),
     ("run pendulum --t 5", "unrecognized arguments: --t 5"),
     ("compare midpoint --scene kepler rectangle",
      "unrecognized arguments: rectangle; write names before the options"),
     ("order --steps", "expected one argument")],
)  # fmt: skip
def test_a_line_that_is_no_command_shows_the_usage(ask, line, message):
    code, out, err = ask(*line.split())
    assert (code, out) == (2, "") and "usage: discmech" in err
    assert message.replace("'", "") in err.replace("'", "")


@pytest.mark.parametrize("words", [["list"], ["run", "pendulum", "--steps", "2"],
                                   ["energy", "harmonic", "--steps", "50"]])  # fmt: skip
def test_a_file_that_cannot_be_written(ask, tmp_path, words):
    (tmp_path / "file").touch()
    for target in (tmp_path / "file" / "a.json", tmp_path):
        code, out, err = ask(*words, "--json", str(target))
        assert (code, out) == (2, "") and "cannot be written" in err and err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["file"]


@pytest.mark.skipif(sys.platform != "linux", reason="makes names of any bytes")
def test_a_folder_whose_name_is_no_text(tmp_path):
    """A name in Latin-1, say: what is written of it escapes the byte."""
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/lat\xe9"))
    folder.mkdir()
    page, found = folder / "page", folder / "found.json"
    words = ("order", "harmonic", "--rule", f"{folder}/latin.py:latin", "--digits", "16")
    with redirect_stdout(TextIOWrapper(BytesIO(), "utf-8", "replace")):  # as the command's own
        assert main(["new", "rule", "latin", "--folder", str(folder)]) == 0
        for more in (("--json", str(found)), ("--folder", str(page))):  # measured, and remembered
            assert main([*words, *more]) == 0
    assert f"{folder}/latin.py" in json.loads(found.read_bytes())["command"]
    assert r"lat\udce9/latin.py" in (page / "index.html").read_text("utf-8")


def test_a_user_s_file_that_needs_too_much_memory_could_not_run(ask, tmp_path):
    (tmp_path / "large.py").write_text("raise MemoryError")
    code, _, err = ask("run", str(tmp_path / "large.py"))
    assert code == 4 and "too little memory" in err and err.count("\n") == 1


def test_a_failed_write_leaves_the_old_file(ask, tmp_path, monkeypatch):
    file = tmp_path / "list.json"
    assert ask("list", "--json", str(file))[0] == 0
    old = file.read_text()

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    code, _, err = ask("list", "--json", str(file))
    assert code == 4 and "No space left on device" in err
    assert file.read_text() == old
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["list.json"]


def test_where_the_result_goes_is_looked_at_before_the_study_runs(ask, tmp_path, monkeypatch):
    monkeypatch.setattr(
        get("energy").measuring, "measure", lambda *_: pytest.fail("measured in vain")
    )
    (tmp_path / "file").touch()
    assert ask("energy", "--json", str(tmp_path / "file" / "a.json"))[0] == 2
    code, _, err = ask("energy", "--folder", str(tmp_path / "file"))
    assert code == 2 and "file cannot be written" in err and err.count("\n") == 1


def test_a_file_that_is_none_of_python_s_is_told(ask, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.md").write_text("# my rule")
    (tmp_path / "mine").mkdir()
    for path in (str(tmp_path), "notes.md", "mine", "."):
        for words in (("verify", path), ("run", path), ("order", "--rule", path)):
            code, _, err = ask(*words)
            assert code == 2 and f"{path} is no Python file" in err
    assert 'there is no scene ""' in ask("run", "")[2]
    (tmp_path / "kepler").mkdir()  # what is called so comes first
    assert ask("run", "kepler", "--steps", "1")[0] == 0


@pytest.mark.parametrize(
    "line",
    ["run pendulum --step 1e400 --steps 2", "run pendulum --step 1e200 --steps 2",
     "run pendulum --step 1e400 --steps 1 --digits 20", "run pendulum --step 1e-30",
     "run pendulum --steps 100000000000000", "run pendulum --step 1e-400 --steps 2"],
)  # fmt: skip
def test_numbers_beyond_the_machine_are_refused_in_words(ask, line):
    code, _, err = ask(*line.split())
    assert code in (1, 2) and err.startswith("discmech: ") and err.count("\n") == 1
