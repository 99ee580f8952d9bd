"""The results of the last runs of the report: the figure and the verdict of each case.

Each run is a row of the store, named by its time: two reports at once lose nothing, and a damaged
run does not affect the others. They are shown beside the newest numbers and judge nothing.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Mapping
from itertools import accumulate
from typing import Any, NamedTuple

from .baseline import identity
from .record import record
from .result import AnyResult, StudyResult
from .store import Store

MOST = 50  # runs that are kept; the oldest are removed first
#: bytes of them all: a run of the whole bench takes 57,000 (1,087 cases), so 50 of them 2.9 million
LARGEST = 4_000_000
KEPT = ("date", "commit", "clean", "discmech", "machine", "cpu")


class Found(NamedTuple):
    """The result of a case in a run."""

    date: str
    commit: str
    figure: str
    verdict: str


class History:
    """The runs in a store, the oldest first; errors are added to the store's troubles.

    A fresh store has its history too: the history does not replace measuring.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self.runs: list[Mapping[str, Any]] = []
        damaged = []
        for name, run, _ in store.all("run"):
            if run is None:
                damaged.append(name)
            else:
                self.runs.insert(0, run)
        if damaged:
            store.troubles["history"] = (
                f"{len(damaged)} of the runs in the history were damaged ({store.path}): left out."
            )
            store.remove("run", damaged)
        del self.runs[:-MOST]

    def add(self, results: Iterable[StudyResult], figure: Callable[[AnyResult], str]) -> None:
        """Add this run; figure: case ↦ the result in words."""
        made = record(0.0, {})
        cases = {
            _name(case): (figure(case), case.verdict) for result in results for case in result.cases
        }
        self.runs = [*self.runs[1 - MOST :], {key: made[key] for key in KEPT} | {"cases": cases}]

    def of(self, case: AnyResult) -> list[Found]:
        """Return the results of a case in the runs that had it."""
        name = _name(case)
        return [
            Found(str(run["date"]), _commit(run), *run["cases"][name])
            for run in self.runs if name in run["cases"]
        ]  # fmt: skip

    def keep(self) -> None:
        """Write the newest run, and remove the oldest ones beyond the limits."""
        try:
            self.store.save("run", f"{time.time_ns():020}", self.runs[-1])
        except OSError as error:
            self.store.troubles["history"] = (
                f"this run is not in the history ({error}: {self.store.path})."
            )
        names, sizes = [], []
        for name, _, size in self.store.all("run"):
            names.append(name)
            sizes.append(size)
        more = [k >= MOST or size > LARGEST for k, size in enumerate(accumulate(sizes))]
        self.store.remove("run", [name for name, old in zip(names, more, strict=True) if old])


def _name(case: AnyResult) -> str:
    """Return a short name of a case's identity: of a thousand no two share 80 bits."""
    return hashlib.sha256("\n".join(identity(case)).encode()).hexdigest()[:20]


def _commit(run: Mapping[str, Any]) -> str:
    commit = str(run["commit"] or "")[:7]
    return commit if run["clean"] or not commit else f"{commit} with changes"
