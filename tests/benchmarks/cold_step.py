"""Count the files and lines of ours that one cold step runs, from the scene to the first numbers.

    python -m tests.benchmarks.cold_step [SCENE RULE] [-v]

The first process derives, writes and compiles the step with an empty cache and takes it; the second
one finds the code in the cache. A file counts if one of its functions is called, by sys.setprofile,
but not by the import of a module. -v lists the files.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


class Calls:
    """The functions of ours that are called while this listens, outside of imports."""

    def __init__(self) -> None:
        self.importing, self.path_of = 0, dict[CodeType, Path | None]()

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if code.co_name == "<module>":
            self.importing += {"call": 1, "return": -1}.get(event, 0)
        elif event == "call" and not self.importing and code not in self.path_of:
            path = Path(code.co_filename).resolve()
            self.path_of[code] = path if path.is_relative_to(ROOT / "integrators") else None

    def lines(self) -> Counter[Path]:
        """Return for each file the number of lines of its functions."""
        found = Counter[Path]()
        for code, path in self.path_of.items():
            if path is not None:
                found[path] += len({line for *_, line in code.co_lines() if line})
        return found


def count(scene: str, rule: str, names: bool) -> None:
    """Take one step in this process and print the counts."""
    from discmech import Scheme, scenes
    from discmech.integrators import rules

    calls = Calls()
    sys.setprofile(calls)
    mu = Scheme(scenes.get(scene), rules.get(rule)).flow("0.05").trajectory(1).mu
    sys.setprofile(None)
    assert abs(mu[-1]).max() > 0
    found = calls.lines()
    whole = sum(len(path.read_text("utf-8").splitlines()) for path in found)
    print(
        f"{len(found)} files of {whole:,} lines; their functions that ran: {found.total():,} lines"
    )
    for path, lines in found.most_common() if names else ():
        print(f"  {lines:5} {path.relative_to(ROOT)}")


def main(words: list[str]) -> None:
    """Count in processes of their own, with one cache that begins empty."""
    names = [word for word in words if word not in ("-v", "--here")] or ["heavy-top", "midpoint"]
    if "--here" in words:
        return count(*names, names="-v" in words)
    command = [sys.executable, "-m", "tests.benchmarks.cold_step", "--here", *words]
    with TemporaryDirectory() as folder:
        for what in ("empty cache", "code in the cache"):
            print(f"{' '.join(names)}, {what}: ", end="", flush=True)
            own = {**os.environ, "DISCMECH_CACHE": folder}
            subprocess.run(command, env=own, cwd=ROOT, check=True)
    return None


if __name__ == "__main__":
    main(sys.argv[1:])
