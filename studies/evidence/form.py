"""Judge whether single steps keep the form: ordinary steps from the places, far below doubles.

A run of one trajectory sees the form only on that trajectory, and on its symmetry planes.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import Flow, form_change_defects, restricted_form_defect

from .places import Place, steps_from

DIGITS = 30  # digits of the states; defects are evaluated to twice as many
#: a defect that exceeds round-off of twice the digits: its zeros are known to √ε² (`defects`)
LIMIT = 10.0 ** (5 - DIGITS)
TRIES = 4  # how many ever shorter steps are tried from a place where no step is found


@dataclass(frozen=True)
class FormDefect:
    """The defect of one step in the form that it has to keep, relative to its absolute terms.

    kind: "poisson" (on the dual; under constraints, on the part that they leave free) or "change"
    (a force's change of the form, beside that of its one-form). step: the step with this defect.
    """

    kind: str
    defect: float
    place: Place
    step: float


@dataclass(frozen=True)
class FormEvidence:
    """The defects at all places; limit: the most that round-off may leave in one.

    unknown: one sentence why there is no evidence; empty if there is some.
    """

    defects: tuple[FormDefect, ...]
    limit: float = LIMIT
    unknown: str = ""

    @property
    def worst(self) -> FormDefect | None:
        """Return the largest defect; one that is not a number counts as the largest."""
        return max(self.defects, key=lambda d: (d.defect != d.defect, d.defect), default=None)

    @property
    def broken(self) -> FormDefect | None:
        """Return the largest defect if it exceeds round-off, otherwise None."""
        worst = self.worst
        return worst if worst is not None and not worst.defect <= self.limit else None


def form_of(scheme: Scheme, places: Sequence[Place], seed: int) -> FormEvidence:
    """Return the defects at the places; none under constraints that keep no form."""
    if reason := scheme.scene.no_form:
        return FormEvidence((), unknown=f"{reason}.")
    if not scheme.rule.is_formula:
        return FormEvidence((), unknown="a program has no derivative but by differences.")
    drawn, found, why = random.Random(seed + 1), list[FormDefect](), ""
    for place in places:
        for step in islice(steps_from(place, drawn), TRIES):
            try:
                found.append(_defect(scheme.flow(step, DIGITS), place))
                break
            except StepFailure as failure:  # this step is too long: a shorter one may be found
                why = " ".join(str(failure).split())
            except CannotMeasure as refusal:
                return FormEvidence((), unknown=" ".join(str(refusal).split()))
    return FormEvidence(tuple(found), unknown="" if found else why)


def _defect(flow: Flow, place: Place) -> FormDefect:
    scene, s = flow.scheme.scene, flow.scheme.s
    x: Any = s.with_time(place.x, place.t)
    at = x, place.mu, place.u
    kind = "change" if scene.force is not None else "poisson"
    if scene.all_constraints:
        found = restricted_form_defect(flow, *at, forced=scene.force is not None)
    elif scene.force is not None:
        found = form_change_defects(flow, *at)[0]
    else:
        found = flow.poisson_defect(x, place.mu, u0=place.u)
    return FormDefect(kind, float(found), place, float(flow.step))
