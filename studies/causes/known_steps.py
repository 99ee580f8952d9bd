"""Steps that are those of a known method to round-off, and so of its order by design."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from discmech.integrators import DiscmechError
from discmech.integrators.numbers import Vector

#: a step of a known method leaves less than this: round-off, and where an iteration stops
SAME = 2.0**-36
#: rows of a run, of which the first and the last begin a step: at rest some methods agree
ROWS = 3
Field: TypeAlias = Callable[[Vector, Vector], tuple[Vector, Vector]]
#: (f, h, q, p, Q, P) ↦ what a step from (q, p) has to add, if (Q, P) is where it ends
Way: TypeAlias = Callable[[Field, float, Vector, Vector, Vector, Vector], Any]


def _kicks(f: Field, h: float, q: Vector, p: Vector, Q: Vector, P: Vector) -> Any:
    half = p + h / 2 * f(q, p)[1]
    return h * f(q, half)[0], h / 2 * (f(q, p)[1] + f(Q, half)[1])


def _drifts(f: Field, h: float, q: Vector, p: Vector, Q: Vector, P: Vector) -> Any:
    middle = q + h / 2 * f(q, p)[0]
    return h / 2 * (f(q, p)[0] + f(middle, P)[0]), h * f(middle, p)[1]


def _at(place: Callable[[Vector, Vector, Vector, Vector], tuple[Vector, Vector]]) -> Way:
    return lambda f, h, *ends: [h * rate for rate in f(*place(*ends))]


#: name ↦ (order, the way of a step); the last two for H(q, p) = T(p) + V(q)
KNOWN: dict[str, tuple[int, Way]] = {
    "the explicit Euler method": (1, _at(lambda q, p, Q, P: (q, p))),
    "the implicit Euler method": (1, _at(lambda q, p, Q, P: (Q, P))),
    "the symplectic Euler method, kick and drift": (1, _at(lambda q, p, Q, P: (q, P))),
    "the symplectic Euler method, drift and kick": (1, _at(lambda q, p, Q, P: (Q, p))),
    "the implicit midpoint rule": (2, _at(lambda q, p, Q, P: ((q + Q) / 2, (p + P) / 2))),
    "Störmer–Verlet, kick–drift–kick": (2, _kicks),
    "Störmer–Verlet, drift–kick–drift": (2, _drifts),
}


def known_step(scheme: Any) -> tuple[str, int] | None:
    """Return (name, order) of the known method whose steps a program's steps are, or None.

    It is asked on scenes whose state is (q, p) and nothing else: without constraints, a chart or
    the time.
    """
    scene = scheme.scene
    if not scene.groupoid.canonical or scene.all_constraints or scene.clocked:
        return None
    try:
        flow = scheme.flow(scene.step)
        run, step, n = flow.trajectory(ROWS), flow.map_of(), flow.system.n
        starts = [np.concatenate([run.x[k], run.mu[k]]).astype(float) for k in (0, ROWS)]
        pairs = [(z, np.asarray(step(z), dtype=float)) for z in starts]
        f, h = flow.system.f, float(flow.step)
        separable = all(_separable(f, *np.split(z, [n]), *np.split(Z, [n])) for z, Z in pairs)
        for name, (order, way) in KNOWN.items():
            if (way in (_kicks, _drifts) and not separable) or not all(
                _is_way(z, Z, np.concatenate(way(f, h, *np.split(z, [n]), *np.split(Z, [n]))))
                for z, Z in pairs
            ):
                continue
            return name, order
    except DiscmechError:
        return None
    return None


def _is_way(z: Vector, Z: Vector, way: Vector) -> bool:
    return bool((np.abs(Z - z - way) <= SAME * (np.abs(z).max() + np.abs(way).max())).all())


def _separable(f: Field, q: Vector, p: Vector, Q: Vector, P: Vector) -> bool:
    """Return True if q̇ changes with p alone, and ṗ with q alone, between these two states."""
    (of_q, of_p), (first, _), (_, last) = f(q, p), f(Q, p), f(q, P)
    sizes = [SAME * np.abs(e).max(initial=0.0) for e in (of_q, of_p)]
    return bool(
        (np.abs(first - of_q) <= sizes[0]).all() and (np.abs(last - of_p) <= sizes[1]).all()
    )
