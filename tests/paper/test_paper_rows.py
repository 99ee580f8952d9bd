"""Every row of the audit: the formula holds, the printed misprint does not, and errors are seen."""

import pytest

from tests.objects import ARROWS, GROUPOIDS, LARGE, STEPS

from .audit import (
    GENERIC,
    blind_to,
    claims,
    covered,
    examined,
    failures,
    loses_a_term,
    quick,
    sample,
    symbolically_equal,
)
from .misprints import FORMULA
from .numbers import agree, entries
from .rows import BROKEN, DEFINITION, SYMBOLIC
from .table import MISPRINTS, ROWS

FORMULAS = {m.tag for m in MISPRINTS if m.kind == FORMULA}
CHECKED = [row for row in ROWS if row.how != DEFINITION]
NUMERIC = [row for row in CHECKED if row.how != SYMBOLIC]
#: the laws of inverses, ρ, L, R and C: each in one stratum on every groupoid in every run
LAWS = {"2.1-4": 0, "3.2-5": 1, "3.2-8": 2, "3.2-9": 0, "3.2-12": 1}


def label(row):
    return row.place


def assert_row(row, failures_by_name):
    """No claim fails but those to be refuted, and of each of these one does somewhere."""
    shown_wrong = set()
    for where, failed in failures_by_name.items():
        for claim, found, wanted in failed:
            assert claim.refuted, f"{claim.says}: {found} against {wanted} ({where})"
            shown_wrong.add(claim.refuted)
    assert (BROKEN in shown_wrong) == row.spoilt
    assert FORMULAS & set(row.misprints) <= shown_wrong - {BROKEN} <= set(row.misprints)


@pytest.mark.dear("16]", "[4.3", "4.2-8", "4.2-7", "3.7-4", "3.5-5", "3.5-3", "4.2-12", "3.7-10",
                  "3.6.1-9", "3.6.1-8", "Lemma 4.5", "Theorem 4.9", "Theorem 4.10",
                  "Proposition 3.2")  # fmt: skip
@pytest.mark.parametrize("row", [
    pytest.param(row, marks=pytest.mark.slow if row.place == "3.5-bench" else ()) for row in CHECKED
], ids=label)  # fmt: skip
def test_row(row):
    if row.how == SYMBOLIC:
        assert_row(row, {"symbolic": failures(row)})
    else:
        assert_row(row, {name: examined(row, name)[0] for name in quick(row)})


@pytest.mark.parametrize(("row", "stratum", "h"), [
    pytest.param(row, *at, id=f"{row.place}-{at[0]}",
                 marks=() if k == LAWS.get(row.place) else pytest.mark.slow)
    for row in NUMERIC for k, at in enumerate(zip(ARROWS, STEPS, strict=True))
])  # fmt: skip
def test_row_on_every_groupoid_in_every_stratum(row, stratum, h):
    """Also what makes a groupoid's functions those of its two maps, which no other test states."""
    names = [name for name in covered(row) if name in GROUPOIDS]
    assert_row(row, {name: failures(row, sample(name, stratum, h, seed=1)) for name in names})


@pytest.mark.slow
@pytest.mark.parametrize("row", NUMERIC, ids=label)
def test_row_on_groups_of_many_dimensions(row):
    names = [name for name in covered(row) if name in LARGE]
    failed = [f for name in names for f in failures(row, sample(name, *GENERIC))]
    assert not [claim.says for claim, _, _ in failed if not claim.refuted]


@pytest.mark.dear("[2.2", "3.7-2", "remark")
@pytest.mark.parametrize("row", [
    pytest.param(row, marks=pytest.mark.slow if row.dear or k % 4 else ())
    for k, row in enumerate(NUMERIC)
], ids=label)  # fmt: skip
def test_a_wrong_ingredient_is_seen(row):
    """Each function that a check reads, off by 1e-30, and by each claim of it at least one.

    It is the check that is checked here: of every fourth row in `make test`.

    `free` names those functions that may be anything.
    """
    assert blind_to(row) == (set(row.free), set())


def test_products_of_groupoids_meet_the_fast_rows():
    names = [name for row in NUMERIC for name in quick(row)]
    assert {n for n in GROUPOIDS if "×" in n and GROUPOIDS[n].dim_u <= 4} <= set(names)


@pytest.mark.parametrize("row", [r for r in CHECKED if r.how == SYMBOLIC], ids=label)
def test_a_lost_term_is_seen(row):
    """In each entry of each claim that is not 0."""
    for claim in claims(row):
        if claim.refuted:
            continue
        pairs = list(zip(entries(claim.found), entries(claim.wanted), strict=True))
        for found, wanted in [p for p in pairs if p[1] != 0] or pairs[:1]:
            assert not symbolically_equal(found, loses_a_term(wanted)), claim.says


def test_forty_digits_are_demanded():
    one = entries(1)[0]
    assert agree(one, one + one / 10**41)
    assert not agree(one, one + one / 10**39)
    assert not agree(10**6 * one, 10**6 * one + one / 10**33)
