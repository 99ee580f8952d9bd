"""Lattices beside plain C, in one run, and their cost against the number of sites.

Ratios are medians of runs taken in turn, by the process's own time; nothing is gated on them.
"""

import os
import statistics
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from discmech.integrators import Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices import LatticeRun
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies.lattices.cost import C_STEP, c_library, c_states

RULES = {"trapezoidal": trapezoidal, "midpoint": midpoint}
SITES_STEPS = {"trapezoidal": 40_000_000, "midpoint": 4_000_000}  # of a run
ROUNDS = 7
SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)
needs_cc = pytest.mark.skipif(c_library() is None, reason="the benchmarks compile C")


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
def bench_chain_beside_c(benchmark, name, sites):
    lattice = systems.fput(sites, mode=max(1, sites // 50))
    flow, steps = Scheme(lattice, RULES[name]).flow(C_STEP), steps_of(name, sites)
    x, mu = flow._start(None, None)
    few = flow.trajectory(10, 10)
    library = c_library()
    _, c_x, c_p = c_states(library, name, x[:, 0], mu[:, 0], 10)
    assert abs(few.x[-1, :, 0] - c_x).max() < 1e-12
    assert abs(few.mu[-1, 1:-1, 0] - c_p[1:-1]).max() < 1e-12
    times = [(our_run(flow, x, mu, steps), c_states(library, name, x[:, 0], mu[:, 0], steps)[0])
             for _ in range(ROUNDS)]  # fmt: skip
    ours, theirs = (min(column) / steps / sites * 1e9 for column in zip(*times, strict=True))
    ratio = statistics.median(a / b for a, b in times)
    benchmark.extra_info |= {"ours / C": round(ratio, 3)}
    print(f"\n  {name}, {sites}: {ours:.2f} ns a site and step, C {theirs:.2f}; ratio {ratio:.3f}")
    benchmark.pedantic(our_run, (flow, x, mu, steps), rounds=1)


SIDE = 300


def springs(other):
    """A lattice with the springs of the FPUT chain in the place of its own bonds."""
    chain = systems.fput(SIDE)
    return replace(other, on_bond=chain.on_bond, parameters=chain.parameters)


BONDS = {
    "chain": lambda: systems.fput(SIDE**2, mode=SIDE),
    "ring": lambda: springs(systems.rotors(SIDE**2)),
    "net": lambda: springs(systems.membrane(SIDE, SIDE)),
}


@pytest.mark.parametrize("name", RULES)
def bench_bonds(benchmark, name):
    """Of one spring: a ring, and a net of two bonds a site, beside the chain."""
    runs = {}
    for bonds, make in BONDS.items():
        flow = Scheme(make(), RULES[name]).flow("1/10")
        runs[bonds] = flow, *flow._start(None, None)
    steps = steps_of(name, SIDE**2)
    times = {bonds: [] for bonds in runs}
    for _ in range(ROUNDS):
        for bonds, run in runs.items():
            times[bonds].append(our_run(*run, steps) / steps / SIDE**2 * 1e9)
    for bonds, own in times.items():
        ratio = statistics.median(a / b for a, b in zip(own, times["chain"], strict=True))
        benchmark.extra_info |= {f"{bonds} / chain": round(ratio, 3)}
        print(f"\n  {name}, {bonds}: {min(own):.2f} ns a site and step, {ratio:.2f} of the chain")
    benchmark.pedantic(lambda: None, rounds=1)


SCALING = """
import sys, time, tracemalloc
from discmech import Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.lattice_run import LatticeRun
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
