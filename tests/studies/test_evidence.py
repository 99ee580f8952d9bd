"""Places, and what single steps from them say."""

import random
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

from discmech import check
from discmech.integrators import BadInput, Scene, Scheme, discretisation, one_step, pair, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get as rule
from discmech.integrators.rules import midpoint, trapezoidal
from discmech.studies.core.case import in_chart
from discmech.studies.core.single_steps import Departure
from discmech.studies.evidence import evidence_of
from discmech.studies.evidence.laws import ARROW, FORM, ROUNDINGS, WAY_BACK, Law, worst_departure
from discmech.studies.evidence.many_steps import many_steps
from discmech.studies.evidence.measuring import of_scheme
from discmech.studies.evidence.places import is_linear
from discmech.studies.evidence.scan import times_that_stand_out
from tests.studies.negative_controls.order_trials import trials


def test_places_lie_on_the_motion_and_beside_it_in_every_coordinate():
    scene = Scene(
        "in-space", pair(3), lambda x, v, p: v.dot(v) / 2 + 1 / sympy.sqrt(x.dot(x)),
        x0=["0.4", 0, 0], v0=[0, 2, 0], duration=3, step="0.01",
    )  # fmt: skip
    places = evidence_of(Scheme(scene, midpoint)).places
    assert [place.beside for place in places] == [False, True, True, True]
    assert places[0].x[2] == 0 and all(abs(place.x[2]) > 0.01 for place in places[1:])
    ratios = [Fraction(a.step, b.step) for a in places for b in places if a is not b]
    assert all(r.numerator & (r.numerator - 1) or r.denominator & (r.denominator - 1)
               for r in ratios)  # fmt: skip


def test_places_follow_from_the_content_of_scene_and_rule():
    scene = scenes.get("pendulum")
    first, again = (evidence_of(Scheme(scene, midpoint)) for _ in range(2))
    assert first is not again and first.seed == again.seed
    assert [p.x for p in first.places] == [p.x for p in again.places]
    assert evidence_of(Scheme(scene, trapezoidal)).seed != first.seed
    heavier = scene.with_values(parameters={"gravity": 2})
    assert evidence_of(Scheme(heavier, midpoint)).seed != first.seed


@pytest.mark.slow
def test_places_are_on_the_orbit_of_the_start():
    """The rows of an attitude stay those of a rotation, however rough the motion is followed."""
    for place in evidence_of(Scheme(scenes.get("pivoted-body"), midpoint)).places:
        rows = [place.x[3 + 3 * i : 6 + 3 * i] for i in range(3)]
        with mpmath.workdps(120):
            off = [mpmath.fdot(a, b) - (i == j)
                   for i, a in enumerate(rows) for j, b in enumerate(rows)]  # fmt: skip
            assert max(map(abs, off)) < mpmath.mpf(10) ** -100


@pytest.mark.parametrize("name", ["heavy-top", "spherical-pendulum", "cartesian-pendulum"])
def test_places_are_states_of_the_scene(name):
    """On the sphere, on the constraint, and with the values of quantities that have one."""
    scene = scenes.get(name)
    for place in evidence_of(Scheme(scene, midpoint)).places:
        assert abs(sum(e**2 for e in place.x) - 1) < 1e-15
        if name != "heavy-top":
            across = sum(a * b for a, b in zip(place.x, place.u, strict=True))
            assert abs(across) < 1e-12


@pytest.mark.dear(but=("pendulum",))
@pytest.mark.sampled
@pytest.mark.parametrize("name", ["pendulum", "rigid-body", "duffing", "suslov", "rotor-body"])
@pytest.mark.parametrize("method", ["rectangle", "midpoint", "runge-kutta-4"])
def test_single_steps_have_the_order_of_the_rule(name, method):
    if not rule(method).applies(scenes.get(name)):
        pytest.skip("the rule has no meaning there")
    scheme = Scheme(scenes.get(name), rule(method))
    found = evidence_of(scheme).order
    assert found.order == pytest.approx(scheme.order, abs=1e-3), found.unknown


