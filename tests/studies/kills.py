"""Kill commands at random moments: `python tests/studies/kills.py [COUNT [SEED]]` (Linux).

Their first process is killed, as by a lack of memory, and the same command begun again on what it
left, until one gets to its end: its results have to be those of an undisturbed run. A line a start;
exit code 1 if a result differs, a stored one is lost or damaged, or a process stays behind.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

RULE = '''"""Mine."""
from discmech.integrators import discretisation


@discretisation(order=2)
def two_thirds(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2
'''
SHORT = ("--digits", "16", "--steps", "64")
PLAIN = ("order", "symplecticity", "momentum", "energy")  # the others measure times, too
STUDIES = tuple(word for name in PLAIN for word in ("--study", name))
SCENES = ("--scene", "pendulum", "--scene", "rigid-body")
COMMANDS = {
    "verify": ("verify", "mine.py", *SCENES, *STUDIES, *SHORT, "--json", "found.json"),
    "power": ("power", "--only", "pendulum midpoint: equation.plus", "--json", "found.json"),
    "report": ("report", "pendulum", "--rule", "midpoint", *SHORT, "--folder", "."),
}
#: of a run, not of what it measures
OWN = ("seconds", "measured_at", "record", "remembered", "notes")
PATIENCE = 20.0  # seconds in which workers notice that nobody asks them any more


class Command:
    """A command with a folder and a cache of its own, begun until it has ended undisturbed."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder, self.begun = name, folder / name, 0
        self.folder.mkdir()
        (self.folder / "mine.py").write_text(RULE, encoding="utf-8")
        self.anew()
        before = time.monotonic()
        process = self.start()
        _, said = process.communicate()
        if process.returncode:
            sys.exit(f"{name} ended with {process.returncode}: {said}")
        self.seconds, self.wanted = time.monotonic() - before, self.found()
        self.anew()

    def anew(self) -> None:
        """An empty cache: what was kept so far no longer counts."""
        self.begun += 1
        self.cache, self.kept = self.folder / f"cache-{self.begun}", set[str]()

    def start(self) -> subprocess.Popen[str]:
        """Begun in a session of its own, whose processes are found by it."""
        own = {"DISCMECH_CACHE": str(self.cache), "TMPDIR": str(self.folder)}
        (self.folder / "found.json").unlink(missing_ok=True)
        shutil.rmtree(self.folder / "tables", ignore_errors=True)
        words = [sys.executable, "-m", "discmech.studies.command", *COMMANDS[self.name]]
        return subprocess.Popen(
            words, cwd=self.folder, env={**os.environ, **own}, start_new_session=True, text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip

    def found(self) -> Any:
        """What it wrote, without what belongs to the run alone."""
        tables = self.folder / "tables"
        files = [tables / f"{n}.json" for n in PLAIN] if tables.exists() else [Path("found.json")]
        files = [self.folder / file for file in files]
        return [_plain(json.loads(f.read_text(encoding="utf-8"))) for f in files if f.exists()]

    def stored(self) -> set[str]:
        """The measurements in its cache."""
        return measurements_in(self.cache)


def measurements_in(cache: Path) -> set[str]:
    """The names of the measurements that the store of a cache folder has."""
    file = cache / "discmech-cache" / "results" / "store.sqlite"
    if not file.exists():
        return set()
    with closing(sqlite3.connect(file)) as store:
        try:
            asked = "SELECT name FROM entry WHERE kind = 'measurement'"
            return {name for (name,) in store.execute(asked)}
        except sqlite3.OperationalError:  # it is just made
            return set()


def _plain(found: Any) -> Any:
    if isinstance(found, dict):
        return {key: _plain(value) for key, value in found.items() if key not in OWN}
    return [_plain(value) for value in found] if isinstance(found, list) else found


def _session(leader: int) -> list[int]:
    """The processes of a session that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session, *_ = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        if int(session) == leader and state != "Z":
            found.append(int(stat.parent.name))
    return found


def kill(command: Command, after: float) -> tuple[bool, list[str]]:
    """Start it and kill it after so many seconds: (whether it was still running, what is wrong)."""
    process, wrong = command.start(), []
    try:
        _, said = process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
        said = ""
    killed = process.returncode == -signal.SIGKILL
    ends = time.monotonic() + PATIENCE
    while (left := _session(process.pid)) and time.monotonic() < ends:
        time.sleep(0.1)
    for number in left:
        os.kill(number, signal.SIGKILL)
        wrong.append(f"process {number} stayed behind")
    if process.stderr is not None:
        process.stderr.close()
    lost = command.kept - command.stored()
    wrong += [f"{len(lost)} results lost"] if lost else []
    wrong += [f"it says: {said}"] if "damaged" in said else []
    if not killed:
        same = process.returncode == 0 and command.found() == command.wanted
        wrong += [] if same else [f"ended with {process.returncode}, other results: {said}"]
    command.kept = command.stored()
    return killed, wrong


def main(count: int = 50, seed: int = 1) -> int:
    """Kill so many times, the commands in turn; how many starts went wrong, at most 1."""
    generator, kills, bad = random.Random(seed), 0, 0
    with TemporaryDirectory(prefix="kills-") as folder:
        commands = [Command(name, Path(folder)) for name in COMMANDS]
        for command in _turns(commands):
            last = kills >= count  # then each gets to its end once more
            after = 10 * command.seconds if last else generator.uniform(0, command.seconds)
            killed, wrong = kill(command, after)
            wrong += ["it did not get to its end"] if killed and last else []
            kills, bad = kills + killed, bad + bool(wrong)
            how = f"killed after {after:.1f} s" if killed else "ended, as undisturbed"
            print(command.name, "; ".join(wrong) or how, f"({len(command.kept)} kept)", flush=True)
            if not killed:
                command.anew()
            if last:
                commands.remove(command)
    print(f"{kills} kills, seed {seed}: {bad} starts went wrong")
    return min(bad, 1)


def _turns(commands: list[Command]) -> Iterator[Command]:
    """One after another, as long as there are some."""
    while commands:
        yield from list(commands)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
