"""From a scene and a rule to a flow that can run: derivation, compilation, start from the cache.

Every scene and the free bodies of so(5) and sp(4); large groups by the exponential, with their
reference. Each figure is of a process of its own with an empty cache of kernels.
"""

import os
import subprocess
import sys
import time

import pytest

from discmech.integrators import (
    Scene,
    Scheme,
    cayley,
    exponential,
    lie_group,
    midpoint,
    rectangle,
    scenes,
    se,
    sl,
    so,
    sp,
    su,
    trapezoidal,
)
from discmech.integrators.compiler import compile, kernel_text


def free_body(algebra, retraction=cayley):
    """A free body whose moments are all different."""
    return Scene(
        f"free-{algebra.name.translate(str.maketrans('', '', '()'))}",
        lie_group(algebra, retraction),
        lambda x, v, p: sum((i + 2) * w**2 for i, w in enumerate(v)) / 2,
        v0=[f"{i + 1}/10" for i in range(algebra.dim)],
    )


SCENES = [*scenes.all_scenes(), free_body(so(5)), free_body(sp(4))]
GROUPS = [free_body(algebra, exponential) for algebra in (su(3), sl(3), sp(4), so(5), se(3))]


RULES = [midpoint, trapezoidal]


def measure(scene, rule):
    """(seconds to derive the equations and write the kernels, seconds to compile them)."""
    from discmech.integrators.numbers import arithmetic

    Scheme(scenes.get("harmonic"), rectangle).flow("0.1").trajectory(1)  # imports do not count
    begun = time.perf_counter()
    scheme = Scheme(scene, rule)
    system = scheme.equations.step
    kernel_text(system)
    derived = time.perf_counter()
    compile(system, arithmetic(16))
    return derived - begun, time.perf_counter() - derived


def measure_group(scene):
    """(processor seconds of scheme, check, kernels and 20 steps, those of 50 digits at t = 2)."""
    from discmech.reference import solution

    Scheme(scenes.get("harmonic"), rectangle).flow("0.1").trajectory(1)
    begun = time.process_time()
    Scheme(scene, midpoint).flow("1/20").trajectory(20)
    run = time.process_time()
    solution(scene, 2, digits=50)
    return run - begun, time.process_time() - run


def in_processes(tmp_path, *words):
    """The least of each of two figures from two processes of their own."""
    times = []
    for attempt in range(2):
        folder = tmp_path / str(attempt)
        folder.mkdir(mode=0o700)
        child = subprocess.run(
            [sys.executable, __file__, *words], check=True, capture_output=True, text=True,
            env={**os.environ, "DISCMECH_CACHE": str(folder)},
        )  # fmt: skip
        times.append([float(word) for word in child.stdout.split()])
    return (min(found) for found in zip(*times, strict=True))


@pytest.mark.parametrize("scene", GROUPS, ids=lambda scene: scene.name)
def bench_group(benchmark, scene, tmp_path):
    """At most 10 s of a processor for the run and 6 s for its reference are wanted."""
    run, reference = in_processes(tmp_path, str(GROUPS.index(scene)))
    benchmark.extra_info |= {"run": run, "reference": reference}
    print(f"\n  {scene.name} exponential: run {run:.2f} s, reference {reference:.2f} s")
    benchmark.pedantic(lambda: None, rounds=1)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def bench_scheme(benchmark, scene, rule, tmp_path):
    """Deriving and compiling, both once in a lifetime; the better of two processes of their own."""
    derive, compiling = in_processes(tmp_path, str(SCENES.index(scene)), str(RULES.index(rule)))
    benchmark.extra_info |= {"derive": derive, "compile": compiling}
    print(f"\n  {scene.name} {rule.name}: derive {derive:.2f} s, compile {compiling:.2f} s")
    flow = Scheme(scene, rule).flow(scene.step)
    benchmark.pedantic(lambda: flow.trajectory(1), rounds=1)


STARTS = {
    "discmech list": ["list"],
    "discmech reference pendulum": ["reference", "pendulum"],
    "discmech run pendulum --steps 10": ["run", "pendulum", "--steps", "10"],
    "discmech order pendulum --rule midpoint": ["order", "pendulum", "--rule", "midpoint"],
    "discmech stability harmonic --rule midpoint": ["stability", "harmonic", "--rule", "midpoint"],
}


@pytest.mark.parametrize("name", STARTS)
def bench_start(benchmark, name):
    """A command as a whole process, its kernels compiled before."""

    def run():
        command = [sys.executable, "-m", "discmech.studies.command", *STARTS[name]]
        subprocess.run(command, check=True, capture_output=True, env=dict(os.environ))

    run()
    benchmark.pedantic(run, rounds=3)


if __name__ == "__main__":
    scene, *rule = map(int, sys.argv[1:])
    print(*(measure(SCENES[scene], RULES[rule[0]]) if rule else measure_group(GROUPS[scene])))