@pytest.mark.slow
def test_the_exact_map_is_said_to_be_exact():
    @one_step(order=2, groupoids="pair")
    def turned(s, z, h):
        c, d = sympy.cos(h), sympy.sin(h)
        return sympy.Matrix([c * z[0] + d * z[1], c * z[1] - d * z[0]])

    scene = Scene("unit", pair(1), lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 2,
                  x0=[1], v0=[0], duration=5, step="0.1")  # fmt: skip
    evidence = evidence_of(Scheme(scene, turned))
    assert evidence.order.exact and is_linear(evidence.scheme.s)
    assert not is_linear(Scheme(scenes.get("pendulum"), midpoint).s)


@pytest.mark.slow
def test_the_form_beside_the_motion():
    found = evidence_of(Scheme(scenes.get("henon-heiles"), rule("runge-kutta-4"))).departure(FORM)
    assert found.broken and found.size > 1e-9
    assert not evidence_of(Scheme(scenes.get("henon-heiles"), midpoint)).departure(FORM).broken


def in_a_part(size, width, power=1):
    """Verlet that damps the momentum where x passes 3/10, in a part of that width."""

    def step(s, z, h):
        x, p = s.split(z)
        p = p + h / 2 * s.split(s.f(z))[1]
        x = x + h * s.split(s.f(s.join(x, p)))[0]
        p = p + h / 2 * s.split(s.f(s.join(x, p)))[1]
        part = ((s.split(z)[0][0] - sympy.Rational(3, 10)) / width) ** 2
        return s.join(x, p * (1 - size * h**power * sympy.exp(-part)))

    return one_step(order=2, groupoids="pair", name="in-a-part")(step)


def beside_the_middle(at):
    """Midpoint whose point leaves the middle in a narrow part about that entry of (x, t)."""

    def formula(L, G, x, u, h):
        part = ((list(x)[-1] - at) * 1000) ** 2
        return h * L(G.target(x, u, h * (5 + sympy.exp(-part)) / 10), u)

    return discretisation(order=2, name="beside-the-middle")(formula)


@pytest.mark.parametrize("refusal", [BadInput, CannotMeasure])
def test_a_place_without_a_step_hides_no_departure_at_another(refusal):
    class Sometimes(Law):
        name = "sometimes"

        def departure(self, scheme, place, step):
            if place.beside:
                raise refusal("there is no value here.")
            return Departure(1.0, 1e-20)

    scheme = Scheme(scenes.get("pendulum"), midpoint)
    places, drawn = evidence_of(scheme).places, random.Random(0)
    assert worst_departure(Sometimes(), scheme, places, drawn).broken
    nowhere = worst_departure(Sometimes(), scheme, [p for p in places if p.beside], drawn)
    assert nowhere.size is None and nowhere.unknown == "there is no value here."


@pytest.mark.slow
def test_a_fault_in_a_narrow_part_of_the_motion_is_found_and_judged():
    """28 places and 1,600 steps of 50 digits passed it: the part is a thousandth of the motion."""
    pendulum = scenes.get("pendulum")
    for size in (sympy.Rational(1, 10**4), sympy.Rational(1, 10**7)):
        rule = in_a_part(size, sympy.Rational(1, 1000))
        found = of_scheme(Scheme(pendulum, rule), FORM)
        assert found.order == pytest.approx(0, abs=0.01) and found.laws["form"].broken
        (case,) = check("symplecticity", [pendulum], [rule], [50])["cases"]
        assert case["verdict"] == "fail", case["reason"]
    found = of_scheme(Scheme(pendulum, beside_the_middle(sympy.Rational(3, 10))), FORM, WAY_BACK)
    assert found.order == pytest.approx(1, abs=0.01)
    assert found.laws["way back"].broken and not found.laws["form"].broken


