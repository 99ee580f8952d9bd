"""Columns of numbers by their names, from CSV, npz and parquet files."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ...errors import BadInput, shown
from ...numbers import exact_rational

WANTED = "columns t, q1, q2, … and p1, p2, …"
STEP = ("h", "step", "dt")  # names of the column with the step

MOST_BYTES = 2**29  # bytes of a file, and of its numbers, which memory holds more than once
PIECE = 2**12  # number of lines that are read at once
#: a decimal number with so many significant digits is a double without rounding
ALL_DIGITS = 16
#: a number of single precision that was written in decimals is off by less than this part of its
#: own rounding; decimals that are coarser do not tell what they were
TOLD = 1 / 4


@dataclass(frozen=True, eq=False)
class Column:
    """The numbers of a column (rows,), none if the run does not use it, and how they were written.

    digits, places: of decimal numbers the most significant digits, and the most digits after the
    point. first: the first number, as it was written if it was in decimals. difference: that of
    successive decimal numbers, exact, if it is always the same.
    """

    values: np.ndarray
    digits: int = ALL_DIGITS
    places: int = 0
    first: str | float = 0.0
    difference: Fraction | None = None

    @property
    def decimals(self) -> np.ndarray:
        """The largest error of each number from writing few decimals: half a unit of the last.

        A number has the last place that the longest of the column has, after the point or in all.
        """
        sizes = np.abs(self.values)
        if self.digits >= ALL_DIGITS:
            return np.zeros(len(sizes))
        with np.errstate(divide="ignore"):
            own = np.floor(np.log10(sizes)) + 1 - self.digits
        return np.asarray(0.5 * 10.0 ** np.maximum(own, -self.places))

    @property
    def roundings(self) -> np.ndarray:
        """The largest error of each number from writing it, in decimals or in single precision."""
        decimals = self.decimals
        with np.errstate(over="ignore"):
            near = self.values.astype(np.float32)
        if not np.isfinite(near).all():
            return decimals
        half = np.spacing(np.abs(near)).astype(float) / 2
        single = bool((np.abs(self.values - near) <= decimals).all())
        told = decimals.max(initial=0.0) <= TOLD * half.max(initial=0.0)
        return decimals + half * (single and told)


#: columns by their names
Columns = dict[str, Column]
UNUSED = Column(np.zeros(0))  # the name is for messages; the entries may be words


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
    told = re.fullmatch(r"(q|x|p|mu|μ|v)(?:_?(\d{1,9})|\[(\d{1,9})\])?", name)
    if told is None:
        return None
    number = told[2] or told[3]
    return told[1], None if number is None else int(number)


def _check_size(path: Path, size: int) -> None:
    if size > MOST_BYTES:
        raise BadInput(
            f"{path.name} has {size // 2**20} MB of numbers, and {MOST_BYTES // 2**20} MB are read "
            "at most: write fewer rows, each k-th step."
        )


def _of_text(path: Path) -> Columns:
    """Return columns of numbers under a line of names, with commas, semicolons or blanks."""
    _check_size(path, path.stat().st_size)
    try:
        with path.open(encoding="utf-8-sig") as file:
            return _of_lines(path, file)
    except UnicodeDecodeError:
        raise BadInput(f"{path.name} is no text; save the run as CSV.") from None
    except csv.Error as error:
        raise BadInput(f"{path.name} cannot be read as CSV ({error}).") from None


def _of_lines(path: Path, file: Iterable[str]) -> Columns:
    stripped = ((number, line.strip()) for number, line in enumerate(file, 1))
    lines = ((number, line) for number, line in stripped if line)
    # the last comment line before the numbers may have the names (numpy.savetxt)
    comment, first = "", None
    for number, line in lines:
        if not line.startswith("#"):
            first = number, line
            break
        comment = line.lstrip("# ")
    if first is None and not comment:
        raise BadInput(f"{path.name} is empty; a run has {WANTED}.")
    plain = ((number, line) for number, line in lines if not line.startswith("#"))
    rows: Iterator[tuple[int, str]] = plain
    head = comment
    if first and not _is_number(_fields(first[1])[0]):
        head = first[1]
    elif first:
        rows = itertools.chain([first], plain)
    if not head:
        raise BadInput(f"{path.name} has no names above its numbers: write t, q1, …, p1, … there.")
    names = [name.strip("\"'") for name in _fields(head)]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"{path.name} has two columns {name}; leave one of them out.")
    columns = {name: _Decimals(name, path.name) for name in names if place(name) is not None}
    while piece := list(itertools.islice(rows, PIECE)):
        table = [_fields(line) for _, line in piece]
        for (number, _), fields in zip(piece, table, strict=True):
            if len(fields) != len(names):
                raise BadInput(
                    f"{path.name}, line {number} has {len(fields)} fields under {len(names)} names."
                )
        for name, texts in zip(names, zip(*table, strict=True), strict=True):
            if name in columns:
                columns[name].add(texts, [number for number, _ in piece])
    return {name: columns[name].column() if name in columns else UNUSED for name in names}


class _Decimals:
    """A column of decimal numbers that is read in pieces."""

    def __init__(self, name: str, file: str) -> None:
        self.name, self.file = name, file
        self.pieces: list[np.ndarray] = []
        self.digits = self.places = self.count = 0
        self.first, self.start, self.difference = "", Fraction(0), Fraction(0)
        self.even = name == "t"

    def add(self, texts: Sequence[str], lines: Sequence[int]) -> None:
        """Take the next texts, of those lines; raises `BadInput` for what is no number."""
        for text, line in zip(texts, lines, strict=True):
            if not _is_number(text):
                raise BadInput(
                    f"{self.file}, line {line}, column {self.name}: {shown(text)} is no number."
                )
        values = np.array([float(text) for text in texts])
        self.first = self.first or texts[0]
        if self.digits < ALL_DIGITS:
            digits, places = zip(*map(_digits, texts), strict=True)
            self.digits, self.places = max(self.digits, *digits), max(self.places, *places)
        self.even = self.even and bool(np.isfinite(values).all()) and self._is_even(texts, lines)
        self.count += len(texts)
        self.pieces.append(values)

    def _is_even(self, texts: Sequence[str], lines: Sequence[int]) -> bool:
        for k, (text, line) in enumerate(zip(texts, lines, strict=True), self.count):
            value = exact_rational(text, f"{self.file}, line {line}: {self.name}")
            if k == 0:
                self.start = value
            elif k == 1:
                self.difference = value - self.start
            elif value != self.start + k * self.difference:
                return False
        return True

    def column(self) -> Column:
        """Return the whole column."""
        values = np.concatenate([np.zeros(0), *self.pieces])
        even = self.difference if self.even else None
        return Column(values, self.digits, self.places, self.first, even)


def _digits(text: str) -> tuple[int, int]:
    """Return the number of significant digits of a decimal number, and of digits after the point.

    A power of ten moves the point, up to that of the smallest double.
    """
    mantissa, _, power = text.lower().partition("e")
    whole, _, part = mantissa.lstrip("+-").partition(".")
    moved = int(power) if len(power) < 5 and power else 0
    return len((whole + part).lstrip("0")), min(max(0, len(part) - moved), 400)


def _fields(line: str) -> list[str]:
    for mark in (",", ";", "\t"):
        if mark in line:
            fields = next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)
            return [field.strip() for field in fields]
    return line.split()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _of_npz(path: Path) -> Columns:
    """Return an archive's columns: arrays (rows,), and those of tables (rows, n) by numbers."""
    columns: Columns = {}
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            wanted = [name for name in archive.files if place(name) is not None]
            _check_size(path, sum(archive.zip.getinfo(f"{name}.npy").file_size for name in wanted))
            arrays = {name: archive[name] for name in wanted}
            names = archive.files
    except BadInput:
        raise
    except Exception as error:  # zipfile and numpy raise many errors for damage
        raise BadInput(f"{path.name} is no npz archive of numbers ({error}).") from None
    for name in names:
        array = arrays.get(name)
        if array is None:
            columns[name] = UNUSED
        elif array.dtype.kind not in "fiu" or array.ndim > 2:
            raise BadInput(f"{path.name}: {name} is no table of real numbers.")
        elif array.ndim == 2:
            for k, column in enumerate(array.T, 1):
                columns[f"{name}{k}"] = _plain(column)
        else:
            columns[name] = _plain(array)
    return columns


def _of_parquet(path: Path) -> Columns:
    try:
        from pyarrow import parquet
    except ImportError:
        raise BadInput(
            f"{path.name} is read by pyarrow, which is not installed: pip install pyarrow, or save "
            "the run as CSV or npz."
        ) from None
    try:
        with parquet.ParquetFile(path) as file:
            names = file.schema_arrow.names
            wanted = [name for name in names if place(name) is not None]
            _check_size(path, 8 * file.metadata.num_rows * len(wanted))
            table = file.read(columns=wanted)
    except BadInput:
        raise
    except Exception as error:  # pyarrow raises its own errors
        raise BadInput(f"{path.name} is no parquet file ({error}).") from None
    columns: Columns = dict.fromkeys(names, UNUSED)
    for name in wanted:
        try:
            columns[name] = _plain(table.column(name).to_numpy())
        except (KeyError, TypeError, ValueError):
            raise BadInput(f"{path.name}: column {name} is no column of numbers.") from None
    return columns


def _plain(numbers: ArrayLike) -> Column:
    values = np.array(numbers, dtype=float).reshape(-1)
    return Column(values, first=float(values[0]) if len(values) else 0.0)
