"""Methods that are broken on purpose: each study must say no to what it is there to catch."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, LocalGroupoid, Scene, discretisation, scenes
from discmech.integrators.equations.legendre_maps import LegendreMaps
from discmech.integrators.rules import midpoint, rectangle, trapezoidal
from discmech.integrators.scene import Conserved
from discmech.studies import check, get
from discmech.studies.core import controls
from discmech.studies.core.running import run_case
from discmech.studies.symplecticity.measuring import CONTROL_SCENES, limit
from tests.studies.cached_results import case, result

CONTROLS = [
    (scene, control)
    for scene in CONTROL_SCENES
    for control in controls.NAMES
    if control != controls.FLIPPED or scene in ("heavy-top", "rotor-body")
]


def copy(name, **changes):
    """A scene of its own: what is broken here is derived anew and shared with nobody."""
    return scenes.get(name).with_values(**changes)


# -- symplecticity --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("digits", "margin"),
    [(16, 1e3), pytest.param(50, 1e20, marks=pytest.mark.slow)],
)
@pytest.mark.parametrize(("scene", "control"), CONTROLS)
def test_every_control_is_caught_with_a_margin(scene, control, digits, margin):
    found = result("symplecticity", scene, "trapezoidal", digits, 24, control)
    assert found["verdict"] == "pass" and found["control"] is True, found["reason"]
    assert found["rule"] == control
    wanted = margin * (1e-13 if digits == 16 else 1e-45)
    assert found["expected"]["at_least"] == pytest.approx(wanted)
    caught = [v for v in found["measured"].values() if v is not None]
    assert max(caught) >= wanted


def test_controls_at_50_digits_where_everything_is_present():
    for control in controls.NAMES:
        found = result("symplecticity", "heavy-top", "trapezoidal", 50, 8, control)
        assert max(v for v in found["measured"].values() if v is not None) >= 1e-25
        assert found["verdict"] == "pass"


@pytest.mark.parametrize("scene", CONTROL_SCENES)
@pytest.mark.parametrize(("control", "power"), [("classical Runge-Kutta", 5), ("Heun", 3)])
def test_at_small_steps_runge_kutta_is_symplectic_to_round_off(scene, control, power):
    """Why the largest stable step is needed: the defect falls as h^(order + 1), down to nothing."""
    rows = result("symplecticity", scene, "trapezoidal", 16, 24, control)["rows"]
    steps = sorted({row["step"] for row in rows})
    defects = [max(r["poisson"] for r in rows if r["step"] == h) for h in steps]
    assert defects[0] <= limit(16) and defects[-1] >= 1e3 * limit(16)
    if control == "Heun":
        assert defects[0] <= 1e-15
    clear = [(h, d) for h, d in zip(steps, defects, strict=True) if d > 1e-12]
    (h1, d1), (h2, d2) = clear[0], clear[3]
    assert np.log(d2 / d1) / np.log(h2 / h1) > power - 0.6


def test_a_control_that_is_not_caught_is_a_failure(monkeypatch):
    monkeypatch.setattr(controls, "damped_defect", lambda flow, x, u: 3e-16)
    found = run_case(get("symplecticity"), case("symplecticity", "pendulum", trapezoidal, 16, 24,
                                                controls.DAMPED))  # fmt: skip
    assert found["verdict"] == "fail" and "control was not caught" in found["reason"]


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(
    ("name", "visible"),
    [("pendulum", False), ("kepler", False), ("rigid-body", False), ("heavy-top", True),
     ("lagrange-top", True)],
)  # fmt: skip
def test_a_flipped_bracket_shows_only_beside_an_anchor(name, visible, digits):
    """On a pair groupoid there is no bracket; on a group −Π is kept wherever Π is."""
    flow = case("symplecticity", name, trapezoidal).scheme.flow(scenes.get(name).step, digits)
    run = flow.trajectory(5)
    for x, mu in zip(run.x, run.mu, strict=True):
        assert flow.poisson_defect(x, mu) <= limit(digits)
        flipped = flow.poisson_defect(x, mu, bracket_sign=-1)
        assert flipped >= 1e20 * limit(50) if visible else flipped <= limit(digits)


def test_damping_is_seen_in_proportion(monkeypatch):
    def worst(damping):
        monkeypatch.setattr(controls, "DAMPING", damping)
        flow = case("symplecticity", "heavy-top", trapezoidal).scheme.flow("0.1", 50)
        run = flow.trajectory(2)
        return max(controls.damped_defect(flow, x, u) for x, u in zip(run.x, run.u, strict=True))

    assert worst("0") <= limit(50)
    assert worst("1e-12") / worst("1e-6") == pytest.approx(1e-6, rel=1e-3)


def test_a_defect_that_is_not_finite_is_no_pass():
    rows = [{"step": 0.1, "index": 0, "time": 0.0, "pullback": 1e-17, "poisson": float("inf")}]
    measured = {"pullback": 1e-17, "poisson": float("inf")}
    verdict = get("symplecticity").judge(
        case("symplecticity", "pendulum"), {"rows": rows, "measured": measured}
    )
    assert verdict.verdict == "fail" and "poisson" in verdict.reason


def test_a_product_that_is_no_product_is_refused_before_anything_is_measured():
    lopsided = LocalGroupoid(
        1, 1,
        target=lambda x, u, h: [x[0] + h * u[0]],
        product=lambda x, u, v, h: [u[0] + v[0] + h * u[0] ** 2 * v[0]],
    )  # fmt: skip
    scene = Scene("lopsided", lopsided, lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[1])
    with pytest.raises(BadInput, match=r"(?i)associat|inverse|unit|target"):
        check("symplecticity", [scene], ["midpoint"], [16])


# -- order ----------------------------------------------------------------------------------------


def declared(order, rule):
    return discretisation(order, name=f"so-called-{rule.name}")(rule.formula)


@discretisation()
def radau(L, G, x, u, h):
    """Radau's two points: of second order with a straight path, and not its own adjoint."""
    return h * L(x, u) / 4 + 3 * h * L(G.target(x, u, sympy.Rational(2, 3) * h), u) / 4


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(
    ("scene", "rule", "side"),
    [
        ("pendulum", declared(2, rectangle), "below"),
        ("pendulum", declared(1, radau), "above"),
        ("kepler", declared(1, radau), "above"),
        ("heavy-top", declared(2, rectangle), "below"),
        ("rigid-body", declared(4, midpoint), "below"),
        ("kepler", declared(4, trapezoidal), "below"),
    ],
)
def test_a_wrongly_declared_order_is_caught_from_both_sides(scene, rule, side, digits):
    found = result("order", scene, rule, digits)
    assert found["verdict"] == "fail"
    assert f"is {side} the expected {rule.order}" in found["reason"]


