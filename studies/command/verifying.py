"""The subcommands `verify` and `compare`: verdicts and ratios for the user's rules."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput, retractions

from ..core.environment import absolute
from ..core.options import digits_in, option_words, values_of, whole
from ..core.store import Store
from ..core.study import every_study
from .baselines import add_baselines, beside_baseline, earlier, exit_beside
from .options import RULE_HELP, add_folder, add_numbers, jobs, look_of, page_of
from .output import console, exit_code, of_all, progress_shown, write, write_result

if TYPE_CHECKING:
    from ..core.result import AnyResult, StudyResult
    from ..report.figures import Look

EPILOG = "A bar shows the progress; after Ctrl-C the same command continues where it stopped. "
EPILOG += "Exit codes: 0 pass or only measured, 1 a verdict failed, 2 bad input, 3 inconclusive, "
EPILOG += "4 could not run."


def add_to(commands: Any) -> None:
    """Declare the subcommands."""
    verify = commands.add_parser(
        "verify",
        help="all verdicts on the rules and scenes in your file",
        epilog=f"The first time a rule takes ninety processor seconds, on six scenes. {EPILOG}",
    )
    verify.add_argument(
        "rules", metavar="FILE.py", nargs="+", help="rules and scenes; or FILE.py:NAME, one of them"
    )
    badge = "write the verdict as a badge for a README"
    verify.add_argument("--badge", metavar="FILE.svg", help=badge)
    add_baselines(verify)
    compare = commands.add_parser("compare", help="methods side by side", epilog=EPILOG)
    compare.add_argument("rules", metavar="RULE", nargs="+", help=f"FILE.py, {RULE_HELP}")
    for parser, name in ((verify, "verify"), (compare, "compare")):
        _add_selection(parser)
        parser.set_defaults(action=_answer, name=name, study=name)
    compare.set_defaults(badge=None, baseline=None, save_baseline=None)


def _add_selection(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--scene", action="append", default=[], metavar="S", dest="scenes",
        help="only this one (a name, or FILE.py:NAME); may be repeated",
    )  # fmt: skip
    add_numbers(parser)
    parser.add_argument("--all", action="store_true", help="every scene, not only six")
    known = [name for name, study in every_study().items() if study.of_systems]
    parser.add_argument(
        "--study", action="append", default=[], metavar="STUDY", dest="studies", choices=known,
        help=f"only this study ({', '.join(known)}); may be repeated",
    )  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    parser.add_argument("--html", metavar="FILE", help="write a page with figures inside")
    add_folder(parser)


def _answer(options: argparse.Namespace) -> int:
    from ..report import verdicts
    from ..report.badge import badge
    from ..user.compare import compare
    from ..user.verify import Request, verify

    for option, file in (("html", options.html), ("badge", options.badge)):
        if file == "-":
            raise BadInput(f"--{option} needs the name of a file.")
    request = Request(
        files=tuple(options.rules),
        scenes=tuple(options.scenes),
        studies=tuple(options.studies),
        retractions=tuple(retractions.get(name).name for name in options.retraction),
        digits=tuple(dict.fromkeys(map(digits_in, options.digits))),
        steps=None if options.steps is None else whole("--steps")(options.steps),
        every_scene=options.all,
        vary=None if options.vary is None else values_of(options.vary),
    )
    before = earlier(options)
    quiet = options.json == "-"
    # a bar counts the cases, so lines are printed only for cases that did not pass
    barred = sys.stderr.isatty()
    reasons: set[str] = set()
    done: list[AnyResult] = []

    def told(case: AnyResult) -> None:
        done.append(case)
        if barred and not case.is_trouble:
            return
        if not quiet and not case.unusable:  # these are reported once, at the end
            print(verdicts.line(case, reasons), flush=True)
            reasons.add(case.reason)

    ask = {"verify": verify, "compare": compare}[options.name]
    begun = time.perf_counter()
    with progress_shown("loading") as show:
        look = look_of(options, request.rules())
        try:
            result = ask(request, show, told, jobs(options), Store(options.fresh))
        except KeyboardInterrupt as stop:
            if done and not quiet:
                _show_stopped(options.name, done, stop)
            raise
        result = of_all(replace(result, command=_typed(options, options.studies)))
        asked = [every_study()[name] for name in {case.study for case in result.cases}]
        result, notes = beside_baseline(options, result, before, asked, request.choice())
        if options.json:
            write_result(options.json, result)
        page = None
        if options.html or options.folder:
            show("figures", None)
            page = _write_pages(request, result, options, look)
        if options.badge:
            write(options.badge, badge(result))
    if not quiet:
        _show(result, time.perf_counter() - begun)
        for note in (*notes, *([f"page: {page}"] if page else [])):
            print(note)
    return exit_beside(result, exit_code(result, told=not quiet))


def _show(result: StudyResult, seconds: float) -> None:
    from ..report import advising, verdicts

    screen = console()
    screen.print(verdicts.table(result))
    if result.comparison is not None:
        screen.print(verdicts.side_by_side(result))
    advised = advising.recommended(result.advice or ())
    said = (*verdicts.of_schemes(result), *verdicts.proofs(result), *result.notes)
    for paragraph in (*advised, *said, *verdicts.troubles(result)):
        screen.print(paragraph, highlight=False, markup=False, soft_wrap=True)
    print(f"{verdicts.summary(result)} ({seconds:.0f} s)")


def _show_stopped(name: str, done: Sequence[AnyResult], stop: KeyboardInterrupt) -> None:
    """Print the table of the cases that are judged, and how many are not."""
    from ..core.case import worst
    from ..core.result import StudyResult
    from ..report import verdicts

    order = sorted(done, key=lambda case: (str(case.rule), str(case.scene)))
    verdict = worst(("inconclusive", *(case.verdict for case in done)))  # the others may fail
    result = StudyResult(study=name, verdict=verdict, cases=order)
    console().print(verdicts.table(result))
    print(*getattr(stop, "__notes__", ()), sep="\n", flush=True)


def _typed(options: argparse.Namespace, studies: Sequence[str]) -> str:
    """Return the command again, with these studies."""
    flags = {
        "--scene": options.scenes, "--vary": options.vary, "--retraction": options.retraction,
        "--study": studies, "--digits": options.digits, "--all": options.all,
        "--steps": options.steps,
    }  # fmt: skip
    return shlex.join(["discmech", options.name, *options.rules, *option_words(flags)])


def _write_pages(
    request: Any, result: StudyResult, options: argparse.Namespace, look: Look
) -> Path | None:
    """Write the page of --html and that of --folder, with its files; return the latter's path."""
    from ..report import advising, verdicts
    from ..report.page import About, lone_page, write_report
    from .methods import about_methods
    from .report import about

    pairs = list(request.choice().pairs())
    described = [about(scene) for scene in {scene.name: scene for scene, _ in pairs}.values()]
    tables = [verdicts.overview(result)]
    if result.comparison is not None:
        advice = [advising.recommendation(result.advice)] if result.advice else []
        tables = [*advice, verdicts.comparison(result), *tables]
    studies = verdicts.by_study(result, lambda study: _typed(options, [study]))
    asked = {"verify": "{} verified", "compare": "{} compared"}[result.study]
    title = asked.format(", ".join(Path(word).name for word in request.files))
    page = About(title, methods=about_methods(pairs))
    html = option_words({"--html": options.html})
    command = page_of(options, " ".join([result.command, *map(shlex.quote, html)]))
    if options.html:
        write(options.html, lone_page(studies, described, command, tables, page, look))
    if not options.folder:
        return None
    folder = absolute(options.folder)
    written = write_report(
        studies, [], described, folder, command, look=look, about=page, tables=tables
    )
    return Path(options.folder) / written.name
