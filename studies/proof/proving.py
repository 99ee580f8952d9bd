"""`prove(rule)`: the order of a rule for every Lagrangian of each class, not on a scene.

Draws: each is a random prime, random coefficients and a random state; "proven" needs all components
to vanish in `DRAWS` of them, "disproven" one that does not in one.
"""

from __future__ import annotations

import itertools
import math
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from discmech.integrators import BadInput, Discretisation, pair
from discmech.integrators.errors import CannotMeasure, NoElements, arguments_checked, shown, unknown
from discmech.integrators.extensions.expansions import NoStep, NotConsistent, NotExpanded, NotKnown
from discmech.integrators.numbers import BITS, NotRational

from ..core import lookup
from .budget import Budget, OutOfTime
from .classes import KINDS, MOST_LETTERS, SceneClass, classes_of
from .conditions import conditions_of, of_law
from .constants import decimals_in, numbers_for
from .laws import BY_TREES, LAWS, Law, law_on, laws_of
from .leading import leading_error, no_leading_error
from .letters import Told, lettered
from .result import Answer, Result
from .steps import MOST_STATES, Comparison, Gaps

MOST_ORDER = 12
NO_TIME = "not looked at within the time that was given"
DRAWS = 2
#: degree of a substep's rows in all letters, times the number of its unknowns and of the values
#: that it names, for which the chance is told
MOST_DEGREE = 10**7
#: bits of the numbers that all coefficients of an error may share, for which the chance is told
CONTENT = 10**6
#: of the primes of `BITS` bits ≡ 11 mod 12 at least this share has the nodes and roots of a rule
SHARE = 1 / 1000
#: order ↦ the coefficients of classes that are looked at without being asked for
USUAL = {2: MOST_LETTERS, 4: 130, 6: 120, MOST_ORDER: 60}
#: states at which a rule may ask for L so that a class of higher degree is looked at, if it fits
MOST_PLACES = 4
#: what a step and the flow differ by, beside the laws
ORDER = Law(Comparison.gaps)
Progress = Callable[[str, float | None], None]
#: returns the answer to a question, which is named, or makes it now
Remembered = Callable[[str, Callable[[], Answer]], Answer]


def _silent(label: str, share: float | None) -> None:
    """Tell nothing."""


def _made(question: str, make: Callable[[], Answer]) -> Answer:
    """Return an answer that nobody keeps."""
    return make()


