"""Adding a groupoid, retraction, rule or scene: one new file, and its line in this folder."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.studies.test_new_study import DECLARED, MEASURING, VIEW

ROOT = Path(__file__).resolve().parents[2]
COPIED = (
    "discmech.py", "pyproject.toml", "integrators", "tests/__init__.py", "tests/objects",
    "tests/laws",
)  # fmt: skip

GROUPOID = '''"""The positive numbers, as factors 1 + hu, acting on the line."""

from .local import LocalGroupoid

factors = LocalGroupoid(
    1, 1,
    target=lambda x, u, h: [x[0] * (1 + h * u[0])],
    product=lambda x, u, v, h: [u[0] + v[0] + h * u[0] * v[0]],
    name="factors",
)
'''

RETRACTION = '''"""Two Cayley transforms of half the angle each."""

from dataclasses import dataclass

from .cayley import Cayley, cayley


@dataclass(frozen=True)
class CayleyTwice(Cayley):
    """cay(ξ/2)²."""

    name: str = "cayley-twice"

    def displacement(self, algebra, xi):
        half = cayley.displacement(algebra, xi / 2)
        return 2 * half + half * half

    def inverse_left_field(self, algebra, xi):
        back = cayley.inverse_left_field(algebra, xi / 2)
        right = cayley.invariant_fields(algebra, xi / 2)[1]
        return (back + back * right * back) / 2

    def invariant_fields(self, algebra, xi):
        return tuple(self.inverse_left_field(algebra, s * xi).inv() for s in (1, -1))


twice = CayleyTwice()
'''

RULE = '''"""A rule of two points."""

from .discretisation import discretisation


@discretisation(order=1)
def fifths(L, G, x, u, h):
    """L at the start and at two fifths of the step."""
    return h * (L(x, u) + L(G.target(x, u, 2 * h / 5), u)) / 2
'''

SCENE = '''"""A ball in a quartic well."""

from ..groupoids import pair
from ..scene import Scene

scene = Scene(
    "quartic",
    pair(1),
    lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 4 / 4,
    x0=["0.4"],
    v0=["0.3"],
    step="0.1",
    title="Ball in a quartic well",
    source="a test",
)
'''

#: kind: (the new file, its text, its name there, the list, file and name of a law, cases of it)
ADDED = {
    "groupoid": ("groupoids/factors.py", GROUPOID, "factors", "GROUPOIDS",
                 "test_groupoid_laws.py", "test_axioms and factors", 9),
    "retraction": ("retractions/twice.py", RETRACTION, "twice", "RETRACTIONS",
                   "test_retraction_laws.py", "test_fields_are and twice-su", 3),
    "rule": ("rules/fifths.py", RULE, "fifths", "RULES",
             "test_flow_laws.py", "test_symplectic_and and harmonic-fifths-own-near", 2),
    "scene": ("scenes/quartic.py", SCENE, "scene", "SCENES",
              "test_flow_laws.py", "test_symplectic_and and quartic-midpoint-own-near", 2),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("kind", ADDED)
def test_what_is_added_is_held_to_the_laws(kind, tmp_path):
    file, text, name, listed, laws, law, cases = ADDED[kind]
    copied(COPIED, tmp_path)
    (tmp_path / "integrators" / file).write_text(text, encoding="utf-8")
    module = f"discmech.integrators.{file[:-3].replace('/', '.')}"
    with (tmp_path / "tests" / "objects" / f"{listed.lower()}.py").open("a") as objects:
        objects.write(f"from {module} import {name}\n{listed}[{name}.name] = {name}\n")
    said = python(tmp_path, *PYTEST, "-p", "no:discmech", f"tests/laws/{laws}", "-k", law)
    assert f"{cases} passed" in said


@pytest.mark.slow
def test_a_study_a_scene_and_a_rule_want_no_line_but_their_names(tmp_path):
    """A folder; two files, and their names where they are registered. No test knows a list."""
    copied(("discmech.py", "pyproject.toml", "integrators", "reference", "studies", "tests",
            "reports/templates"), tmp_path)  # fmt: skip
    study, mathematics = tmp_path / "studies" / "distance", tmp_path / "integrators"
    study.mkdir()
    for name, text in (("__init__", DECLARED), ("measuring", MEASURING), ("view", VIEW)):
        (study / f"{name}.py").write_text(text, encoding="utf-8")
    for file, text, _, _, _, _, _ in (ADDED["scene"], ADDED["rule"]):
        (mathematics / file).write_text(text, encoding="utf-8")
    replaced(mathematics / "scenes" / "__init__.py", "NAMES = (", 'NAMES = (\n    "quartic",')
    rules = mathematics / "rules" / "__init__.py"
    replaced(rules, "from .galerkin", "from .fifths import fifths\nfrom .galerkin")
    replaced(rules, "(rectangle, midpoint", "(fifths, rectangle, midpoint")
    python(tmp_path, "discmech.studies.command", "reference", "--rebuild", "quartic")
    said = python(tmp_path, *PYTEST, *AWARE, "-m", "not slow", "-k", " or ".join(OF_ALL))
    assert all(name in said for name in ("quartic", "fifths", "distance"))

    def command(*words):
        return python(tmp_path, "discmech.studies.command", *words)

    names = json.loads(command("list", "--json", "-"))["studies"]
    assert names.index("energy") < names.index("distance") < names.index("contact")
    assert "how far the start is from the origin" in command("--help")
    asked = ("--rule", "midpoint", "--digits", "16", "--steps", "10")
    found = json.loads(command("distance", "kepler", *asked, "--power", "3", "--json", "-"))
    (case,) = found["cases"]
    assert case["measured"]["length"] > 0 and found["command"].endswith("--power 3 --steps 10")
    shown = command("report", "harmonic", *asked, "--jobs", "1", "--folder", "build")
    page = (tmp_path / "build" / "index.html").read_text(encoding="utf-8")
    for words in ("Distance of the start", "Length at the start", "a start says nothing"):
        assert words in page
    assert (
        re.search(r"distance +. pass", shown) and (tmp_path / "build/tables/distance.csv").exists()
    )


#: tests that go over all studies, scenes or rules
AWARE = ("tests/test_registries.py", "tests/test_house.py", "tests/test_pickled.py",
         "tests/studies/test_command.py", "tests/studies/test_records.py",
         "tests/reference/test_reference_tables.py")  # fmt: skip
OF_ALL = ("quartic", "fifths", "distance", "registered", "names_everything", "what_a_study_has",
          "left_over", "no_two_systems")  # fmt: skip
PYTEST = ("pytest", "-v", "-p", "no:cacheprovider")


def copied(sources, tree):
    for source in sources:
        copy = shutil.copytree if (ROOT / source).is_dir() else shutil.copy
        (tree / source).parent.mkdir(exist_ok=True)
        copy(ROOT / source, tree / source)


def replaced(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def python(tree, module, *words):
    """What a module says in that copy, where it ends well."""
    done = subprocess.run(
        [sys.executable, "-m", module, *words], cwd=tree, timeout=600, text=True,
        env={**os.environ, "PYTHONPATH": str(tree)}, capture_output=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
