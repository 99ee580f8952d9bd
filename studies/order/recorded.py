"""The order of recorded runs: their errors at the last time at which all of them have a row."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from discmech.integrators.errors import CannotMeasure
from discmech.integrators.foreign import Recorded

from ..core.case import Case
from ..systems import system_of
from .records import Found, Row
from .window import fit

FEWEST = 4  # fewest runs: as many points tell a straight line from a bent one


def measure(case: Case) -> Found:
    """Return rows as `measuring.measure` does, one per recorded run, with the reference from its
    start.

    Raises `CannotMeasure` if the runs have no later time in common, or begin at a time other than 0
    for a scene that depends on time.
    """
    scheme: Any = case.scheme
    if scheme.s.clocked and scheme.rule.recordings[0].start != 0:
        raise CannotMeasure(
            f"{case.scene.name} depends on time, and its reference begins at t = 0: "
            f"{case.label} begin at {float(scheme.rule.recordings[0].start):.6g}."
        )
    duration, at = common_time(scheme.rule)
    system = system_of(case)
    exact = system.end(duration, 30)
    rows = []
    for run, index in zip(scheme.runs, at, strict=True):
        error, of_x, of_mu = system.error(run.x[index], run.mu[index], exact)
        rows.append(Row(round(duration / run.step), float(run.step), error, of_x, of_mu))
    return Found(*fit(case, rows, exact.certain), exact.certain, duration=float(duration))


def common_time(rule: Recorded) -> tuple[Fraction, list[int]]:
    """Return (the last time after the start that all runs have, its row in each)."""
    recordings = rule.recordings
    coarse = max(recordings, key=lambda run: run.interval)
    for row in range(len(coarse.t) - 1, 0, -1):
        time, found = row * coarse.interval, []
        for run in recordings:
            index = round(time / run.interval)
            if index >= len(run.t) or abs(index * run.interval - time) > run.late + coarse.late:
                break
            found.append(index)
        else:
            return time, found
    raise CannotMeasure(
        f"{rule.name}: the runs have no time in common at which all have a row, so their "
        "errors cannot be compared: let all end at the same time."
    )
