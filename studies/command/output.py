"""The output of the command: files, tables on the terminal, a progress bar."""

from __future__ import annotations

import argparse
import errno
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput
from discmech.integrators.errors import CouldNotRun

from ..core.environment import absolute
from ..core.lookup import left_out
from ..core.ours import MANIFEST, is_badge, refuse_foreign, refuse_foreign_in
from ..core.outcome import worst

if TYPE_CHECKING:
    from ..core.result import StudyResult

EXIT = {"pass": 0, "measured": 0, "fail": 1, "bad input": 2, "inconclusive": 3, "could not run": 4}
FILES = ("json", "html", "badge", "page", "out")  # options that name a file to be written
LOGGED_EVERY = 60.0  # seconds
DERIVED = 0.5  # approximate share of deriving in the time to derive and compile


def exit_code(*results: StudyResult, told: bool = False) -> int:
    """Return the exit code of the worst verdict.

    Raises `BadInput` if nothing failed, but some rule could not be measured at all; told: True if
    the reason was printed already.
    """
    said = worst(result.verdict for result in results)
    cases = [case for result in results for case in result.cases if case.rule]
    usable = {str(case.rule) for case in cases if not case.unusable}
    bad = {case.rule: case.reason for case in cases if case.rule and case.rule not in usable}
    if said != "fail" and bad:
        if told:
            raise BadInput(f"nothing could be measured of {', '.join(bad)}, as is said above.")
        why = " Nor of ".join(f"{rule}: {reason}" for rule, reason in bad.items())
        raise BadInput(f"nothing could be measured of {why}")
    return EXIT[said]


def strict_json(data: Any, indent: int | None = None) -> str:
    """Return the data as JSON, which has neither NaN nor infinities: they become null."""
    how: dict[str, Any] = {"indent": indent, "ensure_ascii": False, "allow_nan": False}
    try:
        return json.dumps(data, **how)
    except (TypeError, ValueError):
        from ..report.tables import plain

        return json.dumps(plain(data), **how)


def write_json(name: str, data: Any, indent: int | None = None) -> None:
    """Write as `strict_json`."""
    write(name, strict_json(data, indent))


def write_result(name: str, result: StudyResult) -> None:
    """Write a result as JSON; its notes tell what was left out of the files, too."""
    write_json(name, replace(result, notes=[*result.notes, *left_out(once=False)]).to_json())


def of_all(result: StudyResult) -> StudyResult:
    """Return a result, which is no pass if something that the files define was left out."""
    if not left_out(once=False):
        return result
    return replace(result, verdict=worst((result.verdict, "inconclusive")))


def write_run(folder: str, data: Mapping[str, Any], run: Any) -> None:
    """Write run.json, run.csv, whose columns `recorded` reads, and the figures that it has."""
    import numpy as np

    from ..report.canvas import files_of
    from ..report.publish import published
    from ..report.tables import csv_of
    from ..user.drawing import KINDS, is_base_another, plot

    parts = [np.array(data[name]).reshape(len(run.t), -1) for name in ("x", "mu")]
    heads = [f"{name}{k + 1}" for name, part in zip(("x", "mu"), parts, strict=True)
             for k in range(part.shape[1])]  # fmt: skip
    rows = [dict(zip(["t", *heads], [t, *row], strict=True))
            for t, row in zip(data["t"], np.hstack(parts).tolist(), strict=True)]  # fmt: skip
    with published(absolute(folder), last="run.json") as new:
        for name, text in (("json", strict_json(data)), ("csv", csv_of(rows, ("t",)))):
            (new / f"run.{name}").write_text(text, encoding="utf-8")
        for kind in KINDS:
            if kind == "base" and is_base_another(run):
                continue
            try:
                figure = plot(run, kind)
            except BadInput:  # a run of this kind has no such figure
                continue
            for ending, written in files_of(figure).items():
                (new / f"{kind}.{ending}").write_bytes(written)


def write(file: str, text: str) -> None:
    """Write to standard output (-), or to a new file that is then renamed."""
    if file == "-":
        print(_said(text))
        return
    from discmech.integrators.files import encoded, write_atomically

    try:
        path = _target(file)
        if _is_stream(path):
            path.write_bytes(encoded(text + "\n"))
            return
        refuse_foreign(path, file)
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask()
        write_atomically(path, text + "\n", mode)
    except OSError as error:
        raise cannot_write(file, error) from None


def _target(file: str) -> Path:
    """Return the target of a link, which is written instead of it; raises `OSError` for a cycle."""
    named = absolute(file)
    if _is_stream(named):  # of /dev/fd/63 the target has no name that can be opened
        return named
    path = Path(os.path.realpath(named))
    if path.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), file)
    return path


