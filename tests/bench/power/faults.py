"""Faults as data: where, what, a seed.

A fault names a scene, a rule, a site and an operator. What stands at the site is derived once,
changed by the operator and put back (`studies.power.sites` says how, site by site).
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cache
from typing import Any

from discmech.integrators import scenes
from discmech.integrators.numbers import first_violation
from discmech.integrators.scene import Scene

from .operators import OPERATORS, Operator
from .units import in_unit_of_action


class NoPlace(LookupError):
    """The operator finds nothing to change at the site."""


@dataclass(frozen=True)
class Fault:
    """One seeded fault: where it is, what is done, and the seed that chooses the place.

    unit: the scene's action is 10^unit times as large; the slip is made at the same place in each.
    `operator` is a name of `OPERATORS`, or a function of one's own with the same arguments where
    the slip needs `words`.
    """

    scene: str
    rule: str
    site: str
    operator: str | Operator
    seed: int = 0
    words: str = ""
    unit: int = 0

    @property
    def what(self) -> str:
        """What is done, in a few words."""
        return self.words or f"{self.operator} #{self.seed}"

    @property
    def name(self) -> str:
        """How tables call it."""
        return f"{self.scene} {self.rule}: {self.site}, {self.what}"

    def changed(self, value: Any, h: Any) -> Any:
        """A sympy matrix with the fault in it.

        Raises `NoPlace` if the operator finds no place, or if what it makes is the same function.
        """
        new = self.operate(value, h)
        if new == value or (
            new.shape == value.shape and first_violation(new - value, _small(value)) is None
        ):
            raise NoPlace(f"{self.name}: nothing is changed.")
        return new

    def operate(self, value: Any, h: Any) -> Any:
        """What the operator makes of anything; raises `NoPlace` if it finds no place."""
        operator = OPERATORS[self.operator] if isinstance(self.operator, str) else self.operator
        new = operator(value, random.Random(self.name), h)
        if new is None:
            raise NoPlace(f"{self.name}: there is no place for it.")
        return new


def _small(matrix: Any) -> list[Any]:
    """Steps and velocities stay small where functions are compared, so charts are not left."""
    letters = set().union(*(e.free_symbols for e in matrix))
    return [s for s in letters if str(s) == "h" or str(s)[0] in "uvws"]


#: parameters in general position: of 1, a wrong power is none
VALUES = {
    "pendulum": {"mass": "3/2", "length": "4/5", "gravity": "6/5"},
    "kepler": {"strength": "5/4"},
    "rigid-body": {"inertia": ["3/2", 2, 3]},
    "heavy-top": {"inertia": ["3/2", 2, 3], "weight": "5/4"},
}


@cache
def scene_of(name: str, unit: int = 0) -> Scene:
    """The scene with parameters in general position, without what is asked of its attitude.

    unit: as of a fault.

    For the attitude another scheme would be derived; its momentum maps follow from the update of
    μ, which the Casimirs see too.
    """
    scene = scenes.get(name)
    kept = [q for q in scene.symmetries if not q.attitude]
    placed = scene.with_values(symmetries=kept, parameters=VALUES.get(name, {}))
    return in_unit_of_action(placed, unit) if unit else placed
