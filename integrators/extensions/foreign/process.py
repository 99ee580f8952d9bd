"""A process that reads a line and answers with one within a time; it ends with this process."""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

GRACE = 0.5  # seconds that a program may take to end by itself after its input has ended
LINES = 3  # number of lines of standard error that a message quotes


class Broken(Exception):
    """A program failed and cannot be asked again; its text says how, `fix` says what to do."""

    def __init__(self, what: str, fix: str = 'mend it, or let it answer {"error": "why"}') -> None:
        super().__init__(what)
        self.fix = fix


class Process:
    """A running program with its pipes; raises `Broken` if it cannot be started.

    path: the program; words: its name and arguments. It gets its own session, so that an interrupt
    reaches only this process, which then ends the program and all its children.
    """

    def __init__(self, path: str, words: Sequence[str], folder: Path) -> None:
        if os.name != "posix":
            raise Broken("cannot be started", "programs are run where the system is POSIX")
        self.owner, self.answers = os.getpid(), 0
        pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
        try:
            self.program = subprocess.Popen(
                [path, *words[1:]], cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0,
                start_new_session=True,
            )  # fmt: skip
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            raise Broken(
                f"cannot be started in {folder} ({why})",
                "give a program that this system runs, or its interpreter first",
            ) from None
        # If this process is killed it cannot end the program. So a shell waits for the end of its
        # own input, which comes however this process ends, and then ends the program.
        self.watch = subprocess.Popen(
            ["/bin/sh", "-c", "read nothing; kill -KILL -$1", "sh", str(self.program.pid)],
            stdin=pipe, stdout=nothing, stderr=nothing, start_new_session=True,
        )  # fmt: skip
        assert self.program.stdin and self.program.stdout and self.program.stderr
        self.into, self.out = self.program.stdin.fileno(), self.program.stdout.fileno()
        self.errors = self.program.stderr.fileno()
        self._rest, self._said = b"", b""
        for pipe in (self.into, self.out, self.errors):
            os.set_blocking(pipe, False)
        self._ready = selectors.DefaultSelector()
        self._ready.register(self.out, selectors.EVENT_READ)
        self._ready.register(self.errors, selectors.EVENT_READ)

    def ask(self, request: bytes, seconds: float, most: int) -> bytes:
        """Write a line and return the line that answers it.

        most: the largest number of characters of an answer. Raises `Broken` if there is no such
        line within the seconds, or if the program had printed something before it was asked.
        """
        if spare := self._printed():
            when = "after its answer, where nothing was asked" if self.answers else "at its start"
            raise Broken(
                f"printed {quoted(spare)} {when}",
                "print one line for each line read, and everything else to standard error",
            )
        answer, until = bytearray(), time.monotonic() + seconds
        request = self._written(request)
        if request:
            self._ready.register(self.into, selectors.EVENT_WRITE)
        try:
            while True:
                events = self._ready.select(max(0.0, until - time.monotonic()))
                if not events:
                    raise Broken(
                        f"gave no answer within {seconds:g} s",
                        "let it write out each answer at once (flush), or allow it more, "
                        f"external(..., seconds={10 * seconds:g})",
                    )
                for key, _ in events:
                    if key.fd == self.into:
                        request = self._written(request)
                        if not request:
                            self._ready.unregister(self.into)
                    elif key.fd == self.errors:
                        self._hear()
                    elif not (data := os.read(self.out, 1 << 20)):
                        raise Broken(self._how_it_ended())
                    else:
                        answer += data
                        if b"\n" in data:
                            line, self._rest = bytes(answer).split(b"\n", 1)
                            self.answers += 1
                            return line
                        if len(answer) > most:
                            raise Broken(
                                f"wrote {len(answer)} characters without the end of a line",
                                "end each answer with the end of a line",
                            )
        finally:
            if self.into in self._ready.get_map():
                self._ready.unregister(self.into)

    def _written(self, request: bytes) -> bytes:
        """Write what fits into the pipe; return the rest of the request."""
        try:
            return request[os.write(self.into, request) :]
        except BlockingIOError:
            return request
        except BrokenPipeError:  # it reads no more; its output shows whether it has ended
            return b""

    def _printed(self) -> bytes:
        """Return what the program printed outside its answers."""
        with contextlib.suppress(BlockingIOError):
            self._rest += os.read(self.out, 4096)
        return self._rest.strip()

    def _hear(self) -> bool:
        """Read standard error and keep its end; return False once it has ended."""
        try:
            data = os.read(self.errors, 1 << 16)
        except BlockingIOError:
            return True
        self._said = (self._said + data)[-4096:]
        if not data and self.errors in self._ready.get_map():
            self._ready.unregister(self.errors)
        return bool(data)

    def last_lines(self) -> str:
        """Return the last lines of its standard error, joined into one."""
        ended, until = self.program.poll() is not None, time.monotonic() + GRACE
        while self.errors in self._ready.get_map():
            # output of a crashed program may still arrive
            events = self._ready.select(max(0.0, until - time.monotonic()) if ended else 0.0)
            if self.errors not in [key.fd for key, _ in events] or not self._hear():
                break
        lines = [line.strip() for line in self._said.decode("utf-8", "replace").splitlines()]
        return " | ".join([line for line in lines if line][-LINES:])

    def _how_it_ended(self) -> str:
        self._ready.unregister(self.out)
        try:
            code = self.program.wait(GRACE)
        except subprocess.TimeoutExpired:
            return "closed its standard output"
        if code >= 0:
            return f"ended with exit code {code}"
        with contextlib.suppress(ValueError):
            return f"was ended by the signal {signal.Signals(-code).name}"
        return f"was ended by the signal {-code}"

    def end(self, grace: float = GRACE) -> None:
        """End the program, all its children, and the shell that watches it."""
        if self.owner != os.getpid():
            return  # another process started it, and ends it
        program, watch = self.program, self.watch
        assert program.stdin and program.stdout and program.stderr and watch.stdin
        self._ready.close()
        program.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(grace)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(program.pid, signal.SIGKILL)
        program.wait()
        watch.kill()
        watch.wait()
        for stream in (program.stdout, program.stderr, watch.stdin):
            stream.close()


def quoted(line: bytes) -> str:
    """Return the first line of an output, shortened for a message."""
    first = (line.decode("utf-8", "replace").strip().splitlines() or [""])[0]
    return repr(first if len(first) <= 60 else f"{first[:57]}...")
