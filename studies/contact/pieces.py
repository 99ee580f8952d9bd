"""A run under contact in pieces: between impacts it has to follow the rule's own free steps."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from discmech.integrators.flows import Trajectory

from ..systems.impulses import OTHERS

FREE = 16  # steps without contact that are repeated, beside all with impacts
MOST = 64  # largest number of steps that are repeated


def off_course(flow: Any, run: Trajectory, located: bool) -> float:
    """Return how far the pieces of a run miss the free steps of its rule, relative to the states.

    Pieces of a step with impacts go from its row to the first impact, from there to the next, and
    to the next row; those of some steps without contact from row to row. The share of a step is the
    time of its impact, which is known to the round-off of t: so states are compared with their
    change in t. In a stepped run the impulse at the start bends its way to an impact: there an
    impact at the end of a step has to leave the momentum of the next row, and one at its start a
    free step.
    """
    h, t0 = float(run.step), float(run.t[0])
    struck: dict[int, list[int]] = {}
    for j, t in enumerate(run.impacts.t):
        k = int((float(t) - t0) / h * (1 + 1e-12))
        on_row = k > 0 and abs(float(t) - t0 - k * h) <= 1e-9 * h
        at_end = on_row and not _still_to_come(run, k, j)
        struck.setdefault(k - 1 if at_end else k, []).append(j)
    still = np.logical_not(abs(run.impulses).any(axis=(1, 2)))
    free = [
        k for k in map(int, np.flatnonzero(still[:-1])) if k not in struck and k - 1 not in struck
    ]
    some = free[:: max(1, len(free) // FREE)][:FREE]
    worst = 0.0
    with flow.numbers.working():
        for k in sorted(struck)[:MOST]:
            if k + 1 < len(run.t):
                worst = _larger(worst, _of_step(flow, run, k, struck[k], located))
        for k in some:
            worst = _larger(worst, _piece(flow, _row(run, k), _row(run, k + 1), run.u[k], 1, h))
    return worst


def _still_to_come(run: Trajectory, k: int, j: int) -> bool:
    """True if row k, at the time of impact j, is before it: its gap was open by round-off."""
    row, each = run.mu[k], run.impacts
    return bool(abs(row - each.before[j]).max() < abs(row - each.after[j]).max())


def _larger(a: float, b: float) -> float:
    return b if not b <= a else a


def _row(run: Trajectory, k: int) -> tuple[float, Any, Any]:
    return float(run.t[k]), run.base[k], run.mu[k]


def _of_step(flow: Any, run: Trajectory, k: int, impacts: list[int], located: bool) -> float:
    h, each, total = float(run.step), run.impacts, abs(run.impulses[k]).max()
    others = abs(run.impulses[k] - sum(each.impulses[j] for j in impacts)).max()
    ends = abs(float(each.t[impacts[-1]] - run.t[k + 1])) <= 1e-9 * h
    if ends:
        after, row = np.asarray(each.after[impacts[-1]]), np.asarray(run.mu[k + 1])
        worst = float(abs(after - row).max() / (abs(row).max() + abs(after).max() or 1))
        if not located:
            return worst
    elif not located and abs(float(each.t[impacts[-1]] - run.t[k])) > 1e-9 * h:
        return 0.0
    else:
        worst = 0.0
    if others > OTHERS * total:  # those of gaps that stay closed
        return worst
    clock = len(run.base[k]) > len(each.x[impacts[0]])
    nodes = [(*_row(run, k)[:2], run.mu[k], run.mu[k])]
    for j in impacts:
        t = float(each.t[j])
        nodes.append((t, [*each.x[j], *([each.t[j]] if clock else [])], each.before[j],
                      each.after[j]))  # fmt: skip
    if not ends:
        nodes.append((*_row(run, k + 1), run.mu[k + 1]))
    for (t, x, _, mu), (s, y, nu, _) in pairwise(nodes):
        share = (s - t) / h
        if share > 0:
            worst = _larger(worst, _piece(flow, (t, x, mu), (s, y, nu), run.u[k], share, h))
    return worst


def _piece(flow: Any, start: Any, end: Any, near: Any, share: float, h: float) -> float:
    """Return how far a free step of a share of h from a start misses an end."""
    numbers = flow.numbers

    def array(values: Any) -> np.ndarray:
        return numbers.array([numbers.number(e) for e in values], -1)

    (t, x, mu), (s, y, nu) = start, end
    x, mu, y, nu = map(array, (x, mu, y, nu))
    got, momentum, _ = flow._part(numbers.number(share), x, mu, array(near))
    worst = 0.0
    for before, after, arrival in ((x, y, got), (mu, nu, momentum)):
        sizes = abs(before).max(initial=0) + abs(after).max(initial=0)
        sizes += (abs(t) + abs(s)) / h * abs(after - before).max(initial=0) / share
        worst = _larger(worst, float(abs(arrival - after).max(initial=0) / (sizes or 1)))
    return worst
