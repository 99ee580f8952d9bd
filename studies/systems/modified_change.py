"""The change of a modified energy along a run, as a record."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Change:
    """The change of the energy and of the modified energy from the start to a state of a run.

    bound, round_off: the error of the modified energy's. walk: what round-off adds on the way.
    path, form: what another state, or another form that is kept, may explain.
    """

    time: float = 0.0
    energy: float = 0.0
    modified: float = 0.0
    bound: float = 0.0
    round_off: float = 0.0
    walk: float = 0.0
    path: float = 0.0
    form: float = 0.0
