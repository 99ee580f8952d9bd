"""What makes an answer certain: settings, methods, forms and invariants that agree."""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from types import SimpleNamespace

import mpmath
import pytest
from mpmath import mpf

from discmech.integrators import Scene, pair, scenes
from discmech.reference import ReferenceFailure, multipliers, solution
from discmech.reference.answer import certify
from discmech.reference.answer.invariants import Invariants
from discmech.reference.answer.problem import Problem
from discmech.reference.closed_forms import registry

T = Fraction(3)
EQUATIONS = SimpleNamespace(name="made up", dim_x=1, dim_u=0, start=(), attitude_size=0)
ASKED = certify.Question(EQUATIONS, None, [T], 30)


@pytest.fixture
def runs(monkeypatch):
    """The settings of each run; ``right[digits]`` of a result's digits are right, else all."""
    made, right = [], {}

    def integrate(equations, program, times, settings):
        assert Fraction(0) in times
        made.append(settings)
        return SimpleNamespace(steps=len(made), order=settings.order)

    def blocks(equations, sweep, working):
        digits = made[sweep.steps - 1].digits
        with mpmath.workdps(400):
            wrong = mpf(9) * mpf(10) ** -(right.get(len(made), digits) + 1)
            return {t: {"x": [1 + (wrong if t else 0)]} for t in (Fraction(0), T)}

    monkeypatch.setattr(certify, "integrate", integrate)
    monkeypatch.setattr(certify, "all_blocks", blocks)
    return made, right


#: right digits of each run -> how many runs there are, for 30 digits
TRIED = [({}, 2), ({1: 30}, 2), ({1: 29}, 3), ({1: 20, 2: 29}, 4), ({1: 20, 2: 30}, 3),
         ({k: 2 * k for k in range(1, 20)}, 2 + certify.ATTEMPTS)]  # fmt: skip


@pytest.mark.parametrize("given, count", TRIED)
def test_two_settings_are_raised_until_they_agree(runs, given, count):
    """Orders in turn; each has the digits that lacked at least, and none is far more precise."""
    made, right = runs
    right |= given
    found, sweep, settings = certify._two_settings(ASKED, "why not")
    assert len(made) == sweep.steps == count and settings == made[-1]
    for k, (one, two) in enumerate(pairwise(made)):
        lacking = max(0, 30 - right.get(k, one.digits)) if k else 0
        assert lacking < two.digits - one.digits < lacking + 50
        assert 0.1 < abs(one.stretch - two.stretch) < 0.3 and 8 <= one.guard <= two.guard < 20
    assert 30 < made[0].digits < 40
    assert found[T].certain == min(right.get(count - 1, made[-2].digits), 10**6)
    for words in (f"1e-{made[-2].digits}, {made[-2].digits + made[-2].guard} digits",
                  f"1e-{made[-1].digits}, {made[-1].digits + made[-1].guard} digits",
                  f"of order {made[-2].order} ", f"of order {made[-1].order} ",
                  "agree to ", "no bound: why not"):  # fmt: skip
        assert words in found[T].evidence
    assert found[T].certainty == "agreement" and found[T].bound is None


@pytest.mark.parametrize("given, agreed, tolerances", [
    ({}, 44, 1), ({1: 30}, 30, 1), ({1: 29}, 54, 2), ({1: 20, 2: 10}, 10, 2),
])  # fmt: skip
def test_a_second_method_has_a_second_try(runs, monkeypatch, given, agreed, tolerances):
    made, right = runs
    right |= given
    monkeypatch.setattr("discmech.reference.answer.certify.extrapolate",
                        lambda e, times, digits, max_steps: certify.integrate(
                            e, None, times, certify.TaylorSettings(digits)))  # fmt: skip
    trusted = {t: {"x": [mpf(1)]} for t in (Fraction(0), T)}
    assert certify._second_method(ASKED, 44, trusted, 7) == {T: agreed}
    assert [s.digits for s in made] == [44, 54][:tolerances]


@pytest.mark.parametrize("failure", [ReferenceFailure, NameError])
def test_a_second_method_that_cannot_be_run_is_said(monkeypatch, failure):
    def fails(*_, **__):
        raise failure("no")

    monkeypatch.setattr("discmech.reference.answer.certify.extrapolate", fails)
    found = solution("henon-heiles", "1/7", 20)
    assert "extrapolation could not be run" in found.evidence and found.certain_digits == 20


def evidence(scene, form=None, attitude=False, **more):
    found = certify.certified_integration(scene, [T], 20, attitude, form=form, **more)
    assert found[T].certain_digits == 20
    return found[T].evidence


