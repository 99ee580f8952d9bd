"""What a certified reference costs: seconds against digits and time, with the growth law.

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
from pathlib import Path
from typing import Any

from discmech.integrators import scenes

from ..core.case import Progress, silent
from ..core.fingerprint import of_work
from ..core.record import machine, provenance, record
from ..core.store import Store

SCENE = "heavy-top"
DIGITS = (15, 30, 50, 100, 200, 400, 700, 1000)
SHORT = Fraction(1, 2)  # the time at which digits are compared
TIMES = (1, 2, 5, 10, 20, 50, 100)
SURE = 0.5  # seconds of processor time, beside which what disturbs a run is small
COMMAND = "discmech reference --costs"


def measure(
    progress: Progress = silent,
    digits: Sequence[int] = DIGITS,
    times: Sequence[int] = TIMES,
    store: Store | None = None,
) -> dict[str, Any]:
    """The result of a study: a case an integration, by digits and then by time, and the slopes.

    A case passes if all digits that were asked for are proven.
    """
    from discmech.reference.equations import equations_of

    equations = equations_of(scenes.get(SCENE))
    jobs = [("digits", d, SHORT) for d in digits] + [("time", 50, Fraction(t)) for t in times]
    weights = [d**2.5 * float(t) for _, d, t in jobs]
    cases = []
    for i, (kind, d, t) in enumerate(jobs):
        progress(f"{SCENE}: {d} digits, t = {t}", sum(weights[:i]) / sum(weights))
        cases.append(_case(kind, _remembered(equations, d, t, store)))
    slopes = {}
    for kind in ("digits", "time"):
        rows = [case["measured"] for case in cases if case["kind"] == kind]
        slopes[kind] = growth = _slope(rows, kind)
        for row in rows:
            row["growth"] = growth
    seconds = sum(case["seconds"] for case in cases)
    return {
        "schema": 1,
        "study": "references",
        "command": COMMAND,
        "verdict": "pass" if all(case["verdict"] == "pass" for case in cases) else "fail",
        "record": record(seconds, {"digits": list(digits), "times": list(times)}),
        "notes": [law(slopes), *([] if digits == DIGITS else [f"{COMMAND} goes on to more."])],
        "slopes": slopes,
        "cases": cases,
    }


def law(slopes: dict[str, float | None]) -> str:
    """The growth that was measured beside the one that is expected."""
    return (
        f"Seconds grow like digits^{slopes['digits']} (law: D² M(D), slope 2 to 3.6) and like "
        f"t^{slopes['time']} (law: 1, a little more where errors grow)."
    )


def _case(kind: str, row: dict[str, Any]) -> dict[str, Any]:
    at, sound = row.pop("measured_at"), row["proven"] >= row["digits"]
    return {
        "scene": SCENE, "rule": None, "retraction": None, "digits": row["digits"], "kind": kind,
        "verdict": "pass" if sound else "fail",
        "reason": "" if sound else f"only {row['proven']} digits are certain.",
        "command": f"discmech reference {SCENE} --time {row['time']:g} --digits {row['digits']}",
        "expected": {"digits": row["digits"]}, "measured": row, "rows": [row],
        "seconds": row["seconds"], "measured_at": at,
    }  # fmt: skip


def _remembered(equations: Any, digits: int, t: Fraction, store: Store | None) -> dict[str, Any]:
    if store is None:
        return _timed(equations, digits, t)
    words = ("references", f"{digits} {t}", str(machine()))
    key = of_work(words, [Path(__file__)], scenes.get(SCENE), ())
    found: dict[str, Any] = store.remembered(key, lambda: _timed(equations, digits, t))
    return found


def _timed(equations: Any, digits: int, t: Fraction) -> dict[str, Any]:
    """One certified integration, without any table or cache; the better of two if it is short."""
    from discmech.reference.bounded import bounded_integration
    from discmech.reference.series import compile_series

    program = compile_series(equations)
    best = math.inf
    for _ in range(2):
        begun = time.process_time()
        findings, sweep, _ = bounded_integration(equations, program, [t], digits)
        best = min(best, time.process_time() - begun)
        if best > SURE:
            break
    found = findings[t]
    return {
        "digits": digits, "time": float(t), "seconds": best, "steps": sweep.steps,
        "order": sweep.order, "proven": found.certain, "certainty": found.certainty,
        "measured_at": provenance(),
    }  # fmt: skip


def _slope(rows: Sequence[dict[str, Any]], by: str) -> float | None:
    """Of seconds in a log-log plot, over the upper half of the points."""
    import numpy as np

    upper = rows[len(rows) // 2 :]
    if len(upper) < 2:
        return None
    x, y = (np.log([row[name] for row in upper]) for name in (by, "seconds"))
    return round(float(np.polyfit(x, y, 1)[0]), 2)
