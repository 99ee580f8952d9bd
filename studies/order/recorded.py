"""The order of recorded runs: their errors at all times at which all of them have a row."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.foreign import Recorded

from ..core.case import Case
from ..evidence.rows import of_rows, velocities
from .records import Found, Row
from .window import fit

FEWEST = 4  # fewest runs: as many points tell a straight line from a bent one
#: certified references along the runs; from each the motion goes on to the rows before the next
CERTIFIED = 12
MOVED = 2.0**-26  # relative change of the start, to see how the motion enlarges it


def measure(case: Case) -> Found:
    """Return rows as `measuring.measure` does, one per recorded run, with the reference from its
    start.

    The error of a run is the quadratic mean over all common rows, each relative to the state and
    over the factor by which the motion enlarges a change of its start up to there: in a chaotic
    motion the last rows would otherwise be all. local: the steps from row to row
    (`evidence.rows`). Raises `CannotMeasure` if the runs have no later time in common, or begin at
    a time other than 0 for a scene that depends on time.
    """
    scheme: Any = case.scheme
    if scheme.s.clocked and scheme.rule.recordings[0].start != 0:
        raise CannotMeasure(
            f"{case.scene.name} depends on time, and its reference begins at t = 0: "
            f"{case.label} begin at {float(scheme.rule.recordings[0].start):.6g}."
        )
    times, rows_at = common_times(scheme.rule)
    motion = _Motion(scheme, times)
    sizes = np.linalg.norm(np.hstack([motion.x, motion.mu]), axis=1)
    sizes = np.where(sizes > 0, sizes, 1) * motion.grown
    rows = []
    for run, at in zip(scheme.runs, rows_at.T, strict=True):
        off = [np.linalg.norm(np.asarray(got, dtype=float)[at] - wanted, axis=1) / sizes
               for got, wanted in ((run.x, motion.x), (run.mu, motion.mu))]  # fmt: skip
        of_x, of_mu = (float(np.sqrt(np.mean(e**2))) for e in off)
        of_base = of_x if motion.x.shape[1] else None
        row = Row(round(times[-1] / run.step), float(run.step))
        rows.append(row.with_errors(float(np.hypot(of_x, of_mu)), of_base, of_mu))
    agreed = motion.certain if case.scene.in_numbers else None
    return Found(*fit(case, rows, motion.certain), motion.certain, agreed,
                 of_rows(scheme), float(times[-1]), float(motion.grown.max()))  # fmt: skip


class _Motion:
    """The scene's motion at the times: x (r, n), mu (r, m), the certain digits of the references.

    grown: how many times larger a relative change of the start is at each time; 1 where it is not.
    """

    def __init__(self, scheme: Any, times: list[Fraction]) -> None:
        last = np.unique(np.linspace(0, len(times) - 1, CERTIFIED + 1).astype(int)[1:])
        answers = reference.solutions(scheme.scene, [times[k] for k in last], digits=30)
        self.certain = min(answer.certain_digits for answer in answers)
        start = scheme.runs[0]
        x, v = (np.asarray(part, dtype=float)[:1] for part in (start.x, velocities(scheme, start)))
        signs = np.resize([1.0, -1.0], x.shape[1] + v.shape[1])
        moved = [part * (1 + MOVED * sign) for part, sign in
                 ((x, signs[: x.shape[1]]), (v, signs[x.shape[1] :]))]  # fmt: skip
        many, before, now = reference.many_motions(scheme.scene), -1, Fraction(0)
        ends, growth = [], [1.0]
        for k, answer in zip(last, answers, strict=True):
            spans = np.array([float(t - now) for t in times[before + 1 : k + 1]])
            count = len(spans)
            at_now, every = np.full(count, float(now)), (np.repeat(e, count, 0) for e in (x, v))
            plain = many.after(next(every), next(every), at_now, spans, 0 * signs)
            other = many.after(moved[0], moved[1], at_now[-1:], spans[-1:], 0 * signs)
            moved = [other.x, other.v]
            state = np.array([[float(e) for e in (*answer.x, *answer.mu)]])
            at = np.hstack([plain.x, plain.mu])
            at[-1] = state[0]
            ends.append(at)
            off = np.linalg.norm(np.hstack([other.x, other.mu]) - state)
            growth.append(max(1.0, float(off / (np.linalg.norm(state) or 1.0) / MOVED)))
            v_end = answer.mu if v.shape[1] and scheme.s.hamiltonian is not None else answer.v
            x = state[:, : x.shape[1]]
            v = np.array([[float(e) for e in v_end]])[:, : v.shape[1]]
            before, now = int(k), times[k]
        whole = np.concatenate(ends)
        self.x, self.mu = whole[:, : x.shape[1]], whole[:, x.shape[1] :]
        known = [0.0, *(float(times[k]) for k in last)]
        self.grown = np.exp(np.interp([float(t) for t in times], known, np.log(growth)))


def common_times(rule: Recorded) -> tuple[list[Fraction], np.ndarray]:
    """Return (times after the start at which all runs have a row, the rows, (times, runs))."""
    recordings = rule.recordings
    coarse = max(recordings, key=lambda run: run.interval)
    times, rows = [], []
    for row in range(1, len(coarse.t)):
        time, indices = row * coarse.interval, []
        for run in recordings:
            index = round(time / run.interval)
            if index >= len(run.t) or abs(index * run.interval - time) > run.late + coarse.late:
                break
            indices.append(index)
        else:
            times.append(time)
            rows.append(indices)
    if not times:
        raise CannotMeasure(
            f"{rule.name}: the runs have no time in common at which all have a row, so their "
            "errors cannot be compared: let all end at the same time."
        )
    return times, np.array(rows)
