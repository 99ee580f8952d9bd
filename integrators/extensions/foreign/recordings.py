"""Runs that were made elsewhere, read from files: CSV, npz or parquet, columns by name.

A file is one run at one step size. It has the columns t, q1, q2, … and p1, p2, … (also x1, … and
mu1, …; counted from 0 or from 1; a single coordinate needs no number), in any order; in an npz
archive q and p may be arrays (rows, n). Other columns are ignored. If not every step has a row, the
column h gives the step.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ...errors import BadInput, shown
from ...numbers.exact import LARGEST_COUNT, measure
from .tables import STEP, WANTED, Column, Columns, columns_of, place

#: the first letters of columns, for state="qp" and for velocities, state="qv"
NAMES = {"qp": (("q", "x"), ("p", "mu", "μ")), "qv": (("q", "x"), ("v",))}
#: probability that a random number has such a simple fraction within its rounding (`_simplest`)
CHANCE = 1e-4
#: relative difference of steps that are one: a run is found by its step to the same tolerance
ALIKE = 1e-9
#: rows may be a whole number of steps apart to this tolerance, since a step may be written rounded
WHOLE = 0.01


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded run: t (r,), x (r, n), mu (r, m), and the step.

    mu holds the second half of the columns, momenta or velocities. interval is the time between
    rows, `every` steps. roundings: the largest error of each column of x and mu from writing fewer
    digits, or all in single precision, (n+m,); late: the same for the times.
    """

    path: Path
    t: np.ndarray
    x: np.ndarray
    mu: np.ndarray
    step: Fraction
    interval: Fraction
    roundings: np.ndarray
    late: float

    @property
    def digest(self) -> str:
        """The key of this run."""
        parts = (self.t.tobytes(), self.x.tobytes(), self.mu.tobytes(), repr(self.step).encode())
        return hashlib.sha256(b"|".join(parts)).hexdigest()

    @property
    def start(self) -> Fraction:
        """The time of the first row."""
        return Fraction(float(self.t[0]))

    @property
    def unit(self) -> float:
        """The largest rounding error of a number, relative to the largest one of its kind."""
        errors = np.split(self.roundings, [self.x.shape[1]])
        both = zip(errors, (self.x, self.mu), strict=True)
        return max((float(e.max() / np.abs(part).max()) for e, part in both if part.any()),
                   default=0.0)  # fmt: skip

    @property
    def every(self) -> int:
        """The number of steps between two rows."""
        return round(self.interval / self.step)

    @property
    def steps(self) -> int:
        """The number of steps of the whole run."""
        return self.every * (len(self.t) - 1)


def recordings(pattern: object, folder: Path, state: str = "qp") -> tuple[Recording, ...]:
    """Return the runs in the files that a pattern (or several) names, the largest step first.

    Patterns are relative to the folder. Raises `BadInput` if no file is found, if a file cannot be
    read, lacks a column, or has an entry that is not a finite number or times that are not evenly
    spaced, and for runs of different sizes or of one step.
    """
    if not isinstance(state, str) or state not in NAMES:
        raise BadInput(f"recorded(state={shown(state)}): state is {' or '.join(map(repr, NAMES))}.")
    patterns = [pattern] if isinstance(pattern, str | Path) else pattern
    if not isinstance(patterns, list | tuple) or not patterns:
        raise BadInput(f'recorded({shown(pattern)}): give the files, such as "runs/*.csv".')
    paths: list[Path] = []
    for one in patterns:
        if not isinstance(one, str | Path):
            raise BadInput(
                f'recorded: {shown(one)} names no files; give a text, such as "runs/*.csv".'
            )
        text = str(one)
        base, inside = (Path("/"), text[1:]) if Path(text).is_absolute() else (folder, text)
        try:
            files = sorted(base.glob(inside)) if inside else []
        except (ValueError, NotImplementedError):
            files = []
        if not files:
            raise BadInput(
                f"recorded: there is no file {text} (from {folder}); relative names are taken from "
                "the folder of the file that says recorded(...)."
            )
        paths += files
    runs = [read(path, state) for path in dict.fromkeys(paths)]
    first = runs[0]
    for run in runs[1:]:
        if (run.x.shape[1], run.mu.shape[1]) != (first.x.shape[1], first.mu.shape[1]):
            raise BadInput(
                f"{first.path.name} has {_size(first)} and {run.path.name} {_size(run)}: runs of "
                "one system have the same columns."
            )
    runs.sort(key=lambda run: -run.step)
    for run, other in itertools.pairwise(runs):
        if run.step - other.step <= ALIKE * run.step:
            raise BadInput(
                f"{run.path.name} and {other.path.name} have one step, {float(run.step):.6g}: give "
                "runs whose steps differ. Where not every step has a row, a column h says the step."
            )
    return tuple(runs)


