"""Every row of the audit: the formula holds, the printed misprint does not, and errors are seen."""

import pytest

from tests.objects import ARROWS, STEPS

from .audit import (
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
from .numbers import agree, entries
from .rows import DEFINITION, SYMBOLIC
from .table import MISPRINTS, ROWS

SLIPS = {m.tag for m in MISPRINTS if m.slip}
CHECKED = [row for row in ROWS if row.how != DEFINITION]
NUMERIC = [row for row in CHECKED if row.how != SYMBOLIC]


def label(row):
    return row.place


def assert_row(row, failures_by_name):
    """No claim fails but those of the misprints, and each of these does somewhere."""
    shown_wrong = set()
    for where, failed in failures_by_name.items():
        for claim, found, wanted in failed:
            assert claim.misprint, f"{claim.says}: {found} against {wanted} ({where})"
            shown_wrong.add(claim.misprint)
    assert shown_wrong == set(row.misprints) - SLIPS


@pytest.mark.parametrize("row", [
    pytest.param(row, marks=pytest.mark.slow if row.place == "3.5-bench" else ()) for row in CHECKED
], ids=label)  # fmt: skip
def test_row(row):
    if row.how == SYMBOLIC:
        assert_row(row, {"symbolic": failures(row)})
    else:
        assert_row(row, {name: examined(row, name)[0] for name in quick(row)})


@pytest.mark.slow
@pytest.mark.parametrize(("stratum", "h"), [*zip(ARROWS, STEPS, strict=True)])
@pytest.mark.parametrize("row", NUMERIC, ids=label)
def test_row_on_every_groupoid_in_every_stratum(row, stratum, h):
    assert_row(row, {n: failures(row, sample(n, stratum, h, seed=1)) for n in covered(row)})


@pytest.mark.parametrize("row", NUMERIC, ids=label)
def test_a_wrong_ingredient_is_seen(row):
    """Each function that a check reads, off by 1e-30; `free` names those that may be anything."""
    assert blind_to(row) == set(row.free)


@pytest.mark.parametrize("row", [r for r in CHECKED if r.how == SYMBOLIC], ids=label)
def test_a_lost_term_is_seen(row):
    for claim in claims(row):
        if claim.misprint:
            continue
        pairs = list(zip(entries(claim.found), entries(claim.wanted), strict=True))
        found, wanted = next((p for p in pairs if p[1] != 0), pairs[0])
        assert not symbolically_equal(found, loses_a_term(wanted)), claim.says


def test_forty_digits_are_demanded():
    one = entries(1)[0]
    assert agree(one, one + one / 10**41)
    assert not agree(one, one + one / 10**39)
    assert not agree(10**6 * one, 10**6 * one + one / 10**33)
