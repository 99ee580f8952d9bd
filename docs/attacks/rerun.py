"""The table of docs/verdicts.md once more, each attack in three units of action.

`python rerun.py` prints a line an attack and unit: its verdict, and where another was wanted.
Exit code 1 if one differs. With words, only attacks whose line holds them.
"""

import json
import re
import shlex
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from discmech.studies.command import main

HERE = Path(__file__).parent
ROW = re.compile(r"^\| (.+?) \| `discmech (.+?)` \| .+? \| (pass|fail)", flags=re.M)
#: scenes that are themselves of another unit: the others stand for them
OWN_UNIT = ("small_action", "large_action", "tiny_action")


def rows():
    """(attack, words of its command, verdict) of each row of the table."""
    table = (HERE.parent / "verdicts.md").read_text(encoding="utf-8")
    return [
        (attack, shlex.split(command), verdict) for attack, command, verdict in ROW.findall(table)
    ]


def in_unit(words, unit):
    """The words of a command with its scene in another unit."""
    study, scene, *more = words
    name = scene.removeprefix("attacks.py:")
    if name in OWN_UNIT:
        name = "kepler"
    return [study, f"attacks.py:{name}_{unit}", *more]


def verdict_of(words):
    """What a command says of its one case."""
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
    return wrong


if __name__ == "__main__":
    sys.exit(min(rerun(" ".join(sys.argv[1:])), 1))
