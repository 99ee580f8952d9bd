"""The first day of a stranger: fifteen tasks, each by commands as they would be typed.

Every command is a process of its own with an empty cache. The time of each task is printed by
`pytest -s` and is in a JUnit file's properties.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PASS, FAIL, BAD_INPUT = 0, 1, 2
DISCMECH = ("-m", "discmech.studies.command")
pytestmark = pytest.mark.slow

WRONG_WEIGHT = """
from discmech import discretisation


@discretisation(order=2)
def two_fifths(L, G, x, u, h):
    return h * (2 * L(x, u) + 3 * L(G.target(x, u, h), u)) / 4
"""

STAGES = """
from sympy import Rational

from discmech import discretisation


@discretisation(order=4, stages=1)
def simpson(L, G, x, u, h, s):
    total = 0
    for theta, weight in ((0, 1), (Rational(1, 2), 4), (1, 1)):
        w, dw = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
        total += h * Rational(weight, 6) * L(G.target(x, w, h), dw)
    return total
"""

PLATE = """
from discmech import Conserved, Scene, pair

plate = Scene(
    name="plate",
    groupoid=pair(2),
    parameters={"k": [1, 4]},
    lagrangian=lambda x, v, p: v.dot(v) / 2 - (p.k[0] * x[0] ** 2 + p.k[1] * x[1] ** 2) / 2,
    x0=[1, 0.5],
    v0=[0, 0.3],
    duration=10,
    symmetries=[Conserved("angular momentum", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
)
"""

RELATIVISTIC = """
import sympy

from discmech import Scene, pair

fast = Scene(
    name="fast-particle",
    groupoid=pair(2),
    lagrangian=lambda x, v, p: -sympy.sqrt(1 - v.dot(v)) + 1 / sympy.sqrt(x.dot(x)) / 4,
    x0=[1, 0],
    v0=[0, 0.5],
    duration=10,
)
"""

TRIPLE_PENDULUM = """
import sympy

from discmech import Scene, pair


def lagrangian(x, v, p):
    kinetic = potential = height = across = up = 0
    for angle, rate in zip(x, v, strict=True):
        height = height - sympy.cos(angle)
        across, up = across + sympy.cos(angle) * rate, up + sympy.sin(angle) * rate
        kinetic, potential = kinetic + (across**2 + up**2) / 2, potential + height
    return kinetic - potential


triple = Scene(
    name="triple-pendulum", groupoid=pair(3), lagrangian=lagrangian, x0=[1, 0.5, 0.5],
    v0=[0, 0, 0], duration=5,
)
"""

FOREIGN_TESTS = """
from discmech import discretisation


@discretisation(order=2)
def mine(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u)


def test_order(assert_order):
    assert_order(mine, "pendulum", 2)


def test_an_order_that_it_has_not(assert_order):
    assert_order(mine, "pendulum", 4)
"""

#: (a file, what is said of it): what is wrong, in which line, and what to do
WRONG_FILES = {
    "typo.py": ("def rule(L, G, x, u, h):\n    return h * (L(x, u)\n", "typo.py, line 2: "),
    "empty.py": ("import math\n", "empty.py defines no rule and no scene: decorate"),
    "undecorated.py": ("def rule(L, G, x, u, h):\n    return h * L(x, u)\n",
                       "decorate a function with @discretisation()"),
    "cosine.py": ("from discmech import discretisation\nimport math\n\n@discretisation()\n"
                   "def mine(L, G, x, u, h):\n    return h * L(x, u) * math.cos(x[0])\n",
                   "line 6: "),
    "start.py": ("from discmech import Scene, pair\n\n"
                 "s = Scene(name='s', groupoid=pair(2), lagrangian=lambda x, v, p: v.dot(v),\n"
                 "          x0=[1], v0=[0, 0])\n", "line 3: "),
}  # fmt: skip


class Stranger:
    """A folder with a cache of its own, in which commands are typed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        own = {"DISCMECH_CACHE": str(folder / "cache"), "COLUMNS": "200"}
        self.environment = {**os.environ, **own}

    def write(self, name: str, text: str) -> None:
        (self.folder / name).write_text(text, encoding="utf-8")

    def example(self, name: str) -> None:
        shutil.copy(ROOT / "examples" / name, self.folder)

    def begin(self, *words: str) -> subprocess.Popen[str]:
        """A Python that has the words as its own: a module or a script, and what it is given."""
        # pytest in the background is deaf to interrupts, and what it begins would be
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            return subprocess.Popen(
                [sys.executable, "-P", *words], cwd=self.folder, env=self.environment,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
            )  # fmt: skip
        finally:
            signal.signal(signal.SIGINT, before)

    def types(self, *words: str, ends: int = PASS, before: tuple[str, ...] = DISCMECH) -> str:
        """What is printed by a command that ends with that exit code, and with no traceback."""
        typed = self.begin(*before, *words)
        said, _ = typed.communicate(timeout=600)
        assert typed.returncode == ends, said
        assert "Traceback" not in said
        return said


@pytest.fixture
def stranger(tmp_path, request, record_property):
    begun = time.perf_counter()
    yield Stranger(tmp_path)
    seconds = time.perf_counter() - begun
    record_property("seconds", seconds)
    print(f"{request.node.name.removeprefix('test_')}: {seconds:.1f} s")


def test_a_rule_with_a_wrong_weight(stranger):
    stranger.write("mine.py", WRONG_WEIGHT)
    said = stranger.types("verify", "mine.py", "--scene", "pendulum", "--study", "order", ends=FAIL)
    assert "Cause: factor: L_d is 5/4 times a consistent one" in said
    assert "discmech order harmonic --rule mine.py:two-fifths" in said


def test_a_stage_rule_on_a_group(stranger):
    stranger.write("mine.py", STAGES)
    asked = ("--study", "order", "--digits", "50")
    assert "✓" in stranger.types("verify", "mine.py", "--scene", "pendulum", *asked)
    said = stranger.types("verify", "mine.py", "--scene", "rigid-body", *asked, ends=FAIL)
    assert "G.velocity(x, w, dw, h)" in said
    stranger.write("mine.py", STAGES.replace(", dw)", ", G.velocity(x, w, dw, h))"))
    assert "✓" in stranger.types("verify", "mine.py", "--scene", "rigid-body", *asked)


def test_an_anisotropic_oscillator_with_a_wrong_symmetry(stranger):
    stranger.write("mine.py", PLATE)
    said = stranger.types("momentum", "mine.py", "--rule", "midpoint", ends=FAIL)
    assert "Cause: scene: the motion itself does not keep angular momentum" in said


def test_a_relativistic_particle(stranger):
    stranger.write("mine.py", RELATIVISTIC)
    assert "energy error" in stranger.types("run", "mine.py", "--steps", "100")
    assert "pass" in stranger.types("energy", "mine.py", "--rule", "midpoint")


def test_a_triple_pendulum(stranger):
    stranger.write("mine.py", TRIPLE_PENDULUM)
    assert "100 steps" in stranger.types("run", "mine.py", "--steps", "100")
    asked = ("--study", "order", "--study", "symplecticity", "--digits", "16")
    assert "✗" not in stranger.types("verify", "mine.py", *asked)


@pytest.mark.parametrize("file", ["user_group.py", "user_action.py", "second_kind.py"])
def test_a_group_an_action_and_a_retraction_of_one_s_own(stranger, file):
    stranger.example(file)
    assert "pass" in stranger.types(file, before=())


def test_the_plugin_in_a_repository_of_one_s_own(stranger):
    stranger.write("test_mine.py", FOREIGN_TESTS)
    said = stranger.types("-p", "no:cacheprovider", ends=FAIL, before=("-m", "pytest"))
    assert "1 failed, 1 passed" in said and "the order is 2.000, asked was 4" in said


def test_a_baseline(stranger):
    asked = ("order", "pendulum", "--rule", "mine.py:mine", "--digits", "16")
    sound = WRONG_WEIGHT.replace("two_fifths", "mine").replace("2 * L(", "2.0 * L(")
    stranger.write("mine.py", sound.replace("2.0", "2").replace("3 *", "2 *"))
    assert "saved" in stranger.types(*asked, "--save-baseline", "before")
    assert "equal" in stranger.types(*asked, "--baseline", "before")
    stranger.write("mine.py", sound)
    assert "worse" in stranger.types(*asked, "--baseline", "before", ends=FAIL)


def test_an_interrupted_verify_goes_on(stranger):
    asked = ("verify", "midpoint", "--scene", "kepler", "--scene", "heavy-top", "--jobs", "2")
    typed = stranger.begin(*DISCMECH, *asked)
    assert typed.stdout is not None
    assert next(line for line in typed.stdout if line.startswith("✓"))
    begun = time.monotonic()
    os.killpg(typed.pid, signal.SIGINT)
    typed.communicate(timeout=30)
    stopped = time.monotonic() - begun
    print(f"Ctrl-C: {stopped:.1f} s")
    assert typed.returncode not in (PASS, FAIL)
    assert "cases were measured by an earlier run" in stranger.types(*asked)


def test_a_comparison(stranger):
    stranger.write("mine.py", WRONG_WEIGHT)
    asked = ("--scene", "pendulum", "--study", "order", "--study", "work-precision")
    said = stranger.types("compare", "mine.py", "midpoint", "gauss-3", *asked, ends=FAIL)
    assert re.search(r"pendulum.*take ", said)


@pytest.mark.parametrize("name", WRONG_FILES)
def test_wrong_files(stranger, name):
    text, sentence = WRONG_FILES[name]
    stranger.write(name, text)
    assert sentence in stranger.types("verify", name, ends=BAD_INPUT)


def test_a_new_study(stranger):
    """In a copy of the bench, as its developers do."""
    for name in ("integrators", "reference", "studies", "tests/bench", "reports/templates"):
        shutil.copytree(ROOT / name, stranger.folder / name,
                        ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    for name in ("discmech.py", "pyproject.toml"):
        shutil.copy(ROOT / name, stranger.folder)
    stranger.environment["PYTHONPATH"] = str(stranger.folder)
    assert "discmech my-study" in stranger.types("new", "study", "my-study")
    assert "pass" in stranger.types("my-study", "harmonic", "--rule", "midpoint")


def test_a_cluster_that_is_not_there(stranger):
    """One that is there is in `tests/studies/test_cluster.py`."""
    asked = ("order", "pendulum", "--scheduler", "tcp://[::1]:1")
    said = stranger.types(*asked, ends=BAD_INPUT)
    assert "dask scheduler" in said or "discmech[cluster]" in said
