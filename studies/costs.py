"""What a certified reference costs: seconds against digits and against time, with the growth law.

A step of order N costs N^2/2 products of numbers of D digits for each product of the equations; N
grows like 1.15 D (Jorba, Zou 2005), the number of steps does not. With M(D) the cost of a product,
D^2 M(D) is expected: slope 2 while numbers are short, 3 to 3.6 when products are schoolbook's or
Karatsuba's. Against time the cost is linear, and a little more where errors grow.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from integrators import scenes

from .case import Progress, silent

SCENE = "heavy-top"
DIGITS = (15, 30, 50, 100, 200, 400, 700, 1000)
SHORT = Fraction(1, 2)  # the time at which digits are compared
TIMES = (1, 2, 5, 10, 20, 50, 100)


def measure(
    progress: Progress = silent, digits: Sequence[int] = DIGITS, times: Sequence[int] = TIMES
) -> dict[str, Any]:
    """Rows {digits, time, seconds, steps, order, proven} of both kinds, and the slopes."""
    from reference.equations import equations_of

    equations = equations_of(scenes.get(SCENE))
    jobs = [(d, SHORT) for d in digits] + [(50, Fraction(t)) for t in times]
    weights = [d**2.5 * float(t) for d, t in jobs]
    rows = []
    for i, (d, t) in enumerate(jobs):
        progress(f"{SCENE}: {d} digits, t = {t}", sum(weights[:i]) / sum(weights))
        rows.append(_timed(equations, d, t))
    against_digits, against_time = rows[: len(digits)], rows[len(digits) :]
    return {
        "schema": 1,
        "scene": SCENE,
        "digits": against_digits,
        "times": against_time,
        "slopes": {
            "digits": _slope(against_digits, "digits"),
            "time": _slope(against_time, "time"),
        },
    }


def _timed(equations: Any, digits: int, t: Fraction) -> dict[str, Any]:
    """One certified integration, without any table or cache; the better of two if it is short."""
    from reference.bounded import bounded_integration
    from reference.series import compile_series

    program = compile_series(equations)
    best = math.inf
    for _ in range(2):
        begun = time.perf_counter()
        findings, sweep, _ = bounded_integration(equations, program, [t], digits)
        best = min(best, time.perf_counter() - begun)
        if best > 2:
            break
    found = findings[t]
    return {
        "digits": digits, "time": float(t), "seconds": best, "steps": sweep.steps,
        "order": sweep.order, "proven": found.certain, "certainty": found.certainty,
    }  # fmt: skip


def _slope(rows: Sequence[dict[str, Any]], by: str) -> float | None:
    """Of seconds in a log-log plot, over the upper half of the points."""
    import numpy as np

    upper = rows[len(rows) // 2 :]
    if len(upper) < 2:
        return None
    x, y = (np.log([row[name] for row in upper]) for name in (by, "seconds"))
    return round(float(np.polyfit(x, y, 1)[0]), 2)