@pytest.mark.slow
def test_the_second_method_is_run_where_nothing_else_is_beside_a_cheap_run(monkeypatch):
    """Its cost is counted in products of coefficients; a form has to give what was asked for."""
    scene = scenes.get("rigid-body")
    form = replace(registry()["rigid-body"], attitude=False)
    sweeps, right = [], certify.bounded_integration

    def seen(*given):
        found = right(*given)
        sweeps.append(found[1])
        return found

    monkeypatch.setattr(certify, "bounded_integration", seen)
    for more, run in (({}, True), ({"form": form}, False), ({"form": form, "thorough": True}, True),
                      ({"form": form, "attitude": True}, True),
                      ({"form": registry()["rigid-body"], "attitude": True}, False)):  # fmt: skip
        assert ("extrapolation agrees" in evidence(scene, **more)) == run
    (products,) = {certify.derived(scene, False)[1].products}
    cost = sweeps[0].steps * sweeps[0].order ** 2 * products
    for price, run in ((cost, False), (cost + 1, True)):
        monkeypatch.setattr(certify, "CHEAP", price)
        assert ("extrapolation agrees" in evidence(scene)) == run
        assert "extrapolation agrees" in evidence(scene, thorough=True)


def test_a_form_is_computed_with_more_digits_until_it_agrees(monkeypatch):
    """Its own round-off is none of the answer's; where it never agrees, that is said."""
    scene, asked, right = scenes.get("harmonic"), [], certify.form_at
    form = registry()["harmonic"]

    def rough(lost):
        def at(equations, parameters, form, t, working):
            asked.append(working)
            found = right(equations, parameters, form, t, working)
            with mpmath.workdps(400):
                return found | {"x": [found["x"][0] + mpf(10) ** (lost - working)]}

        return at

    for lost, tries in ((0, 1), (10, 1), (30, 2), (60, 2)):
        asked.clear()
        monkeypatch.setattr(certify, "form_at", rough(lost))
        assert "agrees to" in evidence(scene, form=form) and len(asked) == tries
    monkeypatch.setattr(certify, "form_at", rough(10**6))
    asked.clear()
    found = certify.certified_integration(scene, [T], 20, False, form=form)[T]
    assert len(asked) == certify.ATTEMPTS and found.certain_digits == 0
    assert found.certainty == "agreement" and found.bound is None
    assert all(b >= 2 * a for a, b in pairwise(asked))


def test_a_scene_that_cannot_be_hashed_is_solved_as_well():
    scene = scenes.get("harmonic")

    class Changing(SimpleNamespace):
        __hash__ = None

    same = Changing(**{name: getattr(scene, name) for name in
                       ("name", "groupoid", "lagrangian", "parameters", "x0", "v0")})  # fmt: skip
    assert solution(same, T, 20).x == solution(scene, T, 20).x
    assert certify.derived(scene, False) is certify.derived(scene, False)


def test_multipliers_where_rows_are_dependent():
    at = solution("cartesian-pendulum", "1/2", 20)
    with pytest.raises(ReferenceFailure, match=r"constraints .* are dependent at t = 0.5"):
        multipliers("cartesian-pendulum", replace(at, x=[mpf(0), mpf(0)]))


def test_a_problem_is_solved_with_a_proof_and_no_more_unless_it_is_asked_for():
    problem = Problem.of(scenes.get("pendulum"))
    plain = problem.solve([T], 20, False)[T]
    assert plain.certainty == "enclosure" and "extrapolation" not in plain.evidence
    assert problem.solve([T], 20, False, proof=False)[T].certainty == "agreement"
    assert "extrapolation agrees" in problem.solve([T], 20, False, thorough=True)[T].evidence


def kept(*now, start=(1, 1, 1), broken=()):
    """What is said where three quantities, each a sum of terms of size 1, are now these."""
    made = Invariants(
        ("a", "b", "c"),
        lambda *numbers: [(n, 1) for n in numbers],
        lambda *numbers: [(mpf("1e-9" if k in broken else "1e-11"), 1) for k in range(3)],
    )

    def blocks(numbers):
        x, v, mu = (mpf(n) if isinstance(n, int) else 1 + mpf(n) for n in numbers)
        return {"x": [x], "v": [v], "mu": [mu]}

    with mpmath.workdps(60):
        return made.digits(blocks(now), blocks(start), 50)


def test_what_is_kept_is_told_by_the_worst():
    assert kept(1, 1, 1) == (10**6, "a, b and c kept exactly")
    assert kept("9e-31", "-9e-21", 1) == (20, "a, b and c kept to 20 digits (b least)")
    assert kept("9e-31", 1, "9e-41") == (30, "a, b and c kept to 30 digits (a least)")
    for lost in (mpmath.nan, mpmath.inf, mpf(8)):
        assert kept(1, lost, 1) == (0, "a, b and c kept to 0 digits (b least)")
    some = "; a, which the scene declares, not conserved by its equations"
    assert kept(2, "9e-21", 1, broken=[0]) == (20, f"b and c kept to 20 digits (b least){some}")
    assert kept(2, 2, "9e-21", broken=[0, 1])[1].startswith("c kept to 20 digits; a and b, which")
    assert kept(2, 2, 2, broken=range(3))[1].startswith("no invariant to compare; a, b and c,")


