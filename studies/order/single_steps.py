"""Single steps for the verdict of the runs, from `studies/evidence`.

A pass needs both. Runs see one trajectory at one final time, where errors may cancel, be hidden by
round-off or not be resolved; single steps see every component at many states, but no run. So steps
of a lower order deny the runs' verdict; and if runs depart from the declared order while steps have
it, another explanation than the method is sought.
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

#: share of the final state: errors of the declared order that add up to more at the coarsest step
#: are small at no step of a ladder
RESOLVED = 20.0
LONGEST = 2  # lengths (`Surroundings.length`) of a coarsest step that is used as given
SHORTENED = Fraction(1, 2)  # lengths of a step if the ladder has to be another
FEWEST = 8  # fewest steps of a coarsest run
#: standard deviations of a walk of roundings
WALK = 5


def measured(case: Case, runs: float | None = None) -> dict[str, Any] | None:
    """Return the result of single steps for a measurement; None if there is none.

    runs: the order of the runs, which steps from states of the motion have to explain.
    """
    try:
        scheme = system_of(case).single_steps()
    except (BadInput, CannotMeasure) as error:
        return {"order": None, "unknown": " ".join(str(error).split())}
    if scheme is None:
        return None
    evidence = evidence_of(scheme)
    found = evidence.order
    own = {} if found.floor is None else {"floor": str(found.floor), "share": found.floor.share}
    if found.unknown:
        return {"order": None, "unknown": found.unknown, "seed": evidence.seed, **own}
    processed = {"effective": vars(evidence.effective)} if case.rule.effective else {}
    told: dict[str, Any] = {
        "order": found.order, "component": found.component, "step": found.step,
        "place": str(found.place or ""), "places": len(evidence.places), "exact": found.exact,
        "seed": evidence.seed, "rate": rate(case, evidence), "linear": evidence.linear,
        **processed, **own,
    }  # fmt: skip
    least = case.order or 1
    if found.order is not None and found.order < least - NEAR:
        floats = evidence.floats(least)
        told["floats"] = {
            "values": list(floats.values), "explain": floats.explain, "size": floats.size,
        }  # fmt: skip
        if runs is not None and not below(case, runs):
            told["on_motion"] = evidence.on_motion.order
    return told


def rate(case: Case, evidence: Evidence) -> float | None:
    """Return c of the errors c h^p per unit of time, relative to the state, p the expected order.

    It comes from the components of that order at the places; None without any.
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
    """Return a ladder (final time, steps of the coarsest run) in which errors of the order are
    small.

    It is the given one, unless its coarsest step is longer than the motion is a polynomial, or
    errors of the declared order would add up to more than the state: then it is shorter, with
    shorter steps.
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
    """Return the effect at the end of a walk of so many roundings, relative to the state.

    It follows from the motion's own conditioning: the growth of a relative change of its start.
    None if a rough integration does not reach the end.
    """
    grown = surroundings(case.scene).conditioning(duration)
    return None if grown is None else WALK * grown * 2.0**-53 * math.sqrt(steps)


def below(case: Case, order: float) -> bool:
    """True if the runs' order is below the expected one by more than its tolerance."""
    wanted = case.order
    return wanted is not None and order < wanted - REACHED[case.digits == 16]
