"""Where a map of numbers is looked at: states around the motion and steps, which it cannot know."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from discmech.integrators.numbers import Matrix, Vector, exact_rational

ROWS = 400  # steps of the motion that are followed, at most
APART = 0.15  # of the motion's size, by which places lie off it in every coordinate
COUNT = 8
GRID = 2**20  # steps are whole numbers of a scene's step over this: exact, and no power of two


@dataclass(frozen=True)
class Place:
    """A state z = (x, μ), a time and a step, both exact, and the rate ‖∂f/∂z‖ there."""

    z: Vector
    time: Any
    step: Any
    rate: float


@dataclass(frozen=True)
class Motion:
    """The motion in numbers: its rows (r, n+m), and the size of each entry (n+m,)."""

    rows: Matrix
    scale: Vector


def motion(flow: Any) -> Motion:
    """The scene's motion by a method of the bench's own on its field: no box has a part in it."""
    system, scene = flow.system, flow.scheme.scene
    run = flow.trajectory(0)
    n, h = system.n, float(scene.step)
    z = np.concatenate([run.x[0], run.mu[0]]).astype(float)
    rows, time = [z], 0.0

    def f(z: Vector, t: float) -> Vector:
        return np.concatenate(system.f(z[:n], z[n:], t)).astype(float)

    for _ in range(min(ROWS, scene.steps_for(scene.step))):
        a = f(z, time)
        b = f(z + h / 2 * a, time + h / 2)
        c = f(z + h / 2 * b, time + h / 2)
        z = z + h / 6 * (a + 2 * b + 2 * c + f(z + h * c, time + h))
        if not np.isfinite(z).all():
            break
        time += h
        rows.append(z)
    found = np.array(rows)
    reach, size = np.ptp(found, axis=0), np.abs(found).max(axis=0)
    # an entry that hardly moves has the size of its value, or of what is like it
    parts = (slice(0, n), slice(n, None))
    like = np.concatenate([np.full(len(size[p]), size[p].max(initial=0.0)) for p in parts])
    scale = np.where(reach > 1e-3 * size, np.maximum(reach, 1e-3 * size), size)
    scale = np.where(scale > 1e-9 * like, scale, like)
    return Motion(found, np.where(scale > 0, scale, 1.0))


def seed_of(scheme: Any) -> int:
    """A number that belongs to the scene and the rule: from their names, values and text."""
    scene, rule = scheme.scene, scheme.rule
    code = getattr(rule.formula, "__code__", None)
    words = [scene.name, rule.name, repr((scene.parameters, scene.x0, scene.v0, scene.step))]
    words += [code.co_code.hex()] if code is not None else []
    return int.from_bytes(hashlib.sha256("\0".join(words).encode()).digest()[:6], "big")


def places(scheme: Any, count: int = COUNT) -> tuple[list[Place], Motion]:
    """`count` places: half on the motion, half off it; steps from half of the scene's to one
    radian of the fastest motion there, which is far from the stable ones of no method."""
    random = np.random.default_rng(seed_of(scheme))
    own = scheme.scene.step
    flow = scheme.flow(own)
    moved = motion(flow)
    found = []
    for k in range(count):
        z = moved.rows[random.integers(len(moved.rows))].copy()
        if k % 2:
            z += (
                APART
                * moved.scale
                * random.uniform(0.3, 1.0, len(z))
                * random.choice([-1, 1], len(z))
            )
        size = float(own) * random.uniform(0.5, 1.0)
        time = exact_rational(own, "step") * int(random.integers(100)) if scheme.s.clocked else 0
        fast = rate(flow.system, z, moved.scale, float(time))
        # the later the place, the nearer its step to the shortest time of the motion
        share = (k + random.uniform(0.2, 0.8)) / count
        size *= max(1.0, 1 / (fast * size)) ** share
        step = (
            exact_rational(own, "step")
            * round(size / float(own) * GRID + random.integers(64))
            / GRID
        )
        found.append(Place(z, time, step, fast))
    return found, moved


def rate(system: Any, z: Vector, scale: Vector, time: float) -> float:
    """‖∂f/∂z‖₂ at z in units of the scale, by differences: one over the motion's shortest time."""
    n = system.n
    columns = []
    for j, d in enumerate(scale):
        way = np.zeros(len(z))
        way[j] = 1e-4 * d
        ends = [np.concatenate(system.f(a[:n], a[n:], time)) for a in (z + way, z - way)]
        columns.append((ends[0] - ends[1]) / 2e-4)
    matrix = np.array(columns, dtype=float).T / scale[:, None]
    return float(np.linalg.norm(matrix, 2)) if np.isfinite(matrix).all() else math.inf
