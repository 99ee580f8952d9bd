"""Count the files and lines of the mathematics that one step runs through before its first number.

python -m tests.benchmarks.cold_step [SCENE RULE]   heavy-top midpoint by default, without a cache
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections import defaultdict
from types import CodeType
from typing import Any


def counted(scene: str, rule: str) -> dict[str, int]:
    """Return {file: lines of the functions that were called}, for one step of a scene by a rule."""
    from discmech.integrators import Scheme, rules, scenes

    met: dict[str, set[CodeType]] = defaultdict(set)

    def seen(frame: Any, event: str, argument: Any) -> None:
        if event == "call" and f"{os.sep}integrators{os.sep}" in frame.f_code.co_filename:
            met[frame.f_code.co_filename].add(frame.f_code)

    given, by = scenes.get(scene), rules.get(rule)
    sys.setprofile(seen)
    try:
        Scheme(given, by).flow(given.step).trajectory(1)
    finally:
        sys.setprofile(None)
    return {
        file: len({line for code in codes for *_, line in code.co_lines() if line})
        for file, codes in met.items()
    }


if __name__ == "__main__":
    os.environ["DISCMECH_CACHE"] = tempfile.mkdtemp()
    found = counted(*(sys.argv[1:3] or ("heavy-top", "midpoint")))
    for file, lines in sorted(found.items(), key=lambda e: -e[1]):
        print(f"{lines:5}  {file.rpartition(f'integrators{os.sep}')[2]}")
    print(f"{sum(found.values())} lines in {len(found)} files")
