"""Adding a groupoid, retraction, rule or scene: one new file, and its line in this folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
COPIED = (
    "discmech.py",
    "pyproject.toml",
    "integrators",
    "tests/__init__.py",
    "tests/objects",
    "tests/laws",
)

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
    for source in COPIED:
        copy = shutil.copytree if (ROOT / source).is_dir() else shutil.copy
        (tmp_path / source).parent.mkdir(exist_ok=True)
        copy(ROOT / source, tmp_path / source)
    (tmp_path / "integrators" / file).write_text(text, encoding="utf-8")
    module = f"discmech.integrators.{file[:-3].replace('/', '.')}"
    with (tmp_path / "tests" / "objects" / f"{listed.lower()}.py").open("a") as objects:
        objects.write(f"from {module} import {name}\n{listed}[{name}.name] = {name}\n")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:discmech", "-p", "no:cacheprovider",
         f"tests/laws/{laws}", "-k", law],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}, timeout=300, text=True,
        capture_output=True,
    )  # fmt: skip
    assert f"{cases} passed" in done.stdout, done.stdout + done.stderr
