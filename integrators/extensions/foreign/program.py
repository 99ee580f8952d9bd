"""A program in any language as an integrator: one JSON line in, one JSON line out, for each run.

The program is started when it is first needed, and answers many runs. Its standard input gets

    {"x": [...], "mu": [...], "h": 0.01, "steps": 100, "every": 10, "scene": "pendulum",
     "parameters": {"length": 1.0}}

on one line (with "t", the time of the start, if the scene depends on time). On its standard output
it prints {"x": rows, "mu": rows}, the start and then every `every`-th step, with 17 significant
digits, so that doubles are transferred unchanged; or {"error": "a sentence"}. Velocities have the
key "v" in place of "mu", both ways. Standard error is free for the program; its last lines are
quoted if something goes wrong.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shlex
import shutil
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock
from typing import Any, TypeAlias

import numpy as np

from ...errors import BadInput, shown
from ...scene import Again
from .process import Broken, Process, quoted

#: what JSON can hold
Json: TypeAlias = Any
#: a parameter's value: a number, or nested sequences of numbers
Parameter: TypeAlias = Any

SECONDS = 60.0  # longest time for an answer
RESTARTS = 3  # number of restarts after successive failures on one scene
#: a number with its sign, digits, exponent, comma and blanks has fewer characters; and the largest
#: number of other characters of a line
CHARACTERS, BESIDE = 64, 65536
FORM = '{"x": rows, "%s": rows}'

_PARTS = re.compile(r"""[\s=:;,'"()<>|&]+""")  # what ends a name within a word of a command


class ProgramFailure(BadInput):
    """A program crashed, gave no answer in time, or answered with something other than rows."""


class Program:
    """A command that answers runs; `run` starts it if it does not run yet.

    command: the words, the first a program on the PATH, or a path. folder: where it runs; relative
    paths are taken from there. seconds: the longest time for one answer. After a crash or a timeout
    the next run starts it again; after restarts + 1 such failures in a row on one scene it is not
    asked about that scene again. files: other files that it reads, None if unknown. second: the key
    of momenta, or of velocities. Raises `BadInput` for a command that cannot be run, and for files
    that do not exist.
    """

    def __init__(
        self,
        command: Sequence[str | os.PathLike[str]],
        folder: Path,
        seconds: float = SECONDS,
        restarts: int = RESTARTS,
        files: Sequence[str | os.PathLike[str]] | None = None,
        second: str = "mu",
    ) -> None:
        self.words, self.folder = _words(command), folder
        self.second, self.form = second, FORM % second
        self.label = shlex.join(self.words)
        self.seconds, self.restarts = _positive(seconds), _count(restarts)
        self.path = _found(self.words[0], folder)
        self.files = _files(files, folder)
        self._process: Process | None = None
        self._failures: dict[str, list[str]] = {}
        self._turn = Lock()  # ensembles run in threads, but there is one pipe

    def __reduce__(self) -> Again:  # another process starts its own program
        arguments = (self.words, self.folder, self.seconds, self.restarts, self.files, self.second)
        return Program, arguments

    @property
    def digest(self) -> str:
        """The digest of the command and the files in it, which changes with the program.

        A word may hold more than a file's name, as --table=forces.csv, or one for sh -c.
        """
        digest = hashlib.sha256(repr((self.words, str(self.folder))).encode())
        parts = (part for word in self.words[1:] for part in (word, *_PARTS.split(word)))
        named = (self.folder / part for part in parts if part)
        below = (path for name in self.files or () for path in _below(self.folder / name))
        for path in (Path(self.path), *named, *below):
            with contextlib.suppress(OSError):
                if path.is_file():
                    digest.update(hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()

    def run(
        self,
        x: np.ndarray,
        mu: np.ndarray,
        h: float,
        steps: int,
        every: int,
        scene: str,
        parameters: Mapping[str, Parameter],
        t: float | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows (r, n) and (r, m) of a run, r = steps // every + 1.

        Raises `ProgramFailure` if the program does not give them.
        """
        with self._turn:
            asked, rows = f"{steps} steps of {scene}", steps // every + 1
            failures = self._failures.setdefault(scene, [])
            if len(failures) > self.restarts:
                raise ProgramFailure(failures[-1])
            request = {
                "x": [float(v) for v in x], self.second: [float(v) for v in mu], "h": float(h),
                "steps": int(steps), "every": int(every), "scene": scene,
                "parameters": {name: _plain(value) for name, value in parameters.items()},
            }  # fmt: skip
            if t is not None:
                request["t"] = float(t)
            line = json.dumps(request).encode() + b"\n"
            most = CHARACTERS * rows * (len(x) + len(mu)) + BESIDE
            try:
                answer = self._answer(self._running().ask(line, self.seconds, most))
            except Broken as broken:
                failure = self._failure(f"{broken}, asked for {asked}", broken.fix)
                failures.append(str(failure))
                self.close(0.0)
                raise failure from None
            except BaseException:  # a late answer would be taken for that of the next run
                self.close(0.0)
                raise
            failures.clear()
            if "error" in answer:
                said = str(answer["error"] or "").strip().rstrip(".") or "an error without words"
                raise ProgramFailure(f"{self.label}, asked for {asked}: {said}.")
            try:
                parts = (("x", x), (self.second, mu))
                tables = [_rows(key, answer, start, rows, self.form) for key, start in parts]
                return tables[0], tables[1]
            except _Wrong as wrong:
                raise self._failure(f"answered {wrong}, asked for {asked}", wrong.fix) from None

    def close(self, grace: float = 0.5) -> None:
        """End the program, if it runs: close its input, and kill it after `grace` seconds."""
        if self._process is not None:
            self._ending.detach()
            self._process.end(grace)
            self._process = None

    def _running(self) -> Process:
        if self._process is None or self._process.owner != os.getpid():  # a fork shares no pipe
            self._process = Process(self.path, self.words, self.folder)
            # at the end of this object, or of Python
            self._ending = weakref.finalize(self, self._process.end)
        return self._process

    def _answer(self, line: bytes) -> dict[str, Json]:
        """Return the object in a line; raises `Broken` if it has none, for more may follow."""
        try:
            answer = json.loads(line.decode("utf-8", "replace"))
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict):
            fix = f"print one line {self.form} for each line read, all else to standard error"
            raise Broken(f"printed {quoted(line)} where an answer is due", fix)
        return answer

    def _failure(self, what: str, fix: str) -> ProgramFailure:
        lines = self._process.last_lines() if self._process else ""
        end = f" Its standard error ends: {lines}" if lines else ""
        return ProgramFailure(f"{self.label} {what}: {fix}.{end}")


class _Wrong(Broken):
    """An answer that is not the rows asked for; the program can be asked again."""


def _rows(
    name: str, answer: Mapping[str, Json], start: np.ndarray, rows: int, form: str
) -> np.ndarray:
    """Return the named rows, (rows, len(start)), finite; raises `_Wrong` for anything else.

    form: what an answer has to be.
    """
    size = len(start)
    wanted = f"give {rows} rows of {size} numbers, the start and then each every-th step"
    if name not in answer:
        there = ", ".join(map(str, answer)) or "nothing"
        raise _Wrong(f"without {shown(name)}", f"give {form}; there is {there}")
    table = answer[name]
    if size == 0 and table in ([], [[]] * rows):
        return np.zeros((rows, 0))
    if odd := _no_table(table):
        raise _Wrong(f"{odd} in {shown(name)}", wanted)
    if (shape := (len(table), len(table[0]) if table else 0)) != (rows, size):
        raise _Wrong(f"{shape[0]} rows of {shape[1]} numbers in {shown(name)}", wanted)
    try:
        numbers = np.array(table, dtype=float)
    except OverflowError:  # an integer beyond the largest double
        numbers = np.array([[float(str(entry)) for entry in row] for row in table])
    if len(wrong := np.flatnonzero(~np.isfinite(numbers).all(axis=1))):
        raise _Wrong(f"a number that is not finite in row {wrong[0]} of {shown(name)}",
                     "take a smaller step, or answer with an error that says why")  # fmt: skip
    return numbers


def _no_table(table: Json) -> str:
    """Return what is wrong with a table of equally long rows of numbers, or ""."""
    if not isinstance(table, list):
        return f"{_brief(table)}, which is no list,"
    for number, row in enumerate(table):
        if not isinstance(row, list):
            return f"{_brief(row)} as row {number}, which is no list,"
        if len(row) != len(table[0]):
            return f"rows of {len(table[0])} and of {len(row)} numbers"
        for entry in row:
            if isinstance(entry, bool) or not isinstance(entry, int | float):
                return f"{_brief(entry)} in row {number}, which is no number,"
    return ""


def _brief(value: Json) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _plain(value: Parameter) -> Json:
    """Return a parameter for JSON: a number, or lists of numbers."""
    if isinstance(value, tuple | list | np.ndarray):
        return [_plain(entry) for entry in value]
    return float(value)


def _words(command: object) -> list[str]:
    """Return the command as a list of texts."""
    example = '["./my-code", "--json"]'
    if isinstance(command, str) or not isinstance(command, Sequence) or not command:
        raise BadInput(
            f"external({shown(command)}): give the command as a list, such as {example}."
        )
    for word in command:
        if not isinstance(word, str | os.PathLike) or "\0" in os.fsdecode(word):
            raise BadInput(
                f"external: {shown(word)} is no word of a command; give texts, as {example}."
            )
    return [os.fsdecode(word) for word in command]


def _found(word: str, folder: Path) -> str:
    """Return the program's path; raises `BadInput` if there is none that can be run."""
    if os.sep not in word:
        if path := shutil.which(word):
            return path
        beside = (folder / word).is_file()
        fix = f"write ./{word}" if beside else "install it, or give its path"
        raise BadInput(f"there is no program {shown(word)} on the PATH: {fix}.")
    file = folder / word
    if file.is_dir():
        raise BadInput(f"{file} is a folder: give the program in it.")
    if not file.is_file():
        raise BadInput(
            f"there is no program {file}: build it first (such as cc -O2 -o NAME NAME.c -lm), or "
            "fix the path, which is taken from the folder of the file that says external(...)."
        )
    if not os.access(file, os.X_OK):
        raise BadInput(
            f"{file} may not be executed: say chmod +x {shlex.quote(str(file))}, or put its "
            'interpreter first, such as ["python3", ...].'
        )
    return str(file)


def _files(files: object, folder: Path) -> tuple[str, ...] | None:
    """Return the files that a program reads; raises `BadInput` unless they are a list of files."""
    if files is None:
        return None
    if isinstance(files, str | os.PathLike) or not isinstance(files, Sequence):
        raise BadInput(f"external(files={shown(files)}): give a list of paths, or () for none.")
    paths = tuple(os.fspath(name) for name in files)
    for name in paths:
        if not (folder / name).exists():
            raise BadInput(f"external(files=...): there is no {name} in {folder}.")
    return paths


def _below(path: Path) -> list[Path]:
    """Return the file, or all files of the folder."""
    return sorted(path.rglob("*")) if path.is_dir() else [path]


LONGEST = 1e9  # seconds, 30 years; a system clock cannot wait longer


def _positive(seconds: float) -> float:
    real = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not real or not 0 < seconds <= LONGEST:
        raise BadInput(f"external: seconds={shown(seconds)} is no time; give a positive number.")
    return float(seconds)


def _count(restarts: object) -> int:
    if type(restarts) is not int or restarts < 0:
        raise BadInput(f"external: restarts={shown(restarts)} is no count; give 0 or more.")
    return restarts
