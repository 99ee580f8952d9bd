"""Single steps for the verdict of the runs, from `studies/evidence`.

A pass needs both. Runs see one trajectory at one final time, where errors may cancel, be hidden by
round-off or not be resolved; single steps see every component at many states, but no run. So steps
of a lower order deny the runs' verdict; and if runs depart from the declared order while steps have
it, another explanation than the method is sought.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

from discmech.reference import surroundings

from ..core.case import Case
from ..core.ended import refuse_ended
from ..core.single_steps import SingleSteps
from ..evidence import NEAR, evidence_of
from ..evidence.measuring import single_steps
from ..evidence.places import Place
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


def measured(case: Case, runs: float | None = None) -> SingleSteps | None:
    """Return the record of single steps, with what the order alone asks of it.

    runs: the order of the runs, which steps from states of the motion have to explain.
    """
    least = case.order or 1
    local = single_steps(case, least=least)
    if local is None or local.unknown:
        return local
    evidence = evidence_of(system_of(case).single_steps())
    local = replace(local, rate=evidence.rate(case.order or 2), linear=evidence.linear)
    if case.rule.effective:
        local = replace(local, effective=evidence.effective)
    lowest: dict[Place, float] = {}
    for c in evidence.order.components:
        if c.place.beside and c.order is not None:
            lowest[c.place] = min(c.order, lowest.get(c.place, c.order))
    # a bump in one part of the states is low at some of these places alone
    low = len(lowest) > 1 and all(order < least - NEAR for order in lowest.values())
    if low and runs is not None and not below(case, runs):
        local = replace(local, on_motion=evidence.on_motion.order)
    return local


def resolved(case: Case, duration: Fraction, first: int) -> tuple[Fraction, int]:
    """Return a ladder (final time, steps of the coarsest run) in which errors of the order are
    small.

    It is the given one, unless its coarsest step is longer than the motion is a polynomial, or
    errors of the declared order would add up to more than the state: then it is shorter, with
    shorter steps. Raises `MotionEnds` where that is so since the motion itself ends, at a collision
    or a pole within the scene's duration, near which no step is short enough.
    """
    evidence = evidence_of(case.scheme)
    local, expected = evidence.order, case.order or 2
    c = None if local.unknown else evidence.rate(expected)
    if c is None:
        return duration, first
    length = min(place.length for place in evidence.places)
    step = duration / first
    grown = float(duration) * c * float(step) ** expected
    if step <= LONGEST * length and grown <= RESOLVED:
        return duration, first
    refuse_ended(case, float(case.scene.duration) / 2)
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
