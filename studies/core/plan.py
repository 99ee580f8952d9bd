"""The plan of a run: the cases of some studies, and their tasks, one per scheme."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from discmech.integrators import Scene

from .case import Case, Choice
from .study import Study

Place = tuple[int, int]  # study, case

MANY = 16  # unknowns; for a dense chain of 32 the forms at 50 digits take 12 s, a run 5 s


@dataclass(frozen=True)
class Task:
    """All the work with one scheme: its cases, and its place among the chosen pairs.

    Or all cases that are compared with each other: a race, which is no pair.
    """

    places: tuple[Place, ...]
    pair: int | None


class Plan:
    """The cases of some studies, and the tasks that they make."""

    def __init__(self, studies: Sequence[Study], choice: Choice) -> None:
        self.studies, self.choice = studies, choice
        self.cases = [list(study.cases(choice)) for study in studies]
        self.pairs = list(choice.pairs())

    @classmethod
    def of_those_that_apply(cls, studies: Sequence[Study], choice: Choice) -> Plan:
        """Return the plan without the studies that have no case."""
        plan = cls(studies, choice)
        pairs = [(s, c) for s, c in zip(plan.studies, plan.cases, strict=True) if c]
        plan.studies, plan.cases = [s for s, _ in pairs], [c for _, c in pairs]
        return plan

    def case(self, place: Place) -> Case:
        """Return the case at a place."""
        return self.cases[place[0]][place[1]]

    def places(self) -> Iterator[tuple[Place, Case]]:
        """Yield every case with its place."""
        for i, cases in enumerate(self.cases):
            for k, case in enumerate(cases):
                yield (i, k), case

    def tasks(self, done: set[Place], answered: set[int], elsewhere: bool = False) -> list[Task]:
        """Return the remaining cases of studies that may run side by side, one task per scheme or
        race.

        answered: the pairs without other open questions. elsewhere: on other machines, whose times
        are not wanted. In a race all are disturbed alike by other processes.
        """
        groups: dict[Any, list[Place]] = {}
        pairs: dict[Any, int] = {
            (id(scene), rule.name): i
            for i, (scene, rule) in enumerate(self.pairs)
            if i not in answered
        }  # keys are objects of this plan, so ids are names
        for key in pairs:
            groups[key] = []
        for place, case in self.places():
            study = self.studies[place[0]]
            whole = study.together(case)
            if place in done or (study.timed(case) and (whole is None or elsewhere)):
                continue
            key = (id(case.scene), case.rule.name) if whole is None else id(whole)
            groups.setdefault(key, []).append(place)
        for places in groups.values():
            places.sort(key=self._turn)
        return [Task(tuple(places), pairs.get(key)) for key, places in groups.items()]

    def _turn(self, place: Place) -> tuple[bool, bool, int]:
        """Return the rank of a case: cases that wait for a reference last, those without compiling
        first.

        So verdicts come soon. With many unknowns compiled runs come first: matrices of many digits
        take longer. Runs of a million steps for momentum and energy are the same, and next to each
        other.
        """
        turn, case = self.studies[place[0]].turn, self.case(place)
        return turn > 1, (case.digits == 16) != (case.scene.groupoid.dim_u >= MANY), turn

    def scene(self, task: Task) -> Scene:
        """Return the scene of a task."""
        return self.case(task.places[0]).scene if task.pair is None else self.pairs[task.pair][0]

    def spread(self, tasks: Sequence[Task]) -> list[Task]:
        """Return the tasks in an order for several workers: a short one, then those of many cases
        first.

        With equal numbers of cases the large scenes come first. So no worker is left with a long
        task at the end, and schemes of one scene are far apart: the values that one worker computes
        for the scene are there for the next.
        """
        scenes = [self.scene(task) for task in tasks]
        turns: Counter[Scene] = Counter()
        keys = []
        for k, (task, scene) in enumerate(zip(tasks, scenes, strict=True)):
            size = scene.groupoid.dim_x + scene.groupoid.dim_u
            keys.append((turns[scene], -len(task.places), -size, k))
            turns[scene] += 1
        *rest, short = [tasks[k] for *_, k in sorted(keys)]
        return [short, *rest]
