"""The rules of the house: who may import whom, and the shape of the folders."""

import graphlib

import pytest

from tests.imports import FOLDERS, ROOT, SOURCES, imported, imports_of, module_of, under, within

PACKAGES = tuple(f"discmech.{name}" for name in FOLDERS)


def label(path):
    return str(path.relative_to(ROOT))


def offences(paths, forbidden, **how):
    """{file: what it imports of the forbidden packages}."""
    found = {label(p): [n for n in imports_of(p, **how) if within(n, *forbidden)] for p in paths}
    return {file: names for file, names in found.items() if names}


def test_the_mathematics_imports_nothing_else_of_ours():
    others = ("discmech.reference", "discmech.studies", "tests")
    assert not offences(under("integrators"), others)


@pytest.mark.slow
def test_no_study_imports_a_test():
    assert not offences(under("studies"), ["tests"])


@pytest.mark.parametrize(
    "path",
    under(
        "integrators/scenes",
        "integrators/extensions/lattices/scenes",
        "integrators/extensions/control/scenes",
    ),
    ids=label,
)
def test_scenes_are_data(path):
    """They know groupoids, algebras, retractions and conserved quantities, and no solver."""
    room = ".".join(path.relative_to(ROOT / "integrators").parts[:-1])
    allowed = ("algebras", "errors", "groupoids", "hooks.getter", "hooks.rooms_of_systems",
               "numbers.exact_rational", "numbers.sympy", "numbers.types", "retractions", "scene",
               "scenes", room, "extensions.lattices.Lattice",
               "extensions.control.Control")  # fmt: skip
    ours = [n for n in imports_of(path) if within(n, *PACKAGES)]
    assert not [n for n in ours if not within(n, *(f"discmech.integrators.{a}" for a in allowed))]


STUDIES = ROOT / "studies"
VIEWS = [p for p in under("studies") if p.parent == STUDIES / "report" or p.stem == "view"
         or p.stem.startswith("plot")]  # fmt: skip
#: what says what was measured: commands, assertions in their messages, `plot`, `film`, and a
#: result in a notebook
SHOWING = (*VIEWS, *under("studies/command"), STUDIES / "__init__.py", STUDIES / "plugin.py",
           STUDIES / "user/assertions.py", STUDIES / "core/study.py",
           STUDIES / "user/drawing.py", STUDIES / "user/filming.py",
           STUDIES / "user/checking.py")  # fmt: skip


@pytest.mark.parametrize("path", VIEWS, ids=label)
def test_views_measure_nothing(path):
    """They see records: neither the integrators, nor the references, nor the measuring."""
    folder = ".".join(("discmech", *path.parent.relative_to(ROOT).parts))
    plots = tuple(f"{folder}.{p.stem}" for p in path.parent.glob("plot*.py"))
    shown = ("discmech.studies.report", "discmech.studies.core.study", *plots,
             "discmech.studies.core.records", f"{folder}.records",
             "discmech.studies.core.ours", "discmech.studies.core.outcome",
                 "discmech.studies.core.result",
             "discmech.integrators.files")  # fmt: skip
    ours = [n for n in imports_of(path, typing=False) if within(n, *PACKAGES)]
    assert not [n for n in ours if not within(n, *shown)]


@pytest.mark.slow
def test_measuring_shows_nothing():
    shown = ("discmech.studies.report", "matplotlib", "rich", "jinja2")
    assert not offences([p for p in under("studies") if p not in SHOWING], shown)


def test_the_rules_would_catch_an_offender():
    def names(text, module="discmech.studies.order.measuring", package=False):
        return set(imported(text, module, package))

    assert names("from ..report import page") == {"discmech.studies.report.page"}
    assert names("def f():\n    from .. import get") == {"discmech.studies.get"}
    assert names("from .. import a", "x.y.z") == {"x.a"}
    assert names("from ..scene import Scene", "discmech.integrators.scenes", True) == {
        "discmech.integrators.scene.Scene"
    }
    assert names("import discmech.studies.core.case as c, os") == {
        "discmech.studies.core.case",
        "os",
    }
    hidden = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import llvmlite"
    assert "llvmlite" in set(imported(hidden, "a.b", False))
    assert "llvmlite" not in set(imported(hidden, "a.b", False, typing=False))


