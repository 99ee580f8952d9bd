"""The tables of docs/verdicts.md once more; of the first, each attack in three units of action.

`python rerun.py` prints a line an attack and unit: its verdict, and where another was wanted.
Exit code 1 if one differs. With words, only attacks whose line holds them.

A row of the second table is `| class | what it is: `command` | before | after |`. Its command is
`discmech ...` or `python FILE.py`, and *after* begins with pass, fail, inconclusive or refused: its
exit codes 0, 1, 3 and 2. A class that ends with (slow) is for `make test-all`.
"""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from discmech.studies.command import main

HERE = Path(__file__).parent
ROW = re.compile(r"^\| (.+?) \| `discmech (.+?)` \| .+? \| (pass|fail)", flags=re.M)
SECOND = re.compile(
    r"^\| (.+?) \| (?:.*?: )?`((?:discmech|python) .+?)` \| .+? "
    r"\| (pass|fail|inconclusive|refused)\b",
    flags=re.M,
)
ANSWERS = {0: "pass", 1: "fail", 2: "refused", 3: "inconclusive"}
#: scenes that are themselves of another unit: the others stand for them
OWN_UNIT = ("small_action", "large_action", "tiny_action")


def rows():
    """(attack, words of its command, verdict) of each row of the first table."""
    page = (HERE.parent / "verdicts.md").read_text(encoding="utf-8")
    table, _, _ = page.partition("## The second attack")
    return [
        (attack, shlex.split(command), verdict) for attack, command, verdict in ROW.findall(table)
    ]


def second_rows():
    """(class, words of its command, answer, whether it is slow) of each row of the later tables."""
    page = (HERE.parent / "verdicts.md").read_text(encoding="utf-8")
    _, _, table = page.partition("## The second attack")
    return [
        (kind, shlex.split(command), answer, kind.endswith("(slow)"))
        for kind, command, answer in SECOND.findall(table.partition("\n## How the bench")[0])
    ]


def answer_of(words):
    """Return the answer of a command of the second table, in a word; it runs in this folder."""
    program, *rest = words
    if program == "python":
        done = subprocess.run([sys.executable, *rest], cwd=HERE, capture_output=True, check=False)
        answer = ANSWERS.get(done.returncode, f"exit code {done.returncode}")
        return "an error of its own" if b"Traceback" in done.stderr else answer
    return ANSWERS[main([*rest, "--jobs", "1"])]


def in_unit(words, unit):
    """The words of a command with its scene in another unit."""
    study, scene, *more = words
    name = scene.removeprefix("attacks.py:")
    if name in OWN_UNIT:
        name = "kepler"
    return [study, f"attacks.py:{name}_{unit}", *more]


def verdict_of(words):
    """Return the verdict of a command on its one case."""
    with TemporaryDirectory() as folder:
        found = Path(folder) / "found.json"
        main([*words, "--jobs", "1", "--json", str(found)])
        (case,) = json.loads(found.read_text(encoding="utf-8"))["cases"]
    return case["verdict"]


def rerun(asked=""):
    """Print every verdict; how many are not those of the table."""
    wrong = 0
    for attack, words, wanted in rows():
        if asked not in attack:
            continue
        told = {
            "as it is": words,
            "10^150": in_unit(words, "large"),
            "10^-150": in_unit(words, "small"),
        }
        for unit, line in told.items():
            verdict = verdict_of(line)
            wrong += verdict != wanted
            sign = "" if verdict == wanted else f"  NOT {wanted}"
            print(f"{verdict:13} {unit:9} {attack}{sign}", file=sys.stderr)
    for kind, words, wanted, _ in second_rows():
        line = f"{kind}: {shlex.join(words)}"
        if asked in line:
            answer = answer_of(words)
            wrong += answer != wanted
            sign = "" if answer == wanted else f"  NOT {wanted}"
            print(f"{answer:13} {line}{sign}", file=sys.stderr)
    return wrong


if __name__ == "__main__":
    sys.exit(min(rerun(" ".join(sys.argv[1:])), 1))