def test_an_order_left_out_is_measured_only():
    found = result("order", "pendulum", discretisation(name="no-claim")(trapezoidal.formula), 50)
    assert found["verdict"] == "pass" and found["expected"]["order"] is None
    assert found["measured"]["order"] == pytest.approx(2, abs=0.01)
    assert "no order" in found["reason"]


def inconsistent(size):
    """The midpoint rule with a potential that is too large by the fraction size·h."""

    def formula(L, G, x, u, h):
        middle = G.target(x, u, h / 2)
        rest = L(middle, 0 * u)
        return h * L(middle, u) + size * h**2 * rest

    return discretisation(2, name=f"drifting-by-{float(size):g}")(formula)


def test_a_rule_that_is_of_first_order_in_the_end_does_not_pass():
    assert result("order", "pendulum", inconsistent(sympy.Rational(1, 10)))["verdict"] == "fail"


LATE = "errors that leave the line far above round-off are taken for round-off"


@pytest.mark.parametrize("size", ["1/100000", "1/1000000"])
def test_a_first_order_error_that_shows_late_is_no_round_off(size):
    found = result("order", "pendulum", inconsistent(sympy.Rational(size)))
    assert found["verdict"] != "pass"


def perturbed(monkeypatch, size):
    """Make the order study compare with the solution for another gravity."""
    import discmech.reference as reference

    def other(scene, *arguments, **more):
        gravity = 1 + sympy.Rational(size)
        return reference_solution(scene.with_values(parameters={"gravity": gravity}),
                                  *arguments, **more)  # fmt: skip

    reference_solution = reference.solution
    monkeypatch.setattr(reference, "solution", other)
    return run_case(get("order"), case("order", copy("pendulum"), trapezoidal, 16))


def test_a_wrong_reference_is_no_pass(monkeypatch):
    found = perturbed(monkeypatch, "1/100")
    assert found["verdict"] != "pass"


@pytest.mark.parametrize("size", ["1/10000000", "1/1000000000"])
def test_a_slightly_wrong_reference_is_no_pass(monkeypatch, size):
    assert perturbed(monkeypatch, size)["verdict"] != "pass"


