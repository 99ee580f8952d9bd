"""The record of single steps, for judges."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SingleSteps:
    """The order of single steps in a component from a place; or why it is unknown.

    exact: True if every step ends where the motion does. floats: True if the last bits of a rule's
    floats explain an order that is too low. refused: True if the rule makes no single step.
    """

    order: float | None = None
    component: str = ""
    step: float = 0.0
    place: str = ""
    exact: bool = False
    floats: bool = False
    seed: int | None = None
    unknown: str = ""
    refused: bool = False