#: the rooms of the core, each below those that import it
CORE = (
    "errors", "hooks", "files", "places", "numbers", "compiler", "runs", "algebras", "retractions",
    "groupoids", "scene", "rules", "equations", "geometry", "bisections", "flows", "scenes",
)  # fmt: skip
#: what a scene may need and most do not, likewise
EXTENSIONS = (
    "expansions", "contact", "lattices", "foreign", "control", "proven", "steps", "export",
)  # fmt: skip
ROOMS = (*CORE, *(f"extensions.{room}" for room in EXTENSIONS))
#: the compiler stands low: these hand it a step as data, run what it makes, or use its cache
COMPILING = {
    "compiler", "runs", "equations", "geometry", "bisections", "flows",
    *(f"extensions.{room}" for room in ("contact", "lattices", "steps", "export")),
}  # fmt: skip
MODULES = {module_of(p): p for p in SOURCES}


def graph(folder):
    """{module: modules it imports} by files, type hints and functions counted, without faces."""

    def file_of(name):
        while name not in MODULES and "." in name:
            name = name.rpartition(".")[0]
        return name

    here = set(under(folder))
    files = {m: p for m, p in MODULES.items() if p.name != "__init__.py" and p in here}
    return {m: (set(map(file_of, imports_of(p))) & set(files)) - {m} for m, p in files.items()}


@pytest.mark.dear(but=("reference",))
@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_imports_itself_over_others(folder):
    graphlib.TopologicalSorter(graph(folder)).prepare()  # CycleError names the circle


@pytest.mark.slow
def test_no_chain_of_imports_is_longer_than_fourteen_files():
    arrows, depth = graph("integrators"), {}
    for module in graphlib.TopologicalSorter(arrows).static_order():
        depth[module] = 1 + max((depth[below] for below in arrows[module]), default=0)
    assert max(depth.values()) <= 14


#: the rooms of reference/, likewise
REFERENCE = ("failures", "progress", "equations", "taylor", "enclosure", "closed_forms", "answer")


@pytest.mark.parametrize("room", REFERENCE)
def test_rooms_of_the_references_import_downwards_only(room):
    above = REFERENCE[REFERENCE.index(room) + 1 :]
    here = under(f"reference/{room}", f"reference/{room}.py")
    assert here and not offences(here, [f"discmech.reference.{other}" for other in above])


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_downwards_only(room):
    below = {*ROOMS[: ROOMS.index(room) + 1]}
    above = {*ROOMS} - (below if room in COMPILING else below - {"compiler"})
    folder = f"integrators/{room.replace('.', '/')}"
    here = under(folder, f"{folder}.py")
    assert here and not offences(here, [f"discmech.integrators.{other}" for other in above])


@pytest.mark.slow
def test_the_core_names_no_extension():
    core = [p for room in CORE for p in under(f"integrators/{room}", f"integrators/{room}.py")]
    assert not offences(core, ["discmech.integrators.extensions"])
    assert not [label(p) for p in core if "integrators.extensions" in p.read_text("utf-8")]


def test_the_top_level_of_the_mathematics_is_its_rooms():
    for folder, rooms in (("integrators", (*CORE, "extensions", "py")),  # py.typed
                          ("integrators/extensions", EXTENSIONS)):  # fmt: skip
        found = {p.stem for p in (ROOT / folder).iterdir() if p.name[0] not in "_."}
        assert found == {*rooms}


def test_a_file_is_one_idea_of_at_most_500_lines():
    lines = {label(p): len(p.read_text("utf-8").splitlines()) for p in under("integrators")}
    assert not {file: count for file, count in lines.items() if count > 500}
