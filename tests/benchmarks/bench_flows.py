"""Compiled flows beside C and scipy, in one run: ratios are printed, nothing is gated on time.

`make bench` runs this. The C programs (gcc -O3 -march=native) stand beside this file: plain ones as
one writes them, and the heavy top with every trick that our driver uses, without its safeguards.
"""

import ctypes
import shutil
import statistics
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discmech.integrators import Scheme, cayley, exponential, midpoint, scenes, trapezoidal
from discmech.integrators.compiler import kernel_text, names_of
from discmech.integrators.compiler.llvm_values import Array
from discmech.integrators.compiler.machine_code import compiled as machine_code

HERE = Path(__file__).parent
STEPS, ROUNDS = 2_000_000, 15  # long enough that starting a run does not count
FLAGS = {"heavy_top_tricks": ["-ffast-math"]}
needs_gcc = pytest.mark.skipif(
    shutil.which("gcc") is None, reason="the benchmarks compile C: install gcc"
)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """C functions by name: f(steps, h, state)."""
    folder = tmp_path_factory.mktemp("c")

    def build(name):
        library = folder / f"{name}.so"
        flags = ["-O3", "-march=native", "-shared", "-fPIC", *FLAGS.get(name, [])]
        subprocess.run(["gcc", *flags, "-o", library, HERE / f"{name}.c", "-lm"], check=True)
        function = getattr(ctypes.CDLL(str(library)), name)
        function.argtypes = [ctypes.c_long, ctypes.c_double, np.ctypeslib.ndpointer(np.float64)]

        def run(state, h):
            state = np.array(state, dtype=np.float64)
            function(STEPS, h, state)
            return state

        return run

    return build


def interleaved(benchmark, ours, others):
    """Time ours and the others in turn; put the median ratios into the benchmark's record."""
    times = {name: [] for name in ("ours", *others)}
    for _ in range(ROUNDS):
        for name, run in {"ours": ours, **others}.items():
            begun = time.perf_counter()
            run()
            times[name].append(time.perf_counter() - begun)
    benchmark.pedantic(ours, rounds=3)
    for name in others:
        pairs = [a / b for a, b in zip(times["ours"], times[name], strict=True)]
        benchmark.extra_info[f"ours / {name}"] = round(statistics.median(pairs), 3)
        best = min(times["ours"]) / min(times[name])
        print(f"\n  ours / {name}: {statistics.median(pairs):.3f} median, {best:.3f} of the minima")
    for name, found in times.items():
        print(f"  {name}: {min(found) / STEPS * 1e9:.1f} ns a step")


@needs_gcc
def bench_stormer_verlet(benchmark, compiled):
    """One sine a step in both; ours also sums with compensation and can keep rows."""
    h, c = 0.01, compiled("stormer_verlet")
    flow = Scheme(scenes.get("pendulum"), trapezoidal).flow(h)
    run = flow.trajectory(STEPS, STEPS)
    assert run.x[-1, 0] == pytest.approx(c([2.0, 0.0], h)[0], abs=1e-8)
    interleaved(benchmark, lambda: flow.trajectory(STEPS, STEPS), {"C": lambda: c([2.0, 0.0], h)})


@needs_gcc
def bench_heavy_top(benchmark, compiled):
    """Cayley, trapezoidal: beside plain C with Newton to 1e-12, and C with every trick."""
    h, plain, tricks = 0.01, compiled("heavy_top"), compiled("heavy_top_tricks")
    scheme = Scheme(scenes.get("heavy-top"), trapezoidal)
    flow = scheme.flow(h)
    run = flow.trajectory(1000)
    u, x, mu = run.u[0], run.x[0], run.mu[0]
    start = [*x, *mu, *u]
    interleaved(
        benchmark,
        lambda: flow.trajectory(STEPS, STEPS),
        {"plain C": lambda: plain(start, h), "C with every trick": lambda: tricks(start, h)},
    )


CORRECTIONS = """
def corrections(out, steps, mu, w, c):
    q = load(c, slice(0, RULE.width))
    p, start, dw = load(mu, slice(0, 6)), load(w, slice(0, 6)), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(steps):
        near = tuple([a + 1e-3 * b for a, b in zip(start, dw)])
        dw, size = RULE.solver((), near, p, (), q)
    save(out, 0, dw)
    return 0, 0
"""