def free_motion(monkeypatch):
    """A motion that every rule gives exactly: the ladder is on the floor from its first rung on."""
    monkeypatch.setattr("discmech.studies.order.measuring.RUNGS", {True: 4, False: 4})
    monkeypatch.setattr("discmech.studies.order.measuring.MOST_RUNGS", {True: 6, False: 6})
    easy = copy("harmonic", parameters={"stiffness": 0}, v0=[1])
    return run_case(get("order"), case("order", easy, midpoint, 16, 4))


def test_nothing_but_round_off_is_inconclusive(monkeypatch):
    found = free_motion(monkeypatch)
    assert found["verdict"] == "inconclusive" and "exact on this scene" in found["reason"]
    assert len(found["rows"]) == 6  # went on looking for a window, and gave up
    assert found["measured"] == {"order": None, "interval": None, "points": 0}
    assert all(row["why_not"] == "round-off" for row in found["rows"][:-1])


def test_every_point_that_is_left_out_has_a_reason(monkeypatch):
    assert all(row["used"] or row["why_not"] for row in free_motion(monkeypatch)["rows"])


# -- momentum -------------------------------------------------------------------------------------


@pytest.fixture
def wrong_gain(tmp_path, monkeypatch):
    """Schemes whose μ′ − μ = F⁺ − F⁻ is off by a part in 10⁹, as by a wrong simplification."""
    right = LegendreMaps.gain.func

    def gain(self):
        return right(self) * (1 + sympy.Rational(1, 10**9))

    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path / "kernels"))  # of no use to anybody else
    monkeypatch.setattr(LegendreMaps, "gain", property(gain))


@pytest.mark.parametrize(
    ("name", "quantity", "digits"),
    [("lagrange-top", "μ·Γ", 50), ("kepler", "angular momentum", 50),
     ("kepler", "angular momentum", 16)],
)  # fmt: skip
def test_a_wrong_update_makes_momentum_fail(wrong_gain, name, quantity, digits):
    found = run_case(get("momentum"), case("momentum", copy(name), midpoint, digits, 100))
    assert found["verdict"] == "fail" and quantity in found["reason"]
    drift, limit = found["measured"]["drift"], found["expected"]["limit"]
    assert drift[quantity] > limit
    if name == "lagrange-top":  # what Γ alone decides is none of this update's business
        assert drift["|Γ|²"] <= limit


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rule", ["rectangle", "midpoint", "trapezoidal"])
def test_a_quantity_that_is_not_conserved_fails_by_name(rule, digits):
    scene = copy(
        "kepler",
        symmetries=[
            *scenes.get("kepler").symmetries,
            Conserved("first momentum", lambda x, mu, p: mu[0]),
        ],
    )
    found = run_case(get("momentum"), case("momentum", scene, rule, digits, 100))
    assert found["verdict"] == "fail"
    assert found["reason"].startswith("first momentum drifts by")
    assert "angular" not in found["reason"]
    assert found["measured"]["drift"]["angular momentum"] <= found["expected"]["limit"]


def test_a_tiny_drift_is_caught_too():
    """Angular momentum with a part in 10¹⁰ of something that moves: just above round-off."""
    small = sympy.Rational(1, 10**10)
    nearly = Conserved("nearly", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0] + small * x[0])
    found = run_case(
        get("momentum"), case("momentum", copy("kepler", symmetries=[nearly]), midpoint, 16, 1000)
    )
    assert found["verdict"] == "fail" and "nearly" in found["reason"]


def test_first_integrals_are_not_asked_to_be_exact():
    only = Conserved("Hamiltonian", lambda x, mu, p: mu[0] ** 2, kind="first integral")
    with pytest.raises(BadInput, match="declares symmetries or Casimirs"):
        check("momentum", [copy("pendulum", symmetries=[only])], ["midpoint"])


def test_a_quantity_of_several_components_drifts_if_one_of_them_does():
    pair_of_both = Conserved(
        "both", lambda x, mu, p: sympy.Matrix([x[0] * mu[1] - x[1] * mu[0], mu[0]])
    )
    scene = copy("kepler", symmetries=[pair_of_both])
    found = run_case(get("momentum"), case("momentum", scene, midpoint, 16, 100))
    assert found["verdict"] == "fail"