@pytest.mark.slow
def test_a_narrow_part_of_the_scene_hides_no_fault_in_another():
    """It is rightly followed, stands out more, and the motion comes back to it six times."""
    stepped = Scene(
        "stepped", pair(1),
        lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0]) + sympy.tanh(50 * x[0] + 45) / 50,
        x0=["1.3"], v0=["0.2"], duration=10,
    )  # fmt: skip
    for size in (sympy.Rational(1, 100), sympy.Rational(1, 10**6)):
        found = of_scheme(Scheme(stepped, in_a_part(size, sympy.Rational(1, 100))), FORM)
        assert found.order == pytest.approx(0, abs=0.01) and found.laws["form"].broken, size


@pytest.mark.slow
def test_a_fault_of_a_high_power_of_the_step_in_a_narrow_part_is_found():
    """At the steps of the first run it is below round-off."""
    rule = in_a_part(1, sympy.Rational(1, 100), power=5)
    found = of_scheme(Scheme(scenes.get("pendulum"), rule), FORM)
    assert found.order == pytest.approx(2, abs=0.01) and found.laws["form"].broken


@pytest.mark.slow
@pytest.mark.parametrize("at", [5, sympy.Rational(9999, 1000)], ids=["within", "at the end"])
def test_a_fault_in_a_narrow_part_of_the_time_is_found(at):
    driven = Scene(
        "driven", pair(1), lambda x, v, p, t: v[0] ** 2 / 2 + sympy.cos(x[0]) + x[0] * sympy.cos(t),
        x0=[1], v0=["0.3"], duration=10, step="0.1",
    )  # fmt: skip
    found = of_scheme(Scheme(driven, beside_the_middle(at)))
    assert found.order == pytest.approx(1, abs=0.01)
    assert float(found.place.split("t = ")[1]) == pytest.approx(float(at), abs=0.01)


@pytest.mark.parametrize("scene", ["pendulum", "kepler", "henon-heiles", "rigid-body"])
def test_a_smooth_run_has_no_part_that_stands_out(scene):
    assert times_that_stand_out(Scheme(scenes.get(scene), midpoint)) == ([], "")


@pytest.mark.slow
def test_many_of_each():
    counts, lines = trials(20261126, 20, 60)
    assert counts[0] == {"fail": 20}, lines
    assert not counts[1]["fail"] and counts[1]["inconclusive"] <= 3, lines


BESIDE_A_GROUP = [s.name for s in scenes.all_scenes() if s.groupoid.kind in ("action", "product")]


@pytest.mark.dear("pivoted-body", "wong", "ball", "kepler", "driven", "kovalevskaya")
@pytest.mark.parametrize("scene", BESIDE_A_GROUP)
def test_the_arrow_of_a_short_step_is_the_velocity(scene):
    """A sound one is nearer than 10⁻⁶ of the limit; a Casimir of 10⁻⁹ is far beyond it."""
    found = evidence_of(Scheme(scenes.get(scene), midpoint)).departure(ARROW)
    assert found.size < 1e-5 * found.limit


@pytest.mark.dear("kirchhoff", "sl2]", "suslov")
@pytest.mark.parametrize("scene", ["rigid-body", "kirchhoff", "sl2", "suslov"])
@pytest.mark.parametrize("retraction", ["cayley", "exponential"])
def test_sound_rules_have_their_order_in_the_attitude_too(scene, retraction):
    chart = in_chart(scenes.get(scene), retraction)
    found = evidence_of(Scheme(chart, trapezoidal)).order
    assert any(c.name.startswith("x") for c in found.components)
    assert found.order == pytest.approx(2, abs=0.01)


@pytest.mark.dear("suslov", "guiding-centre")
@pytest.mark.parametrize(("scene", "name"), [
    ("lotka-volterra-half", "degenerate-gauss-1"), ("guiding-centre", "projected-gauss-1"),
    ("cartesian-pendulum", "midpoint"), ("suslov", "midpoint"),
])  # fmt: skip
def test_a_way_back_begins_on_the_states_that_a_rule_has(scene, name):
    """Beside the motion μ was not ϑ(x), and in doubles a state is off φ = 0 for 50 digits."""
    scheme = Scheme(scenes.get(scene), rule(name))
    assert not WAY_BACK.conspicuous(scheme)[0]
    many = many_steps(scheme)
    assert np.nanmax(WAY_BACK.gaps(many)) < ROUNDINGS * 2.0**-53


