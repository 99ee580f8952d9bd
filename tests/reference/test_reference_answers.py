"""What is asked and answered: names, times, errors and memory."""

import inspect
from dataclasses import replace
from fractions import Fraction

import pytest
from sympy import sin

from discmech.integrators import Scene, pair, scenes
from discmech.reference import MotionEnds, ReferenceFailure, follow, solution, solutions
from discmech.reference.answer.problem import Problem


def test_times_are_exact():
    """A float is its binary value; a string, a fraction and a decimal string are what they say."""
    tenth = solution("harmonic", "0.1")
    assert tenth.t == Fraction(1, 10)
    assert solution("harmonic", Fraction(1, 10)) is tenth
    assert solution("harmonic", "1/10") is tenth
    assert 0 < abs(solution("harmonic", 0.1).x[0] - tenth.x[0]) < 1e-17


@pytest.mark.slow
def test_several_times_at_once_are_what_they_are_alone():
    times = [3, -1, "0.5", 3]
    together = solutions("lagrange-top", times, digits=31)
    assert [s.t for s in together] == [3, -1, Fraction(1, 2), 3]
    assert solutions("lagrange-top", [], digits=31) == []
    for s in together:
        alone = solution("lagrange-top", s.t, digits=30)
        assert max(abs(a - b) for a, b in zip(s.mu, alone.mu, strict=True)) < 1e-29


def test_the_start_is_the_start():
    found = solution("heavy-top", 0, attitude=True)
    start = scenes.get("heavy-top").x0
    assert all(
        abs(a * b.denominator - b.numerator) < 1e-49 for a, b in zip(found.x, start, strict=True)
    )
    assert found.attitude[0, 0] == 1 and found.attitude[0, 1] == 0
    assert found.certain_digits == 50


def test_solutions_are_kept_by_content():
    scene = scenes.get("heavy-top")
    assert solution(scene, 1) is solution("heavy-top", 1)
    other = scene.with_values(parameters={"weight": "1.0000000001"})
    assert solution(other, 1).x != solution(scene, 1).x


@pytest.mark.parametrize("more", [
    {"force": lambda x, v, p: [-v[0]]},
    {"nonholonomic": lambda x, p: [[1]], "v0": [0]},
    {"lagrangian": lambda x, v, p, t: v[0] ** 2 / 2 - (1 + t) * x[0] ** 2 / 2},
], ids=["force", "constraint", "time"])  # fmt: skip
def test_closed_forms_are_of_lagrangians_alone(more):
    free = scenes.get("harmonic")
    assert Problem.of(free).has_attitude is False
    assert Problem.of(free).form() is not None
    assert Problem.of(replace(free, name="more", **more)).form() is None


def test_evidence_names_what_was_done():
    found = solution("heavy-top", 1)
    assert found.method == "Taylor series" and found.certain_digits == 50
    assert found.certainty == "enclosure" and found.bound < 1e-50
    for words in ("error is enclosed", "Gragg", "energy, μ·Γ and |Γ|² kept to"):
        assert words in found.evidence


def test_sensitive_motion_is_certified_at_higher_precision():
    """x = exp(-rt), r^2 = 2, on a saddle: the rounding of r grows like exp(rt), by 1e18."""
    import mpmath
    import sympy

    scene = replace(
        scenes.get("harmonic"), name="saddle", x0=(1,), v0=(-sympy.sqrt(2),),
        lagrangian=lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2,
    )  # fmt: skip
    found = solution(scene, 30, digits=30)
    assert found.certain_digits == 30 and found.certainty == "enclosure"
    assert "1e-31" not in found.evidence
    with mpmath.workdps(60):
        assert abs(found.x[0] - mpmath.exp(-30 * mpmath.sqrt(2))) < mpmath.mpf(10) ** -30


@pytest.mark.parametrize("scene, t, digits, message", [
    ("pendulm", 1, 50, "there is no scene 'pendulm': did you mean pendulum"),
    ("pendulums", 1, 50, "pendulum or spring-pendulum or double-pendulum?"),  # and no more
    ("zzz", 1, 50, "there are harmonic"),
    ("pendulum", float("nan"), 50, "t=nan is not finite"),
    ("pendulum", float("inf"), 50, "t=inf is not finite"),
    ("pendulum", "soon", 50, "t='soon' is not an exact finite number"),
    ("pendulum", None, 50, "t=None is not an exact"),
    ("pendulum", 1j, 50, "not an exact"),
    ("pendulum", "inf", 50, "not an exact"),
    ("pendulum", 1, 0, "digits=0 is no positive whole number"),
    ("pendulum", 1, 12.5, "digits=12.5 is no positive"),
    (42, 1, 50, "42 is no scene"),
])  # fmt: skip
def test_bad_questions_are_refused(scene, t, digits, message):
    with pytest.raises(ReferenceFailure) as failure:
        solution(scene, t, digits=digits)
    assert message in str(failure.value)
    assert "\n" not in str(failure.value)


