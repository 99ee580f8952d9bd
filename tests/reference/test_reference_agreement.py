"""Agreement of answers, and what a remark does to the digits that are certain."""

from dataclasses import replace
from fractions import Fraction

import mpmath
import pytest
from mpmath import mpf

from discmech.reference.answer.agreement import EXACT, agreement, said
from discmech.reference.answer.result import Finding, Solution

TENTH = Fraction(1, 10)


def test_agreement_is_of_the_worst_block_relative_to_its_largest_component():
    one = {"x": [mpf(1), mpf(100)], "v": [], "mu": [mpf(3)]}
    start = {"x": [mpf(1), mpf(1)], "mu": [mpf(3)]}

    def off(block, at, by):
        entries = list(one[block])
        with mpmath.workdps(80):
            entries[at] = entries[at] + mpf(by)
        return one | {block: entries}

    assert agreement(one, one, start) == EXACT > 10**5 and said(EXACT) == "exactly"
    assert said(EXACT - 1) != "exactly"
    for by in ("2e-40", "-2e-40"):
        assert agreement(off("x", 0, by), one, start) == 41  # of 100
        assert agreement(one, off("x", 0, by), {"x": [mpf(-1000)]}) == 42
    assert agreement(off("mu", 0, "2e-40"), one, start) == 40
    assert agreement(off("mu", 0, 5), one, {}) == 0 and said(7) == "to 7 digits"
    assert agreement({"v": [mpf(0)]}, {"v": [mpf("2e-9")]}, {}) == 0
    assert agreement({"v": [mpf("2e-9")]}, {"v": [mpf(0)]}, {}) == 8  # of 1, where all is 0
    for wrong in (mpmath.nan, mpmath.inf):
        assert agreement(one | {"mu": [wrong]}, one, start) == 0
    with pytest.raises(ValueError):
        agreement(one | {"mu": []}, one, start)


BLOCKS = {"x": [mpf(2)], "v": [mpf(0)], "mu": [mpf(1)], "attitude": [mpf(k) for k in range(4)]}


def test_a_remark_may_only_lower_what_is_certain():
    """A proof stands unless less than enough, and less than it says, agrees."""
    proven = Finding(TENTH, BLOCKS, 60, "enclosure", "a", "b", mpf("1e-60"))
    for agreed, enough, certain, holds in (
        (70, 50, 60, True), (60, 50, 60, True), (55, 50, 55, True), (50, 50, 50, True),
        (49, 50, 49, False), (60, 80, 60, True), (59, 80, 59, False),
    ):  # fmt: skip
        found = proven.limited(agreed, "c", enough)
        assert found.certain == certain and found.evidence == "b; c"
        assert (found.certainty == "enclosure") == (found.bound is not None) == holds


def test_what_is_handed_out_says_where_it_has_less_than_was_asked_for():
    found = Finding(TENTH, BLOCKS, 40, "agreement", "a", "b")
    assert found.solution(40, False) == Solution(
        TENTH, [mpf(2)], [mpf(1)], [mpf(0)], None, 40, "a", "b"
    )
    assert found.solution(30, False).certain_digits == 30
    poor = found.solution(41, True)
    assert poor.certain_digits == 40 and "fewer than the 41 asked for" in poor.evidence
    assert poor.attitude == mpmath.matrix([[0, 1], [2, 3]])
    fewer = poor.limited_to(7, True)
    assert fewer == replace(poor, certain_digits=7) and poor.limited_to(50, True) == poor
    assert poor.limited_to(7, False) == replace(fewer, attitude=None)