def read(path: Path, state: str = "qp") -> Recording:
    """Return the run of one file; raises `BadInput` like `recordings`."""
    columns = columns_of(path)
    if "t" not in columns:
        raise _lacking(path, "no column t", columns)
    x_names, mu_names = (_numbered(path, columns, letters) for letters in NAMES[state])
    if not mu_names:
        fix = ""
        if state == "qp" and _numbered(path, columns, ("v",)):
            fix = ' Velocities are meant? Say recorded(..., state="qv").'
        letter = NAMES[state][1][0]
        raise _lacking(path, f"no column {letter}1", columns, fix)
    rows = len(columns["t"].values)
    for name in ("t", *x_names, *mu_names):
        values = columns[name].values
        if len(values) != rows:
            raise BadInput(f"{path.name}: {name} has {len(values)} rows and t has {rows}.")
        if len(wrong := np.flatnonzero(~np.isfinite(values))):
            raise BadInput(
                f"{path.name}: {name} is {values[wrong[0]]} in row {wrong[0]}; a run that broke "
                "down ends before."
            )
    if rows < 2:
        raise BadInput(f"{path.name} has {rows} row: a run has its start and at least one more.")
    interval, late = _interval(path, columns["t"])
    x, mu = (np.stack([columns[name].values for name in names], 1) if names else np.zeros((rows, 0))
             for names in (x_names, mu_names))  # fmt: skip
    # all are written alike; alone, a coordinate of 1/2 would be one of a single digit
    parts = [columns[name] for name in (*x_names, *mu_names)]
    digits, places = (max(getattr(part, name) for part in parts) for name in ("digits", "places"))
    together = Column(np.concatenate([part.values for part in parts]), digits, places)
    roundings = together.roundings.reshape(-1, rows).max(axis=1)
    step = _step(path, columns, interval)
    return Recording(path, columns["t"].values, x, mu, step, interval, roundings, late)


def _size(run: Recording) -> str:
    return f"{run.x.shape[1]} coordinates and {run.mu.shape[1]} momenta"


def _lacking(path: Path, what: str, columns: Columns, fix: str = "") -> BadInput:
    names = list(columns)
    listed = ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
    return BadInput(
        f"{path.name} has {what}: there {'is' if len(names) == 1 else 'are'} "
        f"{listed or 'none'}; a run has {WANTED}.{fix}"
    )


def _numbered(path: Path, columns: Columns, letters: tuple[str, ...]) -> list[str]:
    """Return the names of the columns of the letters, ordered by their complete numbers."""
    names: dict[str, dict[int | None, str]] = {letter: {} for letter in letters}
    for name in columns:
        letter, number = place(name) or ("", None)
        if letter in names:
            names[letter][number] = name
    kinds = [letter for letter in letters if names[letter]]
    if len(kinds) > 1:
        a, b = (next(iter(names[kind].values())) for kind in kinds[:2])
        raise BadInput(f"{path.name} has {a} and {b}, two names of one thing; leave one out.")
    if not kinds:
        return []
    numbers = names[kinds[0]]
    if None in numbers:
        if len(numbers) > 1:
            raise BadInput(f"{path.name} has {numbers[None]} without a number beside others.")
        return [numbers[None]]
    order = sorted(number for number in numbers if number is not None)
    if order[0] > 1 or order != list(range(order[0], order[0] + len(order))):
        raise BadInput(
            f"{path.name} has the columns {', '.join(numbers[k] for k in order)}: number them "
            f"{kinds[0]}1, {kinds[0]}2, … and leave none out."
        )
    return [numbers[k] for k in order]


def _interval(path: Path, column: Column) -> tuple[Fraction, float]:
    """Return (the time between rows, the largest error of the times).

    Decimal times that are exactly even are taken as they are. Others may have been added up in
    double precision, with a rounding per step, or written with few decimals or in single precision:
    each must be as near to even times as its own rounding allows, and the simplest fraction within
    these bounds is the interval if that cannot be chance. Raises `BadInput` for times that stand
    still, go back, or are uneven.
    """
    t, rows = column.values, len(column.values) - 1
    if len(wrong := np.flatnonzero(np.diff(t) <= 0)):
        how = "stands still" if t[wrong[0] + 1] == t[wrong[0]] else "goes back"
        raise BadInput(f"{path.name}: t {how} in row {wrong[0] + 1}; the times of a run rise.")
    if column.difference is not None:
        return column.difference, 0.0
    bound = column.roundings + np.finfo(float).eps * rows * np.abs(t).max()
    mean, share = (t[-1] - t[0]) / rows, np.arange(len(t)) / rows
    # the line through the first and the last time is off by the part of their errors at each row
    off = np.abs(t - (t[0] + (t[-1] - t[0]) * share))
    if (off > bound + (1 - share) * bound[0] + share * bound[-1]).any():
        gaps = np.diff(t)
        row = int(np.abs(gaps - np.median(gaps)).argmax())
        raise BadInput(
            f"{path.name}: t is uneven, {gaps[row]:.6g} from row {row} to row {row + 1} and "
            f"{np.median(gaps):.6g} elsewhere; an order needs runs of constant steps, so write "
            "each k-th step, and all with the same k."
        )
    half = (bound[0] + bound[-1]) / rows
    simple = _simplest(Fraction(mean - half), Fraction(mean + half))
    if simple.denominator**2 * 2 * half < CHANCE:
        return simple, 0.0
    return Fraction(mean), 2 * float(bound.max())


def _simplest(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction with the smallest denominator in [low, high], 0 < low (Stern–Brocot)."""
    whole = math.floor(low)
    if whole == low or whole + 1 <= high:
        return Fraction(whole if whole == low else whole + 1)
    return whole + 1 / _simplest(1 / (high - whole), 1 / (low - whole))


def _step(path: Path, columns: Columns, interval: Fraction) -> Fraction:
    """Return the step that the file gives, or else the time between rows."""
    told = next((name for name in STEP if name in columns), None)
    if told is None:
        return interval
    values = columns[told].values
    if not len(values) or values.min() != values.max() or not 0 < values[0] < math.inf:
        raise BadInput(f"{path.name}: the column {told} is the step, one positive number.")
    step = measure(columns[told].first, f"{path.name}: the step in the column {told}")
    every = round(interval / step)
    many = every * len(columns["t"].values) > LARGEST_COUNT
    if abs(interval / step - every) > WHOLE or not every or many:
        raise BadInput(
            f"{path.name}: rows are {float(interval):.6g} apart, which is no whole number of steps "
            f"of {float(step):.6g} (the column {told})."
        )
    return interval / every
