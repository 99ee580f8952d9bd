"""How a process ends that could not do what it was asked: exit code 4, and one sentence.

Exit code 1 says that a verdict failed, so nothing else may end with it.
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
#: what is said of a name alone, whatever the disk is like
_NO_NAMES = (errno.ENAMETOOLONG, errno.ELOOP)
#: what a machine refuses, and what helps
_FULL = {errno.ENOSPC: "make room", errno.EDQUOT: "make room",
         errno.EFBIG: "files may be larger by `ulimit -f unlimited`",
         errno.EMFILE: "more files may be open by `ulimit -n 1024`",
         errno.ENFILE: "close other programs", errno.ENOMEM: "close other programs"}  # fmt: skip


def told(error: BaseException, again: str = "") -> int:
    """Say why on standard error, if that takes it; again: how to go on.

    Returns exit code 4, or 2 where a name was given that no system takes.
    """
    if isinstance(error, OSError) and error.errno in _NO_NAMES:
        print(f"discmech: {str(error.filename)[:100]} is no name of a file ({error.strerror}): "
              "name another.", file=sys.stderr)  # fmt: skip
        return BAD_INPUT
    with suppress(Exception):  # nobody can be told
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
    """Let standard streams take what they are given, in a process of our own.

    One that is closed is a hole into which the next file that is opened would fall; one that has
    not all letters shows another; and where nobody reads any more, the verdict still counts.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # which takes the lowest number that is free
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
    """A file of which nobody hears that its reader has gone."""

    gone = False

    def write(self, content: Any, /) -> int:
        """As of a file; what nobody reads goes nowhere."""
        if not self.gone:
            try:
                return super().write(content) or 0
            except BrokenPipeError:
                self.gone = True
        return memoryview(content).nbytes


def close_streams(code: int) -> int:
    """The exit code, once all that was said is out; 4 where it cannot be."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python tries again, and complains
        why = getattr(error, "strerror", None) or error
        return told(OSError(getattr(error, "errno", 0), f"standard output takes nothing ({why})"))
    return code
