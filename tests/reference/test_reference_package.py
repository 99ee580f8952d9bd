"""The package: what it may import, and that nobody can change what is handed to several."""

import subprocess
import sys
from dataclasses import is_dataclass
from importlib import import_module
from pathlib import Path

import pytest

import discmech.reference as reference
from tests.imports import DYNAMIC, imported, module_of, under, within

PACKAGE = Path(reference.__file__).parent
#: data, and how and where a file is written, which has no formula
SHARED = {"discmech.integrators.scene", "discmech.integrators.scenes",
          "discmech.integrators.files", "discmech.integrators.places"}  # fmt: skip


def offences(source, module="discmech.reference.answer.solution", is_package=False):
    """Imports that break the rule: scene data and files only, nothing else of ours."""
    names = imported(source, module, is_package)
    foreign = [n for n in names if not within(n, "discmech.reference", *SHARED)]
    return [n for n in foreign if within(n, "discmech", "tests", *DYNAMIC)]


@pytest.mark.parametrize("path", under("reference"), ids=lambda p: p.name)
def test_references_share_no_formula(path):
    source = path.read_text(encoding="utf-8")
    assert offences(source, module_of(path), path.name == "__init__.py") == []


def test_the_import_rule_catches_offenders():
    allowed = "from discmech.integrators.scene import Scene\nfrom integrators import scenes"
    assert offences(allowed) == []
    for line in (
        "import discmech.integrators",
        "from discmech.integrators import cayley",
        "from ...integrators import cayley",
        "from discmech.integrators.retractions import cayley",
        "import discmech.studies.order",
        "from importlib import import_module as m\nimport importlib\nimportlib.import_module('x')",
        "__import__('discmech.integrators')",
    ):
        assert offences(line), line


def test_import_is_light():
    code = (
        "import sys, reference; "
        "print([m for m in ('sympy', 'mpmath', 'numpy', 'gmpy2', 'flint', 'integrators') "
        "if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=PACKAGE.parent, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


#: a search under way
CHANGING = {"_Witness"}


@pytest.mark.parametrize("path", under("reference"), ids=lambda p: p.name)
def test_what_is_made_stays_as_it_is(path):
    """Whoever asks again is given the same object, so nobody may change one."""
    for name, made in vars(import_module(module_of(path))).items():
        if isinstance(made, type) and is_dataclass(made) and name not in CHANGING:
            assert made.__dataclass_params__.frozen, name
