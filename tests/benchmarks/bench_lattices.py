"""Lattices beside plain C, in one run, and their cost against the number of sites.

Ratios are medians of runs taken in turn, by the process's own time; nothing is gated on them.
"""

import ctypes
import os
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from discmech.integrators import Scheme, midpoint, trapezoidal
from discmech.integrators.lattices import systems
from discmech.integrators.lattices.lattice_run import LatticeRun

HERE, H, ALPHA, BETA = Path(__file__).parent, 0.125, 0.25, 0.1
RULES = {"stoermer_verlet": trapezoidal, "midpoint": midpoint}
SITES_STEPS = {"stoermer_verlet": 40_000_000, "midpoint": 4_000_000}  # of a run
ROUNDS = 7
SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)
needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="the benchmarks compile C")


@pytest.fixture(scope="module")
def c_library(tmp_path_factory):
    library = tmp_path_factory.mktemp("c") / "lattice.so"
    flags = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "-o", library, HERE / "lattice.c"], check=True)
    return ctypes.CDLL(str(library))


def c_run(library, name, x, mu, steps):
    """Seconds of C, and its x and p."""
    x, p, sites = x[:, 0].copy(), mu[:, 0].copy(), len(x)
    arrays = [x, p] if name == "stoermer_verlet" else [x, p, p.copy(), np.zeros(2 * sites)]
    numbers = map(ctypes.c_double, (H, ALPHA, BETA))
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
    begun = time.process_time()
    getattr(library, name)(ctypes.c_long(sites), ctypes.c_long(steps), *numbers, *pointers)
    return time.process_time() - begun, x, p


def our_run(flow, x, mu, steps):
    run = LatticeRun(flow, x.copy(), mu.copy())
    run.advance(1)
    begun = time.process_time()
    run.advance(steps)
    return time.process_time() - begun


def steps_of(name, sites):
    return max(10, SITES_STEPS[name] // sites)


@needs_cc
@pytest.mark.parametrize("sites", SIZES)
@pytest.mark.parametrize("name", RULES)
def bench_chain_beside_c(benchmark, c_library, name, sites):
    lattice = systems.fput(sites, mode=max(1, sites // 50))
    flow, steps = Scheme(lattice, RULES[name]).flow(H), steps_of(name, sites)
    x, mu = flow._start(None, None)
    few = flow.trajectory(10, 10)
    _, c_x, c_p = c_run(c_library, name, x, mu, 10)
    assert abs(few.x[-1, :, 0] - c_x).max() < 1e-12
    assert abs(few.mu[-1, 1:-1, 0] - c_p[1:-1]).max() < 1e-12
    times = [(our_run(flow, x, mu, steps), c_run(c_library, name, x, mu, steps)[0])
             for _ in range(ROUNDS)]  # fmt: skip
    ours, theirs = (min(column) / steps / sites * 1e9 for column in zip(*times, strict=True))
    ratio = statistics.median(a / b for a, b in times)
    benchmark.extra_info |= {"ours / C": round(ratio, 3)}
    print(f"\n  {name}, {sites}: {ours:.2f} ns a site and step, C {theirs:.2f}; ratio {ratio:.3f}")
    benchmark.pedantic(our_run, (flow, x, mu, steps), rounds=1)


BONDS = {
    "chain": lambda: systems.fput(90_000, mode=1000),
    "ring of rotors": lambda: systems.rotors(90_000),
    "net": lambda: systems.membrane(300, 300),
}


@pytest.mark.parametrize("name", RULES)
@pytest.mark.parametrize("bonds", BONDS)
def bench_bonds(benchmark, name, bonds):
    lattice = BONDS[bonds]()
    flow, steps = Scheme(lattice, RULES[name]).flow("1/10"), steps_of(name, lattice.sites)
    x, mu = flow._start(None, None)
    seconds = min(our_run(flow, x, mu, steps) for _ in range(3))
    print(f"\n  {name}, {bonds}: {seconds / steps / lattice.sites * 1e9:.2f} ns a site and step")
    benchmark.pedantic(our_run, (flow, x, mu, steps), rounds=1)


SCALING = """
import sys, time, tracemalloc
from discmech import Scheme, midpoint, trapezoidal
from discmech.integrators.lattices import systems
from discmech.integrators.lattices.lattice_run import LatticeRun
sites, rule = int(sys.argv[1]), {"trapezoidal": trapezoidal, "midpoint": midpoint}[sys.argv[2]]
lattice = systems.fput(sites)
Scheme(systems.fput(4), trapezoidal if rule is midpoint else midpoint)  # sympy is loaded
begun = time.perf_counter()
flow = Scheme(lattice, rule).flow("1/8")
flow.kernels
ready = time.perf_counter() - begun
tracemalloc.start()
run = LatticeRun(flow, *flow._start(None, None))
run.advance(10)
print(ready, tracemalloc.get_traced_memory()[1] / sites)
"""


@pytest.mark.parametrize("rule", ["trapezoidal", "midpoint"])
@pytest.mark.parametrize("sites", SIZES)
def bench_derivation_and_memory(benchmark, tmp_path, rule, sites):
    """Seconds to derive and compile with an empty cache, and bytes a site of a run."""
    environment = {**os.environ, "DISCMECH_CACHE": str(tmp_path)}
    command = [sys.executable, "-c", SCALING, str(sites), rule]
    output = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    ready, memory = map(float, output.stdout.split())
    print(f"\n  {rule}, {sites}: {ready:.2f} s to derive and compile, {memory:.0f} bytes a site")
    benchmark.pedantic(lambda: None, rounds=1)
