"""What importing the package loads."""

import subprocess
import sys
from pathlib import Path

import pytest

import discmech.integrators as integrators
from discmech.integrators import compiler
from discmech.integrators.extensions import lattices

HEAVY = ("sympy", "llvmlite", "matplotlib", "scipy", "mpmath", "gmpy2", "rich", "jinja2")
OURS = ("discmech.reference", "discmech.studies")
#: what derives and runs a scheme, of which a list of names needs nothing
DERIVING = tuple(
    f"discmech.integrators.{room}" for room in ("equations", "flows", "extensions.foreign")
)


def loaded_by(statement):
    told = HEAVY + OURS + DERIVING + ("numpy",)
    code = f"import sys; {statement}; print([m for m in {told} if m in sys.modules])"
    root = Path(integrators.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    return set(eval(done.stdout, {}))


@pytest.mark.dear(but=("import discmech",))
@pytest.mark.parametrize(("statement", "more"), [
    ("import discmech", ()),
    ("from discmech.integrators import scenes; scenes.all_scenes()", ()),
    ("from discmech import *; Scene('a', pair(1), lambda x, v, p: 0, x0=[1], v0=['0.5'])", ()),
    ("from discmech.integrators import so, se, sl, sp; so(4), se(3), sl(3), sp(4)", ()),
    ("from discmech.studies.report import page, tables", ("numpy",)),
    *((f"import io; sys.stdout, shown = io.StringIO(), sys.stdout; sys.stderr = sys.stdout; "
       f"from discmech.studies.command import main; main({words}); sys.stdout = shown",
       (*DERIVING, "discmech.reference")) for words in (["list"], ["list", "--json", "-"])),
])  # fmt: skip
def test_importing_is_light(statement, more):
    assert not loaded_by(statement) & {*HEAVY, *more}


@pytest.mark.slow
def test_a_flow_in_double_precision_loads_no_matplotlib():
    statement = (
        "import warnings; warnings.simplefilter('ignore'); "
        "from discmech.integrators import *; from discmech.integrators import scenes; "
        "Scheme(scenes.get('harmonic'), trapezoidal).flow('0.1').trajectory(2)"
    )
    loaded = loaded_by(statement)
    assert not loaded & {"matplotlib", *OURS}
    assert "sympy" in loaded


def test_a_name_of_a_package_is_not_the_name_of_a_module():
    """Importing the module would put it in the place of the name that is loaded on demand."""
    for package in (integrators, lattices, compiler):
        modules = {path.stem for path in Path(package.__file__).parent.iterdir()}
        assert not modules & (set(package.__all__) - {"scenes"})
        assert all(getattr(package, name) is not None for name in package.__all__)
