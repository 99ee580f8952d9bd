"""Odd command lines at random, from a seed: `python -m tests.odd_commands [COUNT [SEED]]`.

Options, names and numbers of every command are left out, doubled, swapped, or given odd words,
odd files and paths that are none. Each line has to end with an exit code of ours, without a
traceback or an error of the command's own, and what it writes as JSON is strict JSON.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import signal
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

SECONDS = 8.0  # then a line is stopped, and nothing is told of it
FAST = ("--digits", "16", "--steps", "8", "--jobs", "1")
STUDIED = ("harmonic", "--rule", "midpoint", *FAST)
#: of each command words with which it asks for little; every other command is a study
BASE: dict[str, tuple[tuple[str, ...], ...]] = {
    "list": ((),), "gallery": (("--list",),), "new": (("rule", "mine"), ("scene", "mine")),
    "run": (("harmonic", "--steps", "3"), ("ok.py:scene", "--rule", "ok.py:rule", "--steps", "3"),
            ("ok.py:chain", "--steps", "3"), ("ok.py:wall", "--steps", "9", "--step", "1/10"),
            ("ok.py:blows", "--step", "1/2", "--steps", "40")),
    "control": ((), ("ok.py:control", "--steps", "3")), "explain": (("harmonic", "midpoint"),),
    "modified": (("harmonic", "midpoint", "--order", "2"),),
    "prove": (("midpoint", "--groupoid", "separable"), ("ok.py:rule", "--groupoid", "time")),
    "export": (("harmonic", "midpoint", "--language", "numpy", "--no-check"),
               ("ok.py:scene", "ok.py:rule", "--language", "c", "--no-check")),
    "verify": (("ok.py:rule", "--scene", "harmonic", "--study", "order", *FAST),
               ("ok.py:box", "--scene", "harmonic", "--study", "energy", *FAST)),
    "compare": (("midpoint", "rectangle", "--scene", "harmonic", "--study", "order", *FAST),),
    "reference": (("harmonic", "--digits", "20"), ("ok.py:scene", "--digits", "20")),
    "power": (("--only", "pendulum midpoint: equation.plus", "--jobs", "1"),),
    "report": (STUDIED,),
}  # fmt: skip
NUMBERS = ("0", "-1", "1", "3", "16", "1/3", "1/0", "1e400", "1e-400", "nan", "-inf", "0x10", "1_0",
           " 3", "٣", "½", "9" * 5000, "1e99999999", "10**(10**7)", "1/" + "9" * 4999, "3.0", "+2",
           "1e", ".", "-", "1,5", "2.5", "1e2", "--", "0.1", "-1/10")  # fmt: skip
NAMES = ("midpoint", "rectangle", "harmonic", "pendulum", "rigid-body", "MIDPOINT", "gauss-3",
         "gauss-0", "gauss-999", "kahan-li-8:midpoint", "a:b:c", ":", "ok.py:", "ok.py:rule",
         "ok.py:scene", "ok.py:chain", "ok.py:wall", "ok.py:control", "ok.py:box", "ok.py:runs",
         "ok.py:nothing", "ok.py:number", "ok.py:__doc__", "ok.py:huge", "ok.py:singular", "order",
         "energy", "cayley", "refuse", "bisect", "all", "midpoint=Gauss", "=", "rule", "scene",
         "newmark-1e400-1", "composed", "rk4", "beads", "bouncing-ball", "ok")  # fmt: skip
WORDS = ("", " ", "é", "\udcff\udcfe", "🙂", "a\nb", "\x1b[2J", "%s%n", "{}", "[bold]", "$HOME",
         "x" * 300, "'", '"', "\\", "*", "~", "None", "__class__", "‮abc")  # fmt: skip
PATHS = ("empty.py", "letters.py", "half.py", "zero.py", "raises.py", "leaves.py", "folder",
         "folder.py", "loop.py", "gone.py", "none/there.py", "/dev/null", "/dev/full", "data.json",
         "x" * 300 + ".py", "spaced out.py:scene", "é.py:scene", "\udcff.py:scene", ".", "..", "/",
         "data.csv", "odd.mplstyle", "-", "out.json", "new/folder/deep", "ok.py")  # fmt: skip
#: what an option may be asked for, by its metavar
LIKELY = {
    "N": ("1", "2", "9", "40"), "K": ("1", "2", "7"), "H": ("1/10", "1e-3", "3"), "E": ("1e-3",),
    "D": ("16", "17", "20", "30"), "T": ("1/2", "0", "-1", "1e-5"), "S": ("7", "harmonic"),
    "R": ("midpoint", "rectangle", "gauss-2", "ok.py:rule", "ok.py:box", "ok.py:runs", "rk4"),
    "FILE": ("out.json", "-", "data.json", "/dev/full", "folder"), "DIR": ("page", "folder"),
    "NAME": ("cayley", "exponential", "main", "flipped"), "STUDY": ("order", "energy"),
    "WHAT": ("bisect", "shrink"), "RULE=TEXT": ("midpoint=é", "midpoint=$x$", "midpoint=$\\x$"),
}  # fmt: skip
OK = """
import sympy
from discmech import *

