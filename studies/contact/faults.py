"""Faulty contacts, which the study has to catch: each breaks one of the laws of a step."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech.integrators.extensions.contact import ContactFlow, Gaps

from . import MISSED, STICKS, WRONG_SIGN

#: the scene on which each control runs, and its values
CONTROLS: dict[str, tuple[str, dict[str, Any]]] = {
    STICKS: ("beads", {"restitution": 0}),
    WRONG_SIGN: ("sliding-block", {}),
    MISSED: ("bouncing-ball", {}),
}


class Sticking(Gaps):
    """Gaps that stay closed, by impulses of either sign."""

    def impulses(self, W: np.ndarray, U0: np.ndarray, cones: Any, start: np.ndarray) -> np.ndarray:
        return self.numbers.solve(W, -U0)


class PushingOn(Gaps):
    """Gaps with friction along the slip, of its full size."""

    against = -1

    def impulses(self, W: np.ndarray, U0: np.ndarray, cones: Any, start: np.ndarray) -> np.ndarray:
        P = super().impulses(W, U0, cones, start)
        for plane, _ in cones.planes.values():
            P[plane] = -P[plane]
        return P


class Overlooking(Gaps):
    """Gaps that are never found to close."""

    def phi(self, rows: np.ndarray) -> np.ndarray:
        return super().phi(rows) * 0 + 1

    @property
    def bounds(self) -> Any:
        return SimpleNamespace(open=lambda rows: np.ones(len(rows) - 1, dtype=bool))


def flow_with(control: str, scheme: Any, step: Any, digits: int) -> ContactFlow:
    """Return the flow of a scheme with a faulty contact."""
    flow = ContactFlow(scheme, step, digits, "refuse", scheme.flow_substeps)
    kinds = {STICKS: Sticking, WRONG_SIGN: PushingOn, MISSED: Overlooking}
    flow.gaps_kind = kinds[control]
    return flow
