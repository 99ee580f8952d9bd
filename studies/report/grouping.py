"""Cases by precision and by scene, as figures have them."""

from __future__ import annotations

from collections.abc import Sequence

from .view import Sketch
from .wording import Case


def precisions(cases: Sequence[Case]) -> dict[int, list[Case]]:
    """The cases of each number of digits, fewest digits first."""
    found: dict[int, list[Case]] = {}
    for case in cases:
        found.setdefault(int(case.get("digits") or 16), []).append(case)
    return dict(sorted(found.items()))


def by_scene(cases: Sequence[Case]) -> dict[str, list[Case]]:
    """The cases of each scene, in the order in which they come."""
    found: dict[str, list[Case]] = {}
    for case in cases:
        found.setdefault(str(case.get("scene")), []).append(case)
    return found


def as_above(caption: str, digits: int, before: Sequence[Sketch]) -> str:
    """The caption of the first of several figures; the others refer to it."""
    return f"As above, with {digits} digits." if before else caption
