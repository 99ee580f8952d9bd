"""Tasks of a plan, measured in this process and in others side by side."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache, partial
from queue import SimpleQueue
from threading import Lock
from typing import Any, TypeAlias

from discmech.integrators import BadInput, Scheme, StepFailure
from discmech.integrators.errors import CannotMeasure, CouldNotRun
from discmech.integrators.flows import cores
from discmech.integrators.scene import Opaque

from . import fingerprint
from .case import Case, Progress, scheme_of, silent
from .cluster import Cluster
from .decisions import same_answers
from .one_case import (
    asks_cause,
    asks_more,
    diagnosed,
    judged,
    measured_case,
    run_case,
    told_of,
    with_more,
    with_order,
)
from .outcome import Found
from .plan import Place, Plan, Task
from .result import AnyResult
from .store import Carried, Store
from .study import Study
from .study_words import study_called, word_of_study
from .userfile import expect_unchanged, stamps
from .workers import tell, worker_pool

WORTH_WORKERS = 8  # cases; starting a worker takes a second or two
#: places with their results, and the answers of `also`, by pair
Finished: TypeAlias = tuple[Sequence[Place], list[AnyResult], dict[int, Any]]
Also: TypeAlias = Callable[[Scheme], Any] | None


def key_of(study: Study, case: Case) -> str | None:
    """Return the fingerprint of a case; None if its result gives a reason against one."""
    try:
        return fingerprint.of_case(study, case, timed=study.timed(case))
    except (BadInput, StepFailure, CannotMeasure, Opaque):
        return None


def found_by(
    store: Store | Carried,
    study: Study,
    case: Case,
    key: str | None,
    *,
    only: bool = False,
    progress: Progress = silent,
) -> AnyResult | None:
    """Return the result of a case whose measurement is stored, judged anew, or None.

    only: None also if anything would have to be measured before that verdict is complete.
    """
    kept = _stored(store, key)
    if key is None or kept is None:
        return None
    return _completed(store, study, case, key, kept, only, progress)


def _stored(store: Store | Carried, key: str | None) -> Found | None:
    """Return the stored measurement, if it rests on what judges would decide now."""
    content = None if key is None else store.find("measurement", key)
    record = None if content is None else Found.of_json(content)
    return record if record is not None and same_answers(record.decisions) else None


def _completed(
    store: Store | Carried,
    study: Study,
    case: Case,
    key: str,
    record: Found,
    only: bool = False,
    progress: Progress = silent,
) -> AnyResult | None:
    """Return the result of a measurement; see `found_by`."""
    verdict, cause = judged(study, case, record), None
    if case.knows_order and not record.knows_order:  # by the judge: it derives nothing next time
        record = _kept(store, key, with_order(record, case))
    if asks_more(study, record, verdict):
        if only:
            return None
        record = _kept(store, key, with_more(study, case, record, verdict))
        verdict = judged(study, case, record)
    if asks_cause(study, case, verdict):  # with other rules and scenes, so all text counts
        named = fingerprint.of_search(study, key, verdict.verdict, verdict.reason)
        told = store.find("cause", named)
        if told is None:
            if only:
                return None
            told = store.keep("cause", named, [diagnosed(study, case, record, progress)])
        (cause,) = told
    return told_of(study, case, record, verdict, cause)


def _kept(store: Store | Carried, key: str, record: Found) -> Found:
    """Store the record, and return it as it will be found."""
    return Found.of_json(store.keep("measurement", key, record.to_json()))


def measured(
    study: Study, case: Case, progress: Progress = silent, store: Store | Carried | None = None
) -> AnyResult:
    """Return the case's result, from a stored measurement, or from one made now and stored."""
    key = None if store is None else key_of(study, case)
    if store is None or key is None:
        return run_case(study, case, progress)
    earlier = found_by(store, study, case, key, progress=progress)
    if earlier is not None:
        return replace(earlier, remembered=True)
    record = measured_case(study, case, progress)
    if not (record.failed and record.failed.unusable):
        record = _kept(store, key, record)
    result = _completed(store, study, case, key, record, progress=progress)
    assert result is not None
    return result


