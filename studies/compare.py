"""`discmech compare`: methods side by side on the same scenes, with what each costs and loses.

Figures that can be compared are held against the best method's of the same scene and precision.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from discmech.integrators import BadInput

from .case import Progress, silent
from .running import Told, unheard
from .store import Store
from .verify import Request, studies, verify


def compare(
    request: Request,
    progress: Progress = silent,
    told: Told = unheard,
    jobs: int | None = None,
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
        reader = READERS.get(case["study"])
        if reader is not None and not case["control"]:
            line.update(reader(case))
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


def _order(case: dict[str, Any]) -> dict[str, Any]:
    # below a thousand roundings an error is not the method's any more
    least = 1e3 * (2.0**-53 if case["digits"] == 16 else 10.0 ** -case["digits"])
    errors = {r["step"]: r["error"] for r in case["rows"] if r["error"] and r["error"] > least}
    return {"order": case["measured"].get("order"), "errors": errors}


def _defect(case: dict[str, Any]) -> dict[str, Any]:
    values = [v for v in case["measured"].values() if v is not None]
    return {"defect": max(values, default=None)}


def _drift(case: dict[str, Any]) -> dict[str, Any]:
    return {"drift": max((case["measured"].get("drift") or {}).values(), default=None)}


def _stable(case: dict[str, Any]) -> dict[str, Any]:
    limits = [v for v in (case["measured"].get("limits") or {}).values() if v is not None]
    return {"stable": min(limits)} if limits else {}


def _costs(case: dict[str, Any]) -> dict[str, Any]:
    costs = case["measured"].get("cost") or {}
    return {"costs": {float(a): seconds for a, seconds in costs.items() if seconds is not None}}


READERS: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "order": _order,
    "symplecticity": _defect,
    "momentum": _drift,
    "energy": lambda case: {"band": case["measured"].get("band")},
    "stability": _stable,
    "work-precision": _costs,
}
