"""Runs: which rows are kept, how much memory they take, and what is compiled and kept on disk."""

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import discmech.integrators as integrators
from discmech.integrators import (
    Scene,
    Scheme,
    StepFailure,
    compiler,
    midpoint,
    pair,
    places,
    trapezoidal,
)
from tests.objects import ALIKE, ALWAYS, SCENES, SCHEMES, flow, named, scheme

ROOT = Path(integrators.__file__).parents[1]
SOME = [
    ("pendulum", "trapezoidal"),
    ("kepler", "midpoint"),
    ("rigid-body", "midpoint"),
    ("heavy-top", "trapezoidal"),
    ("affine-on-line", "rectangle"),
    ("pendulum", "triple-jump:trapezoidal"),
]
some_schemes = pytest.mark.parametrize(("scene", "rule"), named(SOME))


@pytest.mark.sampled
@some_schemes
@pytest.mark.parametrize("digits", [16, 30])
@pytest.mark.parametrize(("steps", "every"), [(21, 7), (23, 7), (5, 7), (0, 3), (1, 1), (20, 1)])
def test_rows_kept_are_rows_of_the_whole_run(scene, rule, digits, steps, every):
    """The start and each every-th, with exactly the numbers of the run that keeps all."""
    f = flow(scene, rule, "1/20", digits)
    whole, kept = f.trajectory(steps), f.trajectory(steps, every)
    index = list(range(0, steps + 1, every))
    assert len(kept.t) == len(index)
    assert len(whole.t) == steps + 1
    for name in ("t", "x", "u", "mu", "iterations"):
        assert np.array_equal(getattr(kept, name), getattr(whole, name)[index]), name
    assert (kept.newton_mean, kept.newton_max) == (whole.newton_mean, whole.newton_max)
    assert kept.steps == whole.steps == steps


@some_schemes
def test_a_run_longer_than_a_chunk_is_one_run(scene, rule):
    """The driver is called piece by piece; at 30 digits a piece is short."""
    f = flow(scene, rule, "1/20", 30)
    done = []
    long = f.trajectory(140, progress=done.append)
    assert done[-1] == 140
    assert len(done) > 1
    assert np.array_equal(long.mu[:31], f.trajectory(30).mu)


@some_schemes
def test_starting_elsewhere(scene, rule):
    """From a row of a run, the rows that follow; the first guess of Newton does not matter."""
    f = flow(scene, rule, "1/20")
    run = f.trajectory(20)
    x = None if scene == "rigid-body" else run.x[10]
    rest = f.trajectory(10, x0=x, mu0=run.mu[10], u0=run.u[9])
    assert np.abs(rest.mu - run.mu[10:]).max() < 1e-13
    other = f.trajectory(10, x0=x, mu0=run.mu[10])
    assert np.abs(other.mu - rest.mu).max() < 1e-13


def test_steps_may_be_numpy_integers():
    assert len(flow("pendulum", "midpoint", "1/20").trajectory(np.int64(3), np.int32(2)).t) == 2


def peak_of(steps):
    f = flow("pendulum", "trapezoidal", "1/20")
    f.trajectory(10)
    tracemalloc.start()
    try:
        run = f.trajectory(steps, every=1000)
        return run, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    "steps", [10**6, pytest.param(10**7, marks=pytest.mark.slow)], ids=["10^6", "10^7"]
)
def test_memory_is_that_of_the_rows(steps):
    """Every 1000th row of a long run: a million steps more would be 24 MB more if they were kept.

    The allowance beside the rows is for the exact times (fractions) they are computed from.
    """
    run, peak = peak_of(steps)
    assert len(run.t) == steps // 1000 + 1
    rows = sum(a.nbytes for a in (run.t, run.x, run.u, run.mu, run.iterations))
    assert peak < 8 * rows + 200_000
    assert np.isfinite(run.mu).all()


FIRST = """
import sys, warnings
warnings.simplefilter("ignore")
from discmech.integrators import Scheme, midpoint, scenes
from discmech.integrators.compiler import kernels, machine_code
if "--sealed" in sys.argv:
    def build(*_):
        raise AssertionError("derived again")
    kernels.module_text = machine_code._object = build
flow = Scheme(scenes.get("pendulum"), midpoint).flow("0.1")
print(repr(flow.trajectory(5).x[-1, 0]))
"""


