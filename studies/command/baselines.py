"""The options --save-baseline and --baseline of every study, and their answers."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from .output import EXIT

if TYPE_CHECKING:
    from ..core.baseline import Comparison
    from ..core.case import Choice
    from ..core.result import StudyResult
    from ..core.study import Study


def add_baselines(parser: argparse.ArgumentParser) -> None:
    """Declare both options."""
    parser.add_argument("--save-baseline", metavar="NAME", help="save the result under this name")
    parser.add_argument(
        "--baseline", metavar="NAME",
        help="compare with the result of that name; exit code 1 if something is worse, 3 if "
        "something cannot be compared",
    )  # fmt: skip


def earlier(options: argparse.Namespace) -> StudyResult | None:
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
    options: argparse.Namespace,
    result: StudyResult,
    before: StudyResult | None,
    studies: Iterable[Study],
    choice: Choice,
) -> tuple[StudyResult, list[str]]:
    """Compare, then save, with what the studies were asked of; a missing baseline is saved.

    Nothing is saved if something that the files define was left out: a baseline cannot be made
    again. Return the result with the comparison, and the lines to print.
    """
    from ..core import baseline, lookup

    lines = []
    if options.baseline is not None or options.save_baseline is not None:
        result = replace(result, asked=baseline.asked_of(studies, choice))
    if before is not None:
        comparison = baseline.compared(options.baseline, result, before)
        result = replace(result, baseline=comparison)
        lines += _said(comparison)
    missing = options.baseline is not None and before is None
    for name in dict.fromkeys([options.save_baseline, options.baseline if missing else None]):
        if name is not None and lookup.left_out(once=False):
            lines.append(f"not saved as the baseline {name}: something of the files was left out.")
        elif name is not None:
            path = baseline.save(name, result)
            new = missing and name == options.baseline
            line = f"saved as the baseline {name}{' (there was none)' * new}: {path}"
            lines.append(line + " (DISCMECH_CACHE names another folder)" * new)
    return result, lines


def exit_beside(result: StudyResult, code: int) -> int:
    """Return the exit code: of a failure if some case is worse than in the baseline.

    If some case cannot be compared with it, a pass is inconclusive. code: that of the verdict.
    """
    from ..core.baseline import OTHER

    answers = {line.answer for line in result.baseline.lines} if result.baseline else set()
    if "worse" in answers:
        return EXIT["fail"]
    return EXIT["inconclusive"] if OTHER in answers and code == EXIT["pass"] else code


def _said(comparison: Comparison) -> list[str]:
    counts = Counter(line.answer for line in comparison.lines)
    told = ", ".join(f"{count} {answer}" for answer, count in counts.items())
    commit = (comparison.commit or "")[:10]
    lines = [
        f"beside {comparison.name} ({comparison.date}{f' at {commit}' if commit else ''}): {told}"
    ]
    lines += [
        f"  {line.answer}: {line.case}: {line.why}\n    again: {line.command}"
        for line in comparison.lines if line.answer != "equal"
    ]  # fmt: skip
    lines += [f"  {what} was {then}, is {now}" for what, then, now in comparison.environment]
    return lines