@arguments_checked
def prove(
    rule: Discretisation | str,
    order: int | None = None,
    *,
    groupoid: str | Sequence[str] = (),
    laws: str | Sequence[str] = LAWS,
    progress: Progress = _silent,
    seconds: float = math.inf,
    remembered: Remembered = _made,
) -> Result:
    """Return what is proven of a rule's order, class by class, for every Lagrangian of the class.

    rule: an object, or a word such as midpoint or FILE.py:NAME. order: to be proven, by default
    what the rule states on each class; of a rule that states none it is found. groupoid: the kinds
    of classes (`classes.KINDS`), by default all that the rule has a meaning on, as far as they take
    seconds. laws: what is asked beside the order, some of `laws.LAWS`, by default all. progress:
    called with a label and a share of the work. seconds: of processor time, after which classes are
    left out, the quickest being asked first (`Result.late`). remembered: keeps the answers of
    classes, which count no time again. Raises `BadInput` for a program, an order above 12,
    unknown kinds and laws, and a rule that cannot be evaluated.
    """
    base = lookup.rule(rule)
    for name, words in (("groupoid", groupoid), ("laws", laws)):
        if not isinstance(words, Sequence):
            raise BadInput(f"{name} is {shown(words)}: give a word, or a list of words.")
    kinds = (groupoid,) if isinstance(groupoid, str) else tuple(groupoid)
    asked_laws = (laws,) if isinstance(laws, str) else tuple(laws)
    for words, what, known in ((kinds, "kind of class", KINDS), (asked_laws, "law", LAWS)):
        for word in words:
            if word not in known:
                raise unknown(what, word, known)
    if order is not None and (type(order) is not int or not 1 <= order <= MOST_ORDER):
        raise BadInput(f"order is {shown(order)}: give a whole number from 1 to {MOST_ORDER}.")
    if not base.composes or base.formula is None:
        raise BadInput(
            f"{base.name} is a program, or takes steps that vary: neither has a series in the "
            "step to be proven; `discmech order` measures it."
        )
    told = Told()
    asked = lettered(base, told)
    if (stated := order or base.order) is not None and stated > MOST_ORDER:
        raise BadInput(f"{base.name} states order {stated}: at most {MOST_ORDER} is proven.")
    usable = [e for e in classes_of(not base.asks_lagrangian, base.splits)
              if not asked.refusal(e.scene(1))]  # fmt: skip
    every = [e for e in usable if not kinds or e.kind in kinds]
    if not every:
        asked_for = ", ".join(kinds or KINDS)
        raise BadInput(f"{base.name} has no meaning on any class of the kinds {asked_for}.")
    meant = every
    draw = random.SystemRandom()
    budget = Budget(seconds)
    try:
        with budget:
            every = _with_degrees(every, asked, stated or 1, draw)
            if stated is None:
                progress("finding the order", None)
                stated = _found(every[0], asked, draw)
    except OutOfTime:
        return Result(base.name, stated, {}, late=[e.name for e in every])
    most = MOST_LETTERS if kinds else next(n for top, n in USUAL.items() if stated <= top)
    chosen = [e for e in every if e.dear * e.count(stated + 1) <= most] or every[:1]
    if chosen[0].count(stated + 1) > MOST_LETTERS:
        raise BadInput(f"{chosen[0].name} has too many coefficients at order {stated}: ask less.")
    answers, notes, late = dict[str, Answer](), list[str](), list[str]()
    if len(every) < len(meant):
        kinds_left = {e.kind for e in every}
        gone = ", ".join(dict.fromkeys(e.kind for e in meant if e.kind not in kinds_left))
        notes.append(f"it asks for group elements, so it has no meaning for {gone}.")
    wanted = order if order is not None or base.order is not None else stated
    quickest = sorted(chosen, key=lambda e: e.dear * e.count(stated + 1))
    for i, e in enumerate(quickest):
        progress(e.name, i / len(chosen))
        try:
            with budget:
                make = partial(_answer, e, asked, wanted, stated, draw)
                answers[e.name] = remembered(f"{e.name}: order {wanted}", make)
        except OutOfTime:
            late.append(e.name)
        except BadInput as error:
            if not answers:  # the rule itself is wrong
                raise
            notes.append(f"it has no meaning for {e.name}: {_sentence(error)}.")
    not_asked, too_large = _beyond([e for e in every if e not in chosen], stated)
    chosen = [e for e in chosen if e.name in answers]
    answers = {e.name: answers[e.name] for e in chosen}
    notes = [*told.notes, *notes, *_every_dimension(asked, answers), *too_large]
    conditions: dict[int, str] = {}
    if told.open:
        progress("conditions", None)
        try:
            with budget:
                conditions, answers = conditions_of(asked, told.open, chosen, stated, answers, draw)
        except CannotMeasure as error:
            notes.append(f"no conditions are known: {_sentence(error)}.")
        except OutOfTime:
            notes.append(f"conditions: {NO_TIME}.")
    leading = dict[str, Any]()
    pairs = [e for e in chosen if e.kind == "pair" and not e.forced][:2]
    if pairs and base.asks_lagrangian and not base.splits:
        progress("leading error", None)
        first = answers[pairs[0].name]
        exact = None if first.at_least or first.proven is None else first.order
        try:
            with budget:
                leading = leading_error(asked, told.open, exact, pairs[-1], draw)
            if not leading:
                notes.append(no_leading_error(exact, told.open))
        except OutOfTime:
            notes.append(f"leading error: {NO_TIME}.")
    progress("laws", None)
    reached = min((a.order for a in answers.values() if a.order), default=stated)

    def answered(e: SceneClass, law: Law, power: int, first: bool) -> Answer:
        if told.open and law.states > 1:
            return Answer(None, None, f"it is looked at for values of {', '.join(told.open)} alone")
        answer = _answer(e, asked, power, power, draw, power, law)
        if not told.open or answer.proven is not False:
            return answer
        return of_law(asked, told.open, e, law.defect, power, answer, draw if first else None)

    def in_time(name: str, e: SceneClass, *about: Any) -> Answer:
        try:
            with budget:
                return remembered(f"{e.name}: {name}", partial(answered, e, *about))
        except OutOfTime:
            return Answer(None, None, NO_TIME)

    no_step = {name: a.why for name, a in answers.items() if a.power == 0}
    kept = laws_of(asked_laws, asked, chosen, min(reached, stated), in_time, no_step)
    if any(a.proven is False for a in kept.get("conjugate-symplectic", {}).values()):
        notes.append(BY_TREES)
    for law in [law for law in asked_laws if not kept[law]]:
        others = ", ".join(dict.fromkeys(e.kind for e in usable if law_on(law, e)))
        more = f", but of those of --groupoid {others}" if others else ""
        notes.append(f"{law} is no law of these classes{more}.")
    claimed = ("symplectic",) if base.claims is not None and base.claims.symplectic else ()
    return Result(base.name, stated, answers, conditions, leading, notes, kept, claimed, not_asked,
                  late)  # fmt: skip


