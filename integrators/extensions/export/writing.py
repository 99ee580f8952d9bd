"""The languages, and the one function that writes a file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ...compiler import digest
from ...errors import arguments_checked, unknown
from .c_file import c_file
from .exported import Exported, exportable
from .exported_lattice import ExportedLattice
from .jax_file import jax_file
from .julia_file import julia_file
from .numpy_file import numpy_file

LANGUAGES: dict[str, Callable[[Exported, Sequence[str], bool], str]] = {
    "c": c_file, "numpy": numpy_file, "julia": julia_file, "jax": jax_file,
}  # fmt: skip

SEAL = "0" * 16  # stands for the digest of a file in itself
#: nodes that a compiler works on at once; 0 where Newton's method solves all
LANES = {"c": 4, "numpy": 1, "julia": 1, "jax": 0}


@arguments_checked
def export(scheme: Any, language: str, harness: bool = False, said: Sequence[str] = ()) -> str:
    """Return the text of one file with a scheme's step, without dependencies.

    language: one of LANGUAGES. harness: with an adapter that answers JSON lines (`external`). said:
    paragraphs for the head, such as what was verified. Raises `BadInput` for another language, and
    for what no file can hold: a program, contact, steps that are made by loops.
    """
    if language not in LANGUAGES:
        raise unknown("language", language, LANGUAGES)
    scheme = exportable(scheme, language != "jax")
    model: Any = ExportedLattice(scheme) if hasattr(scheme, "lattice") else Exported(
        scheme, LANES[language])  # fmt: skip
    text = LANGUAGES[language](model, [said_by_us(), *said], harness)
    return text.replace(SEAL, digest(text.strip())[: len(SEAL)], 1)


def as_written(text: str) -> bool:
    """Tell whether a file is as `export` wrote it, so that another may take its place."""
    match = re.search(rf"seal ([0-9a-f]{{{len(SEAL)}}})", text)
    return match is not None and match[1] == digest(
        text.replace(match[1], SEAL, 1).strip()
    )[: len(SEAL)]  # fmt: skip


def said_by_us() -> str:
    """Return the paragraph of date and version, with a place for the digest of the whole."""
    try:
        number = version("discmech")
    except PackageNotFoundError:
        number = "of a checkout"
    return f"Written by discmech {number} on {date.today().isoformat()} (seal {SEAL})."
