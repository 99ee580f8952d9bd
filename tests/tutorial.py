"""The tutorial, followed in a fresh environment from the built wheel, with the time of each step.

    python -m tests.tutorial            # builds a wheel and installs it with what it needs, by pip
    python -m tests.tutorial mine.whl

Times are wall and processor time, since pip was done; the first picture is the one to look at.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.imports import ROOT
from tests.pages import command_lines, files, in_order

TUTORIAL = ROOT / "docs" / "tutorial.md"
#: a Python in which the page's blocks are typed one after another
SESSION = """
import json, sys
names = {"__name__": "__main__"}
for line in sys.stdin:
    exec(json.loads(line), names)
    print("done", flush=True)
"""


def follow(python: Path, folder: Path) -> Iterator[tuple[str, float, float]]:
    """(step, wall, processor seconds) of each step of the page, as it is done in the folder.

    python: that of an environment in which discmech is installed, with a cache of its own.
    """
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST"))}
    clean["DISCMECH_CACHE"] = str(folder / "cache")
    begun, before = time.monotonic(), _children()

    def done(step: str) -> tuple[str, float, float]:
        return step, time.monotonic() - begun, _children() - before

    with subprocess.Popen([python, "-c", SESSION], cwd=folder, env=clean, text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as session:  # fmt: skip
        assert session.stdin is not None and session.stdout is not None
        names = {text: name for name, text in files(TUTORIAL).items()}
        for language, text in in_order(TUTORIAL):
            if text in names:
                (folder / names[text]).write_text(text, "utf-8")
            elif language == "python":
                session.stdin.write(json.dumps(text) + "\n")
                session.stdin.flush()
                while (line := session.stdout.readline()) != "done\n":
                    assert line, f"the tutorial's block ended Python:\n{text}"
                yield done(text.strip().splitlines()[0] + " …")
            elif language == "sh":
                for words, code in command_lines(text, "discmech"):
                    line = [python, "-m", "discmech.studies.command", *words[1:]]
                    ran = subprocess.run(
                        line, cwd=folder, env=clean, capture_output=True, text=True
                    )
                    assert ran.returncode == code, ran.stdout + ran.stderr
                    yield done(" ".join(words))
        session.stdin.close()
    yield done("all of it")


def _children() -> float:
    """Processor seconds of the processes that ended, and of theirs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Build, install, follow and print."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        pip = ("-m", "pip", "--disable-pip-version-check", "-q")
        if len(sys.argv) > 1:
            wheel = Path(sys.argv[1]).resolve()
        else:
            made = [sys.executable, *pip, "wheel", "--no-deps", "--no-build-isolation", "-w", place]
            subprocess.run([*made, ROOT], check=True)
            (wheel,) = folder.glob("*.whl")
        subprocess.run([sys.executable, "-m", "venv", folder / "env"], check=True)
        python = folder / "env" / ("Scripts" if os.name == "nt" else "bin") / "python"
        begun = time.monotonic()
        subprocess.run([python, *pip, "install", wheel], check=True)
        print(f"pip install: {time.monotonic() - begun:.1f} s")
        (folder / "mine").mkdir()
        for step, wall, processor in follow(python, folder / "mine"):
            picture = " (a picture)" if [*(folder / "mine").rglob("*.png")] else ""
            print(f"{wall:6.1f} s, {processor:6.1f} s of processor: {step}{picture}", flush=True)


if __name__ == "__main__":
    main()
