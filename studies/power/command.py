"""The subcommand `discmech power`: which faults are caught, and whether valid rules are."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from typing import Any

from integrators import BadInput

from ..output import console, progress_shown, writable, write

PASS, FAIL = 0, 1
SAMPLE = 12  # of so many faults and rules one, unless all are asked for
RULES = 200


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "power",
        help="seeded faults that must be caught, and random valid rules that must not be",
        epilog="Exit codes: 0 every fault is caught or proved to be none, 1 one is not, or a valid "
        "rule was refused, 2 bad input.",
    )
    parser.add_argument(
        "--thorough", action="store_true", help=f"all faults and {RULES} rules, not one in {SAMPLE}"
    )
    parser.add_argument("--only", metavar="WORDS", help="faults whose name holds these words")
    parser.add_argument("--jobs", metavar="N", default="2", help="processes (default 2)")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_power)


def _power(options: argparse.Namespace) -> int:
    from .catalogue import everything
    from .measuring import measure

    writable(options.json)
    if not options.jobs.isdecimal() or int(options.jobs) < 1:
        raise BadInput(f"--jobs is {options.jobs!r}: give a whole number from 1.")
    every = 1 if options.thorough or options.only else SAMPLE
    candidates = [i for i, f in enumerate(everything()) if (options.only or "") in f.name]
    if not candidates:
        raise BadInput(f"no fault's name holds {options.only!r}.")
    rules = range(0 if options.only else RULES)
    with progress_shown() as show:
        faults, valid = measure(candidates[::every], rules[::every], int(options.jobs), show)
    result = summary(faults, valid)
    if options.json:
        write(options.json, json.dumps(result, indent=1, ensure_ascii=False))
    if options.json != "-":
        _print(result)
    return PASS if result["verdict"] == "pass" else FAIL


def summary(faults: list[dict[str, Any]], valid: list[dict[str, Any]]) -> dict[str, Any]:
    """The result as JSON has it: verdict, counts by study and by site, and every case."""
    by_study = Counter(name for f in faults for name in f["caught"])
    alone = Counter(f["caught"][0] for f in faults if len(f["caught"]) == 1)
    survivors = [f["name"] for f in faults if not f["caught"] and not f["equivalent"]]
    alarms = [v["name"] for v in valid if v["caught"]]
    return {
        "schema": 1, "study": "power", "command": "discmech power --thorough",
        "verdict": "fail" if survivors or alarms else "pass",
        "faults": len(faults), "caught": sum(bool(f["caught"]) for f in faults),
        "equivalent": sum(bool(f["equivalent"]) for f in faults), "survivors": survivors,
        "rules": len(valid), "false_alarms": alarms,
        "studies": {name: {"caught": n, "alone": alone[name]} for name, n in by_study.items()},
        "sites": {
            site: dict(Counter(_outcome(f) for f in faults if f["site"].split(".")[0] == site))
            for site in dict.fromkeys(f["site"].split(".")[0] for f in faults)
        },
        "seconds": sum(r["seconds"] for r in (*faults, *valid)),
        "cases": [*faults, *valid],
    }  # fmt: skip


def _outcome(fault: dict[str, Any]) -> str:
    return "caught" if fault["caught"] else "equivalent" if fault["equivalent"] else "survives"


def _print(result: dict[str, Any]) -> None:
    from rich.table import Table

    table = Table(title="Faults, by what they are in")
    for heading in ("site", "caught", "equivalent", "survives"):
        table.add_column(heading, justify="left" if heading == "site" else "right")
    for site, counts in result["sites"].items():
        row = (str(counts.get(k, 0)) for k in ("caught", "equivalent", "survives"))
        table.add_row(site, *row)
    studies = Table(title="Faults, by the study that caught them")
    for heading in ("study and digits", "caught", "by it alone"):
        studies.add_column(heading, justify="left" if heading[0] == "s" else "right")
    for name, counts in sorted(result["studies"].items()):
        studies.add_row(name, str(counts["caught"]), str(counts["alone"]))
    console().print(table, studies)
    for case in result["cases"]:
        if case["equivalent"]:
            print(f"equivalent: {case['name']}: {case['equivalent']}.")
        elif case["site"] != "valid rule" and not case["caught"]:
            print(f"SURVIVES: {case['name']}")
        elif case["site"] == "valid rule" and case["caught"]:
            print(f"FALSE ALARM: {case['name']}: {', '.join(case['caught'])}")
    print(
        f"{result['faults']} faults: {result['caught']} caught, {result['equivalent']} proved to "
        f"be none, {len(result['survivors'])} survive; {result['rules']} valid rules: "
        f"{len(result['false_alarms'])} false alarms; {result['seconds']:.0f} s of processor time."
    )