def test_attitude_where_there_is_none():
    with pytest.raises(ReferenceFailure, match="pair groupoid, which has no attitude"):
        solution("kepler", 1, attitude=True)


def test_contact_has_no_reference():
    with pytest.raises(ReferenceFailure, match="bouncing-ball has contact"):
        solution("bouncing-ball", 1)


def test_one_time_and_several_are_asked_alike():
    """The same is meant where nothing is said."""
    one, several = (inspect.signature(f).parameters for f in (solution, solutions))
    for name in ("digits", "attitude", "proof"):
        assert one[name].default == several[name].default
    assert one["proof"].default is True and one["attitude"].default is False


@pytest.mark.slow
def test_collision_is_named_with_its_time():
    """Kepler's problem from rest at distance 2a = 2/5: the centre is hit at pi sqrt(a^3)."""
    falling = scenes.get("kepler").with_values(v0=[0, 0])
    with pytest.raises(ReferenceFailure, match=r"stops at t = 0\.2809\d*: .*collision"):
        solution(falling, 1, digits=20)


@pytest.mark.parametrize("potential", [
    lambda x: sin(x[0]) / x[0],  # 0/0, with a limit
    lambda x: 1 / x[0],
])  # fmt: skip
def test_no_series_at_the_start_is_no_end_of_the_motion(potential):
    """It would excuse every failure of a method later on."""
    scene = Scene("start", pair(1), lambda x, v, p: v[0] ** 2 / 2 - potential(x), x0=[0], v0=[1],
                  duration=1, step="1/10")  # fmt: skip
    with pytest.raises(ReferenceFailure, match="no series at t = 0") as failure:
        follow(scene, 1)
    assert not isinstance(failure.value, MotionEnds)


@pytest.mark.slow
def test_a_motion_is_followed_to_its_end_and_no_further_than_so_many_steps():
    fall = scenes.get("kepler").with_values(v0=[0, 0])
    follow(fall, "1/4")
    with pytest.raises(MotionEnds, match=r"stops at t = 0\.2809"):
        follow(fall, 80)
    with pytest.raises(ReferenceFailure, match="more than 10 steps"):
        follow("kepler", 100, max_steps=10)


def on_a_line(lagrangian, x0=0, v0=0):
    return Scene("line", pair(1), lagrangian=lagrangian, x0=[x0], v0=[v0])


def falling(x, v, p):
    return v[0] ** 2 / 2 - 10 * x[0]


@pytest.mark.dear("1e400")
@pytest.mark.parametrize("t", [3, -2, "1e-400", "1e400"])
def test_free_fall(t):
    """A constant acceleration that is a whole number, near and far."""
    import mpmath

    found = solution(on_a_line(falling, 1, 2), t, digits=30)
    time = Fraction(t)
    with mpmath.workdps(900):
        for got, wanted in ((found.x, 1 + 2 * time - 5 * time**2), (found.mu, 2 - 10 * time)):
            wanted = mpmath.mpf(wanted.numerator) / wanted.denominator
            assert abs(got[0] - wanted) <= abs(wanted) * mpmath.mpf(10) ** -30
    assert found.certain_digits == 30


@pytest.mark.sampled
@pytest.mark.parametrize("t", [5, "1e-400", "1e400"])
@pytest.mark.parametrize("scene", [
    on_a_line(lambda x, v, p: v[0] ** 2 / 2),
    on_a_line(lambda x, v, p: v[0] ** 2 / 2 - (x[0] - 1) ** 4, 1),
    scenes.get("rigid-body").with_values(v0=[0, 0, 0]),
])  # fmt: skip
def test_rest_at_an_equilibrium(scene, t):
    found = solution(scene, t, digits=30)
    assert found.certain_digits == 30
    assert list(found.x) == list(scene.x0) and not any(found.v) and not any(found.mu)


@pytest.mark.parametrize("t, message", [
    ("1e400", "more than 1000000 steps: 300 lead to t = 87"), ("1e5000", "lies beyond 10^±1000"),
    ("1e-999999999", "lies beyond"),
])  # fmt: skip
def test_times_that_are_too_far_are_refused_at_once(t, message):
    with pytest.raises(ReferenceFailure) as failure:
        solution("pendulum", t)
    assert message in str(failure.value) and len(str(failure.value)) < 200


def test_a_very_early_time():
    import mpmath

    found = solution("pendulum", "1e-400")
    assert found.certain_digits == 50 and found.mu[0] < 0
    with mpmath.workdps(60):
        wanted = -mpmath.sin(2) * mpmath.mpf(10) ** -400
        assert abs(found.mu[0] / wanted - 1) < mpmath.mpf(10) ** -50