def _with_degrees(
    every: list[SceneClass], rule: Discretisation, order: int, draw: random.Random
) -> list[SceneClass]:
    """Return the classes with the degrees that a rule needs which differentiates L itself, or asks
    for it at other states: an error could vanish for lower ones.

    What it does is seen on the first class, which keeps its degree if it had too many coefficients
    then: `_drawn` looks again, and proves nothing on a class whose degree is too low.
    Only those that have group elements are returned for a rule that asks for them.
    """
    try:
        comparison = Comparison(every[0].scene(2), rule)
        constants = [c for part in comparison.constants for c in part]
        numbers = numbers_for(constants, comparison.scheme, draw)
        _gaps(ORDER, comparison, numbers, draw, 2, None)
    except NoElements:
        if some := [e for e in every[1:] if e.groupoid.retraction]:
            return _with_degrees(some, rule, order, draw)
        raise
    except (BadInput, CannotMeasure, NotRational, ZeroDivisionError, RecursionError):
        return every  # which is told with the first class

    def higher(e: SceneClass) -> SceneClass:
        further, places = comparison.reach(e.still)
        return replace(e, further=int(further), places=places)

    if comparison.told.taken == math.inf:
        return every
    first, *others = map(higher, every)
    fits = first.dear * first.count(order + 1) <= MOST_LETTERS
    return [first if fits else every[0], *others]


def _every_dimension(rule: Discretisation, answers: dict[str, Answer]) -> list[str]:
    """Return a sentence on dimensions that are not among the classes.

    A sum of trees of order p has at most 3p − 6 contractions, and 1 for p ≤ 2 (docs/proofs.md).
    """
    sizes = {n: answers[name].order or 0 for n in (1, 2, 3)
             if (name := f"L(x, v), n = {n}") in answers and answers[name].proven}  # fmt: skip
    if not sizes:
        return []
    comparison = Comparison(SceneClass("", "pair", pair(2)).scene(2), rule)
    order = 0
    if not comparison.substeps and comparison.is_tree_sum:
        order = max(min(p, 3 if n == 3 else 2) for n, p in sizes.items())
    said = (
        f"L(x, v): order {order} for every n, if the rule is one formula for all n, by a theorem; "
        if order
        else "L(x, v): "
    )
    return [said + "else for the n that are listed."]


