"""What single steps make of the verdict of the runs: `studies/evidence`.

A pass needs both. Runs see one trajectory at one final time, where errors may cancel, be hidden by
round-off or not be resolved; single steps see every component at many states, but no run. So steps
of a lower order deny what the runs say; and runs that depart from the declared order, where steps
have it, are asked whether something else than the method explains them.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import mpmath
from discmech.reference import surroundings

from ..core.case import Case
from ..evidence import NEAR, Evidence, evidence_of
from ..systems import system_of
from .window import REACHED

#: of the final time's state: errors of the declared order that add up to more at the coarsest step
#: leave no step of a ladder in which they are small
RESOLVED = 20.0
LONGEST = 2  # lengths (`Surroundings.length`) of a coarsest step, as it is
SHORTENED = Fraction(1, 2)  # lengths of a step where the ladder has to be another
FEWEST = 8  # steps of a coarsest run
#: standard deviations of a walk of roundings
WALK = 5


def measured(case: Case) -> dict[str, Any] | None:
    """What single steps say, as it is kept in a measurement; None where they say nothing."""
    try:
        scheme = system_of(case).single_steps()
    except (BadInput, CannotMeasure) as error:
        return {"order": None, "unknown": " ".join(str(error).split())}
    if scheme is None:
        return None
    evidence = evidence_of(scheme)
    found = evidence.order
    if found.unknown:
        return {"order": None, "unknown": found.unknown, "seed": evidence.seed}
    processed = {"effective": vars(evidence.effective)} if case.rule.effective else {}
    told: dict[str, Any] = {
        "order": found.order, "component": found.component, "step": found.step,
        "place": str(found.place or ""), "places": len(evidence.places), "exact": found.exact,
        "seed": evidence.seed, "rate": rate(case, evidence), "linear": evidence.linear,
        **processed,
    }  # fmt: skip
    least = case.order or 1
    if found.order is not None and found.order < least - NEAR:
        floats = evidence.floats(least)
        told["floats"] = {
            "values": list(floats.values), "explain": floats.explain, "size": floats.size,
        }  # fmt: skip
    return told


def rate(case: Case, evidence: Evidence) -> float | None:
    """The c of errors c h^p of a unit of time, relative to the state, p the expected order.

    From the components of that order at the places; None where there is none.
    """
    expected = case.order or 2
    worst = 0.0
    for c in evidence.order.components:
        if c.order is not None and c.constant and abs(c.order - expected) <= NEAR:
            with mpmath.workdps(20):
                size = mpmath.norm([*c.place.x, *c.place.mu], 2)
                worst = max(worst, float(c.constant / size)) if size else worst
    return worst or None


def resolved(case: Case, duration: Fraction, first: int) -> tuple[Fraction, int]:
    """A ladder (final time, steps of the coarsest run) in which errors of the order can be small.

    As it is given, unless its coarsest step is longer than the motion is a polynomial, or errors of
    the declared order would add up to more than the state: then shorter, with shorter steps.
    """
    evidence = evidence_of(case.scheme)
    found, expected = evidence.order, case.order or 2
    c = None if found.unknown else rate(case, evidence)
    if c is None:
        return duration, first
    length = min(place.length for place in evidence.places)
    step = duration / first
    grown = float(duration) * c * float(step) ** expected
    if step <= LONGEST * length and grown <= RESOLVED:
        return duration, first
    step = min(step, SHORTENED * length)
    time = min(float(duration), 1 / (c * float(step) ** expected))
    most = first if case.digits > 16 else math.inf
    steps = int(min(max(FEWEST, time / float(step)), most, 10**6))
    return steps * step, steps


def amplified(case: Case, duration: Fraction, steps: int) -> float | None:
    """What a walk of so many roundings of doubles may come to at the end, relative to the state.

    By the motion's own conditioning: what it makes of a relative change of its start. None where a
    rough integration does not reach the end.
    """
    grown = surroundings(case.scene).conditioning(duration)
    return None if grown is None else WALK * grown * 2.0**-53 * math.sqrt(steps)


def below(case: Case, found: dict[str, Any]) -> bool:
    """Whether the runs' order is below the expected one by more than its tolerance."""
    order, wanted = found["measured"]["order"], case.order
    return order is not None and wanted is not None and order < wanted - REACHED[case.digits == 16]
