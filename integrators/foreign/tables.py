"""Columns of numbers by their names, from CSV, npz and parquet files."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from ..errors import BadInput, shown

WANTED = "columns t, q1, q2, … and p1, p2, …"
STEP = ("h", "step", "dt")  # names of the column with the step

#: a column: its numbers, and their texts if the file has decimal numbers
Columns = dict[str, tuple[np.ndarray, list[str] | None]]


def columns_of(path: Path) -> Columns:
    """Return the columns of a file; those that a run does not use are empty.

    Raises `BadInput` for files of another kind, files that cannot be read, and entries that are not
    numbers.
    """
    readers = {".csv": _of_text, ".txt": _of_text, ".tsv": _of_text, ".dat": _of_text,
               ".npz": _of_npz, ".parquet": _of_parquet, ".pq": _of_parquet}  # fmt: skip
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise BadInput(f"{path.name} is no CSV, npz or parquet file: save the run as one of these.")
    try:
        columns = reader(path)
    except OSError as error:
        raise BadInput(f"{path} cannot be read ({error.strerror or error}).") from None
    return columns


def place(name: str) -> tuple[str, int | None] | None:
    """Return (letter, number) of a column such as t, h, q1, p_2, mu[0]; None for any other."""
    if name == "t" or name in STEP:
        return name, None
    told = re.fullmatch(r"(q|x|p|mu|μ|v)(?:_?(\d+)|\[(\d+)\])?", name)
    if told is None:
        return None
    number = told[2] or told[3]
    return told[1], None if number is None else int(number)


def _of_text(path: Path) -> Columns:
    """Return columns of numbers under a line of names, with commas, semicolons or blanks."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(f"{path.name} is no text; save the run as CSV.") from None
    lines = [(k, line.strip()) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    if not lines:
        raise BadInput(f"{path.name} is empty; a run has {WANTED}.")
    # the last comment line before the numbers may have the names (numpy.savetxt)
    comments = [line for _, line in lines if line.startswith("#")]
    lines = [(k, line) for k, line in lines if not line.startswith("#")]
    head = lines.pop(0)[1] if lines and not _is_number(_fields(lines[0][1])[0]) else ""
    if not head:
        head = comments[-1].lstrip("# ") if comments else ""
    if not head:
        raise BadInput(f"{path.name} has no names above its numbers: write t, q1, …, p1, … there.")
    names = [name.strip().strip("\"'") for name in _fields(head)]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"{path.name} has two columns {name}; leave one of them out.")
    texts: list[list[str]] = [[] for _ in names]
    for number, line in lines:
        fields = _fields(line)
        if len(fields) != len(names):
            raise BadInput(
                f"{path.name}, line {number} has {len(fields)} fields under {len(names)} names."
            )
        for column, field in zip(texts, fields, strict=True):
            column.append(field.strip())
    wanted = {name for name in names if place(name) is not None}
    found: Columns = {}
    for name, column in zip(names, texts, strict=True):
        if name not in wanted:
            found[name] = np.zeros(0), None  # the name is for messages; its entries may be words
            continue
        for (number, _), field in zip(lines, column, strict=True):
            if not _is_number(field):
                raise BadInput(
                    f"{path.name}, line {number}, column {name}: {shown(field)} is no number."
                )
        found[name] = np.array([float(field) for field in column]), column
    return found


def _fields(line: str) -> list[str]:
    for mark in (",", ";", "\t"):
        if mark in line:
            return next(csv.reader([line], delimiter=mark))
    return line.split()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _of_npz(path: Path) -> Columns:
    """Return an archive's columns: arrays (rows,), and those of tables (rows, n) by numbers."""
    found: Columns = {}
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as error:  # zipfile and numpy raise many errors for damage
        raise BadInput(f"{path.name} is no npz archive of numbers ({error}).") from None
    for name, array in arrays.items():
        if place(name) is None:
            found[name] = np.zeros(0), None
        elif array.dtype.kind not in "fiu" or array.ndim > 2:
            raise BadInput(f"{path.name}: {name} is no table of real numbers.")
        elif array.ndim == 2:
            for k, column in enumerate(array.T, 1):
                found[f"{name}{k}"] = np.asarray(column, dtype=float), None
        else:
            found[name] = np.asarray(array, dtype=float), None
    return found


def _of_parquet(path: Path) -> Columns:
    try:
        from pyarrow import parquet
    except ImportError:
        raise BadInput(
            f"{path.name} is read by pyarrow, which is not installed: pip install pyarrow, or save "
            "the run as CSV or npz."
        ) from None
    try:
        table = parquet.read_table(path).to_pydict()
    except Exception as error:  # pyarrow raises its own errors
        raise BadInput(f"{path.name} is no parquet file ({error}).") from None
    found: Columns = {}
    for name, column in table.items():
        if place(name) is None:
            found[name] = np.zeros(0), None
            continue
        try:
            found[name] = np.array(column, dtype=float), None
        except (TypeError, ValueError):
            raise BadInput(f"{path.name}: column {name} is no column of numbers.") from None
    return found
