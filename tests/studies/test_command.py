"""The command as it is installed: what it lists, and what it loads, prints and answers."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import discmech.integrators as integrators
from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.studies import NAMES
from tests.studies.commands import in_a_process, strict

LIGHT = "import sys; from discmech.studies.command import main; code = main(sys.argv[1:]); "


def test_list_names_everything(ask):
    code, out, err = ask("list")
    assert (code, err) == (0, "")
    for name in (*scenes.names(), *discretisations.BUILT_IN, *NAMES, "LocalGroupoid"):
        assert f"  {name}" in out
    for name in scenes.names():  # words stay apart, however long the name
        assert f"  {name} " in out and f"  {scenes.get(name).title}\n" in out


def test_list_as_json(ask, tmp_path):
    code, out, _ = ask("list", "--json", "-")
    found = strict(out)
    assert code == 0 and list(found) == [
        "scenes", "rules", "groupoids", "studies", "one_step_maps", "lattices",
    ]  # fmt: skip
    assert found["scenes"] == list(scenes.every_name()) and found["studies"] == list(NAMES)
    assert found["rules"][:3] == ["rectangle", "midpoint", "trapezoidal"]
    assert found["rules"] == list(discretisations.names())
    assert ask("list", "--json", str(tmp_path / "list.json")) == (0, "", "")
    assert strict((tmp_path / "list.json").read_text()) == found


def test_every_groupoid_that_is_listed_can_be_imported(ask):
    for name in strict(ask("list", "--json", "-")[1])["groupoids"]:
        assert name in integrators.__all__


@pytest.mark.slow
def test_bad_input_as_a_process():
    done = in_a_process("run", "pendulum", "--rule", "trapez")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == 'discmech: there is no rule "trapez": did you mean trapezoidal?\n'


@pytest.mark.slow
def test_a_run_as_a_process_is_json_alone():
    """No progress bar, no warning, no notice of a compiler beside it."""
    done = in_a_process("run", "pendulum", "--steps", "3", "--json", "-")
    assert (done.returncode, done.stderr) == (0, "")
    assert strict(done.stdout)["steps"] == 3


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        [sys.executable, "-c",
         "import subprocess, sys\n"
         "p = subprocess.Popen([sys.executable, '-m', 'discmech.studies.command', 'list'],"
         " stdout=subprocess.PIPE, stderr=subprocess.PIPE)\n"
         "p.stdout.close()\n"
         "print(p.stderr.read().decode()); sys.exit(p.wait())"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert "Traceback" not in done.stdout


@pytest.mark.slow
def test_bad_input_loads_neither_sympy_nor_llvmlite():
    done = in_a_process("run", "pendulm", code=LIGHT + "print(code, 'llvmlite' in sys.modules)")
    assert done.stdout.split() == ["2", "False"]


def test_the_console_script_is_this_function():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert project["project"]["scripts"] == {"discmech": "discmech.studies.command:main"}
