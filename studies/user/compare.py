"""`discmech compare`: methods side by side on the same scenes, with what each costs and loses.

Figures that can be compared are held against the best method's of the same scene and precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from discmech.integrators import BadInput

from ..core.case import Progress, silent
from ..core.cluster import Cluster
from ..core.running import Told, unheard
from ..core.store import Store
from ..core.study import view_of
from .verify import Request, studies, verify


def compare(
    request: Request,
    progress: Progress = silent,
    told: Told = unheard,
    jobs: int | Cluster | None = None,
    store: Store | None = None,
) -> dict[str, Any]:
    """Like `verify`, with work and precision; "comparison" holds a line a scene and method.

    Raises `BadInput` for fewer than two methods.
    """
    rules = request.rules()
    if len(rules) < 2:
        raise BadInput("name at least two methods to compare, such as my_rule.py midpoint.")
    asked = request.studies or (*studies(), "work-precision")
    result = verify(replace(request, studies=asked), progress, told, jobs, store)
    result["study"] = "compare"
    result["comparison"] = comparison(result["cases"])
    return result


def comparison(cases: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Lines {"scene", "rule", "retraction", "digits", NAME: value, ..., "ratios": {NAME: times}}.

    error: at the smallest `step` that all methods of the scene ran. seconds: to the smallest
    `accuracy` that all of them reach. order, defect, drift, band, stable (largest step times
    fastest frequency, where maps are drawn) as their studies have them. Ratios are to the smallest
    of the scene and precision.
    """
    lines: dict[tuple[Any, ...], dict[str, Any]] = {}
    for case in cases:
        key = (case["scene"], case["rule"], case["retraction"], case["digits"])
        line = lines.setdefault(
            key, dict(zip(("scene", "rule", "retraction", "digits"), key, strict=True))
        )
        read = view_of(case["study"]).compared
        if read is not None and not case["control"]:
            line.update(read(case))
    found = [line for line in lines.values() if len(line) > 4]
    for line in found:
        fellows = [f for f in found if (f["scene"], f["digits"]) == (line["scene"], line["digits"])]
        _common(line, fellows, "errors", "step", "error")
        _common(line, fellows, "costs", "accuracy", "seconds")
    for line in found:
        fellows = [f for f in found if (f["scene"], f["digits"]) == (line["scene"], line["digits"])]
        line["ratios"] = {
            name: line[name] / least
            for name in ("error", "band", "seconds")
            if line.get(name) and (least := min(f[name] for f in fellows if f.get(name)))
        }
    return [{k: v for k, v in line.items() if k not in ("errors", "costs")} for line in found]


def _common(
    line: dict[str, Any], fellows: Sequence[dict[str, Any]], held: str, key: str, value: str
) -> None:
    """The value at the smallest key that is held by all of the methods."""
    tables = [f[held] for f in fellows if f.get(held)]
    shared = set.intersection(*map(set, tables)) if tables else set()
    if line.get(held) and shared:
        line[key] = min(shared)
        line[value] = line[held][line[key]]
