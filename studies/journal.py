"""What an interrupted study had finished, so that the same command goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from discmech.integrators.compiler import cache_folder
from discmech.integrators.numbers import flatten

from .case import Case, Choice
from .lookup import stamp


class Journal:
    """Results of finished cases, one JSON line each, kept until the study is complete.

    The key covers what was asked and the sources of the project: changed code starts anew.
    """

    def __init__(self, study: str, choice: Choice) -> None:
        self.path = cache_folder() / "unfinished" / f"{study}_{_key(study, choice)}.jsonl"
        self.done: dict[str, Any] = {}
        if self.path.exists():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                try:
                    entry = json.loads(line)
                    self.done[entry["key"]] = entry["result"]
                except (json.JSONDecodeError, KeyError, TypeError):  # it was being written
                    continue

    def find(self, case: Case) -> dict[str, Any] | None:
        """The case's result, if an interrupted run had finished it."""
        return self.done.get(_case_key(case))

    def add(self, case: Case, result: dict[str, Any]) -> None:
        """Keep a finished case."""
        self.keep(_case_key(case), result)

    def keep(self, key: str, result: Any) -> None:
        """Keep a result under a key of its own; `done` has those of an interrupted run."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            # a line break before as well: the last line may be a half one
            file.write("\n" + json.dumps({"key": key, "result": result}) + "\n")

    def close(self) -> None:
        """The study is complete: nothing is left to go on with."""
        self.path.unlink(missing_ok=True)


def _case_key(case: Case) -> str:
    scene = case.scene
    values = [*flatten(tuple(scene.parameters.values())), *scene.x0, *scene.v0, scene.duration,
              scene.step]  # fmt: skip
    return f"{case.label} {case.command} {scene.groupoid.name} {' '.join(map(str, values))}"


def _key(study: str, choice: Choice) -> str:
    root = Path(__file__).resolve().parent.parent
    sources = [p for name in ("integrators", "reference", "studies")
               for p in sorted((root / name).rglob("*.py"))]  # fmt: skip
    asked = [[*map(stamp, choice.scenes)], [*map(stamp, choice.rules)], choice.controls,
             choice.retractions, choice.digits, choice.steps, choice.peers, choice.axes,
             choice.periods, choice.budget, choice.thorough, choice.extremes]  # fmt: skip
    digest = hashlib.sha256(f"{study} {asked}".encode())
    for path in sources:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:20]
