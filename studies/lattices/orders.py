"""Errors of a lattice's runs on ladders of steps, in time and in space, and their lines."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.lattices import Lattice

from ..core.case import Case
from ..core.fitting import Window, asymptotic_window
from .known import SPACING, Known
from .reference import solution

LEVELS, MOST_LEVELS = 5, 8
COARSE, HIGHER = 32, 8  # steps of the coarsest run in time, so many fewer from order 4 on
FINER = 8  # in space, a step is so small a part of the spacing
STRAIGHT = 0.012  # as in the study of order
#: of a change or an error, beside the largest number of its kind: round-off of some hundred steps
LEAST = 2.0**-46


def end_of(case: Case, exact: Any) -> tuple[Any, float, dict[str, str]]:
    """(x, μ) after COARSE steps by the equations of motion, how well it is known (errors below that
    say nothing), and what errors are held against.

    The first is None where there is a closed form, and where the equations are not followed: then
    the change to the run with half the step has to do, and {"held_against", "why_not"} says so.
    """
    if exact is not None:
        return None, LEAST, {"held_against": "closed form"}
    try:
        x, mu, known = solution(case.scheme, float(COARSE * case.scene.step))
    except CannotMeasure as error:
        return None, LEAST, {"held_against": "its own runs", "why_not": str(error)}
    return (x, mu), known, {"held_against": "equations of motion"}


def in_time(case: Case, exact: Any, end: Any, most: int) -> list[tuple[float, float]]:
    """(step, error) of runs over COARSE steps of the lattice's own size, halved and halved."""
    lattice: Any = case.scene
    T, runs = COARSE * lattice.step, []
    coarsest = COARSE if (case.scheme.order or 0) < 4 else COARSE // HIGHER
    itself = exact is None and end is None  # held against its own runs
    for k in range(most + itself):
        flow = case.scheme.flow(T / (coarsest * 2**k))
        run = flow.trajectory(coarsest * 2**k, coarsest * 2**k)
        runs.append((run.x[-1], run.mu[-1]))
    ends = runs[1:] if itself else [end] * most
    if exact is not None:
        ends = [_state(flow, exact(lattice, float(T)))] * most
    inner = _inner(lattice) if exact is not None else slice(None)
    return [(float(T) / (coarsest * 2**k), _apart(runs[k], ends[k], inner)) for k in range(most)]


def in_space(case: Case, known: Known, most: int) -> list[tuple[float, float]]:
    """(spacing, error) on grids, halved and halved, with steps that are a part of the spacing."""
    assert known.refined is not None and known.exact is not None
    T, found = 4, []
    for k in range(most):
        spacing = SPACING / 2**k
        lattice = known.refined(spacing)
        flow = Scheme(lattice, case.rule).flow(spacing / FINER)
        steps = round(T / (spacing / FINER))
        end = flow.trajectory(steps, steps)
        wanted = _state(flow, known.exact(lattice, T))
        # momenta are those of a site, a times the field's
        found.append((float(spacing), _apart((end.x[-1], end.mu[-1]), wanted, slice(None))))
    return found


def _inner(lattice: Lattice) -> slice:
    """Sites that the ends of a chain, which closed forms do not have, do not reach."""
    return slice(lattice.sites // 10, -(lattice.sites // 10))


def _state(flow: Any, field: Any) -> tuple[np.ndarray, np.ndarray]:
    x, v = (e[:, None] for e in field)
    return x, np.where(flow.lattice.free[:, None], flow.momenta(x, v), 0)


def _apart(one: Any, other: Any, inner: slice) -> float:
    """The most that x or μ differ by, each over its largest."""
    return max(float(abs(a - b)[inner].max() / (abs(b).max() or 1))
               for a, b in zip(one, other, strict=True))  # fmt: skip


def fitted(
    kind: str, ladder: Callable[[int], list[tuple[float, float]]], levels: int, least: float = LEAST
) -> tuple[list[dict[str, Any]], Window | None]:
    """Rows of a ladder with as many levels as a line needs, and the line."""
    window = None
    for most in (levels, MOST_LEVELS) if kind == "time" else (levels, levels + 1):
        points = ladder(most)
        steps, errors = zip(*points, strict=True)
        safe = [e if e > 0 else math.nan for e in errors]
        window = asymptotic_window(steps, safe, least, STRAIGHT)
        if window is not None:
            break
    rows = []
    for i, (step, error) in enumerate(points):
        used = window is not None and window.first <= i <= window.last
        below = error <= least or (window is not None and i > window.last)
        floor = "reference" if LEAST < error <= least else "round-off"
        why = "" if used else floor if below else "pre-asymptotic"
        rows.append({"kind": kind, "step": step, "error": error, "used": used, "why_not": why})
    return rows, window


def slope(window: Window | None) -> float | None:
    """Return the slope of a window of errors, or None where there is no window."""
    return None if window is None else window.line.slope
