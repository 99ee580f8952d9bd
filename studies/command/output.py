"""What the command writes: files, tables on the terminal, a progress bar."""

from __future__ import annotations

import errno
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.errors import CouldNotRun

EXIT = {"pass": 0, "fail": 1, "bad input": 2, "inconclusive": 3, "could not run": 4}
LOGGED_EVERY = 60.0  # seconds
DERIVED = 0.5  # share that deriving is, about, of a wait for what is derived and compiled


def exit_code(*results: Mapping[str, Any], told: bool = False) -> int:
    """That of the worst verdict.

    Raises `BadInput` where nothing failed, and nothing could be measured of some rule; told: why
    has been said.
    """
    from ..core.case import worst

    said = worst(result["verdict"] for result in results)
    cases = [case for result in results for case in result["cases"] if case["rule"]]
    usable = {case["rule"] for case in cases if not case.get("unusable")}
    bad = {case["rule"]: case["reason"] for case in cases if case["rule"] not in usable}
    if said != "fail" and bad:
        if told:
            raise BadInput(f"nothing could be measured of {', '.join(bad)}, as is said above.")
        why = " Nor of ".join(f"{rule}: {reason}" for rule, reason in bad.items())
        raise BadInput(f"nothing could be measured of {why}")
    return EXIT[said]


def strict_json(found: Mapping[str, Any]) -> str:
    """The data as JSON, which has neither NaN nor infinities: they become null."""
    try:
        return json.dumps(found, allow_nan=False)
    except ValueError:
        from ..report.tables import plain

        return json.dumps(plain(found), allow_nan=False)


def write_json(name: str, found: Any, indent: int | None = None) -> None:
    """`write` as strict JSON: what is not finite is null."""
    from ..report.tables import plain

    text = json.dumps(plain(found), indent=indent, ensure_ascii=False, allow_nan=False)
    write(name, text)


def write(file: str, text: str) -> None:
    """To standard output (-), or beside the file and then renamed."""
    if file == "-":
        print(_said(text))
        return
    from discmech.integrators.compiler import write_atomically

    try:
        path = _target(file)
        if path.exists() and not path.is_file():  # a device, a pipe
            path.write_text(text + "\n", encoding="utf-8")
            return
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask()
        write_atomically(path, text + "\n")
        path.chmod(mode)  # what was written beside is for its owner alone
    except OSError as error:
        raise cannot_write(file, error) from None


def _target(file: str) -> Path:
    """What a link points to is written, not the link; raises `OSError` for a link to itself."""
    path = Path(os.path.realpath(file))
    if path.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), file)
    return path


def _said(text: str) -> str:
    """JSON in letters that standard output has: the others as JSON writes them in ASCII."""
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        return "".join(c if c.isascii() else json.dumps(c)[1:-1] for c in text)
    return text


#: why the system refuses a name that was given, not the work of writing
_NAMES = (errno.ENOENT, errno.EACCES, errno.EPERM, errno.EISDIR, errno.ENOTDIR, errno.EROFS,
          errno.ENAMETOOLONG, errno.ELOOP, errno.EINVAL)  # fmt: skip


def cannot_write(file: str, error: OSError) -> Exception:
    """The error for a file that cannot be written: bad input, or a disk that takes nothing."""
    why = error.strerror or error
    if error.errno in _NAMES:
        return BadInput(f"{file} cannot be written ({why}); name another file.")
    return CouldNotRun(f"{file} cannot be written ({why}); make room, or name another file.")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def writable(file: str | None) -> None:
    """Say before hours of measuring that the result could not be written."""
    if file in (None, "-"):
        return
    try:
        path = _target(str(file))
        why = (
            "Is a directory" if path.is_dir()
            else "No such folder" if not path.parent.is_dir()
            else "" if os.access(path if path.exists() else path.parent, os.W_OK)
            else "Permission denied"
        )  # fmt: skip
    except OSError as error:  # a name that is too long, a link to itself
        why = str(error.strerror)
    if why:
        raise BadInput(f"{file} cannot be written ({why}); name another file.")


def console() -> Any:
    """Rich's console; wide where the output is no terminal."""
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=150)


def writable_folder(name: str | None) -> None:
    """The same of a folder, which is made if it is not there."""
    if name is None:
        return
    try:
        Path(name).mkdir(parents=True, exist_ok=True)
        if not os.access(name, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
    except OSError as error:
        raise BadInput(
            f"{name} cannot be written ({error.strerror}); name another --folder."
        ) from None


def _logged() -> Callable[[str, float | None], None]:
    """What writes a line to standard error where the last one was a minute ago."""
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
    """A progress bar on standard error, if that is a terminal: yields show(label, fraction).

    It moves to and fro until the first fraction, and again where the fraction is None. In a log
    a line a minute says the same.
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
    # what is printed meanwhile goes above the bar, unless it is for a file or another program
    shared, screen = sys.stdout.isatty(), Console(stderr=True)
    # the pace leaves out the first report: what an earlier run has done is there at once
    with Progress(*columns, console=screen, transient=True, redirect_stdout=shared,
                  speed_estimate_period=3600) as bar:  # fmt: skip
        task = bar.add_task(label, total=None)

        def show(label: str, fraction: float | None) -> None:
            if fraction is None or fraction < bar.tasks[0].completed:
                bar.tasks[0].total = None  # another wait, with a pace of its own
            # a bar that is full counts no time any more, and what follows may take some
            done = min(fraction or 0.0, 0.999)
            total = None if fraction is None else 1.0
            bar.update(task, total=total, description=label, completed=done)

        yield show
