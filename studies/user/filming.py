"""`film`: moving bodies as a matplotlib animation that a notebook plays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from discmech.integrators import Scene
from discmech.integrators.equations.symbols import SceneSymbols
from discmech.integrators.errors import BadInput, shown
from discmech.integrators.numbers import sympy

from .drawing import frame_of, subject_of

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation

MOST_FRAMES, TRAIL = 120, 40  # frames of a film, and of them those that a trail shows
BETWEEN = 16  # most points of a trail from frame to frame: a path has no corners of the film's own
MOST_TRAILS = 12
MARKS = "osD^v<>P"
INCHES = 3.6
EXAMPLE = "lambda x: [[0, 0], [np.sin(x[0]), -np.cos(x[0])]]"


def film(
    run: Any, bodies: Callable[..., Any] | None = None, *, seconds: float = 6.0,
    trail: bool | None = None,
) -> FuncAnimation:  # fmt: skip
    """Return the motion of a run as a film: a `FuncAnimation` that a notebook plays, with `.save`.

    run: a trajectory of `flow.trajectory`, of a scene or a lattice, or a motion of `control.solve`.
    bodies: a function of x, an array of n numbers (of a lattice (N, n), and (N,) if n is 1), that
    returns the points of one row, k×2 or k×3, joined by a line, or a list of such rows, each a body
    of its own: for a double pendulum its joints.

    By default x itself is a point (n = 2, 3), unless the kinetic energy depends on it, as on angles
    and radii: no film shows these as a place. With parameters `masses` it is a point for each of
    them; a body in a field (an action, n = 3) is a line from the origin, and an attitude
    (`with_attitude`, or beside a place) is three axes at the body's place. The sites of a lattice
    stand at their x (n = 2, 3, or the place of a pose), joined along its bonds, or those of a chain
    side by side, and of a net by rows and columns, at the height x (n = 1). seconds: the length of
    the film; it has at most 120 frames. trail: True to leave behind each row's last point its path
    of the last third of the film (default: not for a lattice).

    Raises `BadInput` for anything else than a run, if bodies is missing and x is no place, and for
    bodies that do not return such points.
    """
    from ..report.canvas import our_style

    if (subject := subject_of(run)) is None:
        raise BadInput(
            "film takes a trajectory of flow.trajectory(...) or a motion of control.solve(...), "
            f"not {type(run).__name__}."
        )
    if not (isinstance(seconds, int | float) and 0 < seconds < math.inf):
        raise BadInput(f"seconds is {shown(seconds)}: give the film's length, such as 6.")
    if bodies is not None and not callable(bodies):
        raise BadInput(f"bodies is {shown(bodies)}: give a function of x, such as {EXAMPLE}.")
    with our_style():
        return _film(run, *subject, bodies, seconds, trail)


def _film(
    run: Any, scene: Any, rule: Any, bodies: Callable[..., Any] | None, seconds: float,
    trail: bool | None,
) -> FuncAnimation:  # fmt: skip
    """Return `film` of the run of a scene or lattice by a rule, in matplotlib's style."""
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure

    class Film(FuncAnimation):
        """The animation, with its display in a notebook."""

        def _repr_html_(self) -> str:
            return str(self.to_jshtml(default_mode="loop"))

    from ..report.palette import CYCLE, MUTED, PAPER

    lattice = np.ndim(run.x) == 3
    x = np.asarray(run.x, dtype=float)
    shape = bodies or (_of_lattice(scene, run.x.shape[-1]) if lattice else _usual(scene, x))
    x = x[..., 0] if lattice and x.shape[-1] == 1 else x
    rows = np.unique(np.linspace(0, len(run.t) - 1, MOST_FRAMES).astype(int))
    frames = [_polylines(shape, x[row]) for row in rows]
    every = np.concatenate([points for frame in frames for points in frame])
    if not np.isfinite(every).all() or len({tuple(p.shape[1] for p in f) for f in frames}) > 1:
        raise BadInput(
            "bodies(x) returns numbers that are not finite, points of 2 and of 3 numbers, or now "
            "more and now fewer lists of points: let it return the same bodies for every x."
        )
    size = every.shape[1]
    figure = Figure(figsize=(INCHES, INCHES), facecolor=PAPER)
    axes: Any = figure.add_subplot(projection="3d" if size == 3 else None)
    if size == 2:  # room for the names of the axes
        figure.subplots_adjust(left=0.17, right=0.97, bottom=0.14, top=0.87)
        axes.spines[["top", "right"]].set_visible(False)
    low, high = every.min(axis=0), every.max(axis=0)
    names = _names(x.shape[1:], lattice, bodies is not None, size)
    half = np.maximum(high - low, 1e-12) * 0.55
    if names[0] not in ("site", "column"):  # all are lengths of one unit
        half = np.full(size, half.max())
        axes.set_aspect("equal")
    for k, (name, middle) in enumerate(zip("xyz", (low + high) / 2, strict=False)):
        getattr(axes, f"set_{name}lim")(middle - half[k], middle + half[k])
        getattr(axes, f"set_{name}label")(names[k], fontsize=8, color=MUTED)
    axes.tick_params(labelsize=7.5)
    axes.locator_params(nbins=5)
    # bodies of one colour differ in their marks; a lattice's bonds are one body
    looks = [(colour, mark) for mark in MARKS for colour in CYCLE]
    looks = looks[: 1 if lattice and bodies is None else None]
    looks = [looks[k % len(looks)] for k in range(len(frames[0]))]
    own = [colour for colour, _ in looks]
    size_of: dict[str, Any] = {"ms": 2.5 if len(every) > 60 * len(frames) else 4, "lw": 1.5}
    lines = [axes.plot(*points.T, "-", color=colour, marker=mark, **size_of)[0]
             for points, (colour, mark) in zip(frames[0], looks, strict=True)]  # fmt: skip
    follows = (not lattice if trail is None else trail) and len(own) <= MOST_TRAILS
    trails = [axes.plot(*points[-1:].T, "-", color=colour, lw=0.8, alpha=0.5, zorder=1)[0]
              for points, colour in zip(frames[0], own, strict=True) if follows]  # fmt: skip
    title = axes.set_title("", fontsize=9, loc="left")
    fine = np.unique(np.linspace(0, len(run.t) - 1, BETWEEN * MOST_FRAMES).astype(int))
    path = [[row[-1] for row in _polylines(shape, x[k])] for k in fine if trails]

    def draw(frame: int) -> list[Any]:
        first, last = (np.searchsorted(fine, rows[k]) for k in (max(0, frame - TRAIL), frame))
        past = path[first : last + 1]
        behind = [np.array([each[k] for each in past]) for k in range(len(trails))]
        for line, points in zip([*lines, *trails], [*frames[frame], *behind], strict=True):
            line.set_data(*points.T[:2])
            if size == 3:
                line.set_3d_properties(points.T[2])
        name = getattr(scene, "title", "") or scene.name
        title.set_text(f"{name}, by {rule.name}\nt = {float(run.t[rows[frame]]):.3g}")
        return [*lines, *trails, title]

    figure.draw_without_rendering()  # ticks are made at first drawing, in the style of then
    pause = 1000 * seconds / len(rows)
    return Film(figure, draw, frames=len(rows), interval=pause)


