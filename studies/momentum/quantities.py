"""A scene's declared quantities: which can be measured, their formulas, their round-off."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.equations import absolute_terms, natural_structure
from discmech.integrators.errors import DiscmechError
from discmech.integrators.extensions.contact import gap_expressions
from discmech.integrators.flows import growth_errors
from discmech.integrators.numbers import (
    arithmetic,
    exact_rational,
    first_violation,
    flatten,
    jacobian,
    numeric,
    numeric_text,
    rounded,
    sympy,
    to_sympy,
    with_running_errors,
)
from discmech.integrators.scene import Conserved
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..evidence import evidence_of
from ..systems import system_of
from .section import KIND

SAMPLES = 16  # rows whose round-off is analysed
NEARBY = 2.0**-10  # share by which drawn states lie beside a place


def measured_in(case: Case) -> list[Any]:
    """Return the quantities that can be compared with a value."""
    if (sums := system_of(case).momenta) is not None:
        return [*sums]
    rule = case.rule
    composed = rule.method is not None or not rule.asks_lagrangian
    exact = [q for q in case.scene.symmetries if q.to_roundoff]
    if not (case.rule.is_formula or case.scheme.s.n):  # a program of μ alone moves no attitude
        exact = [q for q in exact if not q.attitude]
    if case.rule.is_recorded:  # no steps can be made that start anew
        exact = [q for q in exact if q.stretch is None]
    return [q for q in exact if not (composed and forced(case, q))]


def kept_in(case: Case) -> list[Any]:
    """Return those of them that do not change."""
    return [q for q in measured_in(case) if not _worked(case, q)]


def _worked(case: Case, q: Any) -> bool:
    """True if a quantity changes by its own equation, a force's work, or impulses of gaps."""
    if not isinstance(q, Conserved):
        return system_of(case).worked(q.name)
    struck = case.scene.contact is not None
    return forced(case, q) or (struck and _pushed(scheme_for(case, q.attitude), q))


def forced(case: Case, q: Conserved) -> bool:
    """True if a quantity changes by its own equation, or a force's work.

    A force's work needs that ∂J/∂μ·f is not zero everywhere.
    """
    if q.kind == KIND:
        return True
    return case.scene.force is not None and _moved(scheme_for(case, q.attitude), q)


@cache
def _moved(scheme: Scheme, q: Conserved) -> bool:
    return _changed_by([scheme.s.force.T], scheme, q)


@cache
def _pushed(scheme: Scheme, q: Conserved) -> bool:
    """True if an impulse along a gap, or its friction in the plane of contact, changes it."""
    s, scene = scheme.s, scheme.scene
    assert scene.contact is not None
    phi, planes = gap_expressions(s, scene.contact)
    rho = natural_structure(s, s.x)[0][: s.n, :]
    rows = [jacobian(phi, s.position) * rho]
    if any(e > 0 for e in flatten((scene.friction,))):
        rows += [rho if e is None else jacobian(e, s.position) * rho for e in planes]
    return _changed_by(rows, scheme, q)


def _changed_by(rows: Sequence[Any], scheme: Scheme, q: Conserved) -> bool:
    """True if some of the rows of covectors, (k, m) each, change a quantity as they change μ."""
    s = scheme.s
    slope = formula_of(scheme, q, scheme.scene.step).jacobian(list(s.mu))
    slope = slope.xreplace(dict(zip(s.mu, s.u, strict=True)))  # any μ will do
    values = map(to_sympy, scheme.scene.parameter_values)  # a wall may be about the origin
    known = dict(zip(s.parameter_list, values, strict=True))
    changes = [e.xreplace(known) for part in rows for e in part * slope.T]
    return first_violation(changes, [*s.u]) is not None


def scheme_for(case: Case, attitude: bool) -> Scheme:
    """Return the case's scheme, with the attitude as base if a quantity needs it."""
    return case.scheme_on(case.scene.with_attitude() if attitude else case.scene)


def formula_of(scheme: Scheme, q: Conserved, step: Any) -> Any:
    """Return the quantity in the scheme's symbols; an attitude is passed on as a matrix.

    Its constant terms are left out: they change nothing, and would hide changes.
    """
    x: Any = scheme.s.position
    if q.attitude:
        size = scheme.scene.groupoid.algebra.size  # type: ignore[attr-defined]
        x = x.reshape(size, size)
    h = to_sympy(exact_rational(step, "step"))
    entries = scheme.s.conserved(q, x, h)
    return sympy.Matrix([_varying(e, [*scheme.x, *scheme.s.mu]) for e in entries])


