"""Running studies: every case is measured and judged, on all cores, and never lost.

Cases are done scheme by scheme, for all studies, so that each scheme is derived and compiled once.
A case that cannot be measured is marked with the reason; the others continue. Earlier measurements,
with all that they depend on unchanged, are taken from the store.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from threading import Lock
from typing import Any

from discmech.integrators import BadInput, Scheme

from . import fingerprint
from .apart import apart
from .case import Case, Choice, Progress, silent, worst
from .cluster import Cluster
from .plan import Place, Plan
from .record import record
from .result import AnyResult, StudyResult
from .shrinking import shrunk
from .side_by_side import finished, found_by, key_of, measured
from .store import Store
from .study import Study
from .userfile import word_for_study

Told = Callable[[AnyResult], None]


def unheard(result: AnyResult) -> None:
    """Ignore single cases."""


def run_study(
    study: Study, choice: Choice, progress: Progress = silent, *, store: Store | None = None,
    jobs: int | Cluster | None = 1,
) -> StudyResult:  # fmt: skip
    """Measure and judge every case of one study: see `run_studies`."""
    return run_studies([study], choice, progress, store=store, jobs=jobs)[0][0]


def run_studies(
    studies: Sequence[Study],
    choice: Choice,
    progress: Progress = silent,
    *,
    store: Store | None = None,
    jobs: int | Cluster | None = 1,
    also: Callable[[Scheme], Any] | None = None,
    told: Told = unheard,
) -> tuple[list[StudyResult], list[Any]]:
    """Return (results of the studies, the answers of `also` for each scheme in the choice's order):
    see `run_plan`.

    Raises `BadInput` if a study applies to nothing that was chosen, or can use nothing of it.
    """
    plan = Plan(studies, choice)
    for study, cases in zip(plan.studies, plan.cases, strict=True):
        if not cases:
            raise BadInput(_why_none(plan, study))
    return run_plan(plan, progress, store=store, jobs=jobs, also=also, told=told)


def _why_none(plan: Plan, study: Study) -> str:
    choice = plan.choice
    names = ", ".join(s.name for s in choice.scenes)
    if said := apart(choice, study):
        return " ".join(said)
    if names and choice.rules and not plan.pairs:
        if said := choice.unheeded():
            return " ".join(said)
        return (
            f"{', '.join(r.name for r in choice.rules)} can be used on none of the chosen "
            f"scenes ({names}): a rule needs a Lagrangian, imex one with a fast part."
        )
    if (lacks := study.lacks(choice)) != study.needs:
        return lacks
    among = f" ({names})" if names else ""
    return f"the study {study.name} applies to none of the chosen scenes{among}: {study.needs}"


def run_plan(
    plan: Plan,
    progress: Progress = silent,
    *,
    store: Store | None = None,
    jobs: int | Cluster | None = 1,
    also: Callable[[Scheme], Any] | None = None,
    told: Told = unheard,
) -> tuple[list[StudyResult], list[Any]]:
    """Return the results of a plan's studies, and the answers of `also` for its schemes in order.

    A study's verdict is the worst of its cases'. With a `store`, each finished case is kept at once
    and none is measured twice, so an interrupted run continues where it stopped. `jobs` processes
    work side by side (None: one per core), or the workers of a `Cluster`, on scenes and rules known
    by name; studies of times, except races, run alone afterwards, here. `told` is called with each
    case as it is finished.

    Raises `BadInput` if no case can use what was chosen. An interruption passes on with a note, how
    many cases are judged.
    """
    studies, choice = plan.studies, plan.choice
    outcomes: dict[Place, AnyResult] = {}
    extras: dict[int, Any] = {}
    total = sum(map(len, plan.cases)) or 1

    lock = Lock()

    def done(places: Sequence[Place], results: Sequence[AnyResult]) -> None:
        for place, result in zip(places, results, strict=True):
            with lock:  # another process's result comes at once, and again with its task
                if place not in outcomes:
                    told(result)
                    outcomes[place] = result

    def heard(news: tuple[Place, AnyResult]) -> None:
        done([news[0]], [news[1]])

    def within(label: str, fraction: float) -> None:
        progress(label, min(1.0, (len(outcomes) + fraction) / total))

    if store is not None:
        for place, result in _stored_results(plan, store):
            done([place], [replace(result, remembered=True)])
        extras = _stored_answers(plan, also, store) if also else {}
    answered = set(extras) if also else set(range(len(plan.pairs)))
    tasks = plan.tasks(set(outcomes), answered, isinstance(jobs, Cluster))
    try:
        for places, results, extra in finished(plan, tasks, jobs, also, within, store, heard):
            done(places, results)
            extras |= extra
            if places:
                case = plan.case(places[-1])
                within(f"{case.scene.name} {case.label}", 0.0)
        for place, case in plan.places():
            if place not in outcomes:  # a study that needs the machine alone
                done([place], [measured(studies[place[0]], case, within, store)])
    except KeyboardInterrupt as stop:
        others = Counter(studies[place[0]].name for place, _ in plan.places()
                         if place not in outcomes)  # fmt: skip
        to_come = ", ".join(f"{count} of {name}" for name, count in others.items())
        stop.add_note(
            f"{len(outcomes)} of {total} cases are judged, {total - len(outcomes)} are not: "
            f"{to_come}."
        )
        raise
    if outcomes and all(result.unusable for result in outcomes.values()):
        raise BadInput(next(iter(outcomes.values())).reason)
    outcomes |= shrunk(plan, outcomes, store, progress)
    if store is not None:
        store.prune()
    complete = []
    for i, study in enumerate(studies):
        whole = [outcomes[i, k] for k in range(len(plan.cases[i]))]
        remembered = sum(case.remembered for case in whole)
        together = StudyResult(
            study=study.name,
            verdict=worst(case.verdict for case in whole if case.counts),
            command=f"discmech {shlex.quote(word_for_study(study.name))}",
            record=record(sum(case.seconds for case in whole), {"steps": choice.steps}),
            remembered=remembered,
            notes=[
                *choice.unheeded(),
                *apart(choice, study),
                *study.notes(choice),
                *_dropped(study, choice, plan.cases[i]),
                *([] if store is None else store.troubles.values()),
                *about_remembered(remembered, len(whole)),
            ],
            cases=whole,
        )
        complete.append(study.completed(together))
    return complete, [extras[i] for i in sorted(extras) if extras[i] is not None]


def _dropped(study: Study, choice: Choice, cases: Sequence[Case]) -> list[str]:
    """Return a sentence for each chosen rule without a case of the study that no note names."""
    # those of a race are labels
    seen = {name for case in cases for name in (case.rule.name, case.label)}
    spoken = " ".join((*choice.unheeded(), *apart(choice, study), *study.notes(choice)))
    sentences = []
    for rule in choice.rules:
        if rule.name in seen or rule.name in spoken:
            continue
        no_fast = rule.splits and all(getattr(s, "fast", None) is None for s in choice.scenes)
        lacks = study.lacks(replace(choice, rules=(rule,)))
        why = "it needs a scene that names a fast potential" if no_fast else lacks
        sentences.append(f"{rule.name} is left out of {study.name}: {why.rstrip('.')}.")
    return sentences


def about_remembered(remembered: int, cases: int) -> list[str]:
    """Return a sentence with the number of cases that were not measured now, if there are any."""
    if not remembered:
        return []
    return [
        f"{remembered} of {cases} cases were measured by an earlier run, with the same text, "
        "numbers and versions; --fresh measures all anew."
    ]


def _stored_results(plan: Plan, store: Store) -> Iterator[tuple[Place, AnyResult]]:
    for place, case in plan.places():
        study = plan.studies[place[0]]
        earlier = found_by(store, study, case, key_of(study, case), only=True)
        if earlier is not None:
            yield place, earlier


def _stored_answers(plan: Plan, also: Callable[[Scheme], Any], store: Store) -> dict[int, Any]:
    """Return the store's answers of `also`, by pair."""
    answers = {}
    for i, pair in enumerate(plan.pairs):
        if all(fingerprint.is_ours(thing) for thing in pair):
            earlier = store.find("answer", fingerprint.of_answer(also, *pair))
            if earlier is not None:
                answers[i] = earlier
    return answers
