"""The subcommand `discmech verify`: a file of the user's in, verdicts out."""

from __future__ import annotations

import argparse
import json
import shlex
import time
from pathlib import Path
from typing import Any

from integrators import BadInput

from . import NAMES
from .options import count, digits_in, jobs
from .output import EXIT, console, progress_shown, writable, write


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "verify",
        help="all verdicts on the rules and scenes of a file of yours",
        epilog="Exit codes: 0 pass, 1 a verdict failed, 2 bad input, 3 inconclusive.",
    )
    parser.add_argument("file", metavar="FILE.py", help="rules, and scenes if it likes")
    parser.add_argument(
        "--scene", action="append", default=[], metavar="S", dest="scenes",
        help="only this one (a name, or FILE.py:NAME); may be repeated",
    )  # fmt: skip
    parser.add_argument("--all", action="store_true", help="every scene, not only six")
    parser.add_argument(
        "--study", action="append", default=[], metavar="NAME", dest="studies", choices=NAMES,
        help="only this study (default: all that judge a rule, none that takes times)",
    )  # fmt: skip
    parser.add_argument(
        "--digits", action="append", default=[], metavar="D", help="default: 16 and 50"
    )
    parser.add_argument("--steps", metavar="N", help="of every run, as the studies' own --steps")
    parser.add_argument("--jobs", metavar="N", help="processes side by side (default: one a core)")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.add_argument("--html", metavar="FILE", help="write a page with figures")
    parser.set_defaults(action=_verify)


def _verify(options: argparse.Namespace) -> int:
    from .rendering import verdicts
    from .rendering.tables import plain
    from .verify import Request, verify

    for file in (options.json, options.html):
        writable(file)
    if options.html == "-":
        raise BadInput("--html needs the name of a file.")
    request = Request(
        files=(options.file,),
        scenes=tuple(options.scenes),
        studies=tuple(options.studies),
        digits=tuple(map(digits_in, options.digits)),
        steps=None if options.steps is None else count(options.steps, "--steps"),
        every_scene=options.all,
    )
    quiet = options.json == "-"

    def told(study: str, case: dict[str, Any]) -> None:
        if not quiet:
            print(verdicts.line(study, case), flush=True)

    begun = time.perf_counter()
    with progress_shown() as show:
        result = verify(request, show, told, jobs(options))
    result["command"] = _as_typed(options)
    if options.json:
        write(options.json, json.dumps(plain(result), ensure_ascii=False, allow_nan=False))
    if options.html:
        from .rendering.page import write_page

        write_page(result, Path(options.html))
    if not quiet:
        screen = console()
        screen.print(verdicts.table(result))
        for paragraph in verdicts.troubles(result):
            screen.print(paragraph, highlight=False, markup=False, soft_wrap=True)
        print(f"{verdicts.summary(result)} ({time.perf_counter() - begun:.0f} s)")
    return EXIT[result["verdict"]]


def _as_typed(options: argparse.Namespace) -> str:
    parts = ["discmech", "verify", options.file]
    for flag, values in (("--scene", options.scenes), ("--study", options.studies),
                         ("--digits", options.digits)):  # fmt: skip
        parts += [word for value in values for word in (flag, value)]
    parts += ["--all"] if options.all else []
    return shlex.join([*parts, *(["--steps", options.steps] if options.steps else [])])
