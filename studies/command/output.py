"""What the command writes: files, tables on the terminal, a progress bar."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput

#: exit codes; bad input has 2
EXIT = {"pass": 0, "fail": 1, "inconclusive": 3}


def write(file: str, text: str) -> None:
    """To standard output (-), or beside the file and then renamed."""
    if file == "-":
        print(text)
        return
    from discmech.integrators.compiler import write_atomically

    path = Path(file).resolve()  # what a link points to is written, not the link
    try:
        if path.exists() and not path.is_file():  # a device, a pipe
            path.write_text(text + "\n", encoding="utf-8")
            return
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~_umask()
        write_atomically(path, text + "\n")
        path.chmod(mode)  # what was written beside is for its owner alone
    except OSError as error:
        raise BadInput(f"{file} cannot be written ({error.strerror}); name another file.") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def writable(file: str | None) -> None:
    """Say before hours of measuring that the result could not be written."""
    if file in (None, "-"):
        return
    path = Path(str(file)).resolve()
    try:
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


@contextmanager
def progress_shown() -> Iterator[Any]:
    """A progress bar on standard error, if that is a terminal: yields show(label, fraction)."""
    if not sys.stderr.isatty():
        yield lambda label, fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = [
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    ]
    # what is printed meanwhile goes above the bar, unless it is for a file or another program
    shared = sys.stdout.isatty()
    screen = Console(stderr=True)
    with Progress(*columns, console=screen, transient=True, redirect_stdout=shared) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda label, fraction: bar.update(task, description=label, completed=fraction)