def _beyond(left: list[SceneClass], order: int) -> tuple[dict[str, list[str]], list[str]]:
    """Return {kind: names of classes that may be asked for}, and what is said of larger ones."""
    fits = [e.dear * e.count(order + 1) <= MOST_LETTERS for e in left]
    kinds: dict[str, list[str]] = {}
    for e in itertools.compress(left, fits):
        kinds.setdefault(e.kind, []).append(e.name)
    large = [e.name for e, is_small in zip(left, fits, strict=True) if not is_small]
    said = f"too large to be asked at order {order}: {'; '.join(large)}."
    return kinds, [said] if large else []


def _found(e: SceneClass, rule: Discretisation, draw: random.Random) -> int:
    """Return the order of a rule on a class, at least 1 and at most `MOST_ORDER`."""
    for power in (3, 5, 9, MOST_ORDER + 1):
        answer = _answer(e, rule, power, power, draw, power)
        if answer.order is None or answer.order < power:
            break
    return min(max(1, answer.order or 1), MOST_ORDER)


def _answer(
    e: SceneClass, rule: Discretisation, order: int | None, stated: int, draw: random.Random,
    power: int | None = None, law: Law = ORDER,
) -> Answer:  # fmt: skip
    """Return what is proven of a law on a class.

    Raises `BadInput` for a rule without a meaning there.
    """
    begun = time.process_time()
    power = stated + 1 if power is None else power
    try:
        answer = _drawn(e, rule, order, power, draw, law)
    except NotKnown:
        answer = Answer(None, None, "quotients 0/0 in it take too many powers of h away")
    except CannotMeasure as error:
        power_missed = 0 if isinstance(error, NoStep) else None
        answer = Answer(None, None, _sentence(error), power=power_missed)
    except RecursionError:
        answer = Answer(None, None, "its formulas are too long for these Lagrangians")
    except (NotRational, ZeroDivisionError) as error:
        answer = Answer(None, None, f"{error}, so nothing is known at a random state")
    except BadInput as error:
        if not (asks := _parameter(error)):
            raise
        why = f"it reads the parameter {asks} of a scene, so it is no rule for every Lagrangian"
        answer = Answer(None, None, why)
    return replace(answer, seconds=time.process_time() - begun)


def _sentence(error: Exception) -> str:
    return str(error).replace("generic with ", "").removeprefix("generic: ").rstrip(".")


def _parameter(error: BadInput) -> str:
    """Return the name of the parameter that a rule asked a scene for in vain; "" otherwise."""
    cause = error.__cause__
    while cause is not None and not isinstance(cause, AttributeError):
        cause = cause.__cause__
    namespace = type(getattr(cause, "obj", None)).__name__ == "SimpleNamespace"
    return str(getattr(cause, "name", "")) if namespace else ""


