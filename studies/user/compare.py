"""`discmech compare`: methods side by side on the same scenes, with their costs and losses.

Comparable figures are divided by those of the best method on the same scene and precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from discmech.integrators import BadInput

from ..core.case import Progress, silent
from ..core.cluster import Cluster
from ..core.records import grouped
from ..core.result import AnyResult, StudyResult
from ..core.running import Told, unheard
from ..core.store import Store
from ..core.study import view_of
from .advice import LOST, advice
from .verify import Request, studies, verify

TABLES = ("errors", "costs", "drifts")  # what a study tells by names, of which a line has one value
PERIODS = 1000  # periods of the long race, in addition to the race over a scene's duration


def compare(
    request: Request,
    progress: Progress = silent,
    told: Told = unheard,
    jobs: int | Cluster | None = None,
    store: Store | None = None,
) -> StudyResult:
    """Run the studies of `verify` and the work-precision study.

    `comparison` has a line per scene and method, `advice` the recommended method (see `advice`).
    Raises `BadInput` for fewer than two methods, in one retraction.
    """
    rules = request.rules()
    if len(rules) < 2 and len(request.retractions) < 2:
        raise BadInput(
            "name at least two different methods to compare, such as my_rule.py midpoint, or two "
            "retractions of one, --retraction cayley --retraction exponential."
        )
    asked = request.studies or (*studies(), "work-precision")
    asking = replace(request, studies=asked, also_periods=PERIODS, together=True,
                     usual=not request.studies)  # fmt: skip
    result = verify(asking, progress, told, jobs, store)
    lines = comparison(result.cases)
    advised = advice(result.cases, lines)
    return replace(result, study="compare", comparison=lines, advice=advised)


def comparison(cases: Sequence[AnyResult]) -> list[dict[str, Any]]:
    """Return lines {"scene", "rule", "retraction", "digits", NAME: value, ..., "ratios": {NAME:
    times}}.

    error: at the smallest `step` that all methods of the scene ran. seconds: to the smallest
    `accuracy` that all of them reach. order, defect, drift, band, stable (largest step times
    fastest frequency, where maps are drawn), bounded and bounded_spread (share of such a map): as
    in their studies. Ratios are to the smallest value of the scene and precision. not_finite: names
    without a value because the run failed or its numbers are not finite; a value as large as the
    quantity itself has no ratio.
    """
    lines: dict[tuple[Any, ...], dict[str, Any]] = {}
    for case in cases:
        key = (case.scene, case.rule, case.retraction, case.digits)
        line = lines.setdefault(
            key, dict(zip(("scene", "rule", "retraction", "digits"), key, strict=True))
        )
        compared = view_of(case.study).compared
        if not case.control and compared is not None:
            failed = case.verdict == "fail" and not case.figures
            for name, value in compared(case).items():
                if _is_finite(value) or (value is None and not failed):
                    line[name] = value
                else:
                    line.setdefault("not_finite", []).append("error" if name == "errors" else name)
    rows = [line for line in lines.values() if len(line) > 4]
    for fellows in grouped(rows, lambda line: (line["scene"], line["digits"])).values():
        for line in fellows:
            _common(line, fellows, "errors", "step", "error")
            _common(line, fellows, "costs", "accuracy", "seconds")
        for line in fellows:
            line["ratios"] = {
                name: line[name] / min(f[name] for f in fellows if _sound(f, name))
                for name in ("error", "band", "seconds")
                if _sound(line, name)
            }
    return [{k: v for k, v in line.items() if k not in TABLES} for line in rows]


def _is_finite(value: Any) -> bool:
    """Return True for a finite number, or for a table with one."""
    if isinstance(value, dict):
        return any(map(math.isfinite, value.values()))
    return value is not None and math.isfinite(value)


def _sound(line: dict[str, Any], name: str) -> bool:
    """Return True if a value may stand in a ratio: if everything is lost, a ratio means nothing."""
    value = line.get(name) or 0.0
    return value > 0 and (name == "seconds" or value < LOST)


def _common(
    line: dict[str, Any], fellows: Sequence[dict[str, Any]], table: str, key: str, value: str
) -> None:
    """Set the value at the smallest key that all of the methods have."""
    tables = [f[table] for f in fellows if f.get(table)]
    shared = set.intersection(*map(set, tables)) if tables else set()
    if line.get(table) and shared:
        line[key] = min(shared)
        line[value] = line[table][line[key]]
