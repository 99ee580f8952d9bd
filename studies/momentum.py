"""Momentum maps and Casimirs over long runs, against the random walk of round-off."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from integrators.momentum import Conserved
from integrators.scene import Scene

from .case import Case, Choice, Progress, Verdict, plain_cases, scheme_of, silent
from .runs import bins, interval, long_run, relative_drifts

NAME = "momentum"
NEEDS = "it needs a scene that declares symmetries or Casimirs."
DIGITS = (16, 50)
ROWS = 400


def cases(choice: Choice) -> list[Case]:
    """Every scene with a quantity that is kept to round-off, by every rule."""
    return [c for c in plain_cases(NAME, choice, DIGITS) if _kept(c)]


def _kept(case: Case) -> list[Conserved]:
    return [q for q in case.scene.symmetries if q.to_roundoff]


@cache
def _with_attitude(scene: Scene) -> Scene:
    return scene.with_attitude()


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {step, time, drift: {name: worst so far in its stretch}}; measured: the worst of each.

    A drift is |J_k − J_0| over the sum of the absolute values of J's terms. Quantities of the
    attitude run on the scene with the attitude as base; the others do without it.
    """
    steps = case.steps or (10**6 if case.digits == 16 else 100)
    series: dict[str, np.ndarray] = {}
    run = None
    for attitude in (False, True):
        quantities = [q for q in _kept(case) if q.attitude is attitude]
        if not quantities:
            continue
        scene = _with_attitude(case.scene) if attitude else case.scene
        scheme = scheme_of(scene, case.rule)
        run = long_run(case, scheme, steps, progress)
        x: Any = scheme.x
        if attitude:
            size = scene.groupoid.algebra.size  # type: ignore[attr-defined]
            x = x.reshape(size, size)
        for q in quantities:
            expression = q.formula(x, scheme.s.mu, scheme.s.parameters)
            series[q.name] = relative_drifts(scheme, expression, run, case.digits)
    assert run is not None
    rows = [
        {"step": min((last - 1) * interval(steps), steps), "time": float(run.t[last - 1]),
         "drift": {name: float(drift[first:last].max()) for name, drift in series.items()}}
        for first, last in bins(len(run.t), ROWS)
    ]  # fmt: skip
    worst = {name: float(drift.max()) for name, drift in series.items()}
    return {"rows": rows, "measured": {"drift": worst}, "steps": steps}


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Round-off: at most 1e-12 over 10⁶ steps, or 10⁴ units at more digits.

    The walk of round-off, ε√N, stands beside it.
    """
    eps = 2.0**-53 if case.digits == 16 else 10.0 ** (-case.digits)
    limit = 1e-12 if case.digits == 16 else 1e4 * eps
    expected = {"limit": limit, "random_walk": eps * math.sqrt(measurement["steps"])}
    drifting = {k: v for k, v in measurement["measured"]["drift"].items() if not v <= limit}
    if not drifting:
        return Verdict("pass", "", expected)
    name, value = max(drifting.items(), key=lambda item: item[1])
    return Verdict("fail", f"{name} drifts by {value:.2g}, more than {limit:.0e}.", expected)
