"""Recorded runs as evidence: each row has to be a step of one method from the row before.

An order, an energy or a momentum at some rows says nothing of rows that were put in between, moved,
smoothed or taken from another run. So the exact motion goes from each row to the next, and the gap
there is the defect of the row. A method of order p leaves d h^p C over the time d between rows,
where C follows from the state alone. Defects of runs at several steps therefore sink alike at
every time, and a row that is no step stands out: by a power of the step, or beside its neighbours.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign.recorded import RecordedScheme
from discmech.integrators.numbers import mpmath
from discmech.reference import ReferenceFailure, many_motions, surroundings

from ..core.limits import OF_ORDER
from ..core.single_steps import ROW, Departure, SingleSteps
from ..systems.runs import energy_with_terms

#: the rows of a run that are compared; of a longer run so many are drawn
MOST_ROWS = 8192
TOGETHER = 64  # rows one after another that are drawn at once
APART = 7.9  # steps have to differ by this factor, 8 to rounding
HALF, CHANGE = OF_ORDER["rows: power"], OF_ORDER["rows: change"]
SPIKE, LARGE = OF_ORDER["rows: alone"], OF_ORDER["rows: way"]
#: rounding of a row: a few operations a step, in units of the last digit, and each of these twice
ROUNDED, TWICE = 8, 4
#: a defect of this share of the way between two rows is the first power of the error to a tenth
SMALL = 1e-2
#: rows so short beside the motion (`Surroundings.length`, an eighth of the distance to the nearest
#: singularity) that C changes by less than a third over three of them
SHORT = 1 / 6
#: rows of a twentieth of the distance to that singularity, so that a difference of order m of
#: h^p C grows less than eightfold over m + 2 rows: 1.25 to the power (m + p + 2) / 2, p up to 8
FAIRLY_SHORT = 2 / 5
DIFFERENCES = 8, 6, 4, 2  # orders of the differences that show one moved row
#: a jump of the defects, as where a solver takes an iteration less, leaves a twelfth of its
#: differences, or more, when the two defects beside it are interpolated
JUMP = 16
MOST_LOOKED_AT = 16  # differences that stand out most, by which a row is sought
LENGTHS = 24  # rows at which the length of the motion is asked for
CLEAR = 10  # a defect of so many roundings gives a power of the step to a tenth


@dataclass(frozen=True, eq=False)
class Defects:
    """Defects of rows over the time `span`, (r,) each: they are relative to the size of the motion.

    at: the times where they begin. off, floor: the defect and its round-off; moved: the way of the
    exact motion. row: the number of the row where each ends. start, gap: the states (x, μ) where
    they begin, and by how much the states where they end are off, (r, n+m), in units of `scale`.
    """

    name: str
    step: float
    span: float
    at: np.ndarray
    off: np.ndarray
    floor: np.ndarray
    moved: np.ndarray
    row: np.ndarray
    start: np.ndarray
    gap: np.ndarray
    scale: np.ndarray

    @property
    def least(self) -> np.ndarray:
        """The defects per unit of time, less their round-off."""
        return np.asarray(np.maximum(self.off - self.floor, 0) / self.span)

    @property
    def most(self) -> np.ndarray:
        """The defects per unit of time with their round-off."""
        return np.asarray((self.off + self.floor) / self.span)

    @property
    def resolved(self) -> np.ndarray:
        """True where a defect is small beside the way, or round-off."""
        return np.asarray(self.off - self.floor <= SMALL * _largest(self.moved, 1))


@lru_cache(maxsize=16)
def of_rows(scheme: RecordedScheme) -> SingleSteps | None:
    """Return the order of the steps from row to row, or why the rows are no steps of one method.

    The order is known to half a power of the step, so it is a whole number. None if no two runs
    show it: all defects are round-off, or no step is `APART` times another. Then a row is no step
    if its defect stands out beside its neighbours', or is large.
    """
    try:
        runs = [_defects(scheme, k) for k in range(len(scheme.runs))]
        lengths = _lengths(scheme)
    except ReferenceFailure as failure:
        return SingleSteps(unknown=" ".join(str(failure).split()))
    pairs = [(a, b) for a, b in itertools.combinations(range(len(runs)), 2)
             if runs[a].step >= APART * runs[b].step]  # fmt: skip
    powers, foreign = [], [_spike(run, lengths) or _moved(run, lengths) for run in runs]
    compared = False
    for a, b in pairs:
        same = _over_the_same(scheme, runs[a], runs[b], b, lengths)
        # noise, which does not add up from row to row, has a higher power over equal times: these
        # are for rows so long that errors cancel in each
        short = _short(lengths, runs[b].at, runs[b].span).any()
        power = _power(runs[a], runs[b] if short or same is None else same)
        powers.append(power)
        if runs[a].resolved.any():
            compared = True
            foreign.append(_beside(runs[a], runs[b], power, lengths))
            if same is not None and power is not None:
                foreign.append(_over_long_rows(runs[a], same, power, lengths))
    said = next(filter(None, foreign), "")
    finest = runs[-1]
    share = (finest.off - finest.floor) / np.maximum(_largest(finest.moved, 1), 1e-300)
    if not said and not compared and share.max(initial=0.0) > LARGE:
        k = int(share.argmax())
        said = (
            f"row {finest.row[k]} of {finest.name} (t = {finest.at[k] + finest.span:.4g}) is off "
            f"the motion from the row before by {share[k]:.0%} of its way, which no other run tells"
        )
    if said:
        return SingleSteps(unknown=said, refused=True)
    known = [p for p in powers if p is not None]
    if not known:
        return None
    order, wanted = round(known[-1]), scheme.order or 1
    if order < wanted:
        said = (
            f"the steps from row to row are of order {known[-1]:.2f} where {wanted} is expected: "
            "the motion is another, rows were mixed or moved, or the method remembers more than "
            "a row"
        )
        return SingleSteps(unknown=said, refused=True)
    k = int(finest.least.argmax())
    place = f"row {finest.row[k] - 1} of {finest.name}, t = {finest.at[k]:.4g}"
    return SingleSteps(order, "(x, mu)", finest.step, place)


def energy_by_row(scheme: RecordedScheme, roundings: float) -> Departure:
    """Return the largest change of the energy from one row to the next, over its terms.

    roundings: those that one step may leave.
    """
    worst, unit = Departure(), scheme.rule.unit(16)
    for run, recording in zip(scheme.runs, scheme.rule.recordings, strict=True):
        values, terms = energy_with_terms(scheme, 16)(run)
        size = np.abs(np.diff(values[:, 0])) / (terms.max() or 1.0)
        k, limit = int(size.argmax()), roundings * unit * math.sqrt(recording.every)
        row = f"{ROW}{k} to row {k + 1} of {recording.path.name} (t = {float(run.t[k + 1]):.4g})"
        one = Departure(float(size[k]), limit, "the energy", float(recording.step), row)
        worst = max(worst, one, key=lambda each: (each.size or 0.0) / (each.limit or 1.0))
    return worst


# -- defects ---------------------------------------------------------------------------------------


def _defects(
    scheme: RecordedScheme, index: int, rows: int = 1, begins: np.ndarray | None = None
) -> Defects:
    """Return the defects of a run over so many rows, from all of its rows or those that are named.

    Of too many rows (`MOST_ROWS`) as many are drawn, `TOGETHER` at a time.
    """
    run, recording = scheme.runs[index], scheme.rule.recordings[index]
    at = np.arange(len(run.t) - rows) if begins is None else begins
    if len(at) > MOST_ROWS:
        drawn, parts = np.random.default_rng(int(recording.digest[:8], 16)), len(at) // TOGETHER
        at = at[: parts * TOGETHER].reshape(parts, TOGETHER)
        at = at[np.sort(drawn.choice(parts, MOST_ROWS // TOGETHER, replace=False))].ravel()
    x, mu = np.asarray(run.x, dtype=float), np.asarray(run.mu, dtype=float)
    v = velocities(scheme, run)
    span = rows * float(recording.interval)
    first = float(recording.start)
    late = recording.late
    sizes = [np.abs(part).max(axis=0) for part in (x, mu, v)]
    own = ROUNDED * 2.0**-53 * math.sqrt(rows * recording.every)
    written = np.split(recording.roundings, [x.shape[1]])
    of_x, of_mu = (np.maximum(own * s, w) * (s > 0)
                   for s, w in zip(sizes[:2], written, strict=True))  # fmt: skip
    of_v = sizes[2] * (of_mu / np.where(sizes[1] > 0, sizes[1], 1)).max(initial=own)
    ends = many_motions(scheme.scene).after(
        x[at], v[at], first + at * float(recording.interval), np.full(len(at), span),
        np.concatenate([of_x, of_v]),
    )  # fmt: skip
    # of all runs: a few rows of one may pass through 0
    every = [np.vstack([getattr(each, name) for each in scheme.runs]) for name in ("x", "mu")]
    scale = np.concatenate([np.full(e.shape[1], np.abs(e.astype(float)).max(initial=0.0) or 1.0)
                            for e in every])  # fmt: skip

    def norm(rows_of: Any) -> np.ndarray:
        return np.asarray(np.linalg.norm(rows_of / scale, axis=1))

    start, end = (np.hstack([x, mu])[k] for k in (at, at + rows))
    exact = np.hstack([ends.x, ends.mu])
    moved = norm(exact - start)
    rounding = np.concatenate([of_x, of_mu]) + ends.grown
    floor = TWICE * norm(rounding) + norm(ends.error) + 2 * late / span * moved
    off = norm(end - exact)
    off[~np.isfinite(off)] = np.inf
    floor[~np.isfinite(floor)] = np.inf
    times, name = first + at * float(recording.interval), recording.path.name
    step, row = float(recording.step), at + rows
    gap = (end - exact) / scale
    return Defects(name, step, span, times, off, floor, moved, row, start, gap, scale)


def velocities(scheme: RecordedScheme, run: Any) -> np.ndarray:
    """Return what the equations of motion know beside x: ξ, μ of a Hamiltonian, or nothing."""
    s = scheme.s
    if s.degenerate:
        return np.zeros((len(run.mu), 0))
    of_mu = s.hamiltonian is not None or scheme.scene.in_numbers
    return np.asarray(run.mu if of_mu else run.u, dtype=float)


def _lengths(scheme: RecordedScheme) -> tuple[np.ndarray, np.ndarray]:
    """Return (times, lengths of the motion there) at rows of the finest run; 0 if unknown."""
    run = scheme.runs[-1]
    at = np.unique(np.linspace(0, len(run.t) - 1, LENGTHS).astype(int))
    times = np.asarray([float(t) for t in run.t])[at]
    if scheme.scene.in_numbers:
        return times, np.zeros(len(at))
    around, v = surroundings(scheme.scene), velocities(scheme, run)
    lengths = []
    for k, t in zip(at, times, strict=True):
        x, u = ([mpmath.mpf(float(e)) for e in part[k]] for part in (run.x, v))
        try:
            length = around.length(x, u, Fraction(t))
        except ReferenceFailure:
            lengths.append(0.0)
            continue
        lengths.append(math.inf if length is None else float(length))
    return times, np.array(lengths)


def _short(
    lengths: tuple[np.ndarray, np.ndarray], at: np.ndarray, span: float, share: float = SHORT
) -> np.ndarray:
    """True where the time is short beside the motion, at both rows around whose length is known."""
    times, sizes = lengths
    after = np.clip(np.searchsorted(times, at), 0, len(times) - 1)
    least = np.minimum(sizes[after], sizes[np.maximum(after - 1, 0)])
    return np.asarray(span <= share * least)


def _largest(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the largest of each value and so many neighbours on each side."""
    padded = np.pad(values, reach, mode="edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1))


def errors_of_no_step(
    scheme: RecordedScheme,
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return (times, states, errors) of short rows: what of an error does not sink with the step.

    Over equal times the defects of the two finest runs are (e + C hᵖ) times the time; the errors
    are e, (r, n+m). None if no rows are short and of equal times, or e is the lesser part of the
    finest defects: then it may be what a higher power of h leaves. Raises `ReferenceFailure`.
    """
    index = len(scheme.runs) - 1
    if index < 1:
        return None
    coarse, fine = _defects(scheme, index - 1), _defects(scheme, index)
    same = _at_equal_times(scheme, coarse, fine, index)
    if same is None or not len(same.at):
        return None
    rates = [run.gap[: len(same.at)] * run.scale / run.span for run in (same, coarse)]
    ratio = (coarse.step / fine.step) ** (scheme.order or 1)
    errors = (ratio * rates[0] - rates[1]) / (ratio - 1)
    seen = _short(_lengths(scheme), same.at, same.span) & np.isfinite(errors).all(axis=1)
    clear = seen.any() and np.abs(errors[seen]).max() > np.abs(rates[0][seen]).max() / 2
    return (same.at[seen], same.start[seen], errors[seen]) if clear else None


# -- rows that are no steps ------------------------------------------------------------------------


def _power(coarse: Defects, fine: Defects) -> float | None:
    """Return the usual power of the step in the defects per unit of time, or None in round-off.

    Steps too long for a power still tell the motion of another clock: its defects do not sink.
    """
    j = _row_of(coarse, fine.at)
    usual = np.zeros(len(coarse.at))
    np.maximum.at(usual, j, fine.off / fine.span)
    clear = np.zeros(len(coarse.at))
    np.maximum.at(clear, j, (fine.off > CLEAR * fine.floor).astype(float))
    every = (coarse.off > CLEAR * coarse.floor) & (clear > 0) & (usual > 0)
    short = every & coarse.resolved
    seen = short if short.any() else every
    if not seen.any():
        return None
    slopes = np.log(coarse.off[seen] / coarse.span / usual[seen])
    power = float(np.median(slopes) / math.log(coarse.step / fine.step))
    return power if short.any() or power < HALF else None


def _near(coarse: Defects, fine: Defects) -> np.ndarray:
    """True at coarse rows where the runs are no further apart than the way of a row, or are beside.

    C is that of a state, and limits have the largest of three rows: a run that is late or early by
    more, by its own error, has another C at that time. One moved row has neighbours that are near.
    """
    k = np.minimum(np.searchsorted(fine.at, coarse.at - fine.span / 2), len(fine.at) - 1)
    apart = np.linalg.norm((fine.start[k] - coarse.start) / coarse.scale, axis=1)
    return np.asarray(_largest((apart <= coarse.moved).astype(float), 2) > 0)


def _row_of(coarse: Defects, times: np.ndarray) -> np.ndarray:
    """Return the defect of the coarse run within which each time lies."""
    rows = np.searchsorted(coarse.at, times + 1e-6 * coarse.span, side="right") - 1
    return np.clip(rows, 0, len(coarse.at) - 1)


def _beside(
    coarse: Defects, fine: Defects, power: float | None, lengths: tuple[np.ndarray, np.ndarray]
) -> str:
    """Return a row of one run that misses the power of the step beside the other run, or ""."""
    if power is None:
        return ""
    ratio = coarse.step / fine.step
    allowed = CHANGE * ratio**HALF
    short = _short(lengths, coarse.at, coarse.span) & _near(coarse, fine)
    sound = (_largest((~coarse.resolved).astype(float), 1) == 0) & short
    j = _row_of(coarse, fine.at)
    usual = ratio**-power * _largest(coarse.most, 1)[j]
    if said := _worst(fine, usual, allowed, sound[j], coarse):
        return said
    most = np.zeros(len(coarse.at))
    np.maximum.at(most, j, fine.most)
    usual = ratio**power * _largest(most, 1)
    sound = (most > 0) & short & (usual * coarse.span <= SMALL * _largest(coarse.moved, 1))
    return _worst(coarse, usual, allowed, sound, fine)


def _over_the_same(
    scheme: RecordedScheme, coarse: Defects, fine: Defects, index: int,
    lengths: tuple[np.ndarray, np.ndarray],
) -> Defects | None:  # fmt: skip
    """Return the defects of the fine run over the coarse one's rows, if any of these is long.

    Over a long row the motion enlarges errors and lets them cancel, so that defects per unit of
    time tell a power of the step over equal times alone. None where all are short, or no rows of
    the fine run make up one of the coarse.
    """
    if _short(lengths, coarse.at, coarse.span).all():
        return None
    return _at_equal_times(scheme, coarse, fine, index)


def _at_equal_times(
    scheme: RecordedScheme, coarse: Defects, fine: Defects, index: int
) -> Defects | None:
    rows = round(coarse.span / fine.span)
    if abs(coarse.span - rows * fine.span) > 1e-9 * coarse.span:
        return None
    begins = (coarse.row - 1) * rows
    return _defects(scheme, index, rows, begins[begins + rows < len(scheme.runs[index].t)])


def _over_long_rows(
    coarse: Defects, same: Defects, power: float, lengths: tuple[np.ndarray, np.ndarray]
) -> str:
    """Return a row that misses the power over equal times, where rows are long; or ""."""
    long = ~_short(lengths, coarse.at, coarse.span) & _near(coarse, same)
    sound = (_largest((~coarse.resolved).astype(float), 1) == 0) & long
    count = len(same.at)  # those that both runs have
    ratio = coarse.step / same.step
    usual = ratio**power * _largest(same.most, 1)
    small = usual * coarse.span <= SMALL * _largest(coarse.moved, 1)[:count]
    most, allowed = ratio**-power * _largest(coarse.most, 1)[:count], CHANGE * ratio**HALF
    said = _worst(same, most, allowed, sound[:count], coarse)
    return said or _worst(coarse, usual, allowed, small & long[:count], same)


def _spike(run: Defects, lengths: tuple[np.ndarray, np.ndarray]) -> str:
    """Return a row whose defect stands out beside those of its neighbours, or ""."""
    if len(run.at) < 8:
        return ""
    short = _short(lengths, run.at, run.span)
    return _worst(run, _beyond(run.most, range(2, 5)), SPIKE, short, None)


def _worst(
    run: Defects, usual: np.ndarray, allowed: float, seen: np.ndarray, other: Defects | None
) -> str:
    """Return the row whose defect is most beyond so many times the usual (r,), or ""."""
    least = run.least[: len(usual)]
    wrong = np.flatnonzero((least > allowed * usual) & seen)
    if not len(wrong):
        return ""
    k = int(wrong[(least[wrong] / usual[wrong]).argmax()])
    return _told(run, k, float(least[k] / usual[k]), other)


def _moved(run: Defects, lengths: tuple[np.ndarray, np.ndarray]) -> str:
    """Return a row that was moved by itself, or "".

    Moved by δ, it changes the defect before it by δ and the one after by −Φ′δ, so high differences
    of the defects, which sink along a smooth motion, by δ times binomial coefficients. These have
    to stand out beside the differences that do not meet the row, and to be gone when the two
    defects are interpolated by their neighbours.
    """
    together = run.row[1:] == run.row[:-1] + 1
    smooth = _short(lengths, run.at, run.span, FAIRLY_SHORT)
    for order in DIFFERENCES:
        reach, half = order + 2, order // 2
        if len(run.at) < 4 * reach:
            continue
        size = np.linalg.norm(np.diff(run.gap, order, axis=0), axis=1)
        whole = np.lib.stride_tricks.sliding_window_view(together, order).all(axis=1)
        size = np.where(whole & np.isfinite(size), size, 0)
        # with so wide a range a zero of these differences in it hides no more than half of them
        around = _beyond(size, range(reach, 3 * reach))
        limit = SPIKE * around + 2**order * _largest(run.floor, half)[half:-half]
        wrong = np.flatnonzero((size > limit) & smooth[half:-half])
        for k in wrong[np.argsort(-size[wrong] / limit[wrong])][:MOST_LOOKED_AT]:
            for first in (int(k) + half - 1, int(k) + half):
                if by := _moved_by(run.gap, first, order):
                    return (
                        f"row {run.row[first]} of {run.name} (t = {run.at[first] + run.span:.4g}) "
                        f"was moved by {by:.1g} of the motion from where the rows on both sides "
                        "of it lead to, which are steps without it"
                    )
    return ""


def _beyond(values: np.ndarray, reaches: range) -> np.ndarray:
    """Return the largest of the values that are so many places before or after each."""
    around = np.zeros(len(values))
    for reach in reaches:
        around[reach:] = np.maximum(around[reach:], values[:-reach])
        around[:-reach] = np.maximum(around[:-reach], values[reach:])
    return around


def _moved_by(gap: np.ndarray, first: int, order: int) -> float:
    """Return by how much the row between two defects, the first and the next, was moved, or 0."""
    nodes = np.array([*range(-order // 2, 0), *range(2, order // 2 + 2)])
    if first + nodes[0] < 0 or first + nodes[-1] >= len(gap):
        return 0.0
    smooth = gap.copy()
    for k in range(2):
        weights = [np.prod([(k - other) / (node - other) for other in nodes if other != node])
                   for node in nodes]  # fmt: skip
        smooth[first + k] = weights @ gap[first + nodes]
    here = slice(max(first - 2 * order, 0), first + 2 * order + 2)
    before, after = (np.linalg.norm(np.diff(e[here], order, axis=0), axis=1).max()
                     for e in (gap, smooth))  # fmt: skip
    by = (gap - smooth)[first : first + 2]
    size = float(np.linalg.norm(by[0]))
    alone = before > JUMP * after and np.linalg.norm(by.sum(axis=0)) <= size / 2
    return size if alone else 0.0


def _told(run: Defects, k: int, times: float, other: Defects | None) -> str:
    beside = "the rows beside it" if other is None else f"{other.name} shows at that time"
    return (
        f"row {run.row[k]} of {run.name} (t = {run.at[k] + run.span:.4g}) is no step from the row "
        f"before, as far as the others are steps: it is off the motion by {run.off[k]:.1g}, "
        f"{times:.3g} times what {beside}, so rows were moved, mixed or smoothed, the motion is "
        "another by a little, or the method remembers more than a row"
    )
