"""Constraints for pip: the oldest packages that pyproject.toml allows, and what its tests need.

python .ci/lowest.py > constraints.txt
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path


def lowest(text: str) -> list[str]:
    """A line name==version of each requirement that says from which version on it is met."""
    project = tomllib.loads(text)
    wanted = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    wanted += project["project"]["optional-dependencies"]["test"]
    return [re.sub(r"^([\w.-]+)>=([\w.]+).*", r"\1==\2", line) for line in wanted if ">=" in line]


if __name__ == "__main__":
    file = Path(__file__).resolve().parents[1] / "pyproject.toml"
    sys.stdout.write("\n".join(lowest(file.read_text(encoding="utf-8"))) + "\n")
