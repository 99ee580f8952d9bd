"""The frozen tables: each scene at its duration and three inner times, to 50 certain digits.

They lie in reference/tables/, one file per scene, and are used only if the fingerprint of the given
scene is the table's. A rebuilt row is proven like any answer, and is always cross-checked by the
second method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from ..failures import Damaged, ReferenceFailure, Uncertain, WrongDigits
from .agreement import agreement
from .problem import Problem, scene_of
from .result import Solution
from .store import Table, read, write

FOLDER = Path(__file__).parent.parent / "tables"
DIGITS = 50
LATER = 20  # chaotic scenes are followed to this time
CHAOTIC = ("double-pendulum", "henon-heiles", "heavy-top", "kirchhoff")


def file_of(name: str) -> Path:
    """Return the file of a scene's table."""
    return FOLDER / f"{name}.json"


def names() -> list[str]:
    """Return the scenes that have a table: those with a continuous Lagrangian."""
    from discmech.integrators import scenes

    return [name for name in scenes.names() if scenes.get(name).lagrangian is not None]


def times_of(scene: Any) -> list[Fraction]:
    """Return each quarter of the duration; for chaotic scenes also `LATER`."""
    times = [scene.duration * Fraction(k, 4) for k in range(1, 5)]
    return sorted({*times, Fraction(LATER)}) if scene.name in CHAOTIC else times


def fitting(name: str, key: str) -> Table | None:
    """Return the table for the scene with this name and fingerprint, or None.

    Raises `ReferenceFailure` if the file is damaged, or if it does not fit the built-in scene of
    that name although this very scene was given.
    """
    table = _read(file_of(name))
    if table is None or table.key == key:
        return table
    if _registered(name) == key:
        raise Damaged(
            f"the frozen table {file_of(name).name} was made for another {name}: the scene was "
            f"changed since; {_mend(name)}"
        )
    return None  # a variation of the scene, which has no table


def _mend(name: str) -> str:
    return f"say discmech reference --rebuild {name}"


def _read(path: Path) -> Table | None:
    if not path.exists():
        return None
    try:
        return read(path)
    except Damaged as damage:
        raise Damaged(f"the frozen table {damage}; {_mend(path.stem)}") from None


@cache
def _registered(name: str) -> str | None:
    """Return the fingerprint of the built-in scene with this name."""
    from discmech.integrators import scenes

    return Problem.of(scenes.get(name)).key if name in scenes.names() else None


def build(name: str) -> Table:
    """Compute and write the table of a scene; nothing is written if it is not certain."""
    problem = Problem.of(scene_of(name))
    times, attitude = times_of(problem.scene), problem.has_attitude
    solutions = problem.solve(times, DIGITS, attitude, thorough=True)
    rows = [solutions[t] for t in times]
    poor = [row for row in rows if row.certain_digits < DIGITS]
    if poor:
        raise Uncertain(
            f"{name} at t = {poor[0].t} has only {poor[0].certain_digits} certain digits "
            f"({poor[0].evidence}); its table was left as it is"
        )
    table = Table(name, problem.key, tuple(rows))
    write(file_of(name), table)
    return table


def _blocks(row: Solution, attitude: bool) -> dict[str, list[Any]]:
    blocks = {"x": row.x, "v": row.v, "mu": row.mu}
    return blocks | ({"attitude": list(row.attitude)} if attitude else {})


def check(name: str, some: Callable[[Sequence[Solution]], Sequence[Solution]] = tuple) -> int:
    """Recompute some rows of a table (by default all); return the fewest correct digits.

    Raises `ReferenceFailure` if the table is missing, damaged or stale, or has a wrong digit.
    """
    from .certify import certified_integration

    problem = Problem.of(scene_of(name))
    table = fitting(problem.scene.name, problem.key)
    if table is None:
        raise ReferenceFailure(f"there is no frozen table of {name}; {_mend(name)}")
    rows = some(table.rows)
    attitude = all(row.attitude is not None for row in rows)
    fresh = certified_integration(problem.scene, [row.t for row in rows], DIGITS + 4, attitude)
    fewest = DIGITS + 4
    for row in rows:
        right = agreement(_blocks(row, attitude), _blocks(fresh[row.t], attitude), {})
        fewest = min(fewest, right)
        if right < row.certain_digits - 1:  # allows two roundings of half a unit
            raise WrongDigits(
                f"the frozen table {file_of(name).name} is wrong at t = {row.t}: only {right} of "
                f"its {row.certain_digits} digits are right; {_mend(name)}"
            )
    return fewest