k = lambda x, v, p: v[0]**2/2 - x[0]**2/2
scene = Scene(name="mine", groupoid=pair(1), lagrangian=k, x0=[1], v0=[0], duration=1)
wall = Scene(name="wall", groupoid=pair(1), lagrangian=k, x0=[1], v0=[-3], duration=1,
             contact=lambda x, p: [x[0]], restitution="1/2")
blows = Scene(name="blows", groupoid=pair(1), lagrangian=lambda x, v, p: v[0]**2/2 + x[0]**4,
              x0=[1], v0=[1], duration=1)
huge = Scene(name="huge", groupoid=pair(1), x0=[1], v0=[0], duration=1,
             lagrangian=lambda x, v, p: k(x, v, p)*sympy.Pow(10, 10**7, evaluate=False))
singular = Scene(name="singular", groupoid=pair(1), lagrangian=lambda x, v, p: x[0]*v[0], x0=[1],
                 v0=[0], duration=1)
chain = Lattice(name="chain", site=pair(1), sites=3, x0=[[0]]*3, v0=[[1]]*3, on_site=k,
                on_bond=lambda x, y, p: -(y[0] - x[0])**2/2, duration=1)
control = Control(scene=scene, cost=lambda x, v, f, p: f.dot(f), end=([0], [0]))
number, nothing = 3, None

@discretisation(order=2)
def rule(L, G, x, u, h):
    return h*L(G.target(x, u, h/2), u)

@black_box(order=1)
def box(q, p, h):
    return q + h*p, p - h*q

runs = recorded("data.csv", 2)
"""
FILES = {
    "ok.py": OK, "spaced out.py": OK, "é.py": OK, "empty.py": "", "half.py": "def f(:", "leaves.py":
    "raise SystemExit(0)", "raises.py": "1/0", "letters.py": b"# \xff\xfe\n", "zero.py": b"a\0b",
    "data.json": "{}", "data.csv": "t,q,p\n0,1,0\n1,x,nan\n", "odd.mplstyle": "lines.width: \xe9",
}  # fmt: skip


class _Late(BaseException):
    """The time for a line is up."""


class Odd:
    """Lines by the generator's choice, which run in a folder of odd files."""

    def __init__(self, seed: int) -> None:
        from discmech.studies.command.entry import _parser

        self.chance = random.Random(seed)
        (commands,) = [a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction)]
        self.options = {
            name: [a for a in parser._actions if a.option_strings and a.dest != "help"]
            for name, parser in commands.choices.items()
        }

    def word(self, asked: str = "") -> str:
        """One odd word, or a good one where it is odd; half of the time one that may be asked."""
        if asked in LIKELY and self.chance.random() < 0.5:
            return self.chance.choice(LIKELY[asked])
        return self.chance.choice(self.chance.choice((NUMBERS, NAMES, WORDS, PATHS)))

    def line(self) -> list[str]:
        choose, chance = self.chance.choice, self.chance.random
        command = choose([*self.options])
        words = list(choose(BASE.get(command, (STUDIED,))))
        for _ in range(choose((1, 1, 1, 2, 2, 3))):
            kind = chance()
            if kind < 0.6 and self.options[command]:
                option = choose(self.options[command])
                flag = choose(option.option_strings)
                if option.nargs == 0:
                    words += [flag] if chance() < 0.9 else [f"{flag}={self.word()}"]
                else:
                    word = self.word(str(option.metavar))
                    words += [flag, word] if chance() < 0.7 else [f"{flag}={word}"]
            elif kind < 0.8 and words:
                words[self.chance.randrange(len(words))] = self.word()
            elif kind < 0.9 and words:
                del words[self.chance.randrange(len(words))]
            else:
                words.insert(self.chance.randint(0, len(words)), self.word())
        return [command if chance() < 0.97 else self.word(), *words]


