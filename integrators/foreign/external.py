"""A program in any language as an integrator, asked by JSON lines (`program`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import arguments_checked
from ..scene import Opaque
from .box import BlackBox, black_box
from .caller import folder_of_caller
from .program import RESTARTS, SECONDS, Program


@dataclass(frozen=True)
class Runs:
    """The runs of a program, as a black box of runs makes them."""

    program: Program

    def __call__(
        self, q: np.ndarray, p: np.ndarray, h: Any, steps: int, every: int, system: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Arrays (rows, n) and (rows, m); raises `ProgramFailure` if the program gives none."""
        t = float(system.t) if system._clocked else None
        parameters = vars(system.parameters)
        xs, mus = self.program.run(q, p, h, steps, every, system.name, parameters, t)
        xs[0], mus[0] = q, p  # the program may have rounded them on the way
        return xs, mus


class External(BlackBox):
    """A program as an integrator; see `external`."""

    @property
    def long_run(self) -> int:
        """A hundred thousand steps: each row is written and read in decimal digits."""
        return 10**5

    @property
    def digest(self) -> str:
        """What tells this program from a changed one; raises `Opaque` where that is not said."""
        program = self.formula.program  # type: ignore[attr-defined]
        if program.files is None:
            raise Opaque(f"{program.label}, which may read any file")
        return f"{self.said} {program.digest}"


@arguments_checked
def external(
    command: Sequence[str | PathLike[str]],
    order: int | None = None,
    *,
    seconds: float = SECONDS,
    restarts: int = RESTARTS,
    files: Sequence[str | PathLike[str]] | None = None,
    name: str | None = None,
    **claims: Any,
) -> External:
    """A program as an integrator: a JSON line in, a JSON line out, for each run (`program`).

    command: the words, such as ["./my-code", "--json"]. A path is taken from the folder of the file
    that says this, where the program also runs; a name without a slash is looked for on the PATH.
    order and claims: as of `black_box` (symplectic, reversible, keeps, state, numbers, read, write,
    source, groupoids). seconds: how long one answer may take. restarts: how many more times it is
    started after crashes and silences that follow one another on one scene. files: all files and
    folders that it reads beside those that the command names, () for none: its results are then
    remembered until one of them, or the command, changes. The program is started when it is first
    asked, and ends with Python.

    Raises `BadInput` for a command that cannot be run and for claims of another kind.
    """
    program = Program(command, folder_of_caller(), seconds, restarts, files)
    made = black_box(
        order, runs=True, name=name or _name(program), **{"source": program.label, **claims}
    )(Runs(program))
    return External(**vars(made))


def _name(program: Program) -> str:
    """The name of the last file that the command names, or of the program."""
    files = [word for word in program.words if (program.folder / word).is_file()]
    stem = Path((files or program.words)[-1 if files else 0]).stem
    return re.sub(r"[^\w.-]+", "-", stem)[:80] or "program"
