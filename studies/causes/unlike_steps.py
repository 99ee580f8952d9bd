"""Steps of a run that are not alike: each tenth of them is another than those beside it.

A single step from a place is the first of its run, and shows no fault that comes with a count.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import DiscmechError
from discmech.integrators.numbers import Vector

from ..core.case import Case
from ..evidence import evidence_of
from ..evidence.isolated import UNLIKE, errors_of_steps, name_of
from ..evidence.scan import run_of, steps_of
from .first_terms import Told

#: the steps of a run that are looked at, of which one in `LONGEST` is seen three times
STEPS = 128
LONGEST = STEPS // 3 - 1
#: an error so many times the lower quartile of those of `BESIDE` steps before and after it is no
#: change along the motion, where the constant of a method changes by less than a third in a step
#: (`evidence.rows`); a quartile is that of a sound step also where each second one is another
CLEARLY, BESIDE = 8, 5


def of_event(case: Case) -> dict[str, Any] | None:
    """Return {"cause", "sentence", "evidence"} of an order that is that of `isolated` steps."""
    local = evidence_of(case.scheme).order
    if local.place is None or UNLIKE not in local.component:
        return None
    name, time = local.component.partition(" ")[0], float(local.place.t)
    if _is_another(case.scheme, local.place.t):
        said = (
            f"the step at t = {time:.4g} is wrong in {name}, those before and after it are right, "
            "and in the same run, made again, it is right: look for what is done by a count "
            "of the calls, or by chance."
        )
        return {"cause": "unlike steps", "sentence": said, "evidence": {"time": time}}
    said = (
        f"the step at t = {time:.4g} is wrong in {name}, and those before and after it are right: "
        "look for what is done where something is crossed, or changes its sign; each run has such "
        "steps, however short they are."
    )
    return {"cause": "event", "sentence": said, "evidence": {"time": time}}


def _is_another(scheme: Any, time: Fraction) -> bool:
    """True if in the same run, made again, that step is as those beside it: no event's is."""
    run = run_of.__wrapped__(scheme, steps_of(scheme))  # not the one that is kept
    k = round(time / run.step)
    at = np.arange(max(0, k - BESIDE), min(len(run.t) - 1, k + BESIDE + 1))
    off = errors_of_steps(scheme, run, at)[0].max(axis=1)
    return not off[at == k].max(initial=0.0) > CLEARLY * np.quantile(off, 0.25)


def of_unlike_steps(case: Case) -> Told | None:
    """Return the cause of steps that are wrong at each so many-th step of a run, or None."""
    scheme: Any = case.scheme
    try:
        flow = scheme.flow(case.scene.step)
        run = flow.trajectory(STEPS)
        gaps, _ = errors_of_steps(scheme, run, np.arange(STEPS))
    except (DiscmechError, reference.ReferenceFailure):
        return None
    off = gaps.max(axis=1)
    usual = np.array([np.quantile(off[max(0, k - BESIDE) : k + BESIDE + 1], 0.25)
                      for k in range(STEPS)])  # fmt: skip
    wrong = np.flatnonzero(off > CLEARLY * usual)
    if not (period := _period(wrong)):
        return None
    k = wrong[int(off[wrong].argmax())]
    entry = int(gaps[k].argmax())
    name = name_of(entry, run)
    return "unlike steps", (
        f"one step in {period} of a run is another than those beside it: step {k + 1} is off by "
        f"{off[k]:.1g} of the motion in {name}, where they are off by {usual[k]:.1g}; look for "
        "what is done, or left out, by a count of the steps, such as a force that is not computed "
        "anew."
    )


def _period(wrong: Vector) -> int:
    """Return the number of steps after which wrong ones come again, each time; 0 for none."""
    first = [int(k) for k in wrong if k and k - 1 not in wrong]  # those in a row count as one
    gaps = set(np.diff(first))
    return int(gaps.pop()) if len(first) > 2 and len(gaps) == 1 and first[0] <= LONGEST else 0