@needs_gcc
@pytest.mark.parametrize("retraction", [cayley, exponential], ids=["cayley", "exponential"])
def bench_correction_on_se3(benchmark, compiled, retraction):
    """One Newton correction of a body in a fluid: beside plain C, which has Cayley's equations."""
    h, c = 0.1, compiled("se3_correction")
    scene = scenes.get("kirchhoff").with_retraction(retraction)
    flow = Scheme(scene, midpoint).flow(h)
    run = flow.trajectory(1)
    text = f"{kernel_text(flow.system)}\n{CORRECTIONS}"
    text = text.replace("def advance(", "def whole(").replace("def corrections(", "def advance(")
    shapes = {"out": Array("f"), "mu": Array("f"), "w": Array("f"), "c": Array("f")}
    kernel = machine_code("corrections", text, names_of(text, flow.numbers), shapes)

    def ours(steps, mu, w, coefficients):
        out = np.zeros(6)
        kernel(out, steps, np.array(mu), np.array(w), coefficients[0])
        return out

    mu, w = tuple(run.mu[0]), tuple(float(v) for v in scene.v0)
    found = ours(STEPS, mu, w, flow.machine.c)
    if retraction is cayley:
        assert found == pytest.approx(c([*mu, *w, *w], h)[12:], rel=1e-12)
    interleaved(
        benchmark,
        lambda: ours(STEPS, mu, w, flow.machine.c),
        {"plain C (Cayley)": lambda: c([*mu, *w, *w], h)},
    )


def bench_heavy_top_beside_scipy(benchmark):
    """The same span of time by DOP853 at rtol 1e-10, equations of motion in numpy."""
    from scipy.integrate import solve_ivp

    inertia, center = np.array([1.0, 2.0, 3.0]), np.array([2 / 3, 1 / 3, 2 / 3])

    def field(t, z):
        x, mu = z[:3], z[3:]
        spin = mu / inertia
        return np.concatenate([np.cross(x, spin), np.cross(mu, spin) - np.cross(x, center) * -1])

    flow = Scheme(scenes.get("heavy-top"), trapezoidal).flow(0.01)
    run = flow.trajectory(2000)
    start = np.concatenate([run.x[0], run.mu[0]])

    def scipys():
        return solve_ivp(field, (0, 20), start, method="DOP853", rtol=1e-10, atol=1e-10)

    energy = [z[3:] @ (z[3:] / inertia) / 2 + z[:3] @ center for z in (start, scipys().y[:, -1])]
    assert energy[0] == pytest.approx(energy[1], abs=1e-7)  # the same equations
    times = []
    for _ in range(5):
        begun = time.perf_counter()
        flow.trajectory(2000, 2000)
        middle = time.perf_counter()
        scipys()
        times.append((middle - begun) / (time.perf_counter() - middle))
    ratio = statistics.median(times)
    benchmark.extra_info["ours / DOP853, T = 20"] = ratio
    print(f"\n  ours (2000 steps of order 2) / DOP853 (rtol 1e-10): {ratio:.2e}")
    benchmark.pedantic(lambda: flow.trajectory(2000, 2000), rounds=5)


def unwatched(scheme, step):
    """The same flow without the look at the chart's extent and the branch after every step."""
    blind = scheme.flow(step)
    blind.__dict__["system"] = replace(blind.system, extents=(), branch=None)
    blind.trajectory(10)
    return blind


def bench_staying_in_one_chart(benchmark):
    """Bisections at hand that nobody needs: at most 5 % over the flow that has none.

    That one knows neither edge nor branch; the flow that refuses the edge runs the same kernels.
    """
    scheme = Scheme(scenes.get("moser-veselov"), trapezoidal)
    with_bisections, refusing = (scheme.flow("0.1", on_edge=e) for e in ("bisect", "refuse"))
    assert with_bisections.trajectory(STEPS, STEPS).edges == 0
    refusing.trajectory(10)
    without = unwatched(scheme, "0.1")
    mu = [flow.trajectory(100).mu for flow in (with_bisections, without)]
    assert np.allclose(*mu, rtol=0, atol=1e-13)
    interleaved(
        benchmark,
        lambda: with_bisections.trajectory(STEPS, STEPS),
        {
            "refuse": lambda: refusing.trajectory(STEPS, STEPS),
            "no bisections": lambda: without.trajectory(STEPS, STEPS),
        },
    )


def bench_watching_the_edge(benchmark):
    """The heavy top with and without the look at its chart's extent after every step."""
    scheme = Scheme(scenes.get("heavy-top"), trapezoidal)
    watched = scheme.flow("0.01")
    watched.trajectory(10)
    blind = unwatched(scheme, "0.01")
    assert np.allclose(blind.trajectory(100).mu, watched.trajectory(100).mu, rtol=0, atol=1e-13)
    interleaved(
        benchmark,
        lambda: watched.trajectory(STEPS, STEPS),
        {"unwatched": lambda: blind.trajectory(STEPS, STEPS)},
    )


def bench_fifty_digits(benchmark):
    """A thousand steps of the heavy top at 50 digits."""
    flow = Scheme(scenes.get("heavy-top"), trapezoidal).flow("0.01", 50)
    flow.trajectory(1)
    benchmark.pedantic(lambda: flow.trajectory(1000, 1000), rounds=3)
