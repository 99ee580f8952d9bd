"""The options --save-baseline and --baseline of every study, and their answers."""

from __future__ import annotations

import argparse
from typing import Any


def add_baselines(parser: argparse.ArgumentParser) -> None:
    """Declare both options."""
    parser.add_argument("--save-baseline", metavar="NAME", help="save the result under this name")
    parser.add_argument(
        "--baseline", metavar="NAME",
        help="compare with the result of that name; exit code 1 if something is worse",
    )  # fmt: skip


def earlier(options: argparse.Namespace) -> dict[str, Any] | None:
    """Return the requested baseline, or None.

    Raises `BadInput` for wrong names, damaged files and results that cannot be saved.
    """
    from ..core import baseline

    for name in (options.save_baseline, options.baseline):
        if name is not None:
            baseline.checked_name(name)
    before = None if options.baseline is None else baseline.load(options.baseline, options.study)
    saved = options.save_baseline or (options.baseline if before is None else None)
    if saved is not None:
        baseline.check_kept(saved, options.study)
    return before


def beside_baseline(
    options: argparse.Namespace, result: dict[str, Any], before: dict[str, Any] | None
) -> list[str]:
    """Compare, then save; a missing baseline is saved. Return the lines to print."""
    from ..core import baseline

    lines = []
    if before is not None:
        found = result["baseline"] = baseline.compared(options.baseline, result, before)
        lines += _said(found)
    missing = options.baseline is not None and before is None
    for name in dict.fromkeys([options.save_baseline, options.baseline if missing else None]):
        if name is not None:
            path = baseline.save(name, result)
            new = " (there was none)" if missing and name == options.baseline else ""
            lines.append(f"saved as the baseline {name}{new}: {path}")
    return lines


def is_worse(result: dict[str, Any]) -> bool:
    """Return True if some case is worse than in the baseline."""
    lines = result.get("baseline", {}).get("lines", ())
    return any(line["answer"] == "worse" for line in lines)


def _said(found: dict[str, Any]) -> list[str]:
    counts: dict[str, int] = {}
    for line in found["lines"]:
        counts[line["answer"]] = counts.get(line["answer"], 0) + 1
    told = ", ".join(f"{count} {answer}" for answer, count in counts.items())
    commit = str(found["commit"] or "")[:10]
    lines = [f"beside {found['name']} ({found['date']}{f' at {commit}' if commit else ''}): {told}"]
    lines += [
        f"  {line['answer']}: {line['case']}: {line['why']}\n    again: {line['command']}"
        for line in found["lines"] if line["answer"] != "equal"
    ]  # fmt: skip
    lines += [f"  {what} was {then}, is {now}" for what, then, now in found["environment"]]
    return lines
