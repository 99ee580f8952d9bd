"""Measured results for the tests of the studies, each made once in a process."""

from __future__ import annotations

from functools import cache
from typing import Any

from discmech.integrators import Scene, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.studies import get
from discmech.studies.case import Case
from discmech.studies.running import run_case
from tests.objects import EXPENSIVE, TURN

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


def case(
    study: str,
    scene: str | Scene,
    rule: str | Discretisation = "midpoint",
    digits: int = 16,
    steps: int | None = None,
    control: str | None = None,
) -> Case:
    return Case(
        study,
        scenes.get(scene) if isinstance(scene, str) else scene,
        discretisations.get(rule) if isinstance(rule, str) else rule,
        digits,
        steps,
        control,
    )


@cache
def result(study: str, *arguments: Any, **more: Any) -> dict[str, Any]:
    """One case measured and judged; arguments as those of `case`."""
    return run_case(get(study), case(study, *arguments, **more))