def in_a_new_process(cache, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", FIRST, *arguments], cwd=ROOT,
        env={**os.environ, "DISCMECH_CACHE": str(cache), "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def files_of(folder):
    return {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_a_second_process_neither_derives_nor_compiles(tmp_path):
    cache = tmp_path / "kernels"
    first = in_a_new_process(cache)
    files = files_of(cache)
    assert any(p.suffix == ".py" for p in files)
    assert any(p.suffix == ".o" for p in files), "machine code is not kept"
    assert oct(cache.stat().st_mode & 0o777) == "0o700"
    assert in_a_new_process(cache, "--sealed") == first
    code = {p: t for p, t in files_of(cache).items() if p.suffix in (".py", ".o")}
    assert code == {p: t for p, t in files.items() if p.suffix in (".py", ".o")}
    # the seal is a real one: without the files it is broken
    with pytest.raises(AssertionError, match="derived again"):
        in_a_new_process(tmp_path / "other", "--sealed")


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path))
    return tmp_path


def kernels(scheme):
    """The text and the functions of a scheme, nothing remembered from before."""
    compiler.kernel_text.cache_clear()
    system = scheme.equations.step
    return compiler.kernel_text(system), compiler.compile(system, scheme.flow(1).numbers)


def test_steps_parameters_and_starts_compile_nothing_new(own_cache, monkeypatch):
    """Other numbers, the same kernels: the same file and the same function."""
    scene = SCENES["harmonic"]
    text, _ = kernels(Scheme(scene, trapezoidal))
    files = files_of(own_cache)
    changed = [
        scene.with_values(parameters={"stiffness": 2, "mass": "1/3"}),
        scene.with_values(x0=["0.7"], v0=[1], duration=3),
    ]
    monkeypatch.setattr("discmech.integrators.compiler.kernels.module_text", None)
    for s in changed:
        scheme = Scheme(s, trapezoidal)
        assert kernels(scheme)[0] == text
        functions = {id(scheme.flow(h)._kernels.advance) for h in ("1/10", "-3/7", 1e-3)}
        assert len(functions) == 1
    assert files_of(own_cache) == files


def test_changed_parameters_change_the_motion():
    """ω = √(k/m) of the harmonic oscillator, from the same kernels."""
    scene = SCENES["harmonic"].with_values(parameters={"stiffness": 9})
    run = Scheme(scene, trapezoidal).flow("1/1000").trajectory(1000)
    assert abs(run.x[-1, 0] - np.cos(3)) < 1e-5


def test_another_lagrangian_is_another_text():
    def text(lagrangian):
        scene = Scene("same", pair(1), lagrangian, x0=[1], v0=[0])
        return kernels(Scheme(scene, trapezoidal))[0]

    one = text(lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 2)
    assert one == text(lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2)
    assert one != text(lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2)


def test_a_cache_that_cannot_be_written_is_no_obstacle(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("a file where the folder should be")
    monkeypatch.setenv("DISCMECH_CACHE", str(blocked))
    assert kernels(Scheme(SCENES["harmonic"], trapezoidal))[0]
    assert blocked not in places.cache_folder().parents


def vanishing_mass(x, v, p):
    """The mass vanishes at x = 1, which is reached in finite time."""
    return (1 - x[0] ** 2) * v[0] ** 2 / 2


def running_away(x, v, p):
    """Explicit, and at infinity in finite time."""
    return v[0] ** 2 / 2 + x[0] ** 6


@pytest.mark.parametrize("digits", [16, 40])
@pytest.mark.parametrize(
    ("lagrangian", "rule", "cause"),
    [
        (vanishing_mass, midpoint, "Newton did not converge|FL is singular"),
        (running_away, trapezoidal, "FL is singular or the numbers are no longer finite"),
    ],
    ids=["singular", "infinite"],
)
def test_a_failure_in_the_middle_keeps_what_was_reached(lagrangian, rule, cause, digits):
    scene = Scene("doomed", pair(1), lagrangian, x0=["0.1"], v0=[1])
    f = Scheme(scene, rule).flow("1/20", digits)
    with pytest.raises(StepFailure, match=cause) as caught:
        f.trajectory(10_000)
    failure, message = caught.value, str(caught.value)
    assert (failure.scene, failure.rule) == ("doomed", rule.name)
    assert failure.step_index > 3
    assert failure.time == pytest.approx(failure.step_index / 20)
    for part in ("doomed", rule.name, f"step {failure.step_index}", "t = ", "x = ", "mu = "):
        assert part in message
    run = failure.trajectory
    assert len(run.t) == failure.step_index
    good = f.trajectory(failure.step_index - 1)
    assert np.array_equal(run.x, good.x)
    assert np.array_equal(run.mu, good.mu)
    with pytest.raises(StepFailure) as sparse:
        f.trajectory(10_000, every=4)
    assert np.array_equal(sparse.value.trajectory.x, run.x[::4])


def test_a_first_step_that_fails_keeps_nothing():
    with pytest.raises(StepFailure, match=r"pendulum with midpoint: .* at step 0, t = 0") as caught:
        flow("pendulum", "midpoint", "3").trajectory(10)
    assert len(caught.value.trajectory.t) == 0 and set(caught.value.state) == {"x", "mu", "u"}


def test_after_a_failure_the_flow_is_as_before():
    scene = Scene("doomed", pair(1), running_away, x0=["0.1"], v0=[1])
    f = Scheme(scene, trapezoidal).flow("1/20")
    good = f.trajectory(3)
    with pytest.raises(StepFailure):
        f.trajectory(10_000)
    assert np.array_equal(f.trajectory(3).mu, good.mu)


def test_schemes_share_a_kernel_where_and_only_where_they_are_one():
    """On a group every rule is h·l(u); written h(l + l)/2 it may be rounded in another order."""
    schemes = [(s, r) for s, r in SCHEMES if s in ALWAYS]
    files = {s: compiler.kernel_text(scheme(*s).equations.step) for s in schemes}
    shared = [(s, r) for s, r in schemes if files[s, r] == files[s, "midpoint"] and r != "midpoint"]
    assert {s for s, _ in shared} <= ALIKE
    assert ("rigid-body", "rectangle") in shared
    assert len(set(files.values())) == len(schemes) - len(shared)
