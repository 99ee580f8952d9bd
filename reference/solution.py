"""solution(scene, t): a closed form where one applies, the Taylor integrator elsewhere.

Agreement is measured relative to the largest component of a block (base, velocity, momentum,
attitude), at the start or at t, whichever is larger: a component that passes through zero does not
count as a loss. Numbers of a scene are exact; a float t is its exact binary value.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from typing import Any

from .exact import exact_time, parameter_values
from .failures import ReferenceFailure
from .result import Solution

_known: dict[tuple[Any, ...], dict[Fraction, Solution]] = {}


def solution(scene: Any, t: Any, digits: int = 50, attitude: bool = False) -> Solution:
    """The reference of a scene (or of the scene of that name) at time t.

    t is an int, Fraction, float (its exact binary value) or decimal string; negative t runs
    backwards. ``certain_digits`` is ``digits`` unless the result could not be certified.
    """
    return solutions(scene, [t], digits, attitude)[0]


def solutions(
    scene: Any, times: Iterable[Any], digits: int = 50, attitude: bool = False
) -> list[Solution]:
    """The references at several times, computed in one sweep and kept for later calls."""
    if isinstance(digits, bool) or not isinstance(digits, int) or digits < 1:
        raise ReferenceFailure(f"digits={digits!r} is no positive whole number; ask for e.g. 50")
    exact_times = [exact_time(t) for t in times]
    problem = Problem.of(_scene(scene), attitude)
    found = _known.setdefault((*problem.key, attitude, digits), {})
    missing = sorted(set(exact_times) - set(found))
    if missing:
        found.update(problem.solve(missing, digits))
    return [found[t] for t in exact_times]


def forget() -> None:
    """Empty the memory of solutions computed in this process."""
    _known.clear()


@dataclass(frozen=True)
class Problem:
    """What is to be solved, and a key made of its exact content."""

    scene: Any
    attitude: bool
    key: tuple[Any, ...]
    form: Any

    @classmethod
    def of(cls, scene: Any, attitude: bool) -> Problem:
        import sympy

        from .algebroid import algebroid_of
        from .closed_forms import closed_form_of
        from .equations import base_and_velocity, exact_lagrangian, exact_start

        x, v = base_and_velocity(scene)
        lagrangian = exact_lagrangian(scene, x, v)
        start = exact_start(scene)
        structure = algebroid_of(scene, x)
        key = (
            scene.name,
            sympy.srepr(lagrangian),
            sympy.srepr(start),
            sympy.srepr(structure.rho),
            tuple((*index, sympy.srepr(c)) for index, c in sorted(structure.constants.items())),
            tuple(map(sympy.srepr, structure.basis)),
        )
        if attitude and not structure.basis:
            raise ReferenceFailure(
                f"scene {scene.name} lives on a {scene.groupoid.kind} groupoid, which has no "
                "attitude; ask with attitude=False"
            )
        form = closed_form_of(
            scene, x, v, lagrangian, structure, parameter_values(scene), start, attitude
        )
        return cls(scene, attitude, key, form)

    def solve(self, times: list[Fraction], digits: int) -> dict[Fraction, Solution]:
        """Certified solutions at the times."""
        from .certify import certified_closed_form, certified_integration

        if self.form is not None:
            return certified_closed_form(self.scene, self.form, times, digits, self.attitude)
        return certified_integration(self.scene, times, digits, self.attitude)


def _scene(scene: Any) -> Any:
    """The scene itself, or the one of that name."""
    if not isinstance(scene, str):
        if not all(hasattr(scene, part) for part in ("lagrangian", "groupoid", "x0", "v0")):
            raise ReferenceFailure(
                f"{scene!r} is no scene; give a Scene or the name of one, such as 'pendulum'"
            )
        return scene
    from integrators import scenes

    names = list(scenes.names())
    if scene in names:
        return scenes.get(scene)
    near = get_close_matches(scene, names, 3)
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(names)}"
    raise ReferenceFailure(f"there is no scene {scene!r}: {hint}")
