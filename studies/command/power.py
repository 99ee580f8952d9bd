"""The subcommand `discmech power`: which faults are caught, and whether valid rules are."""

from __future__ import annotations

import argparse
import json
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.flows import cores

from ..core.options import refuse
from ..core.store import Store
from .options import add_fresh, add_jobs, jobs
from .output import EXIT, console, progress_shown, writable, write


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "power",
        help="seeded faults that must be caught, and random valid rules that must not be",
        epilog="Exit codes: 0 every fault is caught or proved to be none, 1 one is not, or a valid "
        "rule was refused, 2 bad input. Interrupted, the same command goes on where it stopped.",
    )
    parser.add_argument(
        "--thorough", action="store_true", help="all faults and 200 rules, not one in 12"
    )
    parser.add_argument(
        "--unit", default="0", metavar="K",
        help="faults alone, on scenes with an action 10^K times as large",
    )  # fmt: skip
    parser.add_argument(
        "--seed", default="0", metavar="S",
        help="faults at other places, another sample, other rules: of numbers nobody has seen",
    )  # fmt: skip
    parser.add_argument(
        "--only", metavar="WORDS",
        help="faults and rules whose name holds these; 'valid rule': all of these",
    )  # fmt: skip
    add_jobs(parser)
    add_fresh(parser)
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_power)


def _unit(text: str) -> int:
    try:
        power = int(text)
    except ValueError:
        power = 1000
    if abs(power) > 150:
        refuse(f"--unit is {text!r}: give a whole number from -150 to 150.")
    return power


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        refuse(f"--seed is {text!r}: give a whole number from 0 on, of 18 digits at most.")
    return int(text)


def _power(options: argparse.Namespace) -> int:
    from ..power.results import power

    unit, seed = _unit(options.unit), _seed(options.seed)
    writable(options.json)
    with progress_shown("loading") as show:
        found = power(
            show, jobs(options) or cores(), thorough=options.thorough, only=options.only or "",
            unit=unit, seed=seed, store=Store(options.fresh),
        )  # fmt: skip
    if not found["cases"]:
        raise BadInput(f"the name of no fault and of no rule holds {options.only!r}.")
    if options.json:
        write(options.json, json.dumps(found, indent=1, ensure_ascii=False))
    if options.json != "-":
        _print(found)
    return EXIT[found["verdict"]]


def _print(found: dict[str, Any]) -> None:
    from ..report.tables import rich_table

    for shown in found["tables"]:
        heads = shown["heads"]
        console().print(rich_table(shown["title"], heads, shown["lines"], numbers=heads[1:]))
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
        f"{len(found['false_alarms'])} false alarms; {found['seconds']:.0f} s of processor time."
    )
