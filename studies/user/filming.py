"""`film`: moving bodies as a matplotlib animation that a notebook plays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from discmech.integrators.errors import BadInput, shown

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation

MOST_FRAMES = 120
INCHES = 3.6
EXAMPLE = "lambda x: [[0, 0], [sin(x[0]), -cos(x[0])]]"


def film(
    run: Any, bodies: Callable[..., Any] | None = None, *, seconds: float = 6.0
) -> FuncAnimation:
    """Return the motion of a run as a film: a `FuncAnimation` that a notebook plays, with `.save`.

    run: a trajectory of `flow.trajectory`. bodies: a function of x, an array of n numbers, that
    returns the points of one row, k×2 or k×3, joined by a line, or a list of such rows: for a
    double pendulum its joints. By default x itself is a point (n = 2, 3), a body in a field (an
    action, n = 3) is a line from the origin, and an attitude (`with_attitude`) is three axes at the
    body's place. seconds: the length of the film; it has at most 120 frames.

    Raises `BadInput` for anything else than a trajectory, if bodies is missing and x is no place,
    and for bodies that do not return such points.
    """
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure

    class Film(FuncAnimation):
        """The animation, with its display in a notebook."""

        def _repr_html_(self) -> str:
            return str(self.to_jshtml(default_mode="loop"))

    if getattr(run, "scheme", None) is None or np.ndim(run.x) != 2:
        raise BadInput(
            f"film takes a trajectory of flow.trajectory(...), not {type(run).__name__}."
        )
    if not (isinstance(seconds, int | float) and 0 < seconds < math.inf):
        raise BadInput(f"seconds is {shown(seconds)}: give the film's length, such as 6.")
    if bodies is not None and not callable(bodies):
        raise BadInput(f"bodies is {shown(bodies)}: give a function of x, such as {EXAMPLE}.")
    shape = bodies or _usual(run)
    rows = np.unique(np.linspace(0, len(run.t) - 1, MOST_FRAMES).astype(int))
    frames = [_polylines(shape, np.asarray(run.x[row], dtype=float)) for row in rows]
    every = np.concatenate([points for frame in frames for points in frame])
    if not np.isfinite(every).all() or len({points.shape[1] for f in frames for points in f}) > 1:
        raise BadInput("bodies gives numbers that are not finite, or points of 2 and of 3 numbers.")
    size = every.shape[1]
    figure = Figure(figsize=(INCHES, INCHES))
    axes: Any = figure.add_subplot(projection="3d" if size == 3 else None)
    low, high = every.min(axis=0), every.max(axis=0)
    half = max(float((high - low).max()), 1e-12) * 0.55
    for name, middle in zip("xyz", (low + high) / 2, strict=False):
        getattr(axes, f"set_{name}lim")(middle - half, middle + half)
    axes.set_aspect("equal")
    lines = [axes.plot(*points.T, "o-", lw=1.5, ms=4)[0] for points in frames[0]]
    title = axes.set_title("")

    def draw(frame: int) -> list[Any]:
        for line, points in zip(lines, frames[frame], strict=True):
            line.set_data(*points.T[:2])
            if size == 3:
                line.set_3d_properties(points.T[2])
        title.set_text(f"t = {float(run.t[rows[frame]]):.3g}")
        return [*lines, title]

    pause = 1000 * seconds / len(rows)
    return Film(figure, draw, frames=len(rows), interval=pause)


def _usual(run: Any) -> Callable[..., Any]:
    """Return the default function for the bodies of a run."""
    groupoid, n = run.scheme.scene.groupoid, run.x.shape[1]
    size = groupoid.algebra.size if getattr(groupoid, "rows", 1) > 1 else 0
    if size in (3, 4) and n == size**2:

        def axes(x: Any) -> Any:
            pose = x.reshape(size, size)
            place = pose[:3, 3] if size == 4 else np.zeros(3)
            return [np.array([place, place + column]) for column in pose[:3, :3].T]

        return axes
    if n in (2, 3) and groupoid.canonical:
        return lambda x: x[None]
    if n == 3 and groupoid.kind == "action":
        return lambda x: np.array([np.zeros(3), x])
    raise BadInput(
        f"{run.scheme.scene.name}: x has {n} numbers, which need not be a place: say where its "
        f"bodies are, as film(run, {EXAMPLE})."
    )


def _polylines(bodies: Callable[..., Any], x: Any) -> list[Any]:
    """Return the rows of points that a function gives, as arrays k×2 or k×3."""
    try:
        given = bodies(x)
    except Exception as error:  # a user's function may raise anything
        raise BadInput(f"bodies(x) raises {type(error).__name__}: {error}.") from error
    try:
        rows = [np.asarray(given, dtype=float)]
    except (TypeError, ValueError):  # rows of different lengths
        rows = [np.asarray(row, dtype=float) for row in given]
    rows = [part for row in rows for part in (row if row.ndim == 3 else [row])]
    if not rows or any(row.ndim != 2 or row.shape[1] not in (2, 3) for row in rows):
        shapes = ", ".join(str(row.shape) for row in rows) or "nothing"
        raise BadInput(
            f"bodies gives {shapes}: give points, each of 2 or 3 numbers, or rows of them."
        )
    return rows
