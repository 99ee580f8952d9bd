"""The languages, and the one function that writes a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ...errors import arguments_checked, unknown
from .c_file import c_file
from .exported import Exported, exported
from .jax_file import jax_file
from .julia_file import julia_file
from .numpy_file import numpy_file

LANGUAGES: dict[str, Callable[[Exported, Sequence[str], bool], str]] = {
    "c": c_file, "numpy": numpy_file, "julia": julia_file, "jax": jax_file,
}  # fmt: skip


@arguments_checked
def export(scheme: Any, language: str, harness: bool = False, said: Sequence[str] = ()) -> str:
    """Return the text of one file with a scheme's step, without dependencies.

    language: one of LANGUAGES. harness: with an adapter that answers JSON lines (`external`). said:
    paragraphs for the head, such as what was verified. Raises `BadInput` for another language, and
    for what no file can hold: a program, a scene with contact, steps that are made by loops.
    """
    if language not in LANGUAGES:
        raise unknown("language", language, LANGUAGES)
    return LANGUAGES[language](exported(scheme), [said_by_us(), *said], harness)


def said_by_us() -> str:
    """Return the paragraph of date and version."""
    try:
        number = version("discmech")
    except PackageNotFoundError:
        number = "of a checkout"
    return f"Written by discmech {number} on {date.today().isoformat()}."
