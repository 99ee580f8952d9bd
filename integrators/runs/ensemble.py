"""Many runs of one flow at once, on all cores; a failure ends only its own run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np

from ..compiler import cores
from ..errors import BadInput, StepFailure, shown
from ..numbers import Arithmetic, Double
from ..numbers.types import Matrix, Numbers, Rows, Vector
from .trajectory import Trajectory

Item = TypeVar("Item")
Result = TypeVar("Result")
#: the starts of an ensemble's members; None is the scene's own
Starts: TypeAlias = list[Numbers | None]


@dataclass(frozen=True)
class Ensemble:
    """The rows of many runs: t (r,), x (k, r, n), u (k, r, m), mu (k, r, m); of N sites with N.

    runs: the trajectory of each member, as far as it came. failures: {member: its `StepFailure`};
    the rows that a failed member did not reach are NaN.
    """

    t: Vector
    x: Matrix
    u: Matrix
    mu: Matrix
    runs: tuple[Trajectory, ...]
    failures: dict[int, StepFailure]


def ensemble(
    run: Callable[[int, Numbers | None, Numbers | None], Trajectory],
    x0s: Rows | None,
    mu0s: Rows | None,
    numbers: Arithmetic,
    what: str,
    in_turn: bool = False,
) -> Ensemble:
    """Run from all starts.

    run: (number of the member, x0, μ0) ↦ trajectory; what: the name in messages. in_turn: True for
    runs that cannot be made in threads.
    """
    starts = list(zip(*_of_one_length(x0s, mu0s, what), strict=True))
    failures: dict[int, StepFailure] = {}

    def member(index: int) -> Trajectory:
        try:
            return run(index, *starts[index])
        except StepFailure as failure:
            if not isinstance(failure.trajectory, Trajectory):
                raise
            failures[index] = failure
            return failure.trajectory

    all_ = range(len(starts))
    runs = [member(k) for k in all_] if in_turn else side_by_side(member, all_, numbers)
    t = max(runs, key=lambda r: len(r.x)).t
    x, u, mu = (
        np.array([_padded(getattr(r, name), len(t), numbers) for r in runs])
        for name in ("x", "u", "mu")
    )
    return Ensemble(t, x, u, mu, tuple(runs), dict(sorted(failures.items())))


def side_by_side(
    function: Callable[[Item], Result], items: Sequence[Item], numbers: Arithmetic
) -> list[Result]:
    """Return the function's results in the order of the items, using all cores in double precision.

    The function must consist of runs: machine code releases Python's lock, so each core has a
    thread; other numbers go one after another. The first item goes alone and compiles everything
    needed.
    """
    results, left = [function(item) for item in items[:1]], items[1:]
    threads = min(cores(), len(left)) if isinstance(numbers, Double) else 1
    if threads < 2:
        return results + [function(item) for item in left]
    with ThreadPoolExecutor(threads) as pool:
        return results + list(pool.map(function, left))


def _of_one_length(x0s: Rows | None, mu0s: Rows | None, what: str) -> tuple[Starts, Starts]:
    """Return both lists of starts; None stands for the scene's own start in each member."""
    for starts in (x0s, mu0s):
        many = isinstance(starts, Sequence | np.ndarray) and getattr(starts, "shape", 1) != ()
        if starts is not None and not many:
            raise BadInput(
                f"{what}: an ensemble's starts are {shown(starts)}; give a list of them."
            )
    lists = [list(starts) for starts in (x0s, mu0s) if starts is not None]
    if not lists or len({len(starts) for starts in lists}) > 1 or not lists[0]:
        counts = " and ".join(str(len(starts)) for starts in lists) or "no"
        raise BadInput(f"{what}: an ensemble of {counts} starts; give x0s and mu0s of one length.")
    none: Starts = [None] * len(lists[0])
    return (none if x0s is None else list(x0s)), (none if mu0s is None else list(mu0s))


def _padded(rows: Matrix, count: int, numbers: Arithmetic) -> Matrix:
    """Return `count` rows: those given, followed by rows of NaN."""
    missing = numbers.public(np.full((count - len(rows), *rows.shape[1:]), np.nan))
    return np.concatenate([rows, missing])
