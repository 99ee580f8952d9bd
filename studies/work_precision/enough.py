"""How many runs the verdict of a race needs, and which of them are different ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

#: errors that sink are told from those that stand by the better one of the last two, beside the
#: best of those before: two of each
FEWEST = 4
#: times the budget that a rule may take for these few runs: its verdict is one of the rule, and not
#: of how busy the machine is
PATIENT = 20


def errors_of(rows: Sequence[dict[str, Any]], metric: str) -> list[float]:
    """The errors of the runs that came to their end; tolerances that share a step made one run."""
    found = {row["steps"] if "promised" in row else k: row[metric]
             for k, row in enumerate(rows) if row[metric] is not None}  # fmt: skip
    return list(found.values())
