"""Measured results for the tests of the studies, each made once in a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import cache, partial
from typing import Any

import pytest

from discmech.integrators import Scene, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.studies import NAMES, every_study, get
from discmech.studies.core import lookup
from discmech.studies.core.case import Case, Progress
from tests.objects import EXPENSIVE, TURN
from tests.studies.as_json import run_case

BUILT_IN = [
    (s, r)
    for s in scenes.names()
    for r, rule in {**discretisations.BUILT_IN, "own": discretisations.own}.items()
    if rule.applies(scenes.get(s))
]
#: each scene with one rule, the rules in turn: every rule meets every kind of groupoid
PAIRWISE = [
    *((s, TURN[s]) for s in scenes.names() if s in TURN and s not in EXPENSIVE),
    ("fpu", "imex"),
]
#: (scene, steps): the smallest case of each study that says something
SMALL = {study.name: study.example for study in every_study().values() if study.usual}


def charts_slowly(study):
    """A study's name as a parameter: charts takes ten seconds and more."""
    return pytest.param(study, marks=pytest.mark.slow if study == "charts" else ())


def case(
    study: str,
    scene: str | Scene,
    rule: str | Discretisation = "midpoint",
    digits: int = 16,
    steps: int | None = None,
    control: str | None = None,
) -> Case:
    return Case(
        study, lookup.scene_given(scene),
        discretisations.get(rule) if isinstance(rule, str) else rule, digits, steps, control,
    )  # fmt: skip


def measured(study: str, *arguments: Any, **more: Any) -> dict[str, Any]:
    """One case measured and judged, without looking for causes; arguments as those of `case`."""
    return run_case(get(study), case(study, *arguments, **more), causes=False)


result = cache(measured)


@contextmanager
def measured_once() -> Iterator[None]:
    """Within it each case is measured once in a process, whoever asks for it by its command."""
    with pytest.MonkeyPatch.context() as patch:
        for name in NAMES:
            patch.setattr(
                get(name).measuring, "measure", partial(_remembered, get(name).measuring.measure)
            )
        yield


def _remembered(measure: Callable[..., Any], case: Case, progress: Progress) -> Any:
    key = case.study, case.label, case.command
    if key not in _MEASURED:
        _MEASURED[key] = measure(case, progress)
    return deepcopy(_MEASURED[key])


_MEASURED: dict[tuple[str, ...], Any] = {}
