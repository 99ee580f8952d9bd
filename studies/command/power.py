"""The subcommand `discmech power`: which faults are caught, and whether valid rules are."""

from __future__ import annotations

import argparse
import shlex
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.errors import shown

from ..core.store import Store
from ..core.study import every_study
from .baselines import add_baselines, beside_baseline, earlier, is_worse
from .options import add_fresh, add_jobs, add_own, jobs, own_of, own_words
from .output import EXIT, console, progress_shown, writable, write_json


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "power",
        help="seeded faults that must be caught, and random valid rules that must not be",
        epilog="Exit codes: 0 every fault is caught or proved to be none, 1 one is not, or a valid "
        "rule was refused, 2 bad input, 3 inconclusive. Interrupted, the same command goes on "
        "where it stopped.",
    )
    add_own(parser, every_study()["power"].options)
    add_jobs(parser)
    add_fresh(parser)
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    add_baselines(parser)
    parser.set_defaults(action=_power, study="power")


def _power(options: argparse.Namespace) -> int:
    from ..core.case import Choice
    from ..core.running import run_study

    study, choice = every_study()["power"], Choice(own=own_of(options))
    before = earlier(options)
    writable(options.json)
    if not study.cases(choice):
        raise BadInput(f"the name of no fault and of no rule holds {shown(options.only)}.")
    with progress_shown("loading") as show:
        found = run_study(study, choice, show, store=Store(options.fresh), jobs=jobs(options))
    found["command"] = shlex.join(["discmech", "power", *own_words(options)])
    notes = beside_baseline(options, found, before)
    if options.json:
        write_json(options.json, found, indent=1)
    if options.json != "-":
        _print(found)
        for note in notes:
            print(note)
    return EXIT["fail"] if is_worse(found) else EXIT[found["verdict"]]


def _print(found: dict[str, Any]) -> None:
    from ..report.tables import rich_table

    for table in found["tables"]:
        heads = table["heads"]
        console().print(rich_table(table["title"], heads, table["lines"], numbers=heads[1:]))
    for case in found["cases"]:
        name = f"{case['scene']} {case['rule']}: {case['measured']['site']}, "
        name += str(case["measured"]["what"])
        if case["measured"]["equivalent"]:
            print(f"equivalent: {name}: {case['reason']}.")
        elif case["verdict"] != "pass":
            print(f"{'SURVIVES' if case['control'] else 'FALSE ALARM'}: {name}: {case['reason']}")
    print(
        f"{found['faults']} faults: {found['caught']} caught, {found['equivalent']} proved to "
        f"be none, {len(found['survivors'])} survive; {found['rules']} valid rules: "
        f"{len(found['false_alarms'])} false alarms; {found['seconds']:.0f} s of measuring."
    )