def _drawn(
    e: SceneClass, rule: Discretisation, order: int | None, power: int, draw: random.Random,
    law: Law,
) -> Answer:  # fmt: skip
    comparison = Comparison(e.scene(power), rule)
    stated = law is ORDER and order in (None, rule.order)
    wanted = comparison.scheme.order if stated else order
    wanted = min(wanted or power - 1, power)
    seen, unknown_numbers, reduced = power, False, False
    gaps = None
    for _ in range(DRAWS):
        every = [c for part in comparison.constants for c in part]
        numbers = numbers_for(every, comparison.scheme, draw)
        try:
            gaps = _gaps(law, comparison, numbers, draw, power, None)
        except NotConsistent as error:
            return Answer(0, False, f"it is not consistent: {_sentence(error)}", power=1)
        except NotExpanded:
            # where L is quadratic in the velocity a step of length 0 is the solution of a linear
            # system: a disproof there is one for the class
            gaps, reduced = _gaps(law, comparison, numbers, draw, power, e.linear(power)), True
        seen, unknown_numbers = min(seen, gaps.order), bool(numbers.unknown)
        if seen < wanted:
            break
    assert gaps is not None
    told = f"h^{seen + 1} differs in {', '.join(gaps.missed)}" if seen < power else ""
    about: dict[str, Any] = {"at_least": seen == power, "missed": gaps.missed,
                             "power": None if seen == power else seen + 1}  # fmt: skip
    if seen >= wanted and reduced:
        return Answer(seen, None, "proven for L quadratic in v alone: for others a step of length "
                      "0 is no rational function", **about)  # fmt: skip
    if seen >= wanted and (said := _too_low(e, comparison, law)):
        further, places = comparison.reach(e.still)
        if further < math.inf and places <= MOST_PLACES:
            further = max(e.further, int(further) + law.further)
            higher = replace(e, further=further, places=max(e.places, places))
            if e.dear * higher.count(power) <= MOST_LETTERS:
                return _drawn(higher, rule, order, power, draw, law)
        return Answer(seen, None, said, **about)
    if seen >= wanted:
        chance = chance_of_error(comparison, power, law.states)
        told = told and f"the next power, {told}"
        return Answer(seen, True, told, chance=chance, **about)
    if said := decimals_in(rule):
        return Answer(seen, None, f"as written {told}: {said}", **about)
    if unknown_numbers:
        return Answer(seen, None, f"{told} for other values of its numbers, which are not known "
                      "as roots", **about)  # fmt: skip
    return Answer(seen, False, told, **about)


def _gaps(
    law: Law, comparison: Comparison, numbers: Any, draw: random.Random, power: int, kept: Any
) -> Gaps:
    """Return the gaps of a draw, and of another where a denominator happens to be 0."""
    numbers.values = _OpenValues(numbers, draw)
    try:
        return law.defect(comparison, numbers, draw, power, kept)
    except ZeroDivisionError:  # a random matrix is singular with a chance of 1/p
        return law.defect(comparison, numbers, draw, power, kept)


class _OpenValues(dict[str, Any]):
    """Open numbers with random values, each the same for a draw."""

    def __init__(self, numbers: Any, draw: random.Random) -> None:
        super().__init__()
        self._numbers, self._draw = numbers, draw

    def __missing__(self, name: str) -> Any:
        self[name] = self._numbers.field.random(1, self._draw)[0]
        return self[name]


def _too_low(e: SceneClass, comparison: Comparison, law: Law) -> str:
    """Return why the polynomials of a class may not show an error; "" where they show each."""
    further, places = comparison.reach(e.still)
    if e.part == "cubic" or (further <= e.further - law.further and places <= e.places):
        return ""
    taken = comparison.told.taken
    counted = "an unknown number of" if taken == math.inf else f"{taken:.0f}"
    many = "an unknown number of" if places >= MOST_STATES else f"{places}"
    return (
        f"it takes {counted} derivatives of L itself, quotients take {comparison.lost} powers of h "
        f"away, and it asks for L at {many} states as h → 0: polynomials that show all errors have "
        "too many coefficients"
    )


def chance_of_error(comparison: Comparison, power: int, states: int = 1) -> float:
    """Return the bound of the chance that errors vanish in all draws and not always.

    docs/proofs.md: the numerator of an error, or of a law, is of a degree below 4(2K − 1)(m + 1)r
    with m unknowns of all substeps and r the degree of their rows, and at most `CONTENT`/(`BITS` −
    1) primes divide all its coefficients. Φ₋ₕ∘Φₕ has twice as many.
    """
    degree = 8 * (2 * power - 1) * len(comparison.parts) * MOST_DEGREE * states
    primes = 2.0 ** (BITS - 1) / (BITS * 0.7 * 4) * SHARE
    return float((degree / 2.0 ** (BITS - 1) + CONTENT / (BITS - 1) / primes) ** DRAWS)
