"""The command `discmech`: list, run, the studies, and the report.

Only the modules that the given command needs are loaded: `discmech list` imports neither sympy nor
llvmlite.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, StepFailure, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.errors import CouldNotRun, NotDecided, nearest, unknown
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.places import settle

from .. import NAMES
from ..core import lookup
from ..core.environment import absolute, names_from
from ..core.options import THOROUGH
from ..core.store import Store
from . import (
    control,
    explain,
    export,
    gallery,
    modified,
    new,
    prove,
    single_run,
    studying,
    verifying,
)
from . import reference as references
from .interrupts import GOES_ON, GOES_ON_FRESH, Farewell, ended_soon
from .last_words import told
from .options import add_choices, add_look, add_own, as_typed, choice_of, jobs, look_of, page_of
from .output import (
    check_outputs,
    console,
    exit_code,
    progress_shown,
    withdraw_badge,
    writable_folder,
    write_json,
)

PASS, FAIL, BAD_INPUT, INCONCLUSIVE = 0, 1, 2, 3
GROUPOIDS = ("pair", "lie_group", "action", "product", "LocalGroupoid")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0 pass, 1 fail, 2 bad input, 3 inconclusive, 4 could not run."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    settle()
    with names_from(_current_folder()):
        return _main(words, arguments is None)


def _current_folder() -> Path:
    try:
        return Path.cwd()
    except FileNotFoundError:  # it was removed: only absolute names work
        return Path()


def _main(words: list[str], alone: bool) -> int:
    withdraw_badge(words)
    try:
        parser = _parser(words)
    except BadInput as error:  # for example a file with a study that cannot be read
        print(f"discmech: {error}", file=sys.stderr)
        return BAD_INPUT
    for word in words:
        # argparse would see an option without value
        if word.startswith("--") and word.endswith("=--"):
            parser.error(f"argument {word[:-3]}: expected one argument")
    options = parser.parse_args(words)
    if alone:  # only in its own process
        with ended_soon() as farewell:
            return _answer(options, farewell)
    return _answer(options, Farewell())


def _answer(options: argparse.Namespace, farewell: Farewell) -> int:
    if hasattr(options, "fresh"):  # its measurements are kept case by case
        farewell.again = GOES_ON_FRESH if options.fresh else GOES_ON
    code = _code_of(options, farewell)
    for said in lookup.left_out():  # the rest has its answer, which may be that it is bad input
        print(f"discmech: {said}", file=sys.stderr)
        code = BAD_INPUT if code in (PASS, INCONCLUSIVE) else code
    return code


def _code_of(options: argparse.Namespace, farewell: Farewell) -> int:
    try:
        check_outputs(options)
        return int(options.action(options))
    except BadInput as error:
        print(f"discmech: {error}", file=sys.stderr)
        return INCONCLUSIVE if isinstance(error, NotDecided) else BAD_INPUT
    except StepFailure as error:
        print(f"discmech: {error.sentence}", file=sys.stderr)
        return FAIL
    except KeyboardInterrupt:
        farewell.say()
        return farewell.code
    except SystemExit:
        return told(CouldNotRun("something that the command ran asks to exit: remove that."))
    except Exception as error:
        from discmech.reference import ReferenceFailure

        if isinstance(error, ReferenceFailure):
            print(f"discmech: {error}", file=sys.stderr)
            return INCONCLUSIVE
        return told(error, farewell.again)


class _Parser(argparse.ArgumentParser):
    """A parser that accepts only whole names of options; -1/10 is a number."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)
        self._negative_number_matcher = re.compile(r"^-[\d.]+([eE/][-+]?\d+)?$")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the arguments, and report unknown ones with the nearest known name."""
        options, left = super().parse_known_args(args, namespace)
        if left:
            near = nearest(left[0].partition("=")[0], self._option_string_actions)
            hint = f"; did you mean {near}?" if near else ""
            if not left[0].startswith("-"):
                hint = "; write names before the options"
            self.error(f"unrecognized arguments: {' '.join(left)}{hint}")
        return options, left

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            kind = str(action.metavar or action.dest).lower()
            self.error(str(unknown(kind, value, action.choices)))


def _parser(words: Sequence[str] = ()) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="discmech",
        description="Verification bench for variational integrators on Lie groupoids.",
        epilog="Exit codes: 0 pass, 1 a verdict failed, 2 bad input, 3 inconclusive, 4 could not "
        "run. Words such as control, band or pullback: discmech list --words.",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="names of scenes, rules, groupoids and studies")
    listing.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    listing.add_argument("--words", action="store_true", help="the bench's words and their meaning")
    listing.set_defaults(action=_list)

    single_run.add_to(commands)
    control.add_to(commands)
    explain.add_to(commands)
    modified.add_to(commands)
    prove.add_to(commands)
    export.add_to(commands)
    gallery.add_to(commands)
    new.add_to(commands)
    studying.add_to(commands, words[0] if words else "")
    verifying.add_to(commands)
    references.add_to(commands)
    report = commands.add_parser("report", help="all studies on one page with its figures")
    add_choices(report)
    report.add_argument("--folder", metavar="DIR", help="default: reports/build")
    report.add_argument(
        "--verbose", action="store_true", help="print whole tables, also of cases that passed"
    )
    report.add_argument(
        "--bench",
        action="store_true",
        help="with the studies that test the bench itself, and with more digits on every scene",
    )
    add_look(report)
    add_own(report, (THOROUGH,))
    report.set_defaults(action=_report, study="report")
    return parser


def _list(options: argparse.Namespace) -> int:
    if options.words:
        from ..report.glossary import WORDS

        meanings = {word: meaning for word, _, meaning in WORDS}
        if options.json:
            write_json(options.json, meanings, indent=1)
        else:
            print("\n".join(f"{word}: {meaning}." for word, meaning in meanings.items()))
        return PASS
    lists = {"scenes": list(scenes.every_name()), "rules": list(discretisations.names()),
             "groupoids": list(GROUPOIDS), "studies": list(NAMES),
             "one_step_maps": list(discretisations.MAPS),
             "lattices": list(systems.NAMES)}  # fmt: skip
    if options.json:
        write_json(options.json, lists, indent=1)
        return PASS
    width = max(map(len, lists["scenes"]))
    for kind, names in lists.items():
        print(f"{kind.replace('_', ' ')}:")
        for name in names:
            title = scenes.get(name).title if kind == "scenes" else ""
            print(f"  {name:<{width}}  {title}".rstrip())
    return PASS


def _report(options: argparse.Namespace) -> int:
    from .report import make_report

    folder = options.folder or "reports/build"
    writable_folder(folder)
    with progress_shown("loading") as show:
        choice = choice_of(options)
        store = Store(options.fresh)
        asked = choice, absolute(folder), show, jobs(options), store, look_of(options, choice.rules)
        results, page = make_report(
            *asked,
            command=page_of(options, as_typed(options)),
            asked=lambda study: as_typed(argparse.Namespace(**{**vars(options), "study": study})),
            bench=options.bench,
        )
    from ..report.summary import print_summary
    from ..report.tables import print_result

    screen = console()
    for result in results if options.verbose else ():
        print_result(screen, result)
    print_summary(screen, results)
    for line in (*store.troubles.values(), f"report: {Path(folder) / page.name}"):
        screen.print(line, highlight=False, markup=False, soft_wrap=True)
    return exit_code(*results, told=True)
