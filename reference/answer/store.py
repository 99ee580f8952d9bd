"""Files of solutions: decimal strings with a checksum, written to a new file and then renamed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from ..failures import Damaged
from .result import Solution, square

SCHEMA = 1
GUARD = 3  # digits written beyond the certain ones


@dataclass(frozen=True)
class Table:
    """Solutions of one scene; ``key`` is the fingerprint of the problem."""

    scene: str
    key: str
    rows: tuple[Solution, ...]

    def row(self, t: Fraction, digits: int, attitude: bool) -> Solution | None:
        """Return the solution at t if it has as many certain digits (and an attitude), or None."""
        for row in self.rows:
            if row.t == t and row.certain_digits >= digits:
                if attitude and row.attitude is None:
                    continue
                return row.limited_to(digits, attitude)
        return None

    def with_rows(self, rows: Iterable[Solution]) -> Table:
        """Return the table with more rows, or better ones for the same times."""
        kept = {(row.t, row.attitude is None): row for row in self.rows}
        kept |= {(row.t, row.attitude is None): row for row in rows}
        return Table(self.scene, self.key, tuple(kept[place] for place in sorted(kept)))


def write(path: Path, table: Table) -> None:
    """Write the table as text that people can read too; no reader ever sees half a file."""
    from discmech.integrators.files import write_atomically

    content = {
        "schema": SCHEMA,
        "scene": table.scene,
        "key": table.key,
        "rows": [_as_text(row) for row in table.rows],
    }
    text = json.dumps(content | {"checksum": checksum(content)}, indent=1, ensure_ascii=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text + "\n", 0o644)


def read(path: Path) -> Table:
    """Return the table in a file; raises `Damaged` unless `write` wrote its content."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        digest = content.pop("checksum")
        if content["schema"] != SCHEMA:
            raise Damaged(f"{path.name} has the schema {content['schema']} instead of {SCHEMA}")
        if digest != checksum(content):
            raise Damaged(f"{path.name} does not fit its checksum")
        rows = tuple(_from_text(row) for row in content["rows"])
        return Table(content["scene"], content["key"], rows)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, Damaged):
            raise
        raise Damaged(f"{path.name} cannot be read ({type(error).__name__}: {error})") from None


def checksum(content: dict[str, Any]) -> str:
    """Return the SHA-256 of the content in one fixed form."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _as_text(row: Solution) -> dict[str, Any]:
    digits = row.certain_digits + GUARD
    blocks = {name: _decimals(getattr(row, name), digits) for name in ("x", "v", "mu")}
    if row.attitude is not None:
        blocks["attitude"] = _decimals(list(row.attitude), digits)
    return {
        "t": str(row.t),
        "certain_digits": row.certain_digits,
        "certainty": row.certainty,
        "bound": None if row.bound is None else _decimals([row.bound], 3)[0],
        "method": row.method,
        "evidence": row.evidence,
        **blocks,
    }


def _decimals(numbers: Iterable[Any], digits: int) -> list[str]:
    import mpmath

    return [mpmath.nstr(number, digits, min_fixed=-3, max_fixed=9) for number in numbers]


def _from_text(row: dict[str, Any]) -> Solution:
    import mpmath

    with mpmath.workdps(row["certain_digits"] + 2 * GUARD):
        names = [name for name in ("x", "v", "mu", "attitude") if name in row]
        blocks = {name: [mpmath.mpf(number) for number in row[name]] for name in names}
        attitude = square(blocks["attitude"]) if "attitude" in blocks else None
        bound = None if row["bound"] is None else mpmath.mpf(row["bound"])
    return Solution(
        Fraction(row["t"]), blocks["x"], blocks["mu"], blocks["v"], attitude,
        row["certain_digits"], row["method"], row["evidence"], row["certainty"], bound,
    )  # fmt: skip
