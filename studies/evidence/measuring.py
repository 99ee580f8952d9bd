"""The record of a case's single steps: their order, and their largest departure from each law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.errors import DiscmechError, Displaced
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..core.single_steps import Departure, SingleSteps
from ..systems import system_of
from ..systems.runs import flights
from . import NEAR, Evidence, LocalOrder, evidence_of
from .integrals import check_first_integrals
from .late import late_steps
from .laws import AGAIN, ARROW, ENERGY, ROUNDINGS, Law
from .rows import energy_by_row, of_rows


def single_steps(
    case: Case, *laws: Law, least: int | None = None, run: Any = None
) -> SingleSteps | None:
    """Return the record of a case's single steps, or None for a system that makes none.

    run: one under contact, between whose impacts steps are asked: of its longest flights, the one
    that tells most against the rule.

    least: the order below which it is too low; without one only consistency is asked, and of a
    program only components whose errors sink as one power of the step count. The steps of recorded
    runs are those from row to row. Raises `Displaced` for a program whose answers begin elsewhere
    than at their start, `BadInput` for a declared first integral that is none.
    """
    if case.rule.is_recorded:
        runs: Any = case.scheme
        record = of_rows(runs)
        by_row = {law.name: energy_by_row(runs, ROUNDINGS) for law in laws
                  if law in ENERGY.values()}  # fmt: skip
        return replace(record or SingleSteps(), laws=by_row) if by_row else record
    parts = None if run is None else list(map(case.scheme_on, flights(case.scene, run)))
    check_first_integrals(parts[0] if parts else case.scheme)
    try:
        scheme = system_of(case).single_steps()
        if scheme is None:
            return None
        settled = least is None and not scheme.rule.is_formula
        records = [of_scheme(each, *laws, least=least or 1, settled=settled)
                   for each in parts or [scheme]]  # fmt: skip
        return min(records, key=_soundness)
    except Displaced:
        raise
    except (ReferenceFailure, DiscmechError) as failure:
        return SingleSteps(unknown=" ".join(str(failure).split()))


def _soundness(record: SingleSteps) -> tuple[bool, float]:
    """Return what is least for the record that tells most against a rule."""
    broken = any(law.broken for law in record.laws.values())
    return not broken, math.inf if record.order is None else record.order


def of_scheme(
    scheme: Scheme, *laws: Law, least: int | None = None, settled: bool = False
) -> SingleSteps:
    """Return the record of the single steps of a scheme.

    least: the order below which it is too low; the declared one if None. settled: True to count
    only components whose errors sink as one power of the step.
    """
    evidence = evidence_of(scheme)
    order = _settled(evidence.order) if settled else evidence.order
    told = SingleSteps(
        order.order, order.component, order.step, str(order.place or ""), seed=evidence.seed,
        exact=order.exact, unknown=order.unknown, refused=order.refused,
    )  # fmt: skip
    if order.floor is not None:
        told = replace(told, floor=str(order.floor), share=order.floor.share)
    if not order.unknown:
        around, sizes = evidence.around
        told = replace(told, places=len(evidence.places), unscanned=evidence.unscanned,
                       around=around, sizes=sizes)  # fmt: skip
    least = least or scheme.order or 1
    if order.order is not None and order.order < least - NEAR:
        floats, lower = evidence.floats(least)
        order = lower or order
        told = replace(told, order=order.order, component=order.component, step=order.step,
                       floats=floats)  # fmt: skip
    always = [law for law in (AGAIN, ARROW) if not law.refusal(scheme)]
    told = replace(told, laws=_departures(evidence, (*laws, *always)))
    again = told.laws.get(AGAIN.name)
    if again is None or again.broken or (late := late_steps(scheme)) is None:
        return told
    if late.size is None and not late.unknown:
        late = replace(again, asked=late.asked * (not again.unknown))
    return replace(told, laws={**told.laws, AGAIN.name: late})


def _departures(evidence: Evidence, laws: Sequence[Law]) -> dict[str, Departure]:
    """Return the largest departure from each law; why it is unknown where there are no places."""
    try:
        return {law.name: evidence.departure(law) for law in laws}
    except ReferenceFailure as failure:
        return {law.name: Departure(unknown=" ".join(str(failure).split())) for law in laws}


def _settled(order: LocalOrder) -> LocalOrder:
    """Return the lowest of the component orders that have a constant: the others are noise."""
    known = [c for c in order.components if c.order is not None and c.constant is not None]
    lowest = min(known, key=lambda c: c.order or 0.0, default=None)
    if lowest is None:
        return replace(order, order=None, unknown=order.unknown or "no error of a step settles")
    return replace(order, order=lowest.order, component=lowest.name, place=lowest.place)
