"""From a scene and a rule to a flow that can run: derivation, compilation, start from the cache.

Every scene and the free bodies of so(5) and sp(4). Each figure is of one process with an empty
cache of kernels; sympy's own memory is emptied between schemes.
"""

import os
import subprocess
import sys
import time

import pytest

from integrators import Scene, Scheme, lie_group, midpoint, scenes, so, sp, trapezoidal
from integrators.compiling import kernel_file, load_kernels


def free_body(algebra):
    """A free body whose moments are all different."""
    return Scene(
        f"free-{algebra.name.translate(str.maketrans('', '', '()'))}",
        lie_group(algebra),
        lambda x, v, p: sum((i + 2) * w**2 for i, w in enumerate(v)) / 2,
        v0=[f"{i + 1}/10" for i in range(algebra.dim)],
    )


SCENES = [*scenes.all_scenes(), free_body(so(5)), free_body(sp(4))]


@pytest.mark.parametrize("rule", [midpoint, trapezoidal], ids=lambda rule: rule.name)
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def bench_scheme(benchmark, scene, rule, tmp_path, monkeypatch):
    """Deriving the equations and writing the kernels; compiling them (both once in a lifetime)."""
    from sympy.core.cache import clear_cache

    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path))
    flow_of = Scheme(scenes.get("pendulum"), midpoint)  # imports and numba's start are not counted
    flow_of.flow("0.1").trajectory(1)
    clear_cache()
    begun = time.perf_counter()
    scheme = Scheme(scene, rule)
    kernel_file(scheme)
    derived = time.perf_counter()
    from integrators.arithmetic import arithmetic

    load_kernels(scheme, arithmetic(16))
    compiled = time.perf_counter()
    benchmark.extra_info |= {"derive": derived - begun, "compile": compiled - derived}
    print(
        f"\n  {scene.name} {rule.name}: derive {derived - begun:.2f} s, "
        f"compile {compiled - derived:.2f} s"
    )
    benchmark.pedantic(lambda: scheme.flow(scene.step).trajectory(1), rounds=1)


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
        command = [sys.executable, "-m", "studies.command", *STARTS[name]]
        subprocess.run(command, check=True, capture_output=True, env=dict(os.environ))

    run()
    benchmark.pedantic(run, rounds=3)
