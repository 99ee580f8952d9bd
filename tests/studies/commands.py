"""The command as a process of its own, and its JSON as the standard has it."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest


def strict(text: str) -> Any:
    """JSON without NaN and Infinity."""
    return json.loads(text, parse_constant=pytest.fail)


def in_a_process(*words: str, code: str | None = None) -> subprocess.CompletedProcess[str]:
    """The command with these words, or a program that is given them."""
    python = [sys.executable] + (["-c", code] if code else ["-m", "discmech.studies.command"])
    return subprocess.run([*python, *words], capture_output=True, text=True, timeout=60)
