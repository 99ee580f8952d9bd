"""The rules of the house: who may import whom, docstrings, complete registries, no local traces."""

from __future__ import annotations

import ast
import graphlib
import importlib
import inspect
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("integrators", "reference", "studies")
PACKAGES = tuple(f"discmech.{name}" for name in FOLDERS)
SOURCES = [p for name in FOLDERS for p in sorted((ROOT / name).rglob("*.py"))]


def module_of(path):
    parts = ("discmech", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(source, module, is_package, *, typing=True):
    """Absolute names of the modules a source imports (relative ones resolved), a.b for `from a`."""
    tree = ast.parse(source)
    hidden = set()
    if not typing:  # what only a type checker sees does not bind the program
        for node in ast.walk(tree):
            if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
                hidden |= {id(inner) for inner in ast.walk(node)}
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(tree):
        if id(node) in hidden:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{stem}.{alias.name}" for alias in node.names)


def imports_of(path, **how):
    return set(
        imported(
            path.read_text(encoding="utf-8"), module_of(path), path.name == "__init__.py", **how
        )
    )


def within(name, *packages):
    return any(name == p or name.startswith(p + ".") for p in packages)


def under(*folders):
    return [p for p in SOURCES if any(p.is_relative_to(ROOT / f) for f in folders)]


def label(path):
    return str(path.relative_to(ROOT))


# -- who may import whom --------------------------------------------------------------------------


@pytest.mark.parametrize("path", under("integrators"), ids=label)
def test_the_mathematics_imports_nothing_else_of_ours(path):
    assert not [
        n for n in imports_of(path) if within(n, "discmech.reference", "discmech.studies", "tests")
    ]


@pytest.mark.parametrize("path", under("integrators/scenes"), ids=label)
def test_scenes_are_data(path):
    """They know groupoids, algebras, retractions and conserved quantities, and no solver."""
    allowed = (
        "algebras",
        "errors",
        "groupoids",
        "numbers.sympy",
        "retractions",
        "scene",
        "scenes",
    )
    ours = [n for n in imports_of(path) if within(n, *PACKAGES)]
    assert not [n for n in ours if not within(n, *(f"discmech.integrators.{a}" for a in allowed))]


@pytest.mark.parametrize("path", under("studies"), ids=label)
def test_no_study_imports_a_test(path):
    assert not [n for n in imports_of(path) if within(n, "tests")]


@pytest.mark.parametrize("path", under("studies/rendering"), ids=label)
def test_rendering_measures_nothing(path):
    """It sees results as data: neither the integrators, nor the references, nor the studies."""
    names = imports_of(path, typing=False)
    ours = [
        n for n in names if within(n, *PACKAGES) and not within(n, "discmech.studies.rendering")
    ]
    assert not ours or path.stem == "readme_picture"


#: modules that say what was measured: commands, and assertions in their messages
SHOWING = ("__init__", "command", "output", "references", "report", "verifying", "assertions")
MEASURING = [p for p in under("studies") if p.parent == ROOT / "studies" and p.stem not in SHOWING]


@pytest.mark.parametrize("path", MEASURING, ids=label)
def test_measuring_renders_nothing(path):
    names = imports_of(path)
    assert not [
        n for n in names if within(n, "discmech.studies.rendering", "matplotlib", "rich", "jinja2")
    ]


def test_the_rules_would_catch_an_offender():
    def names(text, module="discmech.studies.order", package=False):
        return set(imported(text, module, package))

    assert names("from .rendering import page") == {"discmech.studies.rendering.page"}
    assert names("def f():\n    from . import get") == {"discmech.studies.get"}
    assert names("from .. import a", "x.y.z") == {"x.a"}
    assert names("from ..scene import Scene", "discmech.integrators.scenes", True) == {
        "discmech.integrators.scene.Scene"
    }
    assert names("import discmech.studies.case as c, os") == {"discmech.studies.case", "os"}
    hidden = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import numba"
    assert "numba" in set(imported(hidden, "a.b", False))
    assert "numba" not in set(imported(hidden, "a.b", False, typing=False))


@pytest.mark.parametrize("name", PACKAGES)
def test_what_a_package_offers_it_has(name):
    package = importlib.import_module(name)
    assert sorted(set(package.__all__)) == sorted(package.__all__)
    for offered in package.__all__:
        assert getattr(package, offered) is not None
    assert (ROOT / name.removeprefix("discmech.") / "py.typed").is_file()


# -- the shape of the house -----------------------------------------------------------------------

#: the rooms of integrators/, each below those that import it
ROOMS = (
    "errors", "numbers", "compiler", "algebras", "retractions", "groupoids", "scene", "scenes",
    "rules", "equations", "geometry", "bisections", "flows",
)  # fmt: skip
#: the compiler stands low: these hand it a step as data, run what it makes, or use its cache
COMPILING = {"compiler", "equations", "geometry", "bisections", "flows"}
MODULES = {module_of(p): p for p in SOURCES}


def graph(folder):
    """{module: modules it imports} by files, type hints and functions counted, without faces."""

    def file_of(name):
        while name not in MODULES and "." in name:
            name = name.rpartition(".")[0]
        return name

    files = {m: p for m, p in MODULES.items() if p.name != "__init__.py" and p in under(folder)}
    return {m: (set(map(file_of, imports_of(p))) & set(files)) - {m} for m, p in files.items()}


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_imports_itself_over_others(folder):
    graphlib.TopologicalSorter(graph(folder)).prepare()  # CycleError names the circle


def test_no_chain_of_imports_is_longer_than_fourteen_files():
    arrows, depth = graph("integrators"), {}
    for module in graphlib.TopologicalSorter(arrows).static_order():
        depth[module] = 1 + max((depth[below] for below in arrows[module]), default=0)
    assert max(depth.values()) <= 14


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_downwards_only(room):
    below = {*ROOMS[: ROOMS.index(room) + 1]}
    above = {*ROOMS} - (below if room in COMPILING else below - {"compiler"})
    offenders = [
        (label(path), name)
        for path in under(f"integrators/{room}", f"integrators/{room}.py")
        for name in imports_of(path)
        if within(name, *(f"discmech.integrators.{other}" for other in above))
    ]
    assert not offenders


def test_the_top_level_of_the_mathematics_is_its_rooms():
    found = {p.stem for p in (ROOT / "integrators").iterdir() if p.name[0] not in "_."}
    assert found == {*ROOMS, "py"}  # py.typed


@pytest.mark.parametrize("path", under("integrators"), ids=label)
def test_a_file_is_one_idea_of_at_most_300_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 300


# -- docstrings -----------------------------------------------------------------------------------


def undocumented(module):
    """Public functions and classes without a docstring, and methods that nobody documents.

    A method may inherit its docstring or be the twin of a documented one; a scene's Lagrangian is
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
            if not inspect.getdoc(getattr(thing, inner, member)) and not inspect.getdoc(member):
                yield f"{name}.{inner}"


#: the twin of another class, member by member, which has the docstrings
TWINS = {("discmech.integrators.numbers.arithmetic", "Multiple")}


@pytest.mark.parametrize("name", list(map(module_of, SOURCES)))
def test_everything_public_has_a_docstring(name):
    module = importlib.import_module(name)
    assert module.__doc__
    assert not list(undocumented(module))


def test_twins_are_twins():
    from discmech.integrators.numbers import Double, Multiple

    def members(kind):
        return {n for n in vars(kind) if not n.startswith("_")}

    assert members(Multiple) - members(Double) <= {"bits"}
    assert members(Double) - members(Multiple) <= {"array_namespace", "digits", "eps"}
    for name in members(Multiple) & members(Double):
        ours, theirs = getattr(Double, name), getattr(Multiple, name)
        if inspect.isfunction(ours):
            assert list(inspect.signature(ours).parameters) == list(
                inspect.signature(theirs).parameters
            )


# -- registries -----------------------------------------------------------------------------------


def scene_files():
    return sorted(p for p in (ROOT / "integrators" / "scenes").glob("*.py") if p.stem != "__init__")


def test_every_scene_file_is_registered_and_every_name_has_a_file():
    from discmech.integrators import scenes

    assert sorted(p.stem.replace("_", "-") for p in scene_files()) == sorted(scenes.NAMES)
    assert len(set(scenes.NAMES)) == len(scenes.NAMES)


@pytest.mark.parametrize("path", scene_files(), ids=lambda p: p.stem)
def test_a_scene_is_short_and_says_where_it_comes_from(path):
    from discmech.integrators import scenes

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
    from discmech.integrators import rules as discretisations

    for name, rule in discretisations.BUILT_IN.items():
        assert rule.name == name and rule.source and rule.order
        assert discretisations.get(name) is rule


def test_every_study_has_what_a_study_has():
    from discmech.studies import NAMES, get

    for name in NAMES:
        study = get(name)
        assert name == study.NAME and study.NEEDS and study.DIGITS[0] == 16
        for part in ("cases", "measure", "judge"):
            assert callable(getattr(study, part))


# -- no local traces ------------------------------------------------------------------------------


def tracked():
    if (ROOT / ".git").exists():
        try:
            done = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"],
                                  capture_output=True, check=True, timeout=20)  # fmt: skip
            return [ROOT / name for name in done.stdout.decode().split("\0") if name]
        except (OSError, subprocess.SubprocessError):
            pass
    skipped = {"build", "dist", "node_modules", "__pycache__"}
    return [
        p
        for p in ROOT.rglob("*")
        if p.is_file()
        and not any(part in skipped or part.startswith(".v") for part in p.relative_to(ROOT).parts)
        and not any(part.startswith(".") and part.endswith("cache") for part in p.parts)
    ]


#: folders of somebody's machine, and package indexes other than the public one (letters in brackets
#: so that this file does not find itself)
TRACES = re.compile(
    r"(?<![\w.])/(?:[h]ome|[U]sers|[r]oot|[w]ork|[t]mp)/\w|C:[\\]+[U]sers|"
    r"--(?:extra-)?[i]ndex-url|--[f]ind-links|[l]ocalhost|127\.0\.[0]\.1|[f]ile://"
)


def test_no_file_holds_a_path_or_a_host_of_somebody_s_machine():
    found = []
    for path in tracked():
        if not path.is_file() or path.suffix in (".png", ".pdf", ".ico"):
            continue
        text = path.read_bytes().decode("utf-8", errors="replace")
        found += [f"{label(path)}: {match.group()}" for match in TRACES.finditer(text)]
    assert not found


def test_the_traces_are_recognised():
    for trace in ("/ho" + "me/ann/x", "/Us" + "ers/ann", "--ind" + "ex-url https://a"):
        assert TRACES.search(trace)
    assert not TRACES.search("https://example.org/work/tmp/homepage")


def test_nothing_generated_is_committed():
    for path in tracked():
        name = label(path)
        assert not name.startswith("reports/build/") and not name.endswith((".pyc", ".nbi", ".nbc"))


def test_shipped_text_ends_with_a_line_break_and_has_no_tabs_in_python():
    for path in tracked():
        if path.suffix in (".py", ".md", ".toml") and path.is_file():
            text = path.read_text(encoding="utf-8")
            assert text == "" or text.endswith("\n"), path
            assert path.suffix != ".py" or "\t" not in text, path
