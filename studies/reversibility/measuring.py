"""Self-adjointness of a method as numbers: Φ₋ₕ after Φₕ, which is the identity for such a method.

`assert_reversible` measures it too.
"""

from __future__ import annotations

import random
from itertools import islice

from discmech.integrators import StepFailure
from discmech.integrators.flows import return_defect
from discmech.reference import ReferenceFailure

from ..core.case import Case, Choice, Progress, plain_cases, silent
from ..evidence import evidence_of
from ..evidence.places import steps_from
from ..symplecticity.limits import of_a_step
from ..symplecticity.measuring import POINTS
from . import in_numbers
from .records import AtPlace, Found, FoundOfNumbers, Measured, Row

NAME = "reversibility"
DIGITS, TRIES = 30, 4  # digits of steps from drawn places, and how many ever shorter ones are tried


NEEDS = "it needs a rule that claims to be reversible."


def cases(choice: Choice) -> list[Case]:
    """Return every scene with every rule that claims to be reversible."""
    return [c for c in plain_cases(NAME, choice, (16,))
            if c.rule.claims is not None and c.rule.claims.reversible]  # fmt: skip


def measure(case: Case, progress: Progress = silent) -> Found | FoundOfNumbers:
    """Return the defects of steps along a run, and of steps from drawn places.

    defect: the larger `return_defect` of the run's own steps and, to twice the digits, of the maps,
    which need no kernel. Each component is judged by its own round-off, so none hides behind a
    larger one.
    """
    if not case.rule.is_formula:
        return in_numbers.measure(case)
    count = POINTS[case.digits == 16]
    forth = case.scheme.flow(case.scene.step, case.digits)
    back = case.scheme.flow(-case.scene.step, case.digits)
    run = forth.trajectory(case.steps or 8 * count)
    spread = max(1, run.steps // count)
    rows, worst = [], 0.0
    for k in range(0, run.steps, spread):
        progress(f"{case.scene.name} {case.label}: there and back", k / run.steps)
        start = run.base[k], run.mu[k], run.u[k]
        again = back.trajectory(1, x0=run.base[k + 1], mu0=run.mu[k + 1], u0=run.u[k])
        defect = float(return_defect(forth, back, *start, (again.base[-1], again.mu[-1])))
        worst = worst if defect <= worst else defect  # one that is not a number stays
        rows.append(Row(float(case.scene.step), k, float(run.t[k]), defect))
    return Found(rows, Measured(worst), _at_places(case))


def _at_places(case: Case) -> AtPlace | None:
    """Return the worst `return_defect` of steps from the evidence's places; None without places."""
    evidence = evidence_of(case.scheme)
    worst: AtPlace | None = None
    try:
        places = evidence.places
    except ReferenceFailure:  # there are no continuous equations
        return None
    drawn = random.Random(evidence.seed + 3)
    for place in places:
        for step in islice(steps_from(place, drawn), TRIES):
            forth, back = (case.scheme.flow(sign * step, DIGITS) for sign in (1, -1))
            x = case.scheme.s.with_time(place.x, place.t)
            try:
                defect = float(return_defect(forth, back, x, place.mu, place.u))
            except StepFailure:
                continue
            if worst is None or not defect <= worst.defect:
                of_maps = forth.context.exactly.numbers.digits
                limit = of_a_step(of_maps)
                worst = AtPlace(defect, limit, float(step), str(place), evidence.seed)
            break
    return worst
