"""The faults that a verdict on a momentum can see: seeded ones, and steps beside the motion."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.numbers import Vector, arithmetic
from discmech.integrators.scene import Conserved

from ..core.single_steps import Departure
from ..evidence.cloud import Cloud
from ..evidence.laws import ROUNDINGS, Law
from ..evidence.places import DIGITS as OF_PLACES
from ..evidence.places import Place
from ..systems.runs import Rows, with_terms
from .cause import KEPT, change_of_motion
from .quantities import formula_of, round_offs
from .records import Fault
from .work import less_work

FAULT = 16  # relative size of the fault that a verdict has to see, in units of round-off
#: directions of a fault, and rows of a run at which it is made; of a sum of two alike momenta a
#: half of the directions changes little: of 16 all do so once in 10⁵ draws
DRAWS, PLACES = 16, 16
DIGITS = 30  # digits of single steps
#: powers of a shorter step beyond the order, to which a change of a quantity by it has to be seen
POWERS = 3
#: a rule without claims is one formula for all states, of which few are asked for all sizes
OF_LAGRANGIAN = 8


def seen(rows_of: Rows, run: Any, noise: float, digits: int, seed: str) -> Fault:
    """Return the effect of a fault of one step on a quantity, over its terms.

    The fault moves each entry of x and μ by about `FAULT` round-offs of a run, up or down as the
    seed gives it. change: the median over rows of the run of the largest effect of `DRAWS` such
    faults. A quantity that does not depend on the state, or whose terms hide the dependence, sees
    nothing.
    """
    drawn, numbers = random.Random(seed), arithmetic(digits)
    size = FAULT * max(noise, float(numbers.eps))
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
            others, _ = rows_of(replace(run, base=moved[0], mu=moved[1], u=u))
            gaps = abs(others - values).max(axis=1)
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


def key_of(name: str) -> str:
    """Return the name of the law of a quantity: one that is called "form" is not the form."""
    return f"keeps {name}"


class Keeps(Law):
    """A quantity that each step has to keep, also beside the motion.

    worked: True for one that a force, or its own equation, changes: what it has to keep is the rest
    (`less_work`).

    One of the step h has to be kept at steps that no method can know. One without h may hold the
    scene's step in a parameter, as integrals of integrable maps do, and is asked at that step.
    """

    tries = 1

    def __init__(self, quantity: Conserved, worked: bool = False) -> None:
        self.quantity, self.name, self.worked = quantity, key_of(quantity.name), worked
        self.of_attitude, self.along = quantity.attitude, worked

    def refusal(self, scheme: Scheme) -> str:
        """Return "" where the quantity is one of the state; a program is held against it, too."""
        return "" if scheme.s.n or not self.of_attitude else "its steps tell no attitude."

    def longest(self, scheme: Scheme, place: Place, drawn: random.Random) -> Fraction:
        """Return the one step at which it is asked."""
        return place.step if self.quantity.of_step else Fraction(scheme.scene.step)

    def signs(self, scheme: Scheme) -> Sequence[int]:
        """Return the signs of the steps."""
        return (1,) if scheme.rule.is_formula else (1, -1)

    def fewer(self, scheme: Scheme) -> int:
        """Return by how much fewer of `many_steps` are asked."""
        return OF_LAGRANGIAN if scheme.rule.claims is None else 1

    def conspicuous(self, scheme: Scheme) -> tuple[list[Place], int]:
        """Return starts of steps of all sizes that do not keep what the motion itself keeps."""
        if self.quantity.of_step or self.worked:
            return [], 0
        starts, asked = super().conspicuous(scheme)
        if not starts:
            return [], asked
        formula = formula_of(scheme, self.quantity, scheme.scene.step)
        moved = change_of_motion(scheme, with_terms(scheme, formula, DIGITS))
        return ([], 0) if moved > KEPT else (starts, asked)

    def gaps(self, many: Cloud) -> Vector:
        """Return the changes of the quantity over its terms."""
        formula = formula_of(many.scheme, self.quantity, many.scheme.scene.step)
        return many.changes(with_terms(many.scheme, formula, 16))

    def departure(self, scheme: Scheme, place: Place, step: Fraction) -> Departure:
        """Return the change by one step, over the sum of the quantity's terms."""
        digits = _digits(scheme, place, step)
        flow, numbers = scheme.flow(step, digits), arithmetic(digits)
        run = flow.trajectory(1, **place.start)
        if self.worked:
            (_, change), units = less_work(flow, self.quantity, run, digits)
        else:
            formula = formula_of(scheme, self.quantity, step)
            values, terms = with_terms(scheme, formula, digits)(run)
            units = round_offs(scheme, formula, run, terms, digits)
            with numbers.working():
                gap, scale = abs(values[1] - values[0]).max(), max(terms.ravel())
                change = float(gap / scale) if gap else 0.0
        own = max(float(numbers.eps), scheme.rule.unit(digits)) if digits == 16 else numbers.eps
        limit = ROUNDINGS * float(own) * (1 + sum(units))
        return Departure(float(change), limit, self.quantity.name, float(step))


@cache
def keeps(quantity: Conserved, worked: bool) -> Keeps:
    """Return the law of a quantity, one object, so that its departure is measured once."""
    return Keeps(quantity, worked)


def laws_of(quantities: Sequence[Any], worked: bool = False) -> list[Keeps]:
    """Return the laws of quantities of a scene; worked: whether a force changes them (`Keeps`)."""
    return [keeps(q, worked) for q in quantities if isinstance(q, Conserved)]


def _digits(scheme: Scheme, place: Place, step: Fraction) -> int:
    """Return the digits of a step from a place: more for one that is shorter than the place's.

    A program may have those of doubles alone.
    A rule of order p changes what it does not keep by h^(p+1) or a power near to it.
    """
    shorter = max(0.0, math.log10(abs(place.step / step)))
    if scheme.digits(DIGITS) == 16:
        return 16
    return min(OF_PLACES, DIGITS + math.ceil(((scheme.order or 1) + POWERS) * shorter))
