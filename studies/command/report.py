"""The report: every study, the equations of every scheme, one page."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators.flows import cores
from discmech.integrators.numbers import flatten

from ..core.case import Choice, Progress, silent
from ..core.cluster import Cluster
from ..core.family import FAMILY, met_in_turn, of_each_kind, same_steps, step_text
from ..core.fingerprint import of_views
from ..core.history import History
from ..core.plan import Plan
from ..core.running import run_plan
from ..core.side_by_side import answer
from ..core.store import Store
from ..core.study import Study, every_study, known_study
from ..core.workers import worker_pool

if TYPE_CHECKING:
    from ..core.result import StudyResult
    from ..report.figures import Look, Remembered, Task

#: panels from which drawing in parallel pays: another process takes two seconds to begin, a panel
#: less than a tenth of one
WORTH_DRAWING_TOGETHER = 60
#: what a study's part of the page says of its precisions
FEW = (
    "More digits than a double's are for one scene of each kind here, by one of the simple rules; "
    "the command of the study, and `make report-all`, take them for every scene and rule."
)
IN_TURN = (
    "Every simple rule is measured on one scene of each kind and on those that race, one rule in "
    "turn on each of the others: {}. The command of the study, and `make report-all`, take all."
)


def make_report(
    choice: Choice,
    folder: Path,
    progress: Progress = silent,
    jobs: int | Cluster | None = None,
    store: Store | None = None,
    look: Look | None = None,
    command: str = "discmech report",
    asked: Callable[[str], str] = "discmech {}".format,
    bench: bool = False,
) -> tuple[list[StudyResult], Path]:
    """Run all studies and write the page; return (results, path of the page).

    With a `store` the run joins its history, and the page shows changes. command, asked: the
    commands that the page shows for itself and for a study by name. Studies that apply to none of
    the chosen scenes are left out. bench: with the studies that test the bench itself: changes of
    charts, savings, and if no scene, rule or precision was chosen the cost of references, and the
    mutation study (a sample of it, unless `thorough`).
    """
    from ..proof.table import proof_table
    from ..report.page import About, write_report
    from ..report.tables import short
    from .equations import equations_of
    from .methods import about_methods

    history = None if store is None else History(store)
    whole = replace(choice, own=()) == Choice()
    studies = [study for study in every_study().values()
               if (bench or not study.of_the_bench)
               and (study.usual or (study.of_the_bench and whole))]  # fmt: skip
    if few := whole and not bench and not choice.thorough:
        same = same_steps(choice.pairs(), partial(answer, step_text, store))
        choice, turns = chosen_of_all(studies, choice, same)
    plan = Plan.of_those_that_apply(studies, choice)
    results, equations = run_plan(plan, progress, store=store, jobs=jobs, also=equations_of)
    results = [replace(result, command=asked(result.study))  # with the choice
               if result.command == f"discmech {result.study}" else result
               for result in results]  # fmt: skip
    if few:
        results = [replace(result, notes=[*result.notes, *left_out(result, same, turns)])
                   for result in results]  # fmt: skip
    progress("figures", 1.0)
    scenes = {scene.name: scene for scene, _ in plan.pairs}
    for (i, _), case in plan.places():
        if plan.studies[i].of_systems:
            scenes.setdefault(case.scene.name, case.scene)  # of contact, and of optimal control
    described = [about(scene) for scene in scenes.values()]
    drawn = _drawn_once(store, jobs if isinstance(jobs, int) else cores())
    words = (results, equations, described, folder, command, drawn)
    about_page = About("Report", methods=about_methods(plan.pairs, store), whole=whole)
    tables = [proof_table(progress, store)] if whole else []
    if history is None:
        return results, write_report(*words, look=look, about=about_page, tables=tables)
    history.add(results, short)
    page = write_report(*words, history.of, look, about_page, tables)
    history.keep()
    return results, page


def chosen_of_all(
    studies: Sequence[Study], choice: Choice, same: Mapping[tuple[str, str], str]
) -> tuple[Choice, dict[str, str]]:
    """Return what the report measures of everything, and scene ↦ its only rule.

    same: (scene, rule) of a step that an earlier rule has there.
    """
    from ..work_precision.measuring import RACED

    own = (*choice.own, ("not_meant", tuple(same)))
    plan = Plan(studies, replace(choice, own=own))
    known = {(scene.name, rule.name): (scene, rule) for scene, rule in plan.pairs}
    asked = ([known[place] for c in cases if (place := (c.scene.name, c.rule.name)) in known]
             for cases in plan.cases)  # fmt: skip
    turns = met_in_turn(plan.pairs, asked, (*FAMILY, *RACED))
    elsewhere = [(scene, rule) for scene, rule in known if turns.get(scene, rule) != rule]
    own = (*choice.own, ("not_meant", (*same, *elsewhere)))
    few = of_each_kind(replace(choice, own=own).pairs())
    return replace(choice, own=(*own, ("few", few))), turns


def left_out(
    result: StudyResult, same: Mapping[tuple[str, str], str], turns: Mapping[str, str]
) -> list[str]:
    """Return sentences about what is not measured of all scenes by all rules."""
    sentences = [FEW] if any(case.digits > 16 for case in result.cases) else []
    if once := turns.keys() & {case.scene for case in result.cases}:
        sentences.append(IN_TURN.format(", ".join(filter(once.__contains__, turns))))
    shown = {(case.scene, case.rule) for case in result.cases}
    for first in dict.fromkeys(same.values()):
        pairs = [pair for pair, one in same.items() if one == first and (pair[0], first) in shown]
        where, others = (", ".join(dict.fromkeys(e[k] for e in pairs)) for k in (0, 1))
        if pairs:
            sentences.append(f"{others}: the same step as {first} on {where}, and measured once.")
    return sentences


def _drawn_once(store: Store | None, jobs: int = 1) -> Remembered | None:
    """Return a function that takes figures from the store, or draws them and stores them.

    Large ones are drawn by other processes, while this one begins with the smallest.
    """
    if store is None:
        return None

    def remembered(tasks: Sequence[Task]) -> list[Any]:
        keys = [of_views(json.dumps(task.depends_on)) for task in tasks]
        figures = [store.find("figure", key) for key in keys]
        left = [k for k, earlier in enumerate(figures) if earlier is None]
        left.sort(key=lambda k: -tasks[k].panels)
        others = min(jobs, len(left)) - 1
        if others > 0 and sum(tasks[k].panels for k in left) >= WORTH_DRAWING_TOGETHER:
            with suppress(BrokenProcessPool), worker_pool(others) as pool:
                waiting = [(k, pool.submit(tasks[k].make)) for k in left]
                for k, future in reversed(waiting):
                    drawn = tasks[k].make() if future.cancel() else future.result()
                    figures[k] = store.keep("figure", keys[k], drawn)
        for k in left:  # all, or those of a killed process
            if figures[k] is None:
                figures[k] = store.keep("figure", keys[k], tasks[k].make())
        return figures

    return remembered


def write_study(
    result: StudyResult, choice: Choice, folder: Path, look: Look | None, command: str
) -> Path:
    """Write the page of one study with its figures and tables into a folder; return its path."""
    from ..report.page import About, write_report
    from .methods import about_methods

    named = {case.scene for case in result.cases}
    study = known_study(result.study)
    cases = list(study.cases(choice)) if study else []
    scenes = {case.scene.name: about(case.scene) for case in cases if case.scene.name in named}
    ours = about_methods((case.scene, case.rule) for case in cases if case.control is None)
    described = list(scenes.values())
    about_page = About(study.title if study else "Results", methods=ours)
    return write_report([result], [], described, folder, command, look=look, about=about_page)


def about(scene: Any) -> dict[str, Any]:
    """Return a scene's or lattice's line in the report."""
    split = getattr(scene, "split_parameters", None)  # an array is one number per site or bond
    parameters = scene.parameters if split is None else {**split["shared"]}
    values = {
        name: "(" + ", ".join(map(str, flatten(value))) + ")" if isinstance(value, tuple) else value
        for name, value in parameters.items()
    }
    return {
        "name": scene.name,
        "title": scene.title or scene.name,
        "source": scene.source,
        "groupoid": scene.groupoid.name,
        "dim_x": scene.groupoid.dim_x,
        "dim_u": scene.groupoid.dim_u,
        "parameters": ", ".join(f"{name} = {value}" for name, value in values.items()),
        "symmetries": [f"{name} (momentum map)" for name in scene.symmetries]
        if split is not None
        else [f"{q.name} ({q.kind})" for q in scene.symmetries],
    }