def test_a_rule_that_breaks_a_symmetry_loses_its_momentum():
    """The potential is taken at a point moved sideways: translations stay, rotations do not."""

    @discretisation()
    def sideways(L, G, x, u, h):
        z = G.target(x, u, h / 2)
        return h * L(z + h * sympy.Matrix([0, sympy.Rational(1, 10)]), u)

    found = run_case(get("momentum"), case("momentum", copy("kepler"), sideways, 16, 100))
    assert found["verdict"] == "fail" and "angular momentum" in found["reason"]
    symplectic = run_case(
        get("symplecticity"), case("symplecticity", copy("kepler"), sideways, 16, 24)
    )
    assert symplectic["verdict"] == "pass"  # still variational: only the symmetry is gone


# -- energy ---------------------------------------------------------------------------------------


def wandering(t):
    """The mean goes from one side of the band to the other, and both of its edges stand."""
    return 1e-3 * (1 - 2 * np.abs(np.sin(3 * t)) ** (0.3 + 3 * t / t[-1]))


@pytest.mark.parametrize(
    ("series", "verdict"),
    [
        (wandering, "pass"),
        (lambda t: wandering(t) + 1e-5 * t, "fail"),
        (lambda t: 1e-3 * np.sin(3 * t), "pass"),
        (lambda t: 1e-3 * np.sin(3 * t) ** 2, "pass"),  # off centre, but steady
        (lambda t: 1e-6 * t, "fail"),
        (lambda t: -1e-6 * t, "fail"),
        (lambda t: 1e-3 * np.sin(3 * t) + 1e-5 * t, "fail"),
        (lambda t: 1e-3 * np.sin(3 * t) + 1e-8 * t, "pass"),
        (lambda t: np.expm1(-t / 50), "fail"),
        (lambda t: 0 * t, "pass"),
        (lambda t: 1e-15 * t / t[-1], "pass"),  # a slope within round-off
        (lambda t: np.where(t > 90, np.nan, 1e-3 * np.sin(3 * t)), "fail"),
        (lambda t: np.where(t > 90, np.inf, 1e-3 * np.sin(3 * t)), "fail"),
    ],
)
def test_energy_that_drifts_fails_and_energy_that_oscillates_passes(monkeypatch, series, verdict):
    def errors(scheme, run, digits=16):
        with np.errstate(all="ignore"):
            return series(np.asarray(run.t, dtype=float))

    monkeypatch.setattr("discmech.studies.energy.measuring.energy_errors", errors)
    with np.errstate(all="ignore"):
        found = run_case(get("energy"), case("energy", "harmonic", midpoint, 16, 1000))
    assert found["verdict"] == verdict, found["reason"]
    assert bool(found["reason"]) is (verdict != "pass")


def test_a_run_of_one_period_is_too_short_to_tell():
    assert result("energy", "pendulum", "midpoint", 16, 64)["verdict"] != "fail"


@pytest.mark.parametrize(("study", "digits"), [("order", 50), ("energy", 50)])
def test_an_update_that_loses_a_thousandth_a_step_fails_elsewhere_too(
    wrong_gain, monkeypatch, study, digits
):
    def gain(self):
        return self.plus * sympy.Rational(999, 1000) - self.minus

    monkeypatch.setattr(LegendreMaps, "gain", property(gain))
    found = run_case(get(study), case(study, copy("pendulum"), midpoint, digits))
    assert found["verdict"] in ("fail", "inconclusive" if study == "order" else "fail")


def test_a_quantity_in_stretches_says_over_how_many_steps_it_was_followed(monkeypatch):
    """On sl2 the spatial momentum: three stretches of 20 steps here, in the rows where they are."""
    from discmech.studies.momentum import measuring as momentum
    from discmech.studies.report.tables import _drifts

    monkeypatch.setattr(momentum, "MOST_STRETCHES", 3)
    monkeypatch.setattr(momentum, "interval", lambda steps: 5)
    monkeypatch.setattr("discmech.studies.core.runs.interval", lambda steps: 5)
    found = run_case(get("momentum"), case("momentum", "sl2", midpoint, 16, 100))
    over = found["expected"]["over"]
    assert over.pop("spatial momentum") == 60 and over and set(over.values()) == {100}
    assert found["expected"]["random_walk"] == pytest.approx(2.0**-53 * 10)
    followed = [r["step"] for r in found["rows"] if r["drift"]["spatial momentum"] is not None]
    assert max(followed) == 60 and max(row["step"] for row in found["rows"]) == 100
    found["expected"]["over"]["spatial momentum"] = 60
    assert "(60 steps)" in _drifts(found) and "(100 steps)" not in _drifts(found)
