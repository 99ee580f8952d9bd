"""Steps that are those of a known method to round-off, and so of its order by design."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from discmech.integrators import DiscmechError
from discmech.integrators.extensions.foreign import scene_in_numbers
from discmech.integrators.numbers import Vector, arithmetic

#: a step of a known method leaves less than this: round-off, and where an iteration stops
SAME = 2.0**-36
#: steps of a run that are looked at: at rest some methods agree, and steps may be unlike
STEPS = 16
#: iterations for the state between two parts of a step, of which a separable H needs two
ITERATIONS = 16
#: name ↦ (order, the parts of a step): each moves along the field at one place, which lies at
#: these shares of the part's way in q and in p
KNOWN: dict[str, tuple[int, tuple[tuple[float, float], ...]]] = {
    "the explicit Euler method": (1, ((0, 0),)),
    "the implicit Euler method": (1, ((1, 1),)),
    "the symplectic Euler method, kick and drift": (1, ((0, 1),)),
    "the symplectic Euler method, drift and kick": (1, ((1, 0),)),
    "the implicit midpoint rule": (2, ((0.5, 0.5),)),
    "the trapezoidal rule": (2, ((0, 0), (1, 1))),
    "Störmer–Verlet, kick–drift–kick": (2, ((0, 1), (1, 0))),
    "Störmer–Verlet, drift–kick–drift": (2, ((1, 0), (0, 1))),
}


def known_step(scheme: Any) -> tuple[str, int] | None:
    """Return (name, order) of the known method whose steps a scheme's steps are, or None.

    It is asked on scenes whose state is (q, p) and nothing else: without constraints, a chart or
    the time.
    """
    scene = scheme.scene
    if not scene.groupoid.canonical or scene.all_constraints or scene.clocked:
        return None
    system = scene_in_numbers(scheme.s, scene, arithmetic(16))
    try:
        flow = scheme.flow(scene.step)
        run = flow.trajectory(STEPS)
        rows = np.stack([run.x, run.mu], axis=1).astype(float)
        for name, (order, parts) in KNOWN.items():
            if all(_is_step(parts, system, float(flow.step), *z) for z in pairwise(rows)):
                return name, order
    except DiscmechError:
        return None
    return None


def _is_step(parts: Any, system: Any, h: float, z: Vector, end: Vector) -> bool:
    """Return True if a step with these parts leads from z to end, (2, n) each, to round-off."""

    def way(part: tuple[float, float], a: Vector, b: Vector) -> Vector:
        return h / len(parts) * np.array(system.f(*(a + np.reshape(part, (2, 1)) * (b - a))))

    for part in parts[:-1]:
        start = z
        for _ in range(ITERATIONS):
            z = start + way(part, start, z)
    last = way(parts[-1], z, end)
    return bool((np.abs(end - z - last) <= SAME * (np.abs(z).max() + np.abs(last).max())).all())
