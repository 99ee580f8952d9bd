"""What is public: docstrings, what packages offer, and registries that miss nothing."""

from __future__ import annotations

import ast
import importlib
import inspect

import pytest

from discmech import studies
from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.integrators.errors import CALLED_HERE, OF_THE_BENCH, unknown
from discmech.integrators.numbers import Double, Multiple
from discmech.integrators.runs import Stepper
from discmech.studies.core.study import OF_THE_BENCH as OF_BENCH
from tests.imports import FOLDERS, ROOT, SOURCES, module_of


def test_names_that_lead_elsewhere_lead_to_something():
    assert {*OF_THE_BENCH} == {e.parent.name for e in OF_BENCH.glob("*/__init__.py")}
    for name in OF_THE_BENCH:  # as after `pip install`, where none of them is there
        assert f"say discmech {name} in a checkout" in str(unknown("study", name, ["order"]))
    for usual, ours in CALLED_HERE.items():
        discretisations.get(ours)
        assert ours in str(unknown("rule", usual, ["order"]))


@pytest.mark.parametrize("name", [f"discmech.{folder}" for folder in FOLDERS])
def test_what_a_package_offers_it_has(name):
    package = importlib.import_module(name)
    assert sorted(set(package.__all__)) == sorted(package.__all__)
    for offered in package.__all__:
        assert getattr(package, offered) is not None
    assert (ROOT / name.removeprefix("discmech.") / "py.typed").is_file()


def undocumented(module):
    """Public functions and classes without a docstring, and methods that nobody documents.

    A method may inherit its docstring or be the twin of a documented one, those of a stepper are
    documented by the protocol; a scene's Lagrangian is
    said by its title, and what a closed form has to offer by `reference.closed_forms.form`.
    """
    protocol = {"lagrangian", "applies", "motion"} if "closed_forms." in module.__name__ else set()
    protocol |= {"lagrangian"} if ".scenes." in module.__name__ else set()
    for name, thing in vars(module).items():
        if name.startswith("_") or getattr(thing, "__module__", None) != module.__name__:
            continue
        if name in protocol or not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue
        if not inspect.getdoc(thing):
            yield name
        if not inspect.isclass(thing) or (module.__name__, name) in TWINS:
            continue
        for inner, member in vars(thing).items():
            member = getattr(member, "func", getattr(member, "fget", member))
            if inner.startswith("_") or not inspect.isfunction(member):
                continue
            if name in STEPPERS and inspect.getdoc(getattr(Stepper, inner, None)):
                continue
            if not inspect.getdoc(getattr(thing, inner, member)) and not inspect.getdoc(member):
                yield f"{name}.{inner}"


#: the twin of another class, member by member, which has the docstrings
TWINS = {("discmech.integrators.numbers.arithmetic", "Multiple")}
#: classes that have the members of `runs.Stepper`, which has their docstrings
STEPPERS = {"FreeMotion", "ContactRun", "LatticeStepper"}


@pytest.mark.parametrize("name", list(map(module_of, SOURCES)))
def test_everything_public_has_a_docstring(name):
    if ".gallery.adapters." in name:  # of a library that may not be there
        pytest.importorskip(name)
    module = importlib.import_module(name)
    assert module.__doc__
    assert not list(undocumented(module))


def test_twins_are_twins():
    def members(kind):
        return {n for n in vars(kind) if not n.startswith("_")}

    assert members(Multiple) - members(Double) <= {"bits"}
    assert members(Double) - members(Multiple) <= {"array_namespace", "bits", "digits", "eps"}
    for name in members(Multiple) & members(Double):
        ours, theirs = getattr(Double, name), getattr(Multiple, name)
        if inspect.isfunction(ours):
            assert list(inspect.signature(ours).parameters) == list(
                inspect.signature(theirs).parameters
            )


def scene_files():
    return sorted(p for p in (ROOT / "integrators" / "scenes").glob("*.py") if p.stem != "__init__")


def test_every_scene_file_is_registered_and_every_name_has_a_file():
    assert sorted(p.stem.replace("_", "-") for p in scene_files()) == sorted(scenes.every_name())
    assert len(set(scenes.every_name())) == len(scenes.every_name())
    assert "cradle" in scenes.__getattr__("lattices").NAMES
    assert "upright-top" in scenes.__getattr__("control").NAMES
    assert not hasattr(scenes, "lattice")


@pytest.mark.parametrize("path", scene_files(), ids=lambda p: p.stem)
def test_a_scene_is_short_and_says_where_it_comes_from(path):
    scene = scenes.get(path.stem.replace("_", "-"))
    assert scene.name == path.stem.replace("_", "-")
    assert scene.title and scene.source and scene.title[0].isupper()
    assert scene.lagrangian is not None or scene.discrete_lagrangian is not None
    lines = path.read_text(encoding="utf-8").splitlines()
    assert sum(1 for line in lines if line.strip()) < 40, "lines that are not blank"
    names = [q.name for q in scene.symmetries]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("path", scene_files(), ids=lambda p: p.stem)
def test_a_scene_holds_exact_numbers_only(path):
    """No float anywhere in a scene's file: 0.1 is "0.1" here."""
    floats = [
        node.value
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, float)
    ]
    assert not floats


def test_rules_are_registered_under_their_names():
    for name, rule in discretisations.BUILT_IN.items():
        assert rule.name == name and rule.source and rule.order
        assert discretisations.get(name) is rule


def test_every_study_has_what_a_study_has():
    for name in studies.NAMES:
        study = studies.get(name)
        assert name == study.name == study.measuring.NAME and study.needs
        for part in ("cases", "measure", "judge"):
            assert callable(getattr(study, part))


def test_a_star_import_does_not_hide_sympy_as_sp():
    names: dict[str, object] = {}
    exec("import sympy as sp\nfrom discmech import *", names)
    assert names["sp"].__name__ == "sympy" and "Scene" in names
    from discmech import sp

    assert sp(2).dim == 3
