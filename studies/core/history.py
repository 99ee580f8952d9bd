"""What the last runs of the report found: of each case its figure and its verdict.

Each run is a file of its own, written and checked as the store's entries are: two reports at once
lose nothing, and a damaged run takes no other with it. They are shown beside the newest numbers and
judge nothing.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from discmech.integrators.compiler import Damaged, seal

from .baseline import identity
from .record import record
from .store import Store, unsealed_json

MOST = 50  # runs; the oldest go first
#: bytes of them all: a run of the whole bench takes 57,000 (1,087 cases), so 50 of them 2.9 million
LARGEST = 4_000_000
KEPT = ("date", "commit", "clean", "discmech", "machine", "cpu")


class Found(NamedTuple):
    """What a run found of a case."""

    date: str
    commit: str
    figure: str
    verdict: str


class History:
    """The runs that a store's folder has, the oldest first; what goes wrong is the store's trouble.

    A fresh store has its history too: it is of what was measured, not instead of measuring.
    """

    def __init__(self, store: Store) -> None:
        self.folder, self.troubles = store.folder.with_name("history"), store.troubles
        self.runs: list[Mapping[str, Any]] = []
        for path in self._newest()[MOST - 1 :: -1]:
            try:
                if run := unsealed_json(path):  # no other report just removed it
                    self.runs.append(run)
            except Damaged:
                self.troubles["history"] = f"a run in the history was damaged ({path}): left out."
                with suppress(OSError):
                    path.unlink()

    def add(
        self,
        results: Iterable[Mapping[str, Any]],
        figure: Callable[[str, dict[str, Any]], str],
    ) -> None:
        """This run; figure says in words what was found of a study's case."""
        made = record(0.0, {})
        cases = {
            _name(case): (figure(result["study"], case), case["verdict"])
            for result in results
            for case in result["cases"]
        }
        self.runs = [*self.runs[1 - MOST :], {key: made[key] for key in KEPT} | {"cases": cases}]

    def of(self, case: dict[str, Any]) -> list[Found]:
        """What the runs found of a case, those that had it."""
        name = _name(case)
        return [
            Found(str(run["date"]), _commit(run), *run["cases"][name])
            for run in self.runs if name in run["cases"]
        ]  # fmt: skip

    def keep(self) -> None:
        """Write the newest run, and remove what is more than is kept."""
        text = json.dumps(self.runs[-1], ensure_ascii=False, separators=(",", ":"))
        try:
            seal(self.folder / f"{time.time_ns()}.json", text)
        except OSError as error:
            self.troubles["history"] = (
                f"this run is not in the history ({error.strerror or error}: {self.folder})."
            )
        with suppress(OSError):  # another report removes them
            paths = self._newest()
            sizes = accumulate(path.stat().st_size for path in paths)
            for number, (path, size) in enumerate(zip(paths, sizes, strict=True)):
                if number >= MOST or size > LARGEST:
                    path.unlink(missing_ok=True)

    def _newest(self) -> list[Path]:
        return sorted(self.folder.glob("*.json"), reverse=True)


def _name(case: dict[str, Any]) -> str:
    """Of a case's identity, short: of a thousand no two share 80 bits."""
    return hashlib.sha256("\n".join(identity(case)).encode()).hexdigest()[:20]


def _commit(run: Mapping[str, Any]) -> str:
    commit = str(run["commit"] or "")[:7]
    return commit if run["clean"] or not commit else f"{commit} with changes"
