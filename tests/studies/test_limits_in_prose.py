"""The limits that pages name in words and numbers are those of the studies' own tables."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from discmech.studies.core.limits import OF_ORDER
from discmech.studies.core.study import every_study
from tests.imports import ROOT

LIMITS = {
    f"{study.name}: {name}": float(value)
    for study in every_study().values()
    for name, value in study.limits.items()
}
WORDS = {
    0.1: "a tenth", 0.125: "1/8", 0.5: "half", 4: "four", 5: "five", 8: "eight", 1000: "a thousand",
    2.0**-26: "√ε",
}  # fmt: skip
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: what each page says; in braces the limit, "study: name", or its name alone on the study's page
SAID = {
    "studies/energy.md": [
        "at least min(p, 2) − {order: double precision}", "account for at most {slope} of",
        "explains more than {slope} of the band", "at least {steady} times as far",
        "no coordinate turns {turns} times", "to its error and to {stands} of the band",
        "its change is known to {known} of the band", "ds {beyond} times",
        "each of {many} and more", "of more than {wide} of the energy that moves",
        "band above {wide} of the energy that moves",
    ],
    "how-to/test-the-integrator-you-have.md": [
        "hide an error of more than {symplecticity: own derivative}, the verdict is inconclusive",
    ],
    "studies/order.md": [
        "within {double precision} of the expected order", "more digits | within {more digits}",
    ],
    "studies/symplecticity.md": [
        "within {form} in double precision", "50 digits ({digits of a form} digits less",
        "within {step} units of round-off", "caught {control}fold",
        "{control with more digits}-fold",
    ],
    "studies/momentum.md": ["within {walk} standard deviations", "a limit below {blind}"],
    "studies/steps.md": [
        "within {order} of the base", "their start to {back}", "form is kept to {form}",
    ],
    "studies/contact.md": [
        "laws hold to {symplecticity: form}", "slip ≤ {turn}", "that of the rule − {slack}",
        "of 2 − {slack} where", "The {slack} is for", "by {falls} at least",
        "it must be {falls} times less",
    ],
    "studies/work-precision.md": [
        "sink to {stalled}, or to {floors} times the floor", "none is below {sinking} when",
    ],
    "studies/stability.md": ["= {resolved}, where", "right to {exchange} at"],
    "studies/charts.md": [
        "Residual ≤ {solved}, defects ≤ {forms}", "operator ≤ {solved}",
        "within {singular} of singular", "·{symplecticity: step} ε √N",
    ],
    "studies/savings.md": ["agree to {same}"],
    "studies/lattices.md": [
        "within {order: double precision} of the rule", "residual ≤ {symplecticity: step} ε",
        "bond and patch ≤ {symplecticity: form}", "hidden ≤ {symplecticity: step} ε",
        "c = {momentum: walk}/√3", "Laws of contact ≤ {symplecticity: form}",
    ],
    "studies/optimality.md": ["within {order: double precision} of the rule"],
    "judged.md": ["at most {energy: slope} of the band"],
    "verdicts.md": [
        "pullback of Ω | {symplecticity: form};", "reversibility | {symplecticity: step} ε",
        "a limit below {momentum: blind};", "{momentum: walk} standard deviations are passed",
        "{momentum: alike} of them may be alike",
        "A program's step has {momentum: program} roundings of each",
        "below its bound and {energy: stands} of the band, with the bound below {energy: known} of",
        "and {energy: beyond} times ∫", "at {energy: many} returns and more",
        "{energy: beyond} times Σ", "at most 1/{contact: falls} of", "half, {contact: falls} |",
        "the mean of four times; {order: double precision} |", "way back | {steps: form};",
        "contact, laws | {symplecticity: form};", "·{symplecticity: step} ε √N",
    ],
    "notes/excuses.md": [
        "misses by ≤ {order: double precision} while", "= {stability: resolved} ",
        "{energy: stands} of the band at most",
        "tolerances of {order: double precision} and {order: more digits}",
        "·{symplecticity: step} ε √N",
    ],
}  # fmt: skip
#: limits that stand in the tables of limits alone
IN_NO_PROSE = {
    "charts: stopped", "contact: excess", "contact: form", "energy: balance", "energy: elsewhere",
    "energy: straight", "energy: whole", "optimality: grows", "order: unresolved",
    "symplecticity: jump across", "symplecticity: jump nearby", "symplecticity: made again",
    *(f"order: {name}" for name in OF_ORDER),
}  # fmt: skip


def written(value: float) -> Iterator[str]:
    """Every way in which pages write a number: 1e-13, 10⁻¹³, a tenth."""
    yield f"{value:g}"
    yield f"{value:.3g}"
    mantissa, exponent = f"{value:e}".split("e")
    yield f"{float(mantissa):g}e{int(exponent)}"
    if float(mantissa) == 1:
        yield f"10{str(int(exponent)).translate(SUPERSCRIPT)}"
    if value in WORDS:
        yield WORDS[value]


def names_of(page: str, words: str) -> list[str]:
    """The full names of the limits that stand in braces."""
    study = page.partition("/")[2].removesuffix(".md")
    return [n if ": " in n else f"{study}: {n}" for n in re.findall(r"{(.*?)}", words)]


def stands(page: str, words: str, limits: dict[str, float], text: str) -> bool:
    """Whether the words stand in the text, with each limit's value in one of its ways."""
    parts = [re.escape(part) for part in re.split(r"{.*?}", words)]
    for place, name in enumerate(names_of(page, words), 1):
        ways = "|".join(map(re.escape, written(limits[name])))
        parts[place] = rf"(?<!\d)(?:{ways})(?![\d.]\d){parts[place]}"
    return re.search("".join(parts).replace(r"\ ", r"\s+"), text) is not None


@pytest.mark.parametrize("page", SAID)
def test_a_page_names_the_limits_as_they_are(page):
    text = (ROOT / "docs" / page).read_text("utf-8")
    for words in SAID[page]:
        assert stands(page, words, LIMITS, text), f"docs/{page} has to say: {words}"
        for name in names_of(page, words):  # and what it says is the limit's own number
            other = LIMITS | {name: LIMITS[name] * 3 + 0.07}
            assert not stands(page, words, other, text), words


def test_each_limit_was_looked_for_in_the_pages():
    """A new limit is named in a page's words, or in its tables alone."""
    told = {
        name for page, all_words in SAID.items() for w in all_words for name in names_of(page, w)
    }
    assert told | IN_NO_PROSE == set(LIMITS) and not told & IN_NO_PROSE