def _names(shape: tuple[int, ...], lattice: bool, own: bool, size: int) -> list[str]:
    """Return the names of a film's axes: those of x where x is drawn itself, else of space."""
    from ..report.wording import subscript

    if lattice and len(shape) == 1 and not own:
        return ["site", "x"] if size == 2 else ["column", "row", "x"]
    if not own and shape[-1] == size:
        return [f"x{subscript(k + 1)}" for k in range(size)]
    return ["x", "y", "z"][:size]


def _usual(scene: Any, x: Any) -> Callable[..., Any]:
    """Return the default function for the bodies of a scene whose run has the rows x."""
    groupoid, n = scene.groupoid, x.shape[-1]
    place, attitude = frame_of(groupoid, n)
    if d := len(attitude):
        at = x[:, place] if len(place) else np.zeros((1, d))
        long = float(np.ptp(at, axis=0).max()) / 8 or 1.0

        def axes(row: Any) -> Any:
            at = row[place] if len(place) else np.zeros(d)
            tips = [at + long * column for column in row[attitude].T]
            # the path left behind is that of the last point: of the place, if there is one
            return [np.array([tip, at] if len(place) else [at, tip]) for tip in tips]

        return axes
    masses = scene.parameters.get("masses", ())
    count = len(masses) if isinstance(masses, tuple | list) and masses else 1
    if groupoid.canonical and n in (2 * count, 3 * count) and not _has_curved_coordinates(scene):
        return lambda x: [point[None] for point in x.reshape(count, -1)]
    if n == 3 and groupoid.kind == "action":
        return lambda x: np.array([np.zeros(3), x])
    raise _no_place(scene, n)


