"""`discmech STUDY`: one study of the chosen scenes and rules, printed, as JSON, or as a page."""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.environment import absolute
from ..core.store import Store
from ..core.study import every_study
from .baselines import add_baselines, beside_baseline, earlier, exit_beside
from .options import add_choices, add_folder, add_own, as_typed, choice_of, jobs, look_of, page_of
from .output import console, exit_code, of_all, progress_shown, write_result


def add_to(commands: Any, word: str = "") -> None:
    """Declare a command for every study, and for one given as FILE.py:NAME."""
    studies = every_study()
    if re.search(r"\.py(:|$)", word):
        from ..core.study_words import study_called

        studies = {**studies, word: study_called(word)}
    for name, study in studies.items():
        limits = "; ".join(
            f"{name} {value}, {what}" for name, what, value, _ in study.told_limits()
        )
        said = f"Limits: {limits}.".replace("%", "%%") if limits else None
        asked = commands.add_parser(name, help=study.summary, epilog=said)
        add_choices(asked, of_scenes=study.of_systems)
        add_own(asked, study.options)
        asked.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
        add_folder(asked)
        add_baselines(asked)
        asked.set_defaults(action=run, study=name)


def run(options: argparse.Namespace) -> int:
    """Run the study and show its result; return the exit code."""
    from ..core.running import run_study
    from ..core.study_words import study_called
    from ..report.tables import print_result

    study = study_called(options.study)
    with progress_shown(f"{study.name}: loading") as show:
        choice = choice_of(options)
        look = look_of(options, choice.rules)
        before = earlier(options)
        result = run_study(study, choice, show, store=Store(options.fresh), jobs=jobs(options))
        result = of_all(replace(result, command=as_typed(options)))
        result, notes = beside_baseline(options, result, before, [study], choice)
        if options.folder:
            from .report import write_study

            show("figures", None)
            command = page_of(options, result.command)
            page = write_study(result, choice, absolute(options.folder), look, command)
    if options.json:
        write_result(options.json, result)
    if options.json != "-":
        print_result(console(), result)
        for note in (*result.notes, *notes):
            print(note)
        if options.folder:
            print(f"page: {Path(options.folder) / page.name}")
    return exit_beside(result, exit_code(result, told=options.json != "-"))
