"""The consistency of single steps, which studies that a rule of any order passes demand."""

from __future__ import annotations

from dataclasses import replace

from discmech.integrators import Scheme
from discmech.integrators.errors import DiscmechError, Displaced
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..core.single_steps import SingleSteps
from ..systems import system_of
from . import NEAR, LocalOrder, evidence_of

#: the key of the consistency in a measurement
CONSISTENCY = "consistency"


def consistency_of(case: Case, least: int | None = 1) -> SingleSteps | None:
    """Return the order of a case's single steps, which `demand_consistency` judges, or None.

    Controls are judged by being caught, and a recorded run makes no single steps. Of a program only
    components whose orders have settled count. Raises `Displaced` for a program whose answers begin
    elsewhere than at their start.
    """
    if case.control is not None or case.rule.is_recorded:
        return None
    try:
        scheme = system_of(case).single_steps()
        return (
            None if scheme is None else of_evidence(scheme, least, settled=not case.rule.is_formula)
        )
    except Displaced:
        raise
    except (ReferenceFailure, DiscmechError) as failure:
        return SingleSteps(unknown=" ".join(str(failure).split()))


def of_evidence(scheme: Scheme, least: int | None = None, settled: bool = False) -> SingleSteps:
    """Return the order of the single steps of a scheme.

    least: the order below which it is too low; the declared one if None. settled: True to count
    only components whose errors sink as one power of the step. floats: whether the last bits of a
    rule's floats explain an order that is too low, which doubles do not show.
    """
    evidence = evidence_of(scheme)
    found = _settled(evidence.order) if settled else evidence.order
    if found.unknown:
        return SingleSteps(seed=evidence.seed, unknown=found.unknown, refused=found.refused)
    least = least or scheme.order or 1
    low = found.order is not None and found.order < least - NEAR
    floats = low and evidence.floats(least).explain
    place = str(found.place or "")
    return SingleSteps(
        found.order, found.component, found.step, place, found.exact, floats, evidence.seed
    )


def _settled(found: LocalOrder) -> LocalOrder:
    """Return the lowest of the component orders that have a constant: the others are noise."""
    known = [c for c in found.components if c.order is not None and c.constant is not None]
    lowest = min(known, key=lambda c: c.order or 0.0, default=None)
    if lowest is None:
        return replace(found, order=None, unknown=found.unknown or "no error of a step settles")
    return replace(found, order=lowest.order, component=lowest.name, place=lowest.place)