NARROW = {
    "in x": lambda x, mu, h: (x - sympy.Rational(7, 5)) * 4000,
    "in the momentum": lambda x, mu, h: (mu + sympy.Rational(13, 10)) * 1000,
    "in the step": lambda x, mu, h: (h - sympy.Rational(7, 100)) * 2000,
    "nowhere": lambda x, mu, h: sympy.oo,
}


@pytest.mark.dear("in x", "in the momentum")
@pytest.mark.parametrize("part", NARROW)
def test_a_form_that_is_lost_in_a_narrow_part(part):
    """Of the states or of the sizes of steps, by a power above the order, which alters no order."""

    @one_step(order=2, symplectic=True, groupoids="pair")
    def narrow(s, z, h):
        x, mu = s.split(z)
        mu = mu + h / 2 * s.split(s.f(z))[1]
        x = x + h * s.split(s.f(s.join(x, mu)))[0]
        mu = mu + h / 2 * s.split(s.f(s.join(x, mu)))[1]
        lost = h**3 / 10 * sympy.exp(-(NARROW[part](x[0], mu[0], h) ** 2))
        return s.join(x, mu * (1 - lost))

    scheme = Scheme(scenes.get("pendulum"), narrow)
    assert evidence_of(scheme).departure(FORM).broken == (part != "nowhere")
    assert evidence_of(scheme).order.order == pytest.approx(2, abs=0.01)


@pytest.mark.parametrize("grown", [0, 1])
def test_a_formula_is_held_to_the_volume_that_it_claims(grown):
    @one_step(order=2, keeps="volume", groupoids="pair")
    def claimed(s, z, h):
        x, mu = s.split(z)
        half = x + h / 2 * s.split(s.f(z))[0]
        mu = mu + h * s.split(s.f(s.join(half, mu)))[1]
        x = half + h / 2 * s.split(s.f(s.join(half, mu)))[0]
        return s.join(x, mu * (1 + grown * h**3 / 100))

    (case,) = check("symplecticity", ["pendulum"], [claimed], [16], steps=8)["cases"]
    assert case["verdict"] == ("fail" if grown else "pass")
    assert ("volume" in case["reason"]) == bool(grown)


def test_an_entry_that_is_round_off_all_along_has_the_scale_of_the_others():
    """A radial motion in oblique coordinates: an entry of 1e-17 was its own scale."""
    turned = sympy.Matrix([["0.3", "0.1"], ["0.1", "0.7"]])

    def lagrangian(x, v, p):
        y, w = turned * sympy.Matrix(x), turned * sympy.Matrix(v)
        return w.dot(w) / 2 - y.dot(y) / 2 - y.dot(y) ** 2

    scene = Scene(name="oblique", groupoid=pair(2), lagrangian=lagrangian, x0=[1, 0], v0=[0, 0],
                  duration=10, step="0.1")  # fmt: skip
    scheme = Scheme(scene, midpoint)
    assert 0 < abs(scheme.flow("0.1").trajectory(100).x[:, 1]).max() < 1e-14
    assert not WAY_BACK.conspicuous(scheme)[0]


@pytest.mark.slow
def test_a_casimir_of_an_action_groupoid_is_another_motion():
    """(x, μ) move rightly with Γ·μ in H, and the top turns about Γ at another rate."""

    @discretisation(order=2, groupoids="action")
    def turned(L, G, x, u, h):
        y = G.target(x, u, h / 2)
        return h * L(y, u - y / 10**9)

    (case,) = check("order", ["heavy-top"], [turned], [50])["cases"]
    assert case["measured"]["order"] == pytest.approx(2, abs=0.01)
    assert case["verdict"] == "fail" and "arrow u" in case["reason"]
    assert "a step so short would leave at most 1e-14" in case["reason"]
