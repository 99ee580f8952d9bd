"""Störmer–Verlet in five forms: one method, so one set of verdicts, one order, one trajectory."""

import shutil
import subprocess

import numpy as np
import pytest

from discmech import Scheme, black_box, external, one_step, recorded, scenes, trapezoidal
from discmech.studies import check
from tests.imports import ROOT

CLAIMS = {"order": 2, "symplectic": True, "keeps": ("momentum",)}
STEPS = 1000  # of which round-off may add up one way, at a few roundings each


@black_box(**CLAIMS)
def as_box(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * system.gradient(q, p)


@one_step(order=2)
def as_map(s, z, h):
    n = z.rows // 2
    q, p = z[:n, :], z[n:, :]
    half = h / 2
    p = p + half * s.f(q.col_join(p))[n:, :]
    q = q + h * s.f(q.col_join(p))[:n, :]
    return q.col_join(p + half * s.f(q.col_join(p))[n:, :])


@pytest.fixture(scope="module")
def forms(tmp_path_factory):
    """{form: rule} of a scene; runs are recorded of the box."""
    folder = tmp_path_factory.mktemp("forms")
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("this machine has no C compiler")
    source = ROOT / "examples" / "external" / "verlet.c"
    subprocess.run([compiler, "-O2", "-o", folder / "verlet", source, "-lm"], check=True)

    def of(scene):
        for k in range(7):
            steps = scene.steps_for(scene.step) * 2**k
            run = Scheme(scene, as_box).flow(scene.duration / steps).trajectory(steps)
            np.savez(folder / f"{scene.name}-{k}.npz", t=run.t, q=run.x, p=run.mu)
        program = external([folder / "verlet"], **CLAIMS, name="as-program")
        runs = recorded(str(folder / f"{scene.name}-*.npz"), **CLAIMS, name="as-runs")
        return {"rule": trapezoidal, "map": as_map, "box": as_box, "program": program, "runs": runs}

    return of


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pendulum", "kepler"])
def test_all_forms_are_one_method(forms, name):
    scene = scenes.get(name)
    rules = forms(scene)
    step = scene.duration / (scene.steps_for(scene.step) * 16)
    ends = {form: Scheme(scene, rule).flow(step).trajectory(STEPS) for form, rule in rules.items()}
    # the motion of kepler stretches differences with t², that of the pendulum with t
    allowed = 4 * np.finfo(float).eps * STEPS
    for run in ends.values():
        for part in ("t", "x", "mu"):
            whole = np.abs(getattr(ends["rule"], part)).max()
            gap = np.abs(getattr(run, part) - getattr(ends["rule"], part)).max()
            assert gap <= allowed * whole
    studies = ["order", "symplecticity"] + ["momentum"] * bool(scene.symmetries)
    for study in studies:
        judged = [r for f, r in rules.items() if f != "runs" or study != "symplecticity"]
        steps = 2000 if study == "momentum" else None
        found = check(study, [scene], judged, digits=[16], steps=steps)
        assert {c["verdict"] for c in found["cases"]} == {"pass"}, [
            (c["rule"], c["verdict"], c["reason"]) for c in found["cases"]
        ]
        if study == "order":
            orders = {c["rule"]: c["measured"]["order"] for c in found["cases"]}
            assert np.ptp(list(orders.values())) < 1e-3, orders
