"""Jumps of a map along lines through many states, and whether they let it keep the form.

On either side of a surface where it jumps a map may keep the form, so that no state shows the jump.
But a line through the states meets the surface, and high differences along it stand out
(`scan.peaks`). A jump Δ leaves the map one that keeps the form only if it is along the image of the
surface, as by a potential with a kink, a force that is cut off, or a wall: ω(Δ, τ) = 0 for each
tangent τ of that image. By any other the images of the two sides overlap, or leave a gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import guarded, images
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..core.claims import not_claimed
from ..evidence.cloud import around, in_box, one_step
from ..evidence.places import seed_in_numbers
from ..evidence.scan import ORDER, STANDS_OUT, highest, peaks_of
from .records import Jump

#: lines, and points of each: a line of so many is smooth to round-off between its points
LINES, POINTS = 6, 2**9
AROUND = 16  # points on either side of a difference that stands out
#: points of such a part, of which `ORDER` + 1 are looked at again, and how often: to 3·10⁻⁸ of the
#: line. The difference of a jump stays, that of a kink falls to a quarter, a smooth one to 4⁻⁸
FINE, ZOOMS = 33, 10
#: distance of the next line, in parts of the motion, and how many are tried; the surface bends by
#: its square, and is known to 3·10⁻⁵ of it
BESIDE, TRIES = 1e-3, 3
#: one turn of an angle in radians, in turns and in degrees: what differs by whole ones is the same
TURNS = 2 * np.pi, 1.0, 360.0
OF_TURN = 1e-6  # part of a turn that is none: a jump is known to 3·10⁻⁸ of its line

Line = Callable[[Vector], Matrix]


def jumps_of(case: Case, scale: Vector) -> list[Jump]:
    """Return the jumps that lines through the states of a cloud meet, the largest first.

    scale: the size of each entry. Those by whole turns are none. None is sought where no form is
    claimed, on groups, and where states are bound or the motion depends on the time.
    """
    scheme, scene = case.scheme, case.scene
    rule: Any = case.rule
    free = scene.groupoid.canonical and scene.is_smooth and not scene.timed
    own = rule.own_coordinates or not rule.repeats or not_claimed(rule, "symplectic")
    if own or not free:
        return []
    step = Fraction(scheme.scene.step)
    f, drawn = one_step(scheme, step, 0), np.random.default_rng(seed_in_numbers(scheme))
    g = guarded(f, len(scale))
    try:
        lines = list(_lines(scheme, drawn))
    except ReferenceFailure:
        return []
    jumps = list[Jump]()
    for start, way in lines:
        line = _on(g, start, way)
        for at in _peaks(line, rule.unit(16)):
            if (told := _jump(line, at, scale)) is None or _turns(told[1]):
                continue
            where, jump = told
            across = _across(g, (start, way), where, jump, scale, drawn)
            jumps.append(Jump(float((np.abs(jump) / scale).max()), across, float(step),
                              (start + where * way).tolist()))  # fmt: skip
    return sorted(jumps, key=lambda jump: -jump.size)


def _lines(scheme: Any, drawn: np.random.Generator) -> Iterator[tuple[Vector, Vector]]:
    """Yield (start, way) of lines through two states, in a box from edge to edge."""
    z = around(scheme).z
    for _ in range(LINES):
        start, end = z[drawn.integers(len(z), size=2)]
        way, inside = end - start, (0.0, 1.0)
        if in_box(scheme):
            edges = (np.array(scheme.rule.states, dtype=float) - start) / np.where(way, way, 1)
            inside = edges.min(axis=0).max(), edges.max(axis=0).min()
        yield start + inside[0] * way, (inside[1] - inside[0]) * way


def _on(g: Any, start: Vector, way: Vector) -> Line:
    return lambda t: images(g, start + np.outer(t, way))


def _peaks(line: Line, unit: float) -> list[float]:
    """Return where along a line differences stand out."""
    t = np.linspace(0, 1, POINTS)
    ends = line(t)
    known = np.flatnonzero(np.isfinite(ends).all(axis=1))
    peaks = highest(peaks_of(ends[known], Fraction(1), unit), 2)
    return [float(t[known[int(peak.time)]]) for peak in peaks]


def _jump(line: Line, at: float, scale: Vector) -> tuple[float, Vector] | None:
    """Return (where on a line, the jump there), or None for what falls on ever finer lines."""
    low, high, level = at - AROUND / POINTS, at + AROUND / POINTS, 0.0
    for _ in range(ZOOMS):
        t = np.linspace(low, high, FINE)
        rows = line(t)
        of = np.abs(np.diff(rows / scale, ORDER, axis=0)).max(axis=1)
        k = int(of.argmax())
        if not of[k] > level / 2:
            return None
        level, low, high = of[k], t[k], t[k + ORDER]
    steps = np.diff(rows, axis=0)
    steps = steps - np.median(steps, axis=0)
    sizes = np.abs(steps / scale).max(axis=1)
    k = int(sizes.argmax())
    return None if sizes[k] <= STANDS_OUT * np.median(sizes) else (float(t[k]), steps[k])


def _turns(jump: Vector) -> bool:
    """True if a jump is by whole turns, and by nothing else."""
    for turn in TURNS:
        whole = np.round(jump / turn)
        if whole.any() and np.abs(jump / turn - whole).max() < OF_TURN:
            return True
    return False


def _across(
    g: Any, line: tuple[Vector, Vector], at: float, jump: Vector, scale: Vector, drawn: Any
) -> float | None:
    """Return the largest share of ω(Δ, τ) beside its terms, τ from the image of one line to those
    of lines beside it; None where these meet no jump.
    """
    (start, way), shares = line, list[float]()
    n = len(start) // 2
    for _ in range(TRIES):
        beside = start + BESIDE * scale * drawn.uniform(-1, 1, len(start))
        if (told := _jump(_on(g, beside, way), at, scale)) is None:
            continue
        here, there = (images(g, z[None] + t * way)[0] for z, t in ((start, at), (beside, told[0])))
        (q, p), (dq, dp) = (((jump + told[1]) / 2 / scale).reshape(2, n),
                            ((there - here) / scale).reshape(2, n))  # fmt: skip
        unit = scale[:n] * scale[n:]
        terms = float(unit @ (np.hypot(q, p) * np.hypot(dq, dp)))
        shares.append(abs(float(unit @ (q * dp - p * dq))) / terms if terms else 0.0)
    return max(shares, default=None)
