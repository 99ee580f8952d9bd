"""`discmech prove RULE`: the order of a rule for every Lagrangian, proven or disproven."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from ..core.options import whole
from .options import RULE_HELP
from .output import EXIT, progress_shown, write_json

#: the exit code of each answer
CODES = {True: EXIT["pass"], False: EXIT["fail"], None: EXIT["inconclusive"]}
KINDS = "pair, separable, magnetic, symmetric, cubic, time, force, lie_group, action, product"


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "prove", help="the order of a rule for every Lagrangian, proven or disproven",
        epilog="Exit codes: 0 proven, 1 disproven, 2 bad input, 3 not decided.",
    )  # fmt: skip
    parser.add_argument("rule", help=RULE_HELP)
    parser.add_argument("--order", metavar="K", help="to be proven (default: what the rule states)")
    parser.add_argument(
        "--groupoid", action="append", default=[], metavar="KIND",
        help=f"a kind of classes: {KINDS}; may be repeated (default: all that take seconds)",
    )  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.set_defaults(action=_prove)


def _prove(options: argparse.Namespace) -> int:
    from ..proof import prove

    order = None if options.order is None else whole("--order", 12)(options.order)
    with progress_shown("deriving") as show:
        found = prove(options.rule, order, groupoid=options.groupoid, progress=show)
    if options.json:
        write_json(options.json, found.to_json())
    if options.json != "-":
        sys.stdout.write(f"{found.text()}\n")
    return CODES[found.proven]
