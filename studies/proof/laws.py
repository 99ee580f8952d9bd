"""Laws of a step as series in h that vanish: the form, the adjoint, and a momentum.

The step Φ from a random state of a random scene is a series in h, and so are its derivative M by
the state and what a law says to be 0. The first power that does not vanish is a certain disproof;
it is one more than the pseudo-symplectic order of a map, say (Aubry, Chartier, BIT 38 (1998), 439).
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from discmech.integrators import Discretisation
from discmech.integrators.equations import poisson_tensor
from discmech.integrators.extensions.expansions import series_function
from discmech.integrators.numbers import PrimeField, numeric_text
from discmech.integrators.numbers.types import Function

from .classes import SceneClass
from .conjugate import STATES, conjugate
from .constants import Numbers
from .result import Answer
from .steps import Comparison, Gaps

MOST_LETTERS = 130  # coefficients of a class with which a law is looked at
TOO_MANY = f"a scene has more than {MOST_LETTERS} coefficients there"
MOST_POWER = 7  # of h, to which a law is looked at where the order does not ask for more
#: nonholonomic scenes are no class of these, and forced ones are not asked
BY_A_THEOREM = "by a theorem, as it has a discrete Lagrangian (nonholonomic scenes have no form)"


@dataclass(frozen=True)
class Law:
    """What vanishes. defect: of a comparison, in numbers, with random letters, to a power of h.

    further: the derivatives that it takes of a step. least: the powers beyond the order of a map
    that are looked at, at least. states: of random scenes that are asked in one field, at most.
    """

    defect: Callable[..., Gaps]
    further: int = 0
    least: int = 1
    states: int = 1


def form(
    c: Comparison, numbers: Numbers, draw: random.Random, power: int,
    kept: Sequence[bool] | None = None,
) -> Gaps:  # fmt: skip
    """Return M Π(z) Mᵀ − Π(Φ(z)) above its diagonal, Π the Poisson tensor."""
    p, exact, at = c.drawn(numbers, draw, 1, kept)
    z, M = c.stepped(numbers, p, at, power, slopes=True)
    n, tensor = len(c.s.x), _bracket(c.s, numbers.field)
    before, after = (np.array(tensor(e[:n], e[n:], p), dtype=object) for e in (at[0], z))
    gap, places = M @ before @ M.T - after, [*zip(*np.triu_indices(len(z), 1), strict=True)]
    names = [f"{{{c.names[i]}, {c.names[j]}}}" for i, j in places]
    return Gaps.of(names, [gap[e] for e in places], numbers.field, power)


@lru_cache(maxsize=64)
def _bracket(s: Any, field: PrimeField) -> Function:
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    text = numeric_text(letters, [poisson_tensor(s, s.x, s.mu)])
    return series_function(text, field)


def volume(
    c: Comparison, numbers: Numbers, draw: random.Random, power: int,
    kept: Sequence[bool] | None = None,
) -> Gaps:  # fmt: skip
    """Return det M − 1, by elimination: M is 1 at h = 0."""
    p, _, at = c.drawn(numbers, draw, 1, kept)
    _, M = c.stepped(numbers, p, at, power, slopes=True)
    rows, det = (numbers.field.zeros(*M.shape) + M).tolist(), numbers.field.number(1)
    for i, row in enumerate(rows):
        det = det * row[i]
        for j in range(i + 1, len(rows)):
            share = rows[j][i] / row[i]
            rows[j] = [a - share * b for a, b in zip(rows[j], row, strict=True)]
    return Gaps.of(["det"], [det - 1], numbers.field, power)


def adjoint(
    c: Comparison, numbers: Numbers, draw: random.Random, power: int,
    kept: Sequence[bool] | None = None,
) -> Gaps:  # fmt: skip
    """Return Φ₋ₕ(Φₕ(z)) − z."""
    p, _, at = c.drawn(numbers, draw, 1, kept)
    z, _ = c.stepped(numbers, p, at, power, signs=(1, -1))
    gaps = [a - b for a, b in zip(z, at[0], strict=True)]
    return Gaps.of(c.names, gaps, numbers.field, power)


def momentum(e: SceneClass) -> Law:
    """Return the law of the quantity that the scenes of a class keep."""
    assert e.keeps
    name, value = e.keeps

    def defect(
        c: Comparison, numbers: Numbers, draw: random.Random, power: int,
        kept: Sequence[bool] | None = None,
    ) -> Gaps:  # fmt: skip
        p, _, at = c.drawn(numbers, draw, 1, kept)
        z, _ = c.stepped(numbers, p, at, power)
        return Gaps.of([name], [value(z) - value(at[0])], numbers.field, power)

    return Law(defect)


FORM, VOLUME, ADJOINT = Law(form, further=1), Law(volume, further=1), Law(adjoint, least=2)
#: the words by which laws are asked for
LAWS = ("symplectic", "conjugate-symplectic", "volume", "self-adjoint", "momentum")
OF_FORM = LAWS[:3]  # those that a form which is kept implies
BY_TREES = (
    "conjugate-symplectic: by a change of variables that is a series of trees, a B-series; whether "
    "another goes further is not looked at."
)


def laws_of(
    laws: Iterable[str], rule: Discretisation, classes: Sequence[SceneClass], order: int,
    answer: Callable[[str, SceneClass, Law, int, bool], Answer], no_step: Mapping[str, str],
) -> dict[str, dict[str, Answer]]:  # fmt: skip
    """Return {law: {class: answer}}.

    order: of the rule. answer: of a law's name, a class, the law, the last power that is to be
    looked at, and whether the law has failed on no class before. no_step: class ↦ why a rule has
    no step there.
    """
    answers: dict[str, dict[str, Answer]] = {}
    for name in laws:
        told = answers.setdefault(name, {})
        for e in classes:
            law = law_on(name, e)
            if law is None:
                continue
            if e.name in no_step:
                told[e.name] = Answer(None, None, no_step[e.name])
                continue
            if name in OF_FORM and rule.asks_lagrangian:
                told[e.name] = Answer(None, True, BY_A_THEOREM)
                continue
            kept = answers.get("symplectic", {}).get(e.name)
            if name in OF_FORM and kept is not None and kept.proven:
                told[e.name] = kept
                continue
            e, least = replace(e, further=e.further + law.further), order + law.least
            most = max(least, min(2 * order + 1, MOST_POWER))
            powers = [k for k in range(least, most + 1) if e.dear * e.count(k) <= MOST_LETTERS]
            first = not any(a.condition or a.proven is False for a in told.values())
            told[e.name] = (
                answer(name, e, law, powers[-1], first) if powers else Answer(None, None, TOO_MANY)
            )
    return answers


def law_on(name: str, e: SceneClass) -> Law | None:
    """Return the law of that name on a class, or None if it is none there."""
    if name == "momentum":
        return momentum(e) if e.keeps else None
    if name == "symplectic":
        return None if e.forced else FORM
    canonical = e.groupoid.canonical and not e.forced
    if name == "volume":
        return VOLUME if canonical else None
    if name == "conjugate-symplectic":
        defect = partial(conjugate, e.part in ("separable", "quadratic"))
        return Law(defect, 1, states=STATES) if canonical and not e.timed else None
    return ADJOINT