def _varying(e: Any, letters: list[Any]) -> Any:
    """Return the expression without the terms that contain none of the letters."""
    multiplied = sympy.expand(e) if e.is_polynomial(*letters) else e
    constant = multiplied.as_independent(*letters, as_Add=True)[0]
    return e - constant if constant != 0 else e


def round_offs(
    scheme: Scheme, formula: Any, run: Any, terms: np.ndarray, digits: int
) -> tuple[float, float]:
    """Return the effect of round-off: (of one step, of the formula's evaluation).

    It is in units ε of the sum of absolute terms; the largest at SAMPLES rows (`running_error`). A
    step rounds x and μ, and what it adds to them (`of_growth`).
    """
    numbers, s = arithmetic(digits), scheme.s
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    text = numeric_text(letters, [list(formula)])
    worst = [0.0, 0.0]
    with numbers.working():
        p = [numbers.number(v) for v in scheme.scene.parameter_values]
        f = with_running_errors(text, numbers)
        for row in np.unique(np.linspace(0, len(run.mu) - 1, SAMPLES).astype(int)):
            x, mu = (np.array([numbers.number(e) for e in part[row]], numbers.dtype)
                     for part in (run.base, run.mu))  # fmt: skip
            own = max(f(x, mu, p).error)
            whole = max(f(rounded(x), rounded(mu), p).error)
            scale = max(terms[row].max(), terms[0].max())
            for place, value in enumerate((whole - own, own)):
                worst[place] = max(worst[place], float(value / scale) if scale else 0.0)
    own = of_growth(scheme, tuple(formula), run.step, digits)
    return math.hypot(worst[0], own), worst[1]


@cache
def of_growth(scheme: Scheme, formula: tuple[Any, ...], step: Any, digits: int) -> float:
    """Return the effect of the round-off of what a step adds to x and μ, in units ε of the terms.

    The sums of a step may have far larger parts, which cancel. It is √3 times the mean square at
    SAMPLES drawn states, as a rounding of ε has ε/√3 in the mean square: the step's formulas with
    the run's digits and with twice as many. No run has a part in it; it is 0 without such states,
    and for a program, whose sums are not known.
    """
    s, squares = scheme.s, list[float]()
    if not (grown := _grown(scheme, step, digits)):
        return 0.0
    numbers = grown[0][0].exactly.numbers
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    f = numeric(letters, [list(formula), list(map(absolute_terms, formula))], numbers)
    for context, after, off in grown:
        try:
            with numbers.working():
                p = [numbers.number(v) for v in scheme.scene.parameter_values]
                (there, terms), (moved, _) = (
                    f(*np.split(at, [len(s.x)]), p) for at in (after, after + off)
                )
                change = max(abs(b - a) for a, b in zip(there, moved, strict=True))
                size = max(terms) * context.numbers.eps
                squares.append(float(change / size) ** 2 if size else 0.0)
        except (DiscmechError, ArithmeticError):
            continue
    return math.sqrt(3 * sum(squares) / len(squares)) if squares else 0.0


@cache
def _grown(scheme: Scheme, step: Any, digits: int) -> list[tuple[Any, Any, Any]]:
    """Return (context, end, its round-off) of steps from SAMPLES drawn states, for all quantities.

    It is empty without such states, and for a program.
    """
    if not scheme.rule.is_formula:
        return []
    try:
        context = scheme.flow(step, digits).context
        places = evidence_of(scheme).places
    except (ReferenceFailure, DiscmechError):
        return []
    steps: list[tuple[Any, Any, Any]] = []
    drawn = random.Random(scheme.scene.name)
    for place in itertools.islice(itertools.cycle(places), SAMPLES if places else 0):
        x, mu = (
            [e * (1 + drawn.uniform(-NEARBY, NEARBY)) for e in part] for part in (place.x, place.mu)
        )
        with suppress(DiscmechError, ArithmeticError):
            ends = growth_errors(context, scheme.s.with_time(x, place.t), mu, place.u)
            steps += [(context, after, off) for after, off in ends]
    return steps