def _has_curved_coordinates(scene: Scene) -> bool:
    """Return True if the kinetic energy depends on x, whose entries may be angles then."""
    s = SceneSymbols(scene)
    energy, moving = (s.lagrangian, s.u) if s.hamiltonian is None else (s.hamiltonian, s.mu)
    return not sympy.hessian(energy, list(moving)).free_symbols.isdisjoint(s.x)


def _of_lattice(lattice: Any, n: int) -> Callable[..., Any]:
    """Return the default function for the sites of a lattice: rows of points joined by bonds."""
    bonds = {(min(bond), max(bond)) for bond in np.asarray(lattice.pairs).tolist()}
    (place, _), columns = frame_of(lattice.site, n), _columns(bonds, lattice.sites)
    if not (n in (2, 3) or len(place) or (n == 1 and columns)):
        raise _no_place(lattice, n)

    def rows(x: Any) -> Any:
        points = x[:, place] if len(place) else x
        if n == 1:
            row, column = np.divmod(np.arange(len(x)), columns)
            places = [column] if columns == len(x) else [column, row]
            points = np.stack([*places, x], axis=1)
        if columns == len(x):
            return points[None]
        if columns:
            net = points.reshape(-1, columns, points.shape[-1])
            return [*net, *net.swapaxes(0, 1)]
        return [points[list(bond)] for bond in sorted(bonds)]

    return rows


def _columns(bonds: set[tuple[int, int]], sites: int) -> int:
    """Return the columns of a net of bonds numbered by rows, all sites of a chain; 0 of others."""
    chain = {(k, k + 1) for k in range(sites - 1)}
    if bonds >= chain:
        return sites
    width = max((b - a for a, b in bonds), default=1)
    net = {(k, j) for k, j in chain if j % width} | {(k, k + width) for k in range(sites - width)}
    return width if bonds == net and sites % width == 0 else 0


def _no_place(subject: Any, n: int) -> BadInput:
    said = f"has {n} numbers, which need not be a place: say where its bodies are, as film(run, "
    said += f"{EXAMPLE})."
    if n == 0:  # on a group
        said = "is empty here: film a run of scene.with_attitude(), whose x is the body's attitude."
    return BadInput(f"{subject.name}: x {said}")


def _polylines(bodies: Callable[..., Any], x: Any) -> list[Any]:
    """Return the rows of points that a function gives, as arrays k×2 or k×3."""
    try:
        points = bodies(x)
    except Exception as error:  # a user's function may raise anything
        raise _unfit(x, f"raises {type(error).__name__}: {error}") from error
    try:
        rows = [np.asarray(points, dtype=float)]
    except (TypeError, ValueError):  # rows of different lengths
        try:
            rows = [np.asarray(row, dtype=float) for row in points]
        except (TypeError, ValueError):
            raise _unfit(x, f"returns {shown(points)}") from None
    rows = [part for row in rows for part in (row if row.ndim == 3 else [row])]
    if not rows or any(row.ndim != 2 or row.shape[1] not in (2, 3) for row in rows):
        raise _unfit(x, f"returns {shown(points)}")
    return rows


def _unfit(x: Any, said: str) -> BadInput:
    return BadInput(
        f"bodies(x) {said}; x is an array of shape {x.shape} here: return a list of points, each "
        f"of 2 or 3 numbers, or a list of such lists, as {EXAMPLE} does (import numpy as np)."
    )