def files(folder: Path) -> None:
    for name, content in FILES.items():
        held = content if isinstance(content, bytes) else content.encode()
        (folder / name).write_bytes(held)
    for name in ("folder", "folder.py"):
        (folder / name).mkdir()
    (folder / "loop.py").symlink_to("loop.py")
    (folder / "gone.py").symlink_to("nowhere")


def ended(words: list[str], encoding: str) -> tuple[int | None, str, str]:
    """(exit code, None where the time was up; what it wrote; what is wrong about it)."""
    from discmech.studies.command.entry import main

    out = io.TextIOWrapper(io.BytesIO(), encoding, "replace")
    said = io.TextIOWrapper(io.BytesIO(), encoding, "backslashreplace")
    code: Any = None
    try:
        signal.setitimer(signal.ITIMER_REAL, SECONDS, 1.0)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
            code = main(words)
    except SystemExit as end:
        code = end.code
    except _Late:
        return None, "", ""
    except BaseException as error:
        return 1, "", f"{type(error).__name__} came through: {error}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    text = "".join(
        stream.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]
        for stream in (out, said) if stream.flush() is None
    )  # fmt: skip
    return code, text, _wrong(words, code, text)


def _wrong(words: list[str], code: Any, text: str) -> str:
    if code not in (0, 1, 2, 3, 4):
        return f"exit code {code}"
    if "Traceback" in text or "an error of its own" in text:
        return "an error of its own"
    if code == 4 and not any("/dev/full" in word for word in words):
        return "the machine did nothing against it"
    if code == 2 and "discmech" not in text:
        return "bad input without a sentence"
    for file in Path(".").glob("*.json"):
        if file.name != "data.json" and file.is_file():
            with contextlib.suppress(UnicodeDecodeError):
                json.loads(file.read_text(encoding="utf-8"), parse_constant=_no_constant)
            file.unlink()
    return ""


def _no_constant(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def wrong_lines(count: int, seed: int, seconds: float = 1e9) -> Counter[Any]:
    """Run so many in the current folder, in which `files` are: how they ended, by exit code.

    Under "wrong" it counts what should not be, and prints it with its line.
    """

    def late(number: int, frame: Any) -> None:
        raise _Late

    before, begun = signal.signal(signal.SIGALRM, late), time.monotonic()
    odd, found = Odd(seed), Counter[Any]()
    try:
        for _ in range(count):
            if time.monotonic() - begun > seconds:
                break
            words = odd.line()
            code, text, wrong = ended(words, odd.chance.choice(("utf-8", "ascii")))
            found["late" if code is None else code] += 1
            if wrong:
                found["wrong"] += 1
                shown = [word[:60] for word in words]
                print(f"{shown!a}: {wrong}: {text[-400:]!a}", file=sys.__stdout__, flush=True)
    finally:
        signal.signal(signal.SIGALRM, before)
    return found


if __name__ == "__main__":
    asked = [*map(int, sys.argv[1:])] or [1000]
    with TemporaryDirectory(prefix="odd-commands-") as place:
        os.environ |= {"DISCMECH_CACHE": f"{place}/cache", "MPLBACKEND": "agg"}
        (inner := Path(place) / "here").mkdir()
        os.chdir(inner)
        files(inner)
        ends = wrong_lines(asked[0], (asked + [1])[1])
        os.chdir("/")
    print(f"{asked[0]} command lines: {dict(sorted(ends.items(), key=str))}")
    sys.exit(bool(ends["wrong"]))
