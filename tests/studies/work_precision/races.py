"""Races for the tests: of the scipy methods, and what a race is made of."""

from __future__ import annotations

import itertools
from typing import Any
from unittest.mock import patch

from discmech.integrators import Scene, scenes
from discmech.integrators.rules import BUILT_IN
from discmech.studies import get
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.core.result import result_of
from discmech.studies.core.store import Store
from discmech.studies.report import tables
from discmech.studies.work_precision import contest, measuring, racing
from discmech.studies.work_precision.contestants import Problem
from discmech.studies.work_precision.peers.equations import equations_of
from tests.studies.as_json import run_study

SCIPY = ("DOP853", "Radau", "LSODA")


def choice(name: str, peers: tuple[str, ...] = SCIPY, **more: Any) -> Choice:
    """A scene with these peers; periods is an option of the study's own."""
    own = [("peer", peers), *((k, more.pop(k)) for k in ("periods",) if k in more)]
    return Choice(scenes=(scenes.get(name),), own=tuple(own), **more)


def race(name: str, store: Store | None = None, **more: Any) -> dict[str, dict[str, Any]]:
    """The cases of a race by the names of the methods.

    Each run takes a second by a made clock, so that ladders end in the same place on a busy
    machine: a verdict is one of the method.
    """
    clock = itertools.count()
    with (
        patch.object(contest, "fine_clock", lambda: lambda: next(clock)),
        patch.object(racing, "MOST", racing.LEAST),
        patch.object(contest, "TALL", 1),  # by that clock the dearest runs are as cheap as others
        patch.multiple(measuring, BUDGET=8 * racing.LEAST, LONG_BUDGET=8 * racing.LEAST),
    ):
        found = run_study(get("work-precision"), choice(name, **more), store=store)
    return {case["rule"]: case for case in found["cases"]}


def shown(column: str, given: dict[str, Any]) -> str:
    """The words of a case in a column of the table."""
    return dict(tables.columns("work-precision"))[column](result_of("work-precision", given))


def race_on(scene: Scene, times: int = 1, **more: Any) -> tuple[Problem, Any]:
    """(problem, equations) of a scene over so many times its duration."""
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), times * scene.duration, **more)
    return problem, equations_of(problem.scheme)
