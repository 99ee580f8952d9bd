"""What a notebook's cells or a script define has a command that works elsewhere."""

import shlex
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from discmech.studies.core.words import address_of, is_found, text_of

CELLS = [
    "%matplotlib inline\nimport sympy\nfrom discmech import *",
    "third = sympy.Rational(1, 3)\nunused = third + 1\nraise_it = None",
    "@discretisation(order=2)\ndef thirds(L, G, x, u, h):\n"
    "    a, b = (G.target(x, u, k * third * h) for k in (1, 2))\n"
    "    return h * (L(a, u) + L(b, u)) / 2",
    "this is no Python",
    "print('never again')\nresult = None",
]


def test_the_program_holds_what_is_needed_and_nothing_else():
    text, anywhere = text_of("thirds", CELLS)
    assert anywhere
    assert "third = " in text and "def thirds" in text and "import sympy" in text
    assert "unused" not in text and "never again" not in text and "result" not in text
    assert text_of("no-such", CELLS) == ("", False)


def test_the_last_statement_before_its_use_binds_a_name():
    cells = ["a = 0", "a = 1", "b = a", "def f():\n    return a", "a = 2"]
    assert text_of("b", cells)[0].splitlines() == ["a = 1", "b = a"]
    assert text_of("f", cells)[0].splitlines()[-1] == "a = 2"


@pytest.fixture
def notebook(monkeypatch):
    """A namespace in which the cells ran, as IPython has it."""
    space = {"In": CELLS, "__name__": "__main__"}
    for k, cell in enumerate(CELLS[:3]):
        exec(compile(cell.replace("%matplotlib inline", ""), f"<ipython-input-{k}>", "exec"), space)
    shell = ModuleType("IPython")
    shell.get_ipython = lambda: SimpleNamespace(user_ns=space)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    return space


@pytest.mark.slow
def test_the_command_of_a_rule_in_a_notebook_runs_elsewhere(notebook, tmp_path):
    from discmech import check

    (case,) = check("order", ["pendulum"], [notebook["thirds"]], [16], steps=100)["cases"]
    done = subprocess.run(
        [sys.executable, "-m", "discmech.studies.command", *shlex.split(case["command"])[1:]],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_command_of_a_rule_in_a_notebook_names_a_file_with_it(notebook):
    from discmech.studies.core.lookup import rules

    word = address_of(notebook["thirds"])
    assert word.endswith(".py:thirds")
    (again,) = rules([word])
    assert again.order == 2 and again.name == "thirds"


def test_a_damaged_file_of_a_notebook_is_written_again(notebook, monkeypatch):
    file = Path(address_of(notebook["thirds"]).partition(":")[0])
    wanted = file.read_text()
    file.write_text(wanted.replace("/ 2", "/ 3"))
    assert address_of(notebook["thirds"]) == f"{file}:thirds" and file.read_text() == wanted
    file.unlink()
    monkeypatch.setattr("discmech.studies.core.words.write_atomically", _full)
    assert not is_found(notebook["thirds"])


def _full(path, content):
    raise OSError(28, "No space left on device")


@pytest.mark.slow
def test_a_script_is_named_itself(tmp_path):
    script = tmp_path / "mine.py"
    script.write_text("\n".join(CELLS[:3]).replace("%matplotlib inline", "") + """
if __name__ == "__main__":
    from discmech.studies.core.words import address_of
    print(address_of(thirds))
""", "utf-8")  # fmt: skip
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True)
    assert done.stdout.strip() == f"{script}:thirds", done.stderr