def test_the_drift_is_relative_to_the_terms_here_or_at_the_start():
    made = Invariants(("a",), lambda x, v, mu: [(x, v)], lambda *_: [(0, 1)])
    for here, start in ((1, 100), (100, 1), (100, 100)):
        pair = ({"x": [mpf(x)], "v": [mpf(v)], "mu": [mpf(0)]}
                for x, v in ((mpf("9e-31"), here), (0, start)))  # fmt: skip
        assert made.digits(*pair, 50)[0] == 32


def quantity(name, formula, **more):
    given = {"attitude": False, "kind": "momentum", "at": lambda x, mu, p, h: formula(x, mu, p)}
    return SimpleNamespace(name=name, formula=formula, **given | more)


def declared(*quantities, scene, attitude=False, **changes):
    given = scenes.get(scene)
    same = {name: getattr(given, name) for name in
            ("name", "groupoid", "lagrangian", "parameters", "x0", "v0")}  # fmt: skip
    asked = SimpleNamespace(**same | changes, symmetries=quantities)
    return certify.certified_integration(asked, [T], 20, attitude)[T]


@pytest.mark.slow
def test_what_a_scene_declares_is_kept_or_named():
    """Also where the rates are a list of assignments."""
    for scene in ("harmonic", "double-pendulum"):
        wrong = quantity("first place", lambda x, mu, p: x[0])
        right = quantity("seven", lambda x, mu, p: 7)
        found = declared(wrong, right, scene=scene)
        assert "energy and seven kept to" in found.evidence and found.certain_digits == 20
        assert "; first place, which the scene declares, not conserved" in found.evidence
    body = declared(quantity("|m|²", lambda x, mu, p: mu.dot(mu)), scene="rigid-body")
    assert "energy and |m|² kept to" in body.evidence
    many = declared(quantity("both", lambda x, mu, p: mu * 0 + mu), scene="rigid-body")
    assert "energy kept" in many.evidence and "both, which the scene" in many.evidence


@pytest.mark.parametrize("more", [{"of_step": True}, {"kind": "nonholonomic momentum"},
                                  {"attitude": True}])  # fmt: skip
def test_what_no_motion_keeps_is_not_compared(more):
    """Of a method; with an equation of its own; of an attitude that is not asked for."""
    skipped = SimpleNamespace(**vars(quantity("nothing", lambda x, mu, p: 1 / 0)) | more)
    later = quantity("seven", lambda x, mu, p: 7)
    for given in ((skipped, later), (later, skipped)):
        found = declared(*given, scene="harmonic")
        assert "energy and seven kept to" in found.evidence and "nothing" not in found.evidence


def test_an_energy_of_zero_is_kept_however_it_is_written():
    """Its terms cancel at the start, also where they stand in a product or a power."""
    ways = (
        lambda x, mu, p: (mu[0] ** 2 + 1) / 2 - 5 / (1 + x[0] ** 2),
        lambda x, mu, p: ((x[0] ** 2 + 1) * (mu[0] ** 2 + 1) / 2 - 5) / (1 + x[0] ** 2),
        lambda x, mu, p: mu[0] + (mu[0] - 3 - x[0]) ** 2 - mu[0],
    )
    for k, energy in enumerate(ways):
        scene = Scene(f"zero-{k}", pair(1), hamiltonian=energy, x0=[-3], mu0=[0])
        assert solution(scene, "1/2", digits=20).certain_digits == 20, k


def test_a_force_or_the_time_keeps_no_energy_and_what_cannot_be_evaluated_is_named():
    for changes in ({"force": lambda x, v, p: [-v[0]]},
                    {"lagrangian": lambda x, v, p, t: v[0] ** 2 / 2 - t * x[0]}):  # fmt: skip
        assert "no invariant" in declared(scene="harmonic", **changes).evidence
    with pytest.raises(ReferenceFailure, match=r"quantity odd of scene harmonic cannot be .*Zero"):
        declared(quantity("odd", lambda x, mu, p: 1 / 0), scene="harmonic")


def test_a_quantity_of_the_attitude_is_compared_where_there_is_one():
    turning = quantity("spatial momentum", lambda A, mu, p: A * mu)
    turning.attitude = True
    found = declared(turning, scene="rigid-body", attitude=True)
    assert "energy and spatial momentum kept to" in found.evidence
    assert found.attitude.rows == 3
