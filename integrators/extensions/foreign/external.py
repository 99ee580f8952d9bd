"""A program in any language as an integrator that is asked by JSON lines (`program`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from ...errors import arguments_checked
from ...numbers.types import Matrix, Vector
from ...scene import Opaque, reads
from .box import BlackBox, black_box
from .caller import folder_of_caller
from .program import RESTARTS, SECONDS, Program
from .scene_in_numbers import SceneInNumbers


@dataclass(frozen=True)
class Runs:
    """The runs of a program, in the form of a black box with runs=True."""

    program: Program

    def __call__(
        self, q: Vector, p: Vector, h: float, steps: int, every: int, system: SceneInNumbers
    ) -> tuple[Matrix, Matrix]:
        """Return arrays (rows, n) and (rows, m); raises `ProgramFailure` without any."""
        t = float(system.t) if system._clocked else None
        parameters = vars(system.parameters)
        name = system.name
        qs, ps = self.program.run(q.ravel(), p, h, steps, every, name, parameters, t)
        return qs.reshape(-1, *q.shape), ps


class External(BlackBox):
    """A program as an integrator; see `external`."""

    @property
    def long_run(self) -> int:
        """The number of steps of a long run: each row is written and read in decimal digits."""
        return 10**5

    @property
    def digest(self) -> str:
        """The key of this version of the program and of the functions beside it.

        Raises `Opaque` if its files are not given, or for such a function.
        """
        program = self.formula.program  # type: ignore[attr-defined]
        if program.files is None:
            raise Opaque(f"{program.label}, which may read any file")
        return f"{self.said} {program.digest} {reads(*self.beside, pure=True)}"


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
    """Use a program as an integrator: one JSON line in and one out for each run (`program`).

    command: the words, such as ["./my-code", "--json"]. A path is relative to the folder of the
    calling file, where the program also runs; a name without a slash is searched on the PATH. order
    and claims: as for `black_box` (symplectic, reversible, keeps, state, numbers, read, write,
    source, groupoids). seconds: the longest time for one answer. restarts: how often it is started
    again after successive crashes and timeouts on one scene. files: all files and folders that it
    reads beside those in the command, () for none: then its results are remembered until one of
    them, or the command, changes. The program is started when it is first needed, and ends with
    Python.

    Raises `BadInput` for a command that cannot be run and for claims of another kind.
    """
    second = "v" if str(claims.get("state")).endswith("v") else "mu"
    program = Program(command, folder_of_caller(), seconds, restarts, files, second)
    made = black_box(
        order, runs=True, name=name or _name(program), **{"source": program.label, **claims}
    )(Runs(program))
    return External(**vars(made))


def _name(program: Program) -> str:
    """Return the name of the last file in the command, or of the program."""
    files = [word for word in program.words if (program.folder / word).is_file()]
    stem = Path((files or program.words)[-1 if files else 0]).stem
    return re.sub(r"[^\w.-]+", "-", stem)[:80] or "program"
