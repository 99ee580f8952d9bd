"""The end of a process that could not do its task: exit code 4, and one sentence.

Exit code 1 means that a verdict failed, so no other failure may use it.
"""

from __future__ import annotations

import errno
import io
import os
import sys
import traceback
from contextlib import suppress
from typing import Any

BAD_INPUT, COULD_NOT_RUN = 2, 4
#: errors that a name alone causes, on any disk
_NO_NAMES = (errno.ENAMETOOLONG, errno.ELOOP)
#: errors of the system, and the fix
_FULL = {errno.ENOSPC: "make room", errno.EDQUOT: "make room",
         errno.EFBIG: "files may be larger by `ulimit -f unlimited`",
         errno.EMFILE: "more files may be open by `ulimit -n 1024`",
         errno.ENFILE: "close other programs", errno.ENOMEM: "close other programs"}  # fmt: skip


def told(error: BaseException, again: str = "") -> int:
    """Print the reason on standard error, if possible; again: how to continue.

    Returns exit code 4, or 2 if a given name is invalid on every system.
    """
    if isinstance(error, OSError) and error.errno in _NO_NAMES:
        print(f"discmech: {str(error.filename)[:100]} is no name of a file ({error.strerror}): "
              "name another.", file=sys.stderr)  # fmt: skip
        return BAD_INPUT
    with suppress(Exception):  # standard error is closed
        print(f"discmech: {_sentence(error, again)}", file=sys.stderr, flush=True)
        if os.environ.get("DISCMECH_TRACEBACK"):
            traceback.print_exception(error, file=sys.stderr)
    return COULD_NOT_RUN


def _sentence(error: BaseException, again: str) -> str:
    from discmech.integrators.errors import CouldNotRun

    if isinstance(error, CouldNotRun):
        return f"{error}{again and f' The{again[5:]}.'}"
    if isinstance(error, OSError):
        what = f"{error.filename}: " if error.filename is not None else ""
        fix = _FULL.get(error.errno or 0, "look after the disk, or name another place")
        return f"{what}{error.strerror or error}: {fix}{again}."
    if isinstance(error, MemoryError):
        return f"there is too little memory: close other programs, or ask for less{again}."
    if isinstance(error, ImportError):
        return f"it cannot be loaded ({error}): install discmech anew, or give it more memory."
    if isinstance(error, RuntimeError) and "can't start new thread" in str(error):
        return f"the system allows no more threads: say --jobs 1, or raise `ulimit -u`{again}."
    place = ""
    for frame in traceback.extract_tb(error.__traceback__):
        place = f" ({os.path.basename(frame.filename)}, line {frame.lineno})"
    return (
        f"an error of its own, {type(error).__name__}: {str(error)[:200]}{place}: please report "
        "it with the command; with DISCMECH_TRACEBACK=1 it says all."
    )


def open_streams() -> None:
    """Make the standard streams safe to use, in our own process.

    A closed one would be reused by the next file that is opened; letters that its encoding lacks
    are replaced; and if its reader is gone, the verdict still counts.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # this takes the lowest free number
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream: Any = getattr(sys, name)
        if stream is not None and stream.isatty():
            stream.reconfigure(errors="backslashreplace" if number == 2 else "replace")
            continue
        encoding = getattr(stream, "encoding", None) or "utf-8"
        errors = "backslashreplace" if number == 2 else "replace"
        raw = io.BufferedWriter(_Patient(number, "wb", closefd=False))
        made = io.TextIOWrapper(raw, encoding, errors, line_buffering=number == 2)
        setattr(sys, name, made)


class _Patient(io.FileIO):
    """A file that ignores a broken pipe."""

    gone = False

    def write(self, content: Any, /) -> int:
        """Write like a file; without a reader the content is dropped."""
        if not self.gone:
            try:
                return super().write(content) or 0
            except BrokenPipeError:
                self.gone = True
        return memoryview(content).nbytes


def close_streams(code: int) -> int:
    """Flush the output and return the exit code; it is 4 if that fails."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError):
            # otherwise Python tries again, and complains
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        why = getattr(error, "strerror", None) or error
        return told(OSError(getattr(error, "errno", 0), f"standard output takes nothing ({why})"))
    return code
