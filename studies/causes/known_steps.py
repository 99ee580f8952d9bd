"""Steps that are those of a known method to round-off, and so of its order by design."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

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
LONGER = 4  # factor of the step at which explicit methods of unlike orders differ by far more
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


def known_step(scheme: Any) -> tuple[str, int] | None:
    """Return (name, order) of the known method whose steps a scheme's steps are, or None.

    It is asked on scenes whose state is (q, p) and nothing else: without constraints, a chart or
    the time; and not of a map of one step.
    """
    scene = scheme.scene
    free = scene.groupoid.canonical and not (scene.all_constraints or scene.clocked)
    if not free or not scheme.rule.follows_motion:
        return None
    system = scene_in_numbers(scheme.s, scene, arithmetic(16))
    steps: list[tuple[float, Vector, Vector]] = []
    try:
        for factor in (1, LONGER):
            flow = scheme.flow(scene.step * factor)
            run = flow.trajectory(STEPS)
            rows = np.stack([run.x, run.mu], axis=1).astype(float)
            if not np.ptp(rows, axis=0).any():  # at rest all methods agree
                return None
            steps += [(float(flow.step), *z) for z in pairwise(rows)]
        for name, (order, parts) in KNOWN.items():
            if all(_is_step(parts, system, *step) for step in steps[:STEPS]):
                return name, order
        for name, (order, shares, weights) in EXPLICIT.items():
            if all(_is_explicit(shares, weights, system, *step) for step in steps):
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
    return _is_way(z, end, way(parts[-1], z, end))


def _is_explicit(shares: Any, weights: Any, system: Any, h: float, z: Vector, end: Vector) -> bool:
    """Return True if the explicit step of such stages leads from z to end, to round-off."""
    slopes = [np.array(system.f(*z))]
    for share in shares:
        slopes.append(np.array(system.f(*(z + h * share * slopes[-1]))))
    return _is_way(z, end, h * sum(w * slope for w, slope in zip(weights, slopes, strict=True)))


def _is_way(z: Vector, end: Vector, way: Any) -> bool:
    return bool((np.abs(end - z - way) <= SAME * (np.abs(z).max() + np.abs(way).max())).all())
