"""The faults that a verdict on a momentum can see: seeded ones, and steps beside the motion."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import arithmetic
from discmech.integrators.scene import Conserved
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..evidence import evidence_of
from ..evidence.places import DIGITS as OF_PLACES
from ..evidence.places import Place
from ..systems.runs import Rows, with_terms
from .quantities import formula_of, round_offs, scheme_for
from .records import Beside, Fault

FAULT = 16  # relative size of the fault that a verdict has to see, in units of the limit
DRAWS, PLACES = 4, 16  # directions of a fault, and the number of rows of a run at which it is made
DIGITS = 30  # digits of single steps
#: powers of a shorter step beyond the order, to which a change of a quantity by it has to be seen
POWERS = 3
#: round-offs that a step of `DIGITS` may be off by: 64 of a step's own bound, 16 for a quantity
#: whose terms grow in it
ALLOWED = 2**10


def seen(rows_of: Rows, run: Any, limit: float, digits: int, seed: str) -> Fault:
    """Return the effect of a fault of one step on a quantity, over its terms.

    The fault moves each entry of x and μ by about `FAULT` limits of its size, up or down as the
    seed gives it. change: the median over rows of the run of the largest effect of `DRAWS` such
    faults. A quantity that does not depend on the state, or whose terms hide the dependence, sees
    nothing.
    """
    drawn, numbers = random.Random(seed), arithmetic(digits)
    size = FAULT * max(limit, float(numbers.eps))
    chosen = np.unique(np.linspace(0, len(run.mu) - 1, PLACES).astype(int))
    with numbers.working():
        number = np.vectorize(numbers.number, otypes=[numbers.dtype])
        x, mu = (number(part[chosen]) if part[chosen].size else part[chosen]
                 for part in (run.base, run.mu))  # fmt: skip
        u = run.u[chosen]
        plain = replace(run, base=x, mu=mu, u=u)
        values, terms = rows_of(plain)
        most = np.zeros(len(chosen))
        for _ in range(DRAWS):
            moved = [_moved(part, size, drawn, numbers) for part in (x, mu)]
            found, _ = rows_of(replace(run, base=moved[0], mu=moved[1], u=u))
            gaps = abs(found - values).max(axis=1)
            scales = [max(t.max(), terms[0].max()) for t in terms]
            change = [float(g / s) if g else 0.0 for g, s in zip(gaps, scales, strict=True)]
            most = np.maximum(most, np.nan_to_num(np.array(change)))
    return Fault(size, float(np.median(most)))


def _moved(part: Any, size: float, drawn: random.Random, numbers: Any) -> Any:
    if not part.size:
        return part
    sizes = abs(part).max(axis=0)
    sizes = np.where(sizes > 0, sizes, sizes.max() or 1)
    # of several sizes: equal ones cancel in a sum, such as two bodies' momentum
    signs = [numbers.number(drawn.choice((-1, 1)) * drawn.uniform(0.8, 1.2)) for _ in sizes]
    return part + numbers.number(size) * sizes * np.array(signs, numbers.dtype)


def beside(case: Case, quantities: Sequence[Conserved]) -> dict[str, Beside]:
    """Return by quantity the worst of single steps from drawn places.

    Places are on the motion and off it (`evidence`); for quantities that no force changes and that
    need no attitude. A quantity of the step h has to be kept at steps that no method can know. One
    without h may hold the scene's step in a parameter, as integrals of integrable maps do, and is
    asked at that step. It is empty without evidence.
    """
    found: dict[str, Beside] = {}
    plain = [q for q in quantities if not q.attitude and q.stretch is None]
    if not plain or not case.rule.is_formula:
        return found
    scheme: Scheme = scheme_for(case, False)
    try:
        places = evidence_of(scheme).places
    except (ReferenceFailure, DiscmechError):
        return found
    for place, of_step in itertools.product(places, (True, False)):
        asked = [q for q in plain if q.of_step is of_step]
        step = place.step if of_step else Fraction(case.scene.step)
        digits = _digits(case, place, step)
        if not asked:
            continue
        try:
            run = scheme.flow(step, digits).trajectory(1, **place.start)
        except (StepFailure, DiscmechError):
            continue
        numbers = arithmetic(digits)
        for q in asked:
            formula = formula_of(scheme, q, step)
            values, terms = with_terms(scheme, formula, digits)(run)
            units = round_offs(scheme, formula, run, terms, digits)
            with numbers.working():
                gap, scale = abs(values[1] - values[0]).max(), max(terms.ravel())
                change = float(gap / scale) if gap else 0.0
            limit = ALLOWED * float(numbers.eps) * (1 + sum(units))
            worst = found.get(q.name)
            if worst is None or change * worst.limit > worst.change * limit:
                found[q.name] = Beside(change, limit, float(step), str(place))
    return found


def _digits(case: Case, place: Place, step: Fraction) -> int:
    """Return the digits of a step from a place: more for one that is shorter than the place's.

    A rule of order p changes what it does not keep by h^(p+1) or a power near to it.
    """
    shorter = max(0.0, math.log10(place.step / step))
    return min(OF_PLACES, DIGITS + math.ceil(((case.order or 1) + POWERS) * shorter))
