"""The start of Newton's method: the ends of a control problem, and a motion between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from ...equations import SceneSymbols, momentum
from ...errors import RAISED, BadInput, line_of
from ...numbers import evaluate_matrix, first_violation, jacobian, numeric, sympy, to_sympy
from ...numbers.types import Given, Matrix, Numbers, Vector
from .stages import ControlStages

#: (x1, v1) where a motion ends, None for what is free; and t ↦ a point near it
End: TypeAlias = tuple[Sequence[Given] | None, Sequence[Given] | None]
Path: TypeAlias = Callable[[float], Numbers]

FLAT = 1e-9  # a smaller singular value of the anchor, relative to the largest, counts as 0
SAME = 1e-7  # relative; an end in decimals that is less off is judged by where its motion ends
MOST = 60  # largest number of corrections of the straight arrow


def first_guess(
    stages: ControlStages, end: End, t: Vector, path: Path | None, cubic: bool = False
) -> tuple[Vector, Vector, Matrix, tuple[Matrix, Matrix, Matrix]]:
    """Return z0 and z1 (n+m), the projection onto the conditions of the end, and a start (z, p, v).

    The start follows `path`, or the straight arrow b(x0, u; t) to x1, without a control. cubic: in
    place of ut the cubic polynomial, in the chart of arrows from x0, with the velocities of both
    ends. Raises `BadInput` if a quantity that every motion keeps is another at x1.
    """
    scene, s, n, m = stages.scene, stages.s, stages.n, stages.m
    data: list[Any] = [scene.x0, scene.v0, *end]
    parts: list[Any] = [e if e is None else np.array([float(a) for a in e]) for e in data]
    x0, v0, x1, v1 = parts
    if x1 is None and v1 is not None and not jacobian(momentum(s), s.position).is_zero_matrix:
        raise BadInput(
            f"{scene.name}: the momentum depends on x, so an end of v1 alone is none; give x1 too."
        )
    if end[0] is not None:
        _check_orbit(stages, scene.x0, end[0])
    points = _points(stages, x0, v0, x1, t, path, v1 if cubic else None, cubic)
    at = np.vstack([points, points[-1] if x1 is None else x1])
    ends = stages.along(at[[0, -1]], np.vstack([v0, v0 if v1 is None else v1]), t[[0, -1]])
    (mu0, mu1), (_, anchor) = ends
    fixed = np.zeros((n + m, n + m))
    if x1 is not None and n:
        U, size, _ = np.linalg.svd(anchor)
        reached = U[:, : len(size)][:, size > FLAT * size.max(initial=0)]
        fixed[:n, :n] = reached @ reached.T
    if v1 is not None:
        fixed[n:, n:] = np.eye(m)
    share = (t / t[-1])[:, None]
    wished = v0 + share * (0 * v0 if v1 is None else v1 - v0)
    middle = (points[1:] + points[:-1]) / 2
    _, anchors = stages.along(middle, wished[1:], t[1:])
    back = np.linalg.pinv(anchors, rcond=FLAT)
    rates = np.diff(points, axis=0) / np.diff(t)[:, None]
    u = np.einsum("kij,kj->ki", back, rates) + np.einsum(
        "kij,kj->ki", np.eye(m) - back @ anchors, wished[1:]
    )
    mu, _ = stages.along(points[1:], u, t[1:])
    sizes = stages.slices
    v = np.zeros((len(u), sum(sizes[k].stop - sizes[k].start for k in ("w", "f", "kappa"))))
    v[:, :m] = u
    z = np.hstack([points[1:], mu])
    z0, z1 = np.append(x0, mu0), np.append(x0 if x1 is None else x1, mu1)
    return z0, z1, fixed, (z, 0 * z, v)


def _check_orbit(stages: ControlStages, x0: Sequence[Given], x1: Sequence[Given]) -> None:
    """Raise `BadInput` if a Casimir of x alone, which no velocity changes, is another at x1."""
    scene = stages.scene
    s = SceneSymbols(scene)
    anchor = s.groupoid.rho(s.x, s.h)[: s.n, :]
    for quantity in scene.symmetries:
        if quantity.attitude:  # it is asked of the turned body, which is no part of x here
            continue
        formula = s.call(quantity.formula, quantity.name, s.position, s.mu, s.parameters)
        rates = jacobian([formula], s.position) * anchor
        if formula.free_symbols & set(s.mu) or first_violation(rates) is not None:
            continue
        formula = formula.xreplace(s.exact_parameters(scene))
        ends = [dict(zip(s.position, map(to_sympy, x), strict=True)) for x in (x0, x1)]
        before, after = evaluate_matrix(sympy.Matrix([formula.xreplace(e) for e in ends]), 30)
        if abs(after - before) > SAME * max(abs(before), abs(after)):
            raise BadInput(
                f"{s.name}: the end cannot be reached: {quantity.name} is {float(before):.6g} at "
                f"x0 and {float(after):.6g} at x1, on another orbit of {scene.groupoid.name}, and "
                "every motion keeps it, whatever acts; give an end with the same value."
            )


def _points(
    stages: ControlStages, x0: Vector, v0: Vector, x1: Vector | None, t: Vector,
    path: Path | None, v1: Vector | None, cubic: bool,
) -> Matrix:  # fmt: skip
    """Return the points of the guess, (N+1, n)."""
    s, n = stages.s, stages.n
    if path is not None:
        try:
            points = np.array([[float(e) for e in path(float(time))] for time in t])
        except RAISED as error:
            place = line_of(path, error)
            raise BadInput(
                f"{place}: {s.name}: path(t) could not be evaluated ({error}); give {n} numbers."
            ) from error
        if points.shape != (len(t), n) or not np.isfinite(points).all():
            raise BadInput(f"{s.name}: path(t) is no point; give {n} finite numbers at every t.")
        return points
    target = s.groupoid.target(s.x, s.u, s.h)[:n, :]
    arguments = {"x": s.position, "u": s.u, "h": s.h}
    f = numeric(arguments, [list(target), jacobian(target, s.u)], stages.numbers)
    u = v0
    if x1 is not None and n:
        u = 0 * v0
        for _ in range(MOST):
            b, slope = f(x0, u, t[-1])
            u = u - np.linalg.lstsq(slope, b - x1, rcond=FLAT)[0]
        off = np.abs(f(x0, u, t[-1])[0] - x1).max()
        if not off <= 1e-9 * max(np.abs(x0).max(), np.abs(x1).max()):
            raise BadInput(
                f"{s.name}: no straight arrow leads from x0 to x1, which may be at the edge of its "
                "chart, as a half turn is, or on another orbit of "
                f"{stages.scene.groupoid.name}; give a path=, or an end that it reaches."
            )
    share = (t / t[-1])[:, None]
    along = u + 0 * share
    if cubic and v1 is None:  # quadratic: the velocity at the end is free
        along = v0 + (u - v0) * share
    elif cubic:
        along = v0 + (3 * u - 2 * v0 - v1) * share + (v0 + v1 - 2 * u) * share**2
    return np.array([f(x0, w, time)[0] for w, time in zip(along, t, strict=True)]).reshape(
        len(t), n
    )
