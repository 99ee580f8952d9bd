"""Steps that are those of a known method to round-off, and so of its order by design."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, lru_cache, partial
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from discmech.integrators import DiscmechError
from discmech.integrators.extensions.foreign import scene_in_numbers
from discmech.integrators.numbers import Vector, arithmetic

from ..core.case import Case
from .first_terms import Told

#: a step of a known method leaves less than this: round-off, and where an iteration stops
SAME = 2.0**-36
#: steps of a run that are looked at: at rest some methods agree, and steps may be unlike
STEPS = 16
#: factor of the step at which explicit methods of unlike orders differ by far more, and how often
#: it is taken until the method's steps are not the motion's
LONGER, LONGEST = 4, 6
PARTS = 16  # steps for the motion itself, of which the error is 16⁴ times smaller
#: iterations for the state between two parts of a step, of which a separable H needs two
ITERATIONS = 16
#: (system, h, z, end) ↦ what a step leaves of a method's equation, over the state
Left: TypeAlias = Callable[[Any, float, Vector, Vector], float]
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
#: name ↦ (order, the shares of the step at which stages after the first lie on the slope of the one
#: before, the weights of all stages)
EXPLICIT: dict[str, tuple[int, tuple[float, ...], tuple[float, ...]]] = {
    "the explicit midpoint rule": (2, (1 / 2,), (0, 1)),
    "Heun's method": (2, (1,), (1 / 2, 1 / 2)),
    "the classical Runge–Kutta method": (4, (1 / 2, 1 / 2, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
#: what steps of these methods lack by design (Hairer, Lubich, Wanner 2006, V.1, VI.4); the
#: trapezoidal rule is conjugate to the midpoint rule (VI.8), so that its energy stays in a band
DRIFT = ("the explicit Euler method", "the implicit Euler method", *EXPLICIT)
LACKS = {
    "symplecticity": ("which is not symplectic", (*DRIFT, "the trapezoidal rule")),
    "energy": ("which is not symplectic, so that its energy has no band to stay in", DRIFT),
    "reversibility": (
        "which is not self-adjoint", (*DRIFT, *(name for name in KNOWN if "symplectic" in name)),
    ),
}  # fmt: skip


def by_design(case: Case, law: str) -> Told | None:
    """Return the cause if steps are those of a known method that lacks a law, or an order.

    law: the name of the study that asks.
    """
    if (known := known_step(case.scheme)) is None:
        return None
    name, order = known
    said = f"its steps are those of {name}, to round-off, "
    if law in LACKS:
        lack, names = LACKS[law]
        return ("known method", f"{said}{lack}.") if name in names else None
    if law != "order" or order >= (case.order or 1):
        return None
    more = ""
    if "symplectic Euler" in name:
        when = "late" if name.endswith("drift") else "early"
        more = ", or begin and end with half a kick: it is a leapfrog whose momentum is half a "
        more += f"step {when}"
    return {1: "first order", 2: "second order", 4: "fourth order"}[order], (
        f"{said}which is of order {order} by design: claim order={order}{more}."
    )


@lru_cache(maxsize=64)
def known_step(scheme: Any) -> tuple[str, int] | None:
    """Return (name, order) of the known method whose steps a scheme's steps are, or None.

    It is asked on scenes whose state is (q, p) and nothing else: without constraints, a chart or
    the time; and not of a map of one step. The motion itself is told from the method by the same
    steps: a method of a higher order is as near to it as round-off where they are short.
    """
    scene = scheme.scene
    free = scene.groupoid.canonical and not (scene.all_constraints or scene.clocked)
    if not free or not scheme.rule.follows_motion:
        return None
    system = scene_in_numbers(scheme.s, scene, arithmetic(16))

    @cache
    def steps_of(longer: int) -> list[tuple[float, Vector, Vector]]:
        flow = scheme.flow(scene.step * LONGER**longer)
        run = flow.trajectory(STEPS)
        rows = np.stack([run.x, run.mu], axis=1).astype(float)
        return [(float(flow.step), *z) for z in pairwise(rows)]

    def seen(left: Left, least: int) -> bool:
        """True if all steps are the method's, up to the first sizes that the motion's are not."""
        for longer in range(LONGEST):
            steps = steps_of(longer)
            if any(left(system, *step) > SAME for step in steps):
                return False
            if longer >= least and any(
                left(system, h, z, moved(system, h, z)) > SAME for h, z, _ in steps
            ):
                return True
        return False

    try:
        if not np.ptp([z for _, z, _ in steps_of(0)], axis=0).any():  # at rest all methods agree
            return None
        implicit = [(name, order, partial(_left, parts), 0)
                    for name, (order, parts) in KNOWN.items()]  # fmt: skip
        explicit = [(name, stages[0], partial(_left_of_explicit, stages), 1)
                    for name, stages in EXPLICIT.items()]  # fmt: skip
        for name, order, left, least in implicit + explicit:
            if seen(left, least):
                return name, order
    except DiscmechError:
        return None
    return None


def _left(parts: Any, system: Any, h: float, z: Vector, end: Vector) -> float:
    """Return what a step with these parts from z to end, (2, n) each, leaves of its equation."""

    def way(part: tuple[float, float], a: Vector, b: Vector) -> Vector:
        return h / len(parts) * np.array(system.f(*(a + np.reshape(part, (2, 1)) * (b - a))))

    for part in parts[:-1]:
        start = z
        for _ in range(ITERATIONS):
            z = start + way(part, start, z)
    return _beside(z, end, way(parts[-1], z, end))


def _left_of_explicit(stages: Any, system: Any, h: float, z: Vector, end: Vector) -> float:
    """Return how far the explicit step of such stages from z is from end."""
    return _beside(z, end, _way_of(stages, system, h, z))


def _beside(z: Vector, end: Vector, way: Any) -> float:
    off = np.abs(end - z - way).max() / (np.abs(z).max() + np.abs(way).max())
    return float(off) if np.isfinite(off) else math.inf


def _way_of(stages: Any, system: Any, h: float, z: Vector) -> Any:
    (_, shares, weights), slopes = stages, [np.array(system.f(*z))]
    for share in shares:
        slopes.append(np.array(system.f(*(z + h * share * slopes[-1]))))
    return h * sum(w * slope for w, slope in zip(weights, slopes, strict=True))


def moved(system: Any, h: float, z: Vector) -> Vector:
    """Return the motion after the time h, but for an error far below that of one step."""
    for _ in range(PARTS):
        z = z + _way_of(EXPLICIT["the classical Runge–Kutta method"], system, h / PARTS, z)
    return z
