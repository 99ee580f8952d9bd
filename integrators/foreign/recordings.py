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
import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..errors import BadInput, shown
from .tables import STEP, WANTED, Columns, columns_of, place

#: the first letters of columns, for state="qp" and for velocities, state="qv"
NAMES = {"qp": (("q", "x"), ("p", "mu", "μ")), "qv": (("q", "x"), ("v",))}
#: a decimal number with so many significant digits is a double without rounding
ALL_DIGITS = 16
#: probability that a random number has such a simple fraction within its rounding (`_simplest`)
CHANCE = 1e-4
#: rows may be a whole number of steps apart to this tolerance, since a step may be written rounded
WHOLE = 0.01


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded run: t (r,), x (r, n), mu (r, m), and the step.

    mu holds the second half of the columns, momenta or velocities. interval is the time between
    rows, `every` steps. rounding: the largest error of x and mu from writing fewer digits; late:
    the same for the times.
    """

    path: Path
    t: np.ndarray
    x: np.ndarray
    mu: np.ndarray
    step: Fraction
    interval: Fraction
    rounding: float
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
        """The largest rounding error of a number, relative to the largest number of the run."""
        size = max(np.abs(self.x).max(initial=0.0), np.abs(self.mu).max(initial=0.0))
        return self.rounding / size if size else 0.0

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
    spaced, and for runs of different sizes.
    """
    if not isinstance(state, str) or state not in NAMES:
        raise BadInput(f"recorded(state={shown(state)}): state is {' or '.join(map(repr, NAMES))}.")
    patterns = [pattern] if isinstance(pattern, str | Path) else pattern
    if not isinstance(patterns, list | tuple) or not patterns:
        raise BadInput(f'recorded({shown(pattern)}): give the files, such as "runs/*.csv".')
    found: list[Path] = []
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
        found += files
    runs = [read(path, state) for path in dict.fromkeys(found)]
    first = runs[0]
    for run in runs[1:]:
        if (run.x.shape[1], run.mu.shape[1]) != (first.x.shape[1], first.mu.shape[1]):
            raise BadInput(
                f"{first.path.name} has {_size(first)} and {run.path.name} {_size(run)}: runs of "
                "one system have the same columns."
            )
    return tuple(sorted(runs, key=lambda run: -run.step))


def read(path: Path, state: str = "qp") -> Recording:
    """Return the run of one file; raises `BadInput` like `recordings`."""
    columns = columns_of(path)
    if "t" not in columns:
        raise _lacking(path, "no column t", columns)
    t, written = columns["t"]
    x_names, mu_names = (_numbered(path, columns, letters) for letters in NAMES[state])
    if not mu_names:
        fix = ""
        if state == "qp" and _numbered(path, columns, ("v",)):
            fix = ' Velocities are meant? Say recorded(..., state="qv").'
        letter = NAMES[state][1][0]
        raise _lacking(path, f"no column {letter}1", columns, fix)
    for name in ("t", *x_names, *mu_names):
        values = columns[name][0]
        if len(values) != len(t):
            raise BadInput(f"{path.name}: {name} has {len(values)} rows and t has {len(t)}.")
        if len(wrong := np.flatnonzero(~np.isfinite(values))):
            raise BadInput(
                f"{path.name}: {name} is {values[wrong[0]]} in row {wrong[0]}; a run that broke "
                "down ends before."
            )
    if len(t) < 2:
        raise BadInput(f"{path.name} has {len(t)} row: a run has its start and at least one more.")
    interval, late = _interval(path, t, written)
    rounding = max((_rounding(columns[name][1]) for name in (*x_names, *mu_names)), default=0.0)
    x, mu = (np.stack([columns[name][0] for name in names], 1) if names else np.zeros((len(t), 0))
             for names in (x_names, mu_names))  # fmt: skip
    return Recording(path, t, x, mu, _step(path, columns, interval), interval, rounding, late)


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
    held: dict[str, dict[int | None, str]] = {letter: {} for letter in letters}
    for name in columns:
        letter, number = place(name) or ("", None)
        if letter in held:
            held[letter][number] = name
    kinds = [letter for letter in letters if held[letter]]
    if len(kinds) > 1:
        a, b = (next(iter(held[kind].values())) for kind in kinds[:2])
        raise BadInput(f"{path.name} has {a} and {b}, two names of one thing; leave one out.")
    if not kinds:
        return []
    numbers = held[kinds[0]]
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


def _interval(path: Path, t: np.ndarray, written: list[str] | None) -> tuple[Fraction, float]:
    """Return (the time between rows, the largest error of the times).

    Decimal times that are exactly even are taken as they are. Others may have been added up, with a
    rounding per step, or written with few digits: they must be even within these bounds, and the
    simplest fraction within them is the interval if that cannot be chance. Raises `BadInput` for
    times that stand still, go back, or are uneven.
    """
    rows = len(t) - 1
    if len(wrong := np.flatnonzero(np.diff(t) <= 0)):
        how = "stands still" if t[wrong[0] + 1] == t[wrong[0]] else "goes back"
        raise BadInput(f"{path.name}: t {how} in row {wrong[0] + 1}; the times of a run rise.")
    if written is not None:
        times = [Fraction(text) for text in written]
        if all(b - a == times[1] - times[0] for a, b in itertools.pairwise(times)):
            return times[1] - times[0], 0.0
    bound = _rounding(written) + np.finfo(float).eps * rows * np.abs(t).max()
    mean = (t[-1] - t[0]) / rows
    # among the lines through the times the middle one: it is even if all are within the bound
    off = t - (t[0] + mean * np.arange(len(t)))
    if np.ptp(off) / 2 > 2 * bound:
        gaps = np.diff(t)
        row = int(np.abs(gaps - np.median(gaps)).argmax())
        raise BadInput(
            f"{path.name}: t is uneven, {gaps[row]:.6g} from row {row} to row {row + 1} and "
            f"{np.median(gaps):.6g} elsewhere; an order needs runs of constant steps, so write "
            "each k-th step, and all with the same k."
        )
    width = 4 * bound / rows
    simple = _simplest(Fraction(mean - width / 2), Fraction(mean + width / 2))
    if simple.denominator**2 * width < CHANCE:
        return simple, 0.0
    return Fraction(mean), 2 * bound


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
    values, texts = columns[told]
    if not len(values) or values.min() != values.max() or not 0 < values[0] < math.inf:
        raise BadInput(f"{path.name}: the column {told} is the step, one positive number.")
    step = Fraction(texts[0]) if texts else Fraction(float(values[0]))
    every = round(interval / step)
    if abs(interval / step - every) > WHOLE or not every:
        raise BadInput(
            f"{path.name}: rows are {float(interval):.6g} apart, which is no whole number of steps "
            f"of {float(step):.6g} (the column {told})."
        )
    return interval / every


def _rounding(texts: list[str] | None) -> float:
    """Return the rounding error of decimal numbers: half a unit in their last place.

    The place is that of the column's largest number, if its longest number shows how many digits
    were written; 0 if a double has no more digits.
    """
    if texts is None:
        return 0.0
    digits, largest = 0, 0.0
    for text in texts:
        mantissa = re.sub(r"[eE].*", "", text).lstrip("+-")
        digits = max(digits, len(mantissa.replace(".", "").lstrip("0")))
        largest = max(largest, abs(float(text)))
    if digits >= ALL_DIGITS or not largest:
        return 0.0
    return 0.5 * 10.0 ** (math.floor(math.log10(largest)) + 1 - digits)