def finished(
    plan: Plan,
    tasks: list[Task],
    jobs: int | Cluster | None,
    also: Also,
    progress: Progress,
    store: Store | None,
    heard: Callable[[tuple[Place, AnyResult]], None] | None = None,
) -> Iterator[Finished]:
    """Yield places with their results, as they are finished, and the answers of `also`, by pair.

    heard: is called at once with a place and its result from another process here, in a thread of
    its own; the result comes again with its task. This process works too: it takes a short task
    first, so that verdicts come soon. A cluster's workers do not use the store here: their
    measurements are kept as they come.
    """
    elsewhere = isinstance(jobs, Cluster)
    workers = jobs if isinstance(jobs, Cluster) else min(jobs or cores(), len(tasks)) - 1
    few = not workers or sum(len(t.places) for t in tasks) < WORTH_WORKERS
    sent = _packed(plan) if tasks and (elsewhere or not few) else None
    if sent is None:
        yield from _in_turn(plan, tasks, also, progress, store)
        return
    from concurrent.futures.process import BrokenProcessPool

    left, ended = deque(plan.spread(tasks)), SimpleQueue[tuple[Task, Any]]()
    kept: Store | Carried | None = Carried() if elsewhere else store

    begun: dict[bool, set[str]] = {True: set(), False: set()}
    one_at_a_time = Lock()  # threads of the pool take tasks, too

    def following(here: bool) -> Task | None:
        """Return the next task on a scene that only this side has begun, or else the next one.

        What one process has derived and followed of a scene, another would do once more.
        """
        with one_at_a_time:
            alone = (t for t in left if plan.scene(t).name not in begun[not here])
            if (task := next(alone, next(iter(left), None))) is not None:
                left.remove(task)
                begun[here].add(plan.scene(task).name)
            return task

    def give(pool: Executor) -> None:
        if (task := following(here=False)) is not None:
            try:
                future = pool.submit(_in_worker, *sent, task, also, kept)
            except RuntimeError as error:  # the pool has ended, or has no thread for it
                future = Future()
                future.set_exception(error)
                ended.put((task, future))  # otherwise it would be waited for without end
            else:
                future.add_done_callback(partial(end, pool, task))

    def end(pool: Executor, task: Task, future: Any) -> None:
        ended.put((task, future))
        # a cluster has all tasks at once; a pool that breaks holds its lock, and this would wait
        if not (elsewhere or future.cancelled() or future.exception()):
            give(pool)

    def taken() -> Finished:
        task, future = ended.get()
        results, said, founds = future.result()
        if elsewhere and store is not None:
            for (i, k), outcome in zip(task.places, founds, strict=True):
                key = key_of(plan.studies[i], plan.cases[i][k])
                if key is not None and outcome is not None:
                    store.keep("measurement", key, outcome)
            for pair, answer in said.items():
                with suppress(Opaque):
                    named = fingerprint.of_answer(also, *plan.pairs[pair])  # type: ignore[arg-type]
                    store.keep("answer", named, answer)
        return task.places, results, said

    mine = others = 0
    try:
        with worker_pool(workers, heard) as pool:
            task = following(here=True)
            for _ in range(len(left) if isinstance(workers, Cluster) else workers):
                give(pool)
            while task is not None:
                for outcome in _in_turn(plan, [task], also, progress, store):
                    yield outcome
                    while not ended.empty():
                        others += 1
                        yield taken()
                mine += 1
                task = following(here=True)
            while mine + others < len(tasks):
                others += 1
                yield taken()
    except BrokenProcessPool:
        raise CouldNotRun(
            "a process that was measuring was killed (too little memory?), or something that it "
            "ran calls exit; the same command goes on where it stopped: say --jobs 1."
        ) from None


def _in_turn(
    plan: Plan, tasks: list[Task], also: Also, progress: Progress, store: Store | None
) -> Iterator[Finished]:
    """Yield the same in this process, case by case."""
    for task in tasks:
        _before_race(plan, task, store)
        for i, k in task.places:
            yield [(i, k)], [measured(plan.studies[i], plan.cases[i][k], progress, store)], {}
        yield (), [], _said(plan, task, also, store)


def _before_race(plan: Plan, task: Task, store: Store | Carried | None) -> None:
    """Give a race the stored measurements of its methods: only the others take part in it."""
    if store is None or task.pair is not None or not task.places:
        return
    i, k = task.places[0]
    study, cases = plan.studies[i], plan.cases[i]
    if (race := study.together(cases[k])) is not None:
        own = [(case, key_of(study, case)) for case in cases if study.together(case) is race]
        kept = {}
        for case, key in own:
            if (record := _stored(store, key)) and record.measurement:
                kept[case] = record.measurement
        study.before_race(kept)


def _said(plan: Plan, task: Task, also: Also, store: Store | Carried | None) -> dict[int, Any]:
    """Return the answer of `also` for the task's scheme, by its place among the pairs."""
    if also is None or task.pair is None:
        return {}
    try:
        return {task.pair: answer(also, store, plan.pairs[task.pair])}
    except BadInput:  # the cases report it
        return {}


def answer(
    also: Callable[[Scheme], Any], store: Store | Carried | None, pair: tuple[Any, Any]
) -> Any:
    """Return what a function says of the scheme of a scene and a rule, kept in a store."""
    with suppress(Opaque):
        if store is not None:
            named = fingerprint.of_answer(also, *pair)
            return store.remembered("answer", named, lambda: also(scheme_of(*pair)))
    return also(scheme_of(*pair))


def _packed(plan: Plan) -> tuple[bytes, tuple[tuple[str, str], ...]] | None:
    """Return the studies and the choice for another process, and the user's files that it needs.

    None if some part cannot go there: functions of a notebook, or of the script that runs.
    """
    try:
        packed = pickle.dumps((list(map(word_of_study, plan.studies)), plan.choice))
        return None if b"__main__" in packed else (packed, stamps(packed))
    except (pickle.PicklingError, AttributeError, TypeError, BadInput):
        return None


def _in_worker(
    packed: bytes,
    files: tuple[tuple[str, str], ...],
    task: Task,
    also: Also,
    store: Store | Carried | None,
) -> tuple[list[AnyResult], dict[int, Any], list[Any]]:
    """Return results, the answers of `also`, and on another machine the records to be kept."""
    expect_unchanged(files)  # which loads them: the plan has things of theirs
    plan = _plan(packed)
    _before_race(plan, task, store)
    results, founds = [], []
    for i, k in task.places:
        results.append(measured(plan.studies[i], plan.cases[i][k], store=store))
        founds.append(store.taken() if isinstance(store, Carried) else None)
        tell(((i, k), results[-1]))
    return results, _said(plan, task, also, store), founds


@lru_cache(maxsize=1)
def _plan(packed: bytes) -> Plan:
    """Return the plan again; a worker gets all tasks of one plan one after another."""
    words, choice = pickle.loads(packed)
    return Plan(list(map(study_called, words)), choice)
