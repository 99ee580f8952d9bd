"""Jointed bodies: time a link and step, Newton's corrections, and the slope of a step's cost.

Beside Pinocchio's articulated-body algorithm, one evaluation of the accelerations, in the same run
where its package is there (pip install pin; docs/lattices.md).
"""

import time

import numpy as np
import pytest

from discmech.integrators import Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices.lattice_run import LatticeRun
from discmech.integrators.extensions.lattices.scenes import linkages

CHAINS = {
    "rods": linkages.rods,
    "spherical": lambda links, rate=0.3: linkages.linkage(links, "spherical", rate),
    "revolute": lambda links, rate=0.3: linkages.linkage(links, "revolute", rate),
}
RULES = {"trapezoidal": trapezoidal, "midpoint": midpoint}
LINKS, SIZES = (8, 100), (100, 1_000, 10_000, 100_000)
STEP, LINK_STEPS, ROUNDS = "1/1000", 200_000, 5


def cost(flow, links):
    """(nanoseconds a link and step, corrections a step)."""
    run, steps = LatticeRun(flow, *flow._start(None, None)), max(5, LINK_STEPS // links)
    run.checked(run.advance(10))
    before, times = run.totals.copy(), []
    for _ in range(ROUNDS):
        begun = time.process_time()
        run.checked(run.advance(steps))
        times.append(time.process_time() - begun)
    corrections = (run.totals - before)[0] / steps / ROUNDS
    return min(times) / steps / links * 1e9, corrections


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("chain", CHAINS)
def bench_a_link_and_step(benchmark, chain, rule):
    for links in LINKS:
        flow = Scheme(CHAINS[chain](links), RULES[rule]).flow(STEP)
        ns, corrections = cost(flow, links)
        benchmark.extra_info |= {f"ns at {links}": ns, f"corrections at {links}": corrections}
        print(f"\n  {chain}, {rule}, {links} links: {ns:.0f} ns a link and step, "
              f"{corrections:.2f} corrections a step")  # fmt: skip
    benchmark.pedantic(lambda: None, rounds=1)


@pytest.mark.parametrize("chain", ["rods", "spherical"])
def bench_the_slope_of_the_cost(benchmark, chain):
    """Of a correction's time against the links, which fall from rest; 1 is linear."""
    seconds = []
    for links in SIZES:
        ns, corrections = cost(Scheme(CHAINS[chain](links, 0), trapezoidal).flow(STEP), links)
        seconds.append(ns * links / corrections)
        print(f"\n  {chain}, {links} links: {ns:.0f} ns a link and step, {corrections:.2f} "
              "corrections")  # fmt: skip
    slope = np.polyfit(np.log(SIZES), np.log(seconds), 1)[0]
    benchmark.extra_info |= {"slope": slope}
    print(f"\n  {chain}: a correction's time grows as links^{slope:.3f}")
    benchmark.pedantic(lambda: None, rounds=1)


@pytest.mark.parametrize("links", LINKS)
def bench_pinocchio(benchmark, links):
    """The articulated-body algorithm of the same chain on spherical joints, called from Python."""
    pin = pytest.importorskip("pinocchio")
    model, before = pin.Model(), 0
    inertia = pin.Inertia(1.0, np.array([0.5, 0, 0]), np.diag([1 / 100, 1 / 12, 1 / 12]))
    for i in range(links):
        at = pin.SE3(np.eye(3), np.array([1.0 if i else 0.0, 0, 0]))
        before = model.addJoint(before, pin.JointModelSpherical(), at, f"joint{i}")
        model.appendBodyToJoint(before, inertia, pin.SE3.Identity())
    data, q, none = model.createData(), pin.neutral(model), np.zeros(model.nv)
    calls = 100_000 // links
    times = []
    for _ in range(ROUNDS):
        begun = time.process_time()
        for _ in range(calls):
            pin.aba(model, data, q, none, none)
        times.append(time.process_time() - begun)
    print(f"\n  Pinocchio, {links} links: {min(times) / calls / links * 1e9:.0f} ns a link")
    benchmark.pedantic(lambda: None, rounds=1)