def _is_stream(path: Path) -> bool:
    """Return True for a pipe or a device, which is written to and never replaced."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _is_standard(file: str) -> bool:
    """Return True if a file is the one that standard output goes to, as /dev/stdout is."""
    with suppress(OSError, ValueError):  # there is no such file, or no standard output
        return os.path.samestat(absolute(file).stat(), os.fstat(sys.stdout.fileno()))
    return False


def _said(text: str) -> str:
    """Return JSON in letters that standard output has; others are escaped."""
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        return "".join(c if c.isascii() else json.dumps(c)[1:-1] for c in text)
    return text


#: errors that refuse a given name, not the writing itself
_NAMES = (errno.ENOENT, errno.EACCES, errno.EPERM, errno.EISDIR, errno.ENOTDIR, errno.EROFS,
          errno.ENAMETOOLONG, errno.ELOOP, errno.EINVAL)  # fmt: skip


def cannot_write(file: str, error: OSError) -> Exception:
    """Return the error for a file that cannot be written: bad input, or a full disk."""
    why = error.strerror or error
    if error.errno in _NAMES:
        return BadInput(f"{file} cannot be written ({why}); name another file.")
    return CouldNotRun(f"{file} cannot be written ({why}); make room, or name another file.")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def withdraw_badge(words: Sequence[str]) -> None:
    """Write a badge without a verdict where a command is to write its own.

    A command that ends without a verdict, by bad input or a signal, leaves that one: no earlier
    pass, and no gap where a job publishes it. words: the command's; they may be wrong in any other
    way.
    """
    if words[:1] != ["verify"]:
        return
    for word, after in pairwise([*words, ""]):
        option, _, value = word.partition("=")
        file = value or after
        if option != "--badge" or file in ("", "-") or file.startswith("--"):
            continue
        with suppress(BadInput, CouldNotRun, OSError):  # it is no badge of ours, or stays as it is
            path = _target(file)
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists() or (path.is_file() and is_badge(path)):
                from ..core.result import StudyResult
                from ..report.badge import badge

                write(file, badge(StudyResult(verdict="inconclusive", cases=[])))


def check_outputs(options: argparse.Namespace) -> None:
    """Raise `BadInput` before hours of measuring if a result of a command could not be written.

    Folders that are missing are made. What is there already and is not ours stays: it may be a file
    that the command reads.
    """
    for word in FILES:
        if (file := getattr(options, word, None)) and _is_standard(file):
            setattr(options, word, "-")
    files = [file for word in FILES if (file := getattr(options, word, None)) not in (None, "-")]
    for file in files:
        writable(file)
    if len({_target(file) for file in files}) < len(files):
        raise BadInput(f"{files[-1]} is to be written twice; name a file for each result.")
    if folder := getattr(options, "folder", None):
        writable_folder(folder)


def writable(file: str) -> None:
    """Raise `BadInput` if a file cannot be written; make its folder if that is missing."""
    try:
        path = _target(str(file))
        path.parent.mkdir(parents=True, exist_ok=True)
        refuse_foreign(path, file)
        why = (
            "Is a directory" if path.is_dir()
            else "" if os.access(path if path.exists() else path.parent, os.W_OK)
            else "Permission denied"
        )  # fmt: skip
    except OSError as error:  # a name that is too long, a link to itself
        why = str(error.strerror)
    if why:
        raise BadInput(f"{file} cannot be written ({why}); name another file.")


def console() -> Any:
    """Return rich's console; it is wide if the output is no terminal."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=150)


def writable_folder(name: str) -> None:
    """Make a folder if it is missing; raise `BadInput` if a page cannot be written there."""
    folder = absolute(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
    except OSError as error:
        raise BadInput(
            f"{name} cannot be written ({error.strerror}); name another --folder."
        ) from None
    refuse_foreign_in(folder, ("index.html", MANIFEST))


def _logged() -> Callable[[str, float | None], None]:
    """Return a function that writes a line to standard error at most once a minute."""
    begun = last = time.monotonic()

    def show(label: str, fraction: float | None) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= LOGGED_EVERY:
            last = now
            share = "" if fraction is None else f"{min(fraction, 0.99):.0%}, "
            print(f"{share}{(now - begun) / 60:.0f} min: {label}", file=sys.stderr, flush=True)

    return show


@contextmanager
def progress_shown(label: str = "") -> Iterator[Any]:
    """Show a progress bar on standard error, if that is a terminal; yield show(label, fraction).

    It moves to and fro until the first fraction, and again while the fraction is None. In a log a
    line a minute says the same.
    """
    if not sys.stderr.isatty():
        yield _logged()
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    words = TextColumn("{task.description}")
    columns = (
        BarColumn(24),
        TimeElapsedColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        words,
    )
    # other output goes above the bar, unless it is for a file or another program
    shared, screen = sys.stdout.isatty(), Console(stderr=True)
    # the pace ignores the first report: results of an earlier run are there at once
    with Progress(*columns, console=screen, transient=True, redirect_stdout=shared,
                  speed_estimate_period=3600) as bar:  # fmt: skip
        task = bar.add_task(label, total=None)

        def show(label: str, fraction: float | None) -> None:
            if fraction is None or fraction < bar.tasks[0].completed:
                bar.tasks[0].total = None  # another wait, with its own pace
            # a full bar stops its clock, but the next part may take time
            done = min(fraction or 0.0, 0.999)
            total = None if fraction is None else 1.0
            bar.update(task, total=total, description=label, completed=done)

        yield show
