"""Kill a program before every write, rename, removal and fsync that it makes, as by SIGKILL.

Begun again on what is left, it has to give the numbers of an undisturbed run, and leave no litter.

    python -m tests.kill_points [publish|beside|lattice|motion|study|baseline|report ...]
                                [--every N] [--first K] [--last L]
"""

from __future__ import annotations

import argparse
import io
import json
import os
import sqlite3
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from discmech.integrators.compiler import unsealed
from discmech.integrators.files import DRAFT, READY

KILLED = 9
#: what Python tells of before it does it
EVENTS = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate")
STUDY = ("order", "harmonic", "--rule", "rectangle", "--digits", "16", "--steps", "16")


class Points:
    """Counts what a process writes in a folder, and ends it before the one of that number."""

    def __init__(self, tree: str, stop: int) -> None:
        self.tree, self.stop, self.count = tree, stop, 0
        own_fdopen = os.fdopen

        def fdopen(handle: int, mode: str = "r", *given: Any, **more: Any) -> Any:
            if mode != "wb":
                return own_fdopen(handle, mode, *given, **more)
            return Halves(self, io.FileIO(handle, "wb"))

        import numpy

        class Store(sqlite3.Connection):
            """A database whose changes have a point before and behind them.

            What its machine code writes meanwhile has none: of that kills at random moments tell
            (`tests/studies/test_store.py`).
            """

            def executemany(self, *given: Any) -> Any:
                points.one()
                return super().executemany(*given)

            def __exit__(self, *given: Any) -> Any:
                points.one()
                ended = super().__exit__(*given)
                points.one()
                return ended

        points, connect = self, sqlite3.connect
        sqlite3.connect = lambda *given, **more: connect(*given, **more, factory=Store)  # type: ignore[assignment]
        os.fdopen = fdopen
        os.fsync = self._before(os.fsync)
        numpy.memmap.flush = self._before(numpy.memmap.flush)  # type: ignore[method-assign]
        sys.addaudithook(self._heard)

    def one(self) -> None:
        """One more."""
        self.count += 1
        if self.count == self.stop:
            os._exit(KILLED)

    def _heard(self, event: str, given: tuple[Any, ...]) -> None:
        if event not in (*EVENTS, "open"):
            return
        names = [os.path.abspath(os.fsdecode(e)) for e in given[:2] if isinstance(e, str | bytes)]
        writes = event != "open" or (isinstance(given[2], int) and given[2] & 3)
        if writes and any(name.startswith(self.tree) for name in names):
            self.one()

    def _before(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def asked(*given: Any, **more: Any) -> Any:
            self.one()
            return function(*given, **more)

        return asked


class Halves(io.BufferedWriter):
    """A file of which half is written, then the other half."""

    def __init__(self, points: Points, raw: io.FileIO) -> None:
        super().__init__(raw)
        self.points = points

    def write(self, content: Any) -> int:
        """Both halves, with a point between."""
        whole = bytes(content)
        super().write(whole[: len(whole) // 2])
        super().flush()
        self.points.one()
        super().write(whole[len(whole) // 2 :])
        return len(whole)


class Ended(NamedTuple):
    """How a program ended: its exit code, the points that it came to, and what it said."""

    code: int
    points: int
    said: str


def run(program: Callable[[], int], folder: Path, point: int = 0) -> Ended:
    """Run it in a process of its own and in that folder, killed at a point; at none if 0.

    This process must have one thread, as that of this module's command has.
    """
    folder.mkdir(exist_ok=True)
    said = folder.parent / f"{folder.name}.said"
    child = os.fork()
    if not child:
        code = 1
        try:
            with said.open("w") as out:
                os.dup2(out.fileno(), 1)
                os.dup2(out.fileno(), 2)
            os.chdir(folder)
            warm = folder.parent / "cache" if program in WARM else folder / "cache"
            os.environ |= {"DISCMECH_CACHE": str(warm), "TMPDIR": str(folder)}
            points = Points(str(folder), point)
            code = program()
            sys.stdout.flush()
            os.write(1, f"\nPOINTS {points.count}".encode())
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    text = said.read_text()
    said.unlink()
    _, found, count = text.rpartition("\nPOINTS ")
    return Ended(os.waitstatus_to_exitcode(status), int(count) if found else 0, text)


def command(*words: str) -> Callable[[], int]:
    """The command, as `discmech` runs it."""

    def program() -> int:
        from discmech.studies.command import main

        return main([*STUDY, *words])

    return program


def lattice() -> int:
    """A run with a state at every stop."""
    from discmech import Scheme, midpoint
    from discmech.integrators.extensions.lattices import scenes as systems
    from discmech.integrators.runs import checkpoint

    checkpoint.SECONDS = 0
    scheme = Scheme(systems.rotors(6), midpoint)
    scheme.flow("1/20").trajectory(30, 10, checkpoint="run.npz")
    return 0


def motion() -> int:
    """The same of a scene with contact, to more digits than a double has."""
    from discmech import Scheme, midpoint, scenes
    from discmech.integrators.extensions.contact import contact_flow
    from discmech.integrators.runs import checkpoint

    checkpoint.SECONDS, contact_flow.MOST_AT_ONCE = 0, 8
    flow = Scheme(scenes.get("bouncing-ball"), midpoint).flow("1/5", 30)
    flow.trajectory(12, 4, checkpoint="run.npz")
    return 0


def publish() -> int:
    """A folder over an older one."""
    from discmech.studies.report.publish import published

    for text in ("old", "new"):
        with published(Path("page"), last="index.html") as new:
            for name in ("figures", "tables"):
                (new / name).mkdir()
                (new / name / f"{text}.txt").write_text(text)
            (new / "index.html").write_text(text)
        check_whole()
    return 0


def beside() -> int:
    """The same, where things of others are in the folder."""
    Path("page").mkdir(exist_ok=True)
    Path("page/mine.txt").write_text("mine")
    return publish()


def rows_of(folder: Path) -> Any:
    import numpy as np

    return [np.load(path).tobytes() for path in sorted(folder.glob("run.npz.*.npy"))]


def entries_of(folder: Path) -> Any:
    """All files of a page."""
    page = folder / "page"
    return {str(p.relative_to(page)): p.read_text() for p in sorted(page.rglob("*"))
            if p.is_file() and p.name != ".discmech-files.json"}  # fmt: skip


def check_whole(folder: Path = Path(".")) -> None:
    """Raise AssertionError unless a page without others' things is one of the two, or none yet."""
    found = entries_of(folder) if (folder / "page").exists() else {}
    whole = [{"index.html": t, f"figures/{t}.txt": t, f"tables/{t}.txt": t} for t in ("old", "new")]
    assert not found or "mine.txt" in found or found in whole, found


#: of a run, not of what it measures
OWN = ("seconds", "measured_at", "record", "remembered", "notes", "command")


def json_of(name: str) -> Callable[[Path], Any]:
    """What a file of results holds, without what belongs to the run alone."""

    def plain(found: Any) -> Any:
        if isinstance(found, dict):
            return {key: plain(value) for key, value in found.items() if key not in OWN}
        return [plain(value) for value in found] if isinstance(found, list) else found

    def read(folder: Path) -> Any:
        return plain(json.loads((folder / name).read_text(encoding="utf-8")))

    return read


def baseline_of(folder: Path) -> Any:
    """The baseline that was saved."""
    (path,) = (folder / "cache" / "discmech-baselines" / "main").glob("*.json")
    (folder / "baseline.json").write_bytes(unsealed(path) or b"")
    return json_of("baseline.json")(folder)


PROGRAMS: dict[str, tuple[Callable[[], int], Callable[[Path], Any]]] = {
    "publish": (publish, entries_of),
    "beside": (beside, entries_of),
    "lattice": (lattice, rows_of),
    "motion": (motion, rows_of),
    "study": (command("--json", "found.json"), json_of("found.json")),
    "baseline": (command("--save-baseline", "main"), baseline_of),
    "report": (command("--folder", "page"), json_of("page/tables/order.json")),
}


#: programs whose kernels are compiled once for all kills
WARM = (publish, beside, lattice, motion)


def every_point(
    name: str, folder: Path, every: int = 1, from_point: int = 1, last: int | None = None
) -> Iterator[str]:
    """Kill a program at each (every-th) point of these and begin it again: what went wrong."""
    program, result = PROGRAMS[name]
    first = run(program, folder / "undisturbed")
    if first.code:
        yield f"{name}: undisturbed it ends with {first.code}: {first.said}"
        return
    wanted, kills, wrong = result(folder / "undisturbed"), 0, 0
    end = first.points if last is None else min(last, first.points)
    for point in range(from_point, end + 1, every):
        where = folder / str(point)
        kills += run(program, where, point).code == KILLED
        for said in _again(program, result, wanted, where):
            wrong += 1
            yield f"{name}, point {point}: {said}"
    print(f"{name}: {kills} kills at {first.points} points, {wrong} went wrong", flush=True)


def _again(program: Any, result: Any, wanted: Any, where: Path) -> Iterator[str]:
    if program is publish:
        try:
            check_whole(where)
        except AssertionError as error:
            yield f"half is published: {error}"
    again = run(program, where)
    if again.code:
        yield f"begun again it ends with {again.code}: {again.said[-600:]}"
    elif result(where) != wanted:
        yield "other numbers"
    litter = [
        p.name
        for p in where.rglob("*")
        if p.name.startswith((DRAFT, READY)) and not p.is_relative_to(where / "cache")
    ]  # which is swept once a day
    if litter:
        yield f"{litter[0]} is left"


def main(words: list[str]) -> int:
    """Every point of these programs; 1 if something went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*PROGRAMS, []], metavar="PROGRAM")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--last", type=int)
    asked, bad = parser.parse_args(words), 0
    import discmech.studies.command.entry
    import discmech.studies.core.running
    import discmech.studies.report.page  # noqa: F401

    with TemporaryDirectory(prefix="kill-points-") as folder:
        for name in asked.names or PROGRAMS:
            (Path(folder) / name).mkdir()
            where, some = Path(folder).resolve() / name, (asked.every, asked.first, asked.last)
            for said in every_point(name, where, *some):
                bad += 1
                print(said, flush=True)
    return min(bad, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
