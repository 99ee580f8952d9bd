"""One import name in checkout, editable install and wheel, next to a user's folders named alike."""

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from tests.tutorial import follow

pytest.importorskip("hatchling", reason="`make setup` installs it")

ROOT = Path(__file__).resolve().parent.parent
PLUGIN = "discmech.studies.plugin"
FOLDERS = ("integrators", "reference", "studies", "reports", "tests")

SMALL = """
import importlib.util, pathlib, sys
import discmech
from discmech import Scene, Scheme, check, pair, scenes, solution
from discmech import integrators, reference, studies
assert not {"sympy", "llvmlite"} & set(sys.modules), "importing is light"
from discmech.studies.command import main
from discmech.studies.report.page import environment
environment().get_template("report.html.j2")
assert reference.answer.frozen.FOLDER.joinpath("heavy-top.json").is_file()
print(main(["list"]))
print(*filter(importlib.util.find_spec, %r))
"""

MINE = """
import integrators, reference, studies
from tests import MINE

def test_mine(assert_reversible):
    assert integrators.MINE and reference.MINE and studies.MINE and MINE
    assert_reversible("midpoint", "harmonic", digits=30)
"""


def run(python, folder, *words, **environment):
    """Output of a command in the folder; the environment's own Python settings are left out."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST"))}
    done = subprocess.run([str(python), *words], cwd=folder, env=clean | environment, text=True,
                          capture_output=True, timeout=300)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The two wheels that pip would unpack, by name."""
    folder = tmp_path_factory.mktemp("built")
    code = (
        "import sys; from hatchling import build as b; print(getattr(b, sys.argv[1])(sys.argv[2]))"
    )
    return {
        way: folder / way / run(sys.executable, ROOT, "-c", code, f"build_{way}", folder / way)
        .splitlines()[-1]
        for way in ("wheel", "editable")
    }  # fmt: skip


@pytest.fixture(params=("checkout", "editable", "wheel"))
def installed(request, built, tmp_path):
    """A Python that sees this one's packages and discmech, with the settings that it needs."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "env"], check=True)
    places = {"base": str(tmp_path / "env"), "platbase": str(tmp_path / "env")}
    site = Path(sysconfig.get_path("purelib", "venv", vars=places))
    others = [path for path in sys.path if path.endswith("-packages")]
    site.joinpath("others.pth").write_text("\n".join(others))
    python = tmp_path / "env" / "bin" / "python"
    if request.param == "checkout":
        return python, {"PYTHONPATH": str(ROOT)}, ["-p", "no:discmech", "-p", PLUGIN]
    with zipfile.ZipFile(built[request.param]) as archive:
        archive.extractall(site)
    return python, {}, []


@pytest.mark.slow
def test_a_wheel_holds_one_package(built):
    names = zipfile.ZipFile(built["wheel"]).namelist()
    assert {n.split("/")[0].split("-")[0] for n in names} == {"discmech"}
    assert {n.split("/")[1] for n in names if n.startswith("discmech/")} == {
        "__init__.py", "py.typed", "integrators", "reference", "reports", "studies",
    }  # fmt: skip
    assert not [n for n in names if "__pycache__" in n or n.endswith((".nbi", ".nbc"))]
    for path in ROOT.joinpath("reference", "tables").iterdir():
        assert f"discmech/reference/tables/{path.name}" in names


def test_an_editable_install_holds_one_module(built):
    """No .pth file: no folder of the checkout is on sys.path."""
    names = zipfile.ZipFile(built["editable"]).namelist()
    assert [n for n in names if ".dist-info/" not in n] == ["discmech.py"]


@pytest.mark.slow
def test_importing_and_commands_find_everything(installed, tmp_path):
    python, environment, _ = installed
    folder = tmp_path / "empty"
    folder.mkdir()
    found = run(python, folder, "-c", SMALL % (FOLDERS,), **environment).splitlines()
    assert found[-2] == "0"
    assert found[-1] == ("" if not environment else " ".join(FOLDERS))


@pytest.mark.slow
def test_the_plugin_runs_next_to_a_user_s_folders_of_those_names(installed, tmp_path):
    python, environment, words = installed
    folder = tmp_path / "mine"
    for name in FOLDERS:
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").write_text("MINE = True\n")
    (folder / "tests" / "test_mine.py").write_text(MINE)
    shown = run(python, folder, "-m", "pytest", "-q", "-W", "error", *words, "tests", **environment)
    assert "1 passed" in shown


@pytest.mark.slow
@pytest.mark.parametrize("installed", ["wheel"], indirect=True)
def test_the_tutorial_can_be_followed_with_the_wheel(installed, tmp_path):
    """With what is needed from here; `python -m tests.tutorial` has it all by pip."""
    python, *_ = installed
    folder = tmp_path / "mine"
    folder.mkdir()
    for step, wall, processor in follow(python, folder):
        print(f"{wall:.1f} s, {processor:.1f} s of processor: {step}")
    assert list(folder.rglob("order-16.png"))
