"""Errors of a lattice's runs on ladders of steps, in time and in space, and their lines."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.lattices import Lattice

from ..core.case import Case
from ..core.fitting import Window, asymptotic_window
from .known import SPACING, Known
from .reference import solution

LEVELS, MOST_LEVELS = 5, 8
COARSE, HIGHER = 32, 8  # steps of the coarsest run in time, so many fewer from order 4 on
#: from order 6 on, where halved steps make errors round-off after three levels: steps of the
#: coarsest run, and the error that it may have for runs of twice the time to be asked for
STEEP, COARSEST, LARGE = 6, 3, 1e-4
ENOUGH = 3  # errors of round-off, one after another
FINER = 8  # in space, a step is so small a part of the spacing
STRAIGHT = 0.012  # as in the study of order; an octave of steps between two errors, else less
#: of a change or an error, beside the largest number of its kind: round-off of some hundred steps
LEAST = 2.0**-46


def end_of(case: Case, exact: Any, T: Fraction) -> tuple[Any, float, dict[str, str]]:
    """(x, μ) at T by the equations of motion, how well it is known (errors below that say
    nothing), and what errors are held against.

    The first is None where there is a closed form, and where the equations are not followed: then
    the change to the run with half the step has to do, and {"held_against", "why_not"} says so.
    """
    if exact is not None:
        return None, LEAST, {"held_against": "closed form"}
    try:
        x, mu, known = solution(case.scheme, float(T))
    except CannotMeasure as error:
        return None, LEAST, {"held_against": "its own runs", "why_not": str(error)}
    return (x, mu), known, {"held_against": "equations of motion"}


def duration(case: Case) -> Fraction:
    """The time T that runs of different steps take.

    Of a steep rule it is made longer, up to the scene's, until its coarsest run has a large error.
    """
    scene: Any = case.scene
    T: Fraction = COARSE * scene.step
    if (case.scheme.order or 0) >= STEEP:
        while scene.duration >= 2 * T and _change(case, 2 * T) < LARGE:
            T *= 2
    return T


def _change(case: Case, T: Fraction) -> float:
    """By how much the coarsest run differs from one of half its steps, infinite without either."""
    try:
        one, other = (_end(case, T, count) for count in (COARSEST, 2 * COARSEST))
    except StepFailure:
        return math.inf
    return _apart(one, other, slice(None))


def _end(case: Case, T: Fraction, count: int) -> tuple[np.ndarray, np.ndarray]:
    run = case.scheme.flow(T / count).trajectory(count, count)
    return run.x[-1], run.mu[-1]


def in_time(
    case: Case, exact: Any, end: Any, T: Fraction, least: float, most: int
) -> list[tuple[float, float]]:
    """(step, error) of runs over the time T, their steps halved and halved.

    Of a steep rule by √2, where its errors are not those to its own runs (changes are on a line
    only where each step is the same part of the one before).
    """
    lattice: Any = case.scene
    itself = exact is None and end is None  # held against its own runs
    order = case.scheme.order or 0
    if order >= STEEP and not itself:
        counts = [round(COARSEST * 2 ** (k / 2)) for k in range(2 * most - 1)]
    else:
        coarsest = COARSE if order < 4 else COARSE // HIGHER
        counts = [coarsest * 2**k for k in range(most + itself)]
    if exact is not None:
        end = _state(case.scheme.flow(T), exact(lattice, float(T)))
    inner = _inner(lattice) if exact is not None else slice(None)
    found, before = list[tuple[float, float]](), None
    for k, count in enumerate(counts):
        run = _end(case, T, count)
        if itself and before is not None:
            found.append((float(T) / counts[k - 1], _apart(before, run, inner)))
        elif not itself:
            found.append((float(T) / count, _apart(run, end, inner)))
        before = run
        if len(found) > most and max(e for _, e in found[-ENOUGH:]) <= least:
            break
    return found


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
        octaves = math.log2(steps[0] / steps[-1]) / (len(steps) - 1)
        window = asymptotic_window(steps, safe, least, STRAIGHT * octaves)
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
