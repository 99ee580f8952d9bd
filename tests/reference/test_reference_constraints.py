"""References under constraints: refused where rows become dependent on the way, or are at first."""

import pytest

from discmech.integrators import Scene, pair, rules
from discmech.reference import ReferenceFailure, independence, solution
from discmech.studies import check


def free(name, rows, x0, v0, n=2, **more):
    """A body without forces but those of the constraint."""
    return Scene(name, pair(n), lambda x, v, p: v.dot(v) / 2, x0=x0, v0=v0, duration=1,
                 step="1/50", **{"nonholonomic": rows, **more})  # fmt: skip


#: the motion is along x[0], from -1/2 to 1/2
VANISHING = [
    free("a-row", lambda x, p: [[0, x[0]]], ["-1/2", 0], [1, 0]),
    free("a-row-with-more", lambda x, p: [[x[1], x[0], x[0]]], ["-1/2", 0, 0], [1, 0, 0], 3),
    free("the-second-follows", lambda x, p: [[0, 1, 0], [0, 1, x[0]]], ["-1/2", 0, 0], [1, 0, 0],
         3),
    free("tangent", lambda x, p: [[0, x[0] ** 2]], ["-1/2", 0], [1, 0]),
    free("two-lines", None, ["-1/2", "-1/2"], [1, 1],
         holonomic=lambda x, p: [x[1] ** 2 - x[0] ** 2]),
]  # fmt: skip
#: an entry vanishes on the way, but no row
REGULAR = [
    free("turning", None, ["-3/5", "4/5"], ["4/5", "3/5"], holonomic=lambda x, p: [x.dot(x) - 1]),
    free("near", lambda x, p: [[0, x[0], "1/100000"]], ["-1/2", 0, 0], [1, 0, 0], 3),
]


@pytest.mark.parametrize("scene", VANISHING, ids=lambda s: s.name)
def test_what_lies_behind_dependent_rows_is_refused(scene):
    assert solution(scene, "1/4", 20).certain_digits == 20
    for t in ("1/2", "3/5", "1"):
        with pytest.raises(ReferenceFailure, match=r"dependent at t = 0.(5\b|499|500)"):
            solution(scene, t, 20)


@pytest.mark.parametrize("scene", REGULAR, ids=lambda s: s.name)
def test_rows_that_stay_independent_are_no_matter(scene):
    assert solution(scene, 1, 20).certain_digits == 20


def test_without_the_check_the_reference_goes_on(monkeypatch):
    """What the check is for: nothing else gives a sign."""
    monkeypatch.setattr(independence.Independence, "check", lambda *_: None)
    assert solution(VANISHING[0].with_values(name="unseen"), "3/5", 20).certain_digits == 20


def test_dependent_rows_at_the_start_are_named():
    scene = free("at-first", lambda x, p: [[0, x[0]]], [0, 0], [1, 0])
    with pytest.raises(ReferenceFailure, match=r"constraints .* dependent at the start"):
        solution(scene, 1, 20)


@pytest.mark.slow
def test_order_says_why_it_cannot_tell():
    found = check("order", [VANISHING[1]], [rules.get("midpoint")], [16])["cases"]
    assert [c["verdict"] for c in found] == ["inconclusive"]
    assert "dependent at t = 0.5" in found[0]["reason"]
