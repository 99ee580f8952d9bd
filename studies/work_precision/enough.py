"""The number of runs that the verdict of a race needs, and which of them are different."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.outcome import Row

#: sinking errors are told from steady ones by the better one of the last two, compared with the
#: best of those before: two of each
FEWEST = 4
#: factor of the budget that a rule may take for these few runs: its verdict is about the rule, and
#: not about how busy the machine is
PATIENT = 20


def errors_of(rows: Sequence[Row], metric: str) -> list[float]:
    """Return the errors of finished runs; tolerances that share a step made one run."""
    errors = {row["steps"] if "promised" in row else k: row[metric]
              for k, row in enumerate(rows) if row[metric] is not None}  # fmt: skip
    return list(errors.values())
