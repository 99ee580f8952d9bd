"""References under constraints: refused where rows become dependent on the way, or are at first."""

import mpmath
import pytest
import sympy

from discmech.integrators import Scene, lie_group, pair, rules, se
from discmech.reference import ReferenceFailure, multiplier_sizes, multipliers, solution
from discmech.reference.equations.constrained_start import on_constraints
from discmech.reference.taylor import independence
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


def test_the_multiplier_of_a_closed_form_to_all_digits():
    """λ = g x₂ − |v|² of a pendulum, whatever its place."""
    at = solution("cartesian-pendulum", "1/2", 30)
    (found,) = multipliers("cartesian-pendulum", at)
    with mpmath.workdps(40):
        assert abs(found - (at.x[1] - at.v[0] ** 2 - at.v[1] ** 2)) < 1e-30
    with pytest.raises(ReferenceFailure, match="pendulum has no constraints"):
        multipliers("pendulum", solution("pendulum", "1/2", 20))


def test_the_multiplier_of_a_force_that_knows_the_time():
    """A table carries a body that is pressed on it with 1 + t: λ = 1 + t."""
    scene = free("pressed", None, [0, 0], [1, 0], holonomic=lambda x, p: [x[1]],
                 force=lambda x, v, p, t: [0, -1 - t])  # fmt: skip
    for t in ("1/3", "3/2"):
        at = solution(scene, t, 20)
        (found,) = multipliers(scene, at)
        assert abs(found - 1 - mpmath.mpf(at.t.numerator) / at.t.denominator) < 1e-15


def test_forces_that_cancel_leave_a_multiplier_of_round_off_and_fail_no_rule():
    """A body slides along the diagonal of its plane: nothing pushes it off, and λ is 0."""
    scene = Scene(
        "slides", lie_group(se(2)), lambda x, v, p: v.dot(v) / 2, v0=["1/2", 1, 1], duration=2,
        step="1/20", holonomic=lambda x, p: [x[2] - x[5]],
    )  # fmt: skip
    assert scene.with_attitude() is scene
    at = solution(scene, "1/20", 30)
    (found,), (size,) = multipliers(scene, at), multiplier_sizes(scene, at)
    assert 0 < abs(found) < 1e-28 and 1 / 2 < size < 2
    (case,) = check("order", [scene], [rules.midpoint], digits=[50])["cases"]
    assert case["verdict"] == "pass" and len(case["rows"]) >= 4


def test_dependent_rows_at_the_start_are_named():
    scene = free("at-first", lambda x, p: [[0, x[0]]], [0, 0], [1, 0])
    with pytest.raises(ReferenceFailure, match=r"constraints .* dependent at the start"):
        solution(scene, 1, 20)


LETTERS = sympy.symbols("x:2 v:2", real=True)
CIRCLE = sympy.Matrix([LETTERS[0] ** 2 + LETTERS[1] ** 2 - 1])


def put(*start, phi=CIRCLE):
    """The start on phi = 0 that is found for these numbers."""
    given = tuple(sympy.Rational(e) for e in start)
    rows = phi.jacobian(LETTERS[:2])
    v = sympy.Matrix(LETTERS[2:])
    return given, on_constraints("circle", given, phi, rows * v, LETTERS[:2], v)


def test_a_start_on_its_constraints_is_left_alone():
    given, found = put("3/5", "4/5", 4, -3)
    assert found == given


@pytest.mark.parametrize("start", [(0.6, 0.8, "0.4", "-0.3"), ("3/5", "4/5", 0.1, -0.075),
                                   (0.6 + 2**-53, 0.8, 0.4, -0.3)])  # fmt: skip
def test_a_start_that_round_off_hides_is_put_there_with_the_least_change(start):
    given, found = put(*start)
    at = dict(zip(LETTERS, found, strict=True))
    assert abs(CIRCLE[0].subs(at)) < 1e-100
    assert abs((CIRCLE.jacobian(LETTERS[:2]) * sympy.Matrix(LETTERS[2:]))[0].subs(at)) < 1e-100
    moved = [float(b - a) for a, b in zip(given, found, strict=True)]
    assert all(abs(e) < 4e-16 for e in moved) and any(moved)
    # along the gradient (3, 4)/5, of x and of v
    for across, along in (moved[:2], moved[2:]):
        assert 4 * across == pytest.approx(3 * along, rel=1e-9, abs=1e-40)


def test_a_start_that_is_off_is_refused_with_one_that_is_not():
    said = (
        r"phi\(x0\) = 0 of scene circle is off by 0.0201; give .* x0=\[1.0, 0.0\], v0=\[0.0, 2.0\]"
    )
    with pytest.raises(ReferenceFailure, match=said):
        put("1.01", 0, 0, 2)
    with pytest.raises(ReferenceFailure, match=r"A\(x0\) v0 = 0 .* off by 2; .* v0=\[0.0, 5.0\]"):
        put(1, 0, 1, 5)
    none = sympy.Matrix([LETTERS[0] ** 2 + 1])
    with pytest.raises(ReferenceFailure, match=r"is off by 2; give a start that satisfies it$"):
        put(1, 0, 0, 2, phi=none)
    # four units of round-off of a row whose size is 4, and its slope 2
    assert abs(put(1 + sympy.Rational(7, 2**53), 0, 0, 1)[1][0] - 1) < 1e-100
    with pytest.raises(ReferenceFailure, match=r"off by 2e-15"):
        put(1 + sympy.Rational(9, 2**53), 0, 0, 1)
    with pytest.raises(ReferenceFailure, match=r"phi\(x0\) = 0"):  # whatever the velocity is
        put(1 + sympy.Rational(1, 10**12), 0, 0, 10**9)
    assert put(1, 0, "1/1000000", 10**12)[1] == (1, 0, 0, 10**12)
    assert put(0, 1, 10**12, "1/1000000")[1] == (0, 1, 10**12, 0)


@pytest.mark.slow
def test_order_says_why_it_cannot_tell():
    found = check("order", [VANISHING[1]], [rules.get("midpoint")], [16])["cases"]
    assert [c["verdict"] for c in found] == ["inconclusive"]
    assert "dependent at t = 0.5" in found[0]["reason"]
