"""Whether single steps keep the form: ordinary steps from the places, evaluated far below doubles.

A run of one trajectory sees the form on that trajectory only, and on the planes of its symmetry.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import (
    Flow,
    form_change_defects,
    restricted_form_defect,
)

from .places import Place, steps_from

DIGITS = 30  # of the states; defects are evaluated to twice as many
#: a defect that is more than round-off of twice the digits: its zeros are known to √ε² (`defects`)
LIMIT = 10.0 ** (5 - DIGITS)
TRIES = 4  # ever shorter steps from a place where a step is not found


@dataclass(frozen=True)
class FormDefect:
    """How far one step is from keeping what it has to keep, relative to its absolute terms.

    kind: "poisson" (on the dual; under constraints, what they leave of it) or "change" (what a
    force does to the form, beside what its one-form says). step: that of this defect.
    """

    kind: str
    defect: float
    place: Place
    step: float


@dataclass(frozen=True)
class FormEvidence:
    """The defects at all places; limit: what round-off may leave of one.

    kept: why no form need be kept, a sentence; empty where one is. unknown: why there is no
    evidence, a sentence; empty where there is some.
    """

    defects: tuple[FormDefect, ...]
    limit: float = LIMIT
    unknown: str = ""

    @property
    def worst(self) -> FormDefect | None:
        """The largest defect; what is not a number is larger than any."""
        return max(self.defects, key=lambda d: (d.defect != d.defect, d.defect), default=None)

    @property
    def broken(self) -> FormDefect | None:
        """The largest defect, where it is more than round-off."""
        worst = self.worst
        return worst if worst is not None and not worst.defect <= self.limit else None


def form_of(scheme: Scheme, places: Sequence[Place], seed: int) -> FormEvidence:
    """The defects at the places; of a nonholonomic scene none, for no form is kept there."""
    if scheme.scene.nonholonomic is not None:
        return FormEvidence((), unknown="nonholonomic: no form need be kept.")
    if not scheme.rule.is_formula:
        return FormEvidence((), unknown="a program has no derivative but by differences.")
    drawn, found, why = random.Random(seed + 1), list[FormDefect](), ""
    for place in places:
        for step in islice(steps_from(place, drawn), TRIES):
            try:
                found.append(_defect(scheme.flow(step, DIGITS), place))
                break
            except StepFailure as failure:  # at so long a step: a shorter one may be found
                why = " ".join(str(failure).split())
            except CannotMeasure as refusal:
                return FormEvidence((), unknown=" ".join(str(refusal).split()))
    return FormEvidence(tuple(found), unknown="" if found else why)


def _defect(flow: Flow, place: Place) -> FormDefect:
    scene, s = flow.scheme.scene, flow.scheme.s
    x: Any = s.with_time(place.x, place.t)
    at = x, place.mu, place.u
    kind = "change" if scene.force is not None else "poisson"
    if scene.constrained:
        found = restricted_form_defect(flow, *at, forced=scene.force is not None)
    elif scene.force is not None:
        found = form_change_defects(flow, *at)[0]
    else:
        found = flow.poisson_defect(x, place.mu, u0=place.u)
    return FormDefect(kind, float(found), place, float(flow.step))
