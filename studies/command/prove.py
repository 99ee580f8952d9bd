"""`discmech prove RULE …`: the order of rules for every Lagrangian, proven or disproven."""

from __future__ import annotations

import argparse
import sys
from functools import partial
from typing import Any

from ..core import lookup
from ..core.options import whole
from ..core.outcome import worst
from .options import RULE_HELP
from .output import EXIT, progress_shown, write_json

#: what a study would say of each answer
VERDICTS = {"proven": "pass", "disproven": "fail", "not decided": "inconclusive"}
KINDS = "pair, separable, magnetic, symmetric, cubic, time, force, lie_group, action, product, fast"


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "prove", help="the order of a rule for every Lagrangian, proven or disproven",
        epilog="Exit codes: 0 proven, 1 disproven, 2 bad input, 3 not decided; of several rules 1 "
        "before 3 before 2.",
    )  # fmt: skip
    parser.add_argument("rules", nargs="+", metavar="RULE", help=f"{RULE_HELP}, or all in FILE.py")
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
        asked = partial(prove, order=order, groupoid=options.groupoid, progress=show)
        told = lookup.answers(lookup.rules(options.rules), asked, lambda rule: True)
    answers = [answer for _, answer in told]
    words = {VERDICTS[answer.verdict]: answer.verdict for answer in answers}
    verdict = worst(words)
    if options.json:
        whole_answer, *others = [answer.to_json() for answer in answers]
        if others:
            every = [whole_answer, *others]
            whole_answer = {"command": "prove", "verdict": words[verdict], "rules": every}
        write_json(options.json, whole_answer)
    if options.json != "-":
        sys.stdout.write("\n".join(f"{answer.text()}\n" for answer in answers))
    return EXIT[verdict]
