"""Two reports beside each other: cases with another verdict, and cases of one of them alone.

    python -m tests.compared OLD NEW        # folders of reports, such as reports/build

A line a case that differs, "same: N cases" last; exit code 1 if a verdict differs. Numbers may
differ (places of the evidence are drawn, times are taken anew); --numbers lists measured numbers
that changed by more than a tenth, too.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

Key = tuple[str, ...]


def cases(folder: Path) -> dict[Key, dict[str, Any]]:
    """The cases of a report, by study, scene, method, chart, precision and what sets them apart."""
    found: dict[Key, dict[str, Any]] = {}
    for file in sorted((folder / "tables").glob("*.json")):
        study = json.loads(file.read_text(encoding="utf-8"))
        for case in study.get("cases", ()):
            parts = (study["study"], case.get("scene"), case.get("rule"), case.get("retraction"),
                     case.get("digits"), case.get("control"), case.get("kind"), case.get("periods"),
                     case.get("extreme"), case.get("label"))  # fmt: skip
            key = tuple(str(part) for part in parts if part not in (None, ""))
            while key in found:
                key = (*key, "again")
            found[key] = case
    return found


def differences(old: Path, new: Path, numbers: bool = False) -> Iterator[str]:
    """A line for each case whose verdict differs or that one report lacks."""
    before, after = cases(old), cases(new)
    for key in sorted({*before, *after}):
        name = " ".join(key)
        if key not in after or key not in before:
            yield f"only in {'the new' if key in after else 'the old'}: {name}"
            continue
        one, two = before[key]["verdict"], after[key]["verdict"]
        if one != two:
            yield f"{one} -> {two}: {name}: {after[key].get('reason') or ''}"
        elif numbers:
            yield from _changed(name, before[key].get("measured"), after[key].get("measured"))


def _changed(name: str, one: Any, two: Any) -> Iterator[str]:
    if isinstance(one, dict) and isinstance(two, dict):
        for part in one.keys() & two.keys():
            yield from _changed(f"{name} {part}", one[part], two[part])
        return
    floats = isinstance(one, float) and isinstance(two, float)
    if floats and not math.isclose(one, two, rel_tol=0.1, abs_tol=1e-12):
        yield f"{one:.4g} -> {two:.4g}: {name}"


def main(words: list[str]) -> int:
    """Print the differences; 1 if a verdict differs, 2 if two folders were not named."""
    folders = [Path(word) for word in words if word != "--numbers"]
    if len(folders) != 2 or not all((folder / "tables").is_dir() for folder in folders):
        print(__doc__, file=sys.stderr)
        return 2
    lines = list(differences(*folders, numbers="--numbers" in words))
    both = cases(folders[0]).keys() & cases(folders[1]).keys()
    print(*lines, f"same: {len(both) - sum(' -> ' in line for line in lines)} cases", sep="\n")
    return int(any(" -> " in line and "-> " in line.split(":")[0] for line in lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
