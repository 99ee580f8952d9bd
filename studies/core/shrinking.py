"""Make a failing case small: the simplest scene and the fewest steps that still fail.

A smaller case counts if the study fails it too, for the same cause, or else in the same words, and
does not fail the midpoint rule there: a scene or a number of steps that fails every method says
nothing about this one. A number of steps that changes nothing, or only makes them longer, is none.
A program that asks no scene for its equations has one motion of its own, and stays on its scene.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.integrators.errors import DiscmechError
from discmech.integrators.scene import Scene

from .case import Case, Choice, Progress
from .fingerprint import of_search
from .one_case import run_case
from .outcome import OF_STEPS, without_figures
from .parts import parts_of
from .plan import Place, Plan
from .records import decoded, encoded
from .result import AnyResult, Smallest
from .side_by_side import key_of
from .store import Store
from .study import Study

#: seconds of processor time; a case that took longer to fail may be tried as long, but no longer
#: than the last: a user waits for it after the verdict, which says what is wrong
LEAST, LONGEST = 1.0, 60.0
MOST_STEPS = 2**20


def shrunk(
    plan: Plan, results: dict[Place, AnyResult], store: Store | None, progress: Progress
) -> dict[Place, AnyResult]:
    """Return the failing results, with the smallest case that fails too: by study and method."""
    groups: dict[tuple[Any, ...], list[Place]] = {}
    for place, case in plan.places():
        study = plan.studies[place[0]]
        if case.rule.is_recorded or "sites" in parts_of(case.scene):  # there is no smaller case
            continue
        if not (case.rule.is_formula or results[place].figures):  # its reason says where
            continue
        if (
            results[place].verdict == "fail"
            and study.of_systems
            and not (case.control or study.alone)
        ):
            groups.setdefault((study.name, case.label, case.digits), []).append(place)
    changed: dict[Place, AnyResult] = {}
    for i, places in enumerate(groups.values()):
        place = min(places, key=lambda p: size(plan.case(p).scene))
        study, case = plan.studies[place[0]], plan.case(place)
        label = f"{study.name}, {case.scene.name} {case.label}: the smallest that fails"
        progress(label, i / len(groups))  # a wait of its own, as long as that for the verdicts
        make = partial(_listed, study, case, results[place])
        key = None if store is None else key_of(study, case)
        if store is not None and key is not None:
            make = partial(store.remembered, "smallest", of_search(study, "smallest", key), make)
        if (small := make()[0]) is not None:
            least = decoded(Smallest, small)
            changed |= {each: replace(results[each], smallest=least) for each in places}
    return changed


def smallest(study: Study, case: Case, result: AnyResult) -> Smallest | None:
    """Return the smallest case found; None if the case is as small already.

    No try begins once they took longer than the case itself, or than `LONGEST`, nor one of a case
    that takes as long as that.
    """
    ends = time.process_time() + min(max(LEAST, result.seconds), LONGEST)
    why = _why(result)

    def fails(tried: Case) -> AnyResult | None:
        """Return the result, if it is a failure of this method and of the same kind."""
        failure = _tried(study, tried)
        if failure is None or bool(failure.figures) != bool(result.figures):
            return None
        usual = discretisations.midpoint
        compared = case.rule is not usual and usual.applies(tried.scene)
        if compared and _tried(study, replace(tried, rule=usual)) is not None:
            return None
        if study.tells_causes:  # another defect may make it fail
            failure = _tried(study, tried, causes=True)
        return failure if failure is not None and _why(failure) == why else None

    def first(candidates: Iterator[Case]) -> tuple[Case, AnyResult] | None:
        for candidate in candidates:
            if time.process_time() > ends:
                return None
            if failure := fails(candidate):
                return candidate, failure
        return None

    small, said = case, result
    if failure := first(_on_simpler_scenes(study, case)):
        small, said = failure
    if (failure := first(_with_fewer_steps(small, said))) and (
        not said.figures or failure[1].figures != said.figures
    ):
        small, said = failure
    whatever, plain = list[str](), small
    for name, value in small.scene.parameters.items():  # each beside those that are 1 already
        if isinstance(value, int | Fraction) and value not in (0, 1):
            tried = replace(plain, scene=plain.scene.with_values(parameters={name: 1}))
            if time.process_time() < ends and said.seconds < LONGEST and fails(tried):
                whatever, plain = [*whatever, name], tried
    if small is case and not whatever:
        return None
    return Smallest(small.scene.name, small.steps, said.command, said.reason, whatever)


def _why(result: AnyResult) -> str:
    """Return the cause of a result without its figures, or else its reason."""
    cause = result.diagnosis
    return without_figures(f"{cause['cause']}: {cause['sentence']}" if cause else result.reason)


def _listed(study: Study, case: Case, result: AnyResult) -> list[Any]:
    """Return the answer of `smallest` in a list, so that a store can tell it from a missing one."""
    return [encoded(smallest(study, case, result))]


def _tried(study: Study, case: Case, causes: bool = False) -> AnyResult | None:
    """Return the result if it is a failure."""
    try:
        result = run_case(study, case, causes=causes)
    except DiscmechError:  # so few steps, or this scene, make no case
        return None
    return result if result.verdict == "fail" and not result.unusable else None


def size(scene: Scene) -> tuple[int, int]:
    """Return the size of a scene: the numbers of its variables and of its parameters."""
    return scene.groupoid.dim_x + scene.groupoid.dim_u, len(scene.parameter_values)


def _on_simpler_scenes(study: Study, case: Case) -> Iterator[Case]:
    """Yield the case on the bench's own scenes that have fewer variables, the fewest first."""
    simpler = [scene for scene in scenes.all_scenes() if size(scene) < size(case.scene)]
    scheme: Any = case.scheme
    own = not case.rule.is_formula and not scheme.flow(case.scene.step).questions()
    if own or not simpler:  # a choice of no scene means all scenes
        return
    choice = Choice(tuple(sorted(simpler, key=size)), (case.rule,), (), (case.digits,), case.steps)
    yield from (candidate for candidate in study.cases(choice) if not candidate.control)


def _with_fewer_steps(case: Case, result: AnyResult) -> Iterator[Case]:
    """Yield the case with 1, 2, 4, ... steps, up to those of the run.

    Of runs to one time fewer steps are longer ones, and where single steps decide no run does.
    """
    if result.why in OF_STEPS or any("steps" in row for row in result.data):
        return
    steps = 1
    while steps < (case.steps or MOST_STEPS):
        yield replace(case, steps=steps)
        steps *= 2
