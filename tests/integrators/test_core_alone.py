"""The core runs without its extensions, and computes the same."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from tests.imports import ROOT

SCHEMES = (
    ("pendulum", "trapezoidal"), ("heavy-top", "midpoint"), ("heavy-top", "gauss-2"),
    ("cartesian-pendulum", "midpoint"), ("suslov", "midpoint"), ("kepler", "suzuki:midpoint"),
    ("heavy-top", "rkmk-4"), ("lotka-volterra", "midpoint"), ("moser-veselov", "rectangle"),
    ("driven-heavy-top", "midpoint"),
)  # fmt: skip
NUMBERS = """
import json, sys
from discmech.integrators import DiscmechError, Scheme
from discmech.integrators import rules, scenes

def numbers(scene, rule):
    scheme, values = Scheme(scenes.get(scene), rules.get(rule)), []
    for digits in (16, 30):
        flow = scheme.flow("1/50", digits)
        run = flow.trajectory(4)
        values += [str(e) for row in (*run.base, *run.mu) for e in row]
        try:
            values.append(str(flow.poisson_defect(run.base[2], run.mu[2])))
        except DiscmechError as error:
            values.append(str(error))
    return [scheme.order, scheme.self_adjoint, *values]

out = {f"{scene} {rule}": numbers(scene, rule) for scene, rule in json.loads(sys.argv[1])}
"""
CONTACT = """
try:
    Scheme(scenes.get("bouncing-ball"), rules.get("midpoint")).flow("1/50")
except DiscmechError as error:
    out["contact"] = str(error)

out["names"] = sorted(m for m in sys.modules if m.startswith("discmech.integrators.extensions"))
"""


def printed(folder, code):
    """What the code leaves in `out`, by the copy of the package in a folder."""
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nprint(json.dumps(out))", json.dumps(SCHEMES)],
        cwd=folder, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(folder)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    folder = tmp_path_factory.mktemp("core")
    shutil.copy(ROOT / "discmech.py", folder)
    shutil.copytree(ROOT / "integrators", folder / "integrators",
                    ignore=shutil.ignore_patterns("extensions", "__pycache__"))  # fmt: skip
    return printed(folder, NUMBERS + CONTACT)


@pytest.mark.slow
def test_the_core_computes_the_same_without_its_extensions(alone):
    whole = printed(ROOT, NUMBERS)
    assert set(whole) == {f"{scene} {rule}" for scene, rule in SCHEMES}
    assert {name: alone[name] for name in whole} == whole


@pytest.mark.slow
def test_what_needs_an_extension_says_so(alone):
    assert alone["contact"] == "a scene with contact: that extension is not a part of this copy."
    assert not alone["names"]
