"""The problem to solve: a scene's exact mathematics with its fingerprint, and its solution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from difflib import get_close_matches
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ..failures import ReferenceFailure, shown
from .result import Solution

if TYPE_CHECKING:
    from ..closed_forms import ClosedForm
    from ..equations import Mechanics


@dataclass(frozen=True)
class Problem:
    """A scene with its mechanics (`equations.Mechanics`); ``key`` is its `fingerprint`."""

    scene: Any
    mechanics: Mechanics
    key: str

    @classmethod
    def of(cls, scene: Any) -> Problem:
        """Return the problem of a scene; raises `ReferenceFailure` if the scene cannot be used."""
        from ..equations import fingerprint, mechanics_of

        mechanics = mechanics_of(scene)
        return cls(scene, mechanics, fingerprint(mechanics))

    @property
    def has_attitude(self) -> bool:
        """True if the groupoid comes from a matrix group."""
        return bool(self.mechanics.structure.basis)

    def form(self) -> ClosedForm | None:
        """Return the closed form that solves it, or None."""
        from ..closed_forms import closed_form_of

        mechanics = self.mechanics
        if mechanics.hamiltonian or mechanics.acting or mechanics.admitted.rows or mechanics.timed:
            return None  # the closed forms are for Lagrangians alone
        return closed_form_of(self.scene, mechanics)

    def with_velocity(self, rows: dict[Fraction, Solution]) -> dict[Fraction, Solution]:
        """Return the solutions with their velocity.

        Those of a Hamiltonian have the momentum in its place, those of a degenerate scene nothing.
        """
        if not (self.mechanics.hamiltonian or self.mechanics.degenerate):
            return rows
        from ..equations import velocity_of

        return {t: replace(row, v=velocity_of(self.mechanics, row)) for t, row in rows.items()}

    def solve(
        self,
        times: list[Fraction],
        digits: int,
        attitude: bool,
        proof: bool = True,
        thorough: bool = False,
    ) -> dict[Fraction, Solution]:
        """Return certified solutions at the times: `certify.certified_integration`."""
        from .certify import certified_integration

        form = self.form()
        return certified_integration(
            self.scene, times, digits, attitude, thorough=thorough, proof=proof, form=form
        )


def scene_of(scene: Any) -> Any:
    """Return the scene itself, or the one of that name."""
    if not isinstance(scene, str):
        if not all(hasattr(scene, part) for part in ("lagrangian", "groupoid", "x0", "v0")):
            raise ReferenceFailure(
                f"{shown(scene)} is no scene; give a Scene or the name of one, such as 'pendulum'"
            )
        if getattr(scene, "contact", None) is not None:
            raise ReferenceFailure(
                f"{scene.name} has contact, and references enclose smooth motions: compare its "
                "runs with smaller steps, or with a closed form"
            )
        return scene
    from discmech.integrators import scenes

    names = list(scenes.names())
    if scene in scenes.every_name():
        return scene_of(scenes.get(scene))
    near = get_close_matches(scene, names, 3)
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(names)}"
    raise ReferenceFailure(f"there is no scene {shown(scene)}: {hint}")
