"""Derivatives of a map of numbers by central differences, each entry with a certain error bound.

A_w, the difference of order 8 with the width w, has a truncation error O(w⁸) and the noise η of the
map divided by w. Neighbouring widths differ by more than the truncation error as soon as it falls,
which measures it; the noise is measured by differences of high order along a short line, in which a
smooth function cancels (Moré, Wild, SIAM J. Sci. Comput. 33 (2011), 1292).

At a knot of a spline the error of A_w falls as a low power of w, and of several knots it may be the
same by chance at neighbouring widths. Wide and narrow stencils, each with the noise on lines of its
own length, therefore have to agree (`RANGES`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import comb, factorial

import numpy as np

from ...errors import StepFailure
from ...numbers.types import Matrix, Rows, Vector

Map = Callable[[Vector], Vector]
#: weights of f(z + iw) − f(z − iw), over w: exact for polynomials of degree 8
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
#: widths relative to the scale, the widest first; with it the stencil reaches as far as the scale
WIDTHS = [2.0**-k for k in range(2, 21)]
#: widths that are compared with each other: for each range the level of noise is that on one line
#: less, since a stencil of 8 w < 2⁻⁹ meets few of the knots on a line of 24 2⁻⁹, and one of 2⁻¹³
#: few of those on 24 2⁻¹⁴
RANGES = (slice(0, 15), slice(10, 17), slice(14, 19))
PARTS = sorted({i * w for i in WEIGHTS for w in WIDTHS})
# round-off of a difference, in units of the noise over w
ROUND_OFFS = 2 * sum(map(abs, WEIGHTS.values()))
#: normal noise exceeds so many standard deviations once in 10⁹ draws
FARTHEST = 6
EPS = 2.0**-53
# number of points of a line on which noise is measured, and the order of differences
LINE, ORDER = 24, 6
SPACINGS = (2.0**-9, 2.0**-14, 2.0**-22)  # distances of these points, relative to the scale
#: roundings of the argument in a sixth difference: its weights add up to 64, and the argument,
#: whose size is a few scales, is rounded a few times in a step
ARGUMENT = 64 * 8
FINER = (8, 64)  # factors of refinement of lines on which a jump is checked again
#: the inverse size of a sixth difference of independent errors of size 1
DEVIATION = (factorial(ORDER) ** 2 / factorial(2 * ORDER)) ** 0.5
#: a sixth difference at spacing w of a function that varies over the scale is about (6w)⁶ of it
#: without any noise: 3e-12 of the map at the widest spacing
SMOOTH = [(6 * w) ** 6 for w in SPACINGS]


@dataclass(frozen=True)
class Noise:
    """The part of a map that is not smooth, for each entry of its value.

    level: the standard deviation of its round-off. jump: the largest jump between neighbouring
    points, such as that of an iteration that stops after another number of steps; 0 if none stands
    out. finer: the noise on the shorter lines alone.
    """

    level: Vector
    jump: Vector
    finer: Noise | None = None

    def rough(self, values: Matrix) -> Vector:
        """Return the largest error of each entry of such values (r, k), by noise or rounding."""
        return FARTHEST * np.maximum(self.level, EPS * np.abs(values).max(axis=0)) + self.jump


@dataclass(frozen=True)
class Derivative:
    """The derivative ∂f/∂y (k, l) with error bounds of the entries (inf without a value)."""

    value: Matrix
    error: Matrix


@dataclass(frozen=True)
class MapOfRows:
    """A map that can also map many points, rows (r, l), in one call: `rows`."""

    one: Map
    rows: Callable[[Matrix], Matrix]

    def __call__(self, z: Vector) -> Vector:
        """Return the image of one point."""
        return self.one(z)


def images(f: Map, points: Rows) -> Matrix:
    """Return the images (r, k) of points (r, l), in one call if the map supports that."""
    rows = np.asarray(points, dtype=float)
    return f.rows(rows) if isinstance(f, MapOfRows) else np.array([f(z) for z in rows])


def guarded(f: Map, size: int) -> Map:
    """Return f with nan in place of a `StepFailure`."""

    def image(z: Vector) -> Vector:
        try:
            return f(z)
        except StepFailure:
            return np.full(size, np.nan)

    def rows(points: Matrix) -> Matrix:
        try:
            return images(f, points)
        except StepFailure:  # one of the points fails
            return np.array([image(z) for z in points])

    return MapOfRows(image, rows) if isinstance(f, MapOfRows) else image


def shifted(f: Map, z: Vector) -> Map:
    """Return the map y ↦ f(z + y)."""
    if isinstance(f, MapOfRows):
        return MapOfRows(lambda y: f(z + y), lambda points: images(f, z + points))
    return lambda y: f(z + y)


def noise_of(f: Map, z: Vector, scale: Vector, unit: float, seed: int = 0) -> Noise:
    """Return the noise of f around z, from sixth differences on short lines in a random direction.

    unit: the round-off of the map's numbers, the least possible noise.
    """
    random = np.random.default_rng(seed)
    way = random.standard_normal(len(z)) * scale / max(1.0, len(z) ** 0.5)
    value = f(z)
    of = Noise(unit * np.abs(value), np.zeros_like(value))
    for width, smooth in reversed([*zip(SPACINGS, SMOOTH, strict=True)]):
        level, jump = of.level, of.jump
        line = images(f, [z + (i - LINE // 2) * width * way for i in range(LINE)])
        rows = _sixth(line)
        if not rows.any():
            of = Noise(level, jump, of)
            continue
        usual, most = np.median(rows, axis=0), rows.max(axis=0)
        # the rounding of the argument causes no jump: near a pole its effect is far larger than the
        # round-off of the value, and larger at some points of the line than at most
        with np.errstate(all="ignore"):
            reach = np.nanmax(np.abs(line), axis=0) + np.abs(value)
            slope = np.nanmax(np.abs(np.diff(line, axis=0)), axis=0) / width
        rounding = ARGUMENT * unit * (np.nan_to_num(slope, posinf=0.0) + reach)
        noise = 1.5 * usual * DEVIATION
        if (noisy := noise > smooth * reach).any():  # noise stays on a finer line; near a pole a
            # smooth map has differences as large, which fall with the sixth power of the spacing
            half = [z + (i - LINE // 2) / 2 * width * way for i in range(LINE)]
            noisy &= _sixth(images(f, half)).max(axis=0) > usual / 3
        level = np.where(noisy, np.maximum(level, noise), level)
        beyond = most > np.maximum(
            np.maximum(smooth * reach, rounding),
            2 * FARTHEST * np.maximum(usual, level / DEVIATION),
        )
        if beyond.any():  # a jump keeps its size on a finer line, but a steep slope does not
            first = int(rows[:, int(np.argmax(beyond))].argmax()) - LINE // 2
            for finer in FINER:
                fine = [z + (first + i / finer) * width * way for i in range(ORDER * finer + 1)]
                beyond &= _sixth(images(f, fine)).max(axis=0) > most / 3
        jump = np.where(beyond, np.maximum(jump, most / comb(ORDER, ORDER // 2)), jump)
        of = Noise(level, jump, of)
    return of


def jump_on(f: Callable[[float], Vector], a: float, b: float, count: int, size: Vector) -> Vector:
    """Return the largest jump of each entry of f on [a, b] that a line of `count` points shows.

    size: that of each entry, which is smooth over a part of [a, b]. The result is 0 if no jump
    remains on finer lines.
    """
    gap = (b - a) / (count - 1)
    rows = _sixth(np.array([f(a + k * gap) for k in range(count)]))
    most, first = rows.max(axis=0), rows.argmax(axis=0)
    rough = (6 * gap / (b - a)) ** ORDER * np.abs(size) + 2 * FARTHEST * np.median(rows, axis=0)
    jumps = np.zeros_like(most)
    for j in np.flatnonzero(most > rough):
        stays = True
        for finer in FINER:
            fine = [f(a + (first[j] + i / finer) * gap) for i in range(ORDER * finer + 1)]
            seen = _sixth(np.array(fine)).max(axis=0)[j]
            stays = stays and bool(most[j] / 3 < seen < 3 * most[j])  # at a pole it grows
        jumps[j] = most[j] / comb(ORDER, ORDER // 2) if stays else 0.0
    return jumps


def _sixth(line: Matrix) -> Matrix:
    """Return the absolute sixth differences along a line of points; 0 if one is not finite."""
    weights = np.array([(-1) ** i * comb(ORDER, i) for i in range(ORDER + 1)])
    with np.errstate(all="ignore"):
        rows = np.abs(np.lib.stride_tricks.sliding_window_view(line, ORDER + 1, axis=0) @ weights)
    return np.where(np.isfinite(rows).all(axis=1)[:, None], rows, 0.0)


def derivative(f: Map, size: int, scale: Vector, noise: Noise) -> Derivative:
    """Return the derivative at 0 of f: R^l → R^size; its arguments vary over scale (l,)."""
    f, steps = guarded(f, size), 2.0 ** np.floor(np.log2(scale))
    most = steps.max(initial=0.0)
    value, error = np.empty((size, len(scale))), np.empty((size, len(scale)))
    with np.errstate(all="ignore"):
        for j, way in enumerate(np.diag(steps)):
            value[:, j], error[:, j] = _along(f, way, steps[j], noise, most)
    value[~np.isfinite(error)] = 0.0
    return Derivative(value, error)


def _along(f: Map, way: Vector, d: float, noise: Noise, most: float) -> tuple[Vector, Vector]:
    """Return the slope of f at 0 along a way of the length d, and its errors.

    most: the longest way. The widths are powers of 2 and share points.
    """
    rows = np.outer(PARTS, way)
    seen = dict(zip(PARTS, images(f, rows) - images(f, -rows), strict=True))

    def pair(part: float) -> Vector:
        if part not in seen:
            seen[part] = f(part * way) - f(-part * way)
        return seen[part]

    slopes = np.array([sum(c * pair(i * w) for i, c in WEIGHTS.items()) / (w * d) for w in WIDTHS])
    rough = _rough(noise)
    value, error, best = _best(slopes, RANGES[0], rough / d)
    # An argument that moves little may be smooth over a far larger width: otherwise the round-off
    # of a light body's large coordinates would drown the small ones of a heavy body. A wider width
    # counts only if each one before it did, and within the error known so far: far away a function
    # may be flat, and widths that agree there tell nothing about its slope here.
    better, (before, here), width = best == 0, (slopes[1], slopes[0]), WIDTHS[0]
    while better.any() and 8 * width * d <= most:
        wider = sum(c * pair(2 * i * width) for i, c in WEIGHTS.items()) / (2 * width * d)
        off = np.maximum(np.abs(here - before), np.abs(wider - here))
        off = off + rough / (width * d) + EPS * np.abs(here)
        better &= (off < error) & (np.abs(here - value) <= error)
        value[better], error[better] = here[better], off[better]
        before, here, width = here, wider, 2 * width
    for narrow in RANGES[1:]:
        noise = replace(noise.finer or noise, jump=noise.jump)
        other, off, _ = _best(slopes, narrow, _rough(noise) / d)
        apart = np.abs(other - value)
        differ = apart > error + off  # one of them is wrong: their distance is the other's error
        value = np.where((off < error) & ~differ, other, value)
        error = np.where(differ, apart + np.maximum(error, off), np.minimum(error, off))
    return value, error


def _rough(noise: Noise) -> Vector:
    """Return the largest effect of noise on a difference, times its width."""
    return ROUND_OFFS * (FARTHEST * noise.level + noise.jump)


def _best(slopes: Matrix, of: slice, rough: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the slopes of such widths that are surest, their errors, and which they are."""
    slopes, widths = slopes[of], np.array(WIDTHS[of])[1:-1, None]
    gaps = np.abs(np.diff(slopes, axis=0))
    off = np.maximum(gaps[:-1], gaps[1:]) + rough / widths + EPS * np.abs(slopes[1:-1])
    off[~np.isfinite(off)] = np.inf
    best = off.argmin(axis=0)
    value, error = (np.take_along_axis(a, best[None], 0)[0] for a in (slopes[1:-1], off))
    return value, error, best
