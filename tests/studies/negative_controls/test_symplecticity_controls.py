"""Maps that are broken on purpose: the study of symplecticity must say no to them."""

import numpy as np
import pytest

from discmech.integrators import BadInput, LocalGroupoid, Scene, StepFailure, scenes
from discmech.integrators.rules import trapezoidal
from discmech.studies import check
from discmech.studies.core import controls
from discmech.studies.symplecticity.limits import limit
from discmech.studies.symplecticity.measuring import CONTROL_SCENES
from tests.studies.cached_results import case, measured, result

CONTROLS = [
    (scene, control)
    for scene in CONTROL_SCENES
    for control in controls.NAMES
    if control != controls.FLIPPED or scene in ("heavy-top", "rotor-body")
]


@pytest.mark.dear("heavy-top-explicit Euler", "rotor-body-explicit Euler", "rigid-body-Heun",
                  "body", "Heun", "Kutta")  # fmt: skip
@pytest.mark.sampled
@pytest.mark.parametrize(
    ("digits", "margin"), [(16, 1e3), pytest.param(50, 1e20, marks=pytest.mark.slow)]
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


@pytest.mark.dear("2-heavy-top", "2-rotor-body", "1-heavy-top")
@pytest.mark.sampled
@pytest.mark.parametrize("scene", CONTROL_SCENES)
@pytest.mark.parametrize(("control", "power"), [("classical Runge-Kutta", 2), ("Heun", 1)])
def test_at_small_steps_runge_kutta_is_symplectic_to_round_off(scene, control, power):
    """Why the largest stable step is needed: the defect falls with h.

    It is of order h^(order + 1), and the terms of some entries are O(h³), Heun's O(h²): relative to
    them it falls as h^power.
    """
    rows = result("symplecticity", scene, "trapezoidal", 16, 24, control)["rows"]
    steps = sorted({row["step"] for row in rows})
    defects = [max(r["poisson"] for r in rows if r["step"] == h) for h in steps]
    assert defects[-1] >= 1e3 * limit(16)
    assert defects[0] <= limit(16) or control == "Heun"
    clear = [(h, d) for h, d in zip(steps, defects, strict=True) if d > 1e-12]
    (h1, d1), (h2, d2) = clear[:2]
    assert np.log(d2 / d1) / np.log(h2 / h1) > power - 0.6


def test_damping_is_seen_in_proportion(monkeypatch):
    def worst(damping):
        monkeypatch.setattr(controls, "DAMPING", damping)
        flow = case("symplecticity", "heavy-top", trapezoidal).scheme.flow("0.1", 50)
        run = flow.trajectory(2)
        return max(controls.damped_defect(flow, x, u) for x, u in zip(run.x, run.u, strict=True))

    assert worst("0") <= limit(50)
    assert worst("1e-12") / worst("1e-6") == pytest.approx(1e-6, rel=1e-3)


def test_a_product_that_is_no_product_is_refused_before_anything_is_measured():
    lopsided = LocalGroupoid(
        1, 1,
        target=lambda x, u, h: [x[0] + h * u[0]],
        product=lambda x, u, v, h: [u[0] + v[0] + h * u[0] ** 2 * v[0]],
    )  # fmt: skip
    scene = Scene("lopsided", lopsided, lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[1])
    with pytest.raises(BadInput, match=r"(?i)associat|inverse|unit|target"):
        check("symplecticity", [scene], ["midpoint"], [16])


def test_a_step_that_could_not_be_followed_is_said(monkeypatch):
    from discmech.studies.symplecticity import measuring

    sound, own = measuring._rows_at, scenes.get("pendulum").step

    def refused(case, step):
        if step > own:
            raise StepFailure("pendulum", "gauss-2", 0, 0.0, {}, "no stages")
        return sound(case, step)

    monkeypatch.setattr(measuring, "_rows_at", refused)
    monkeypatch.setattr(measuring, "largest_stable_step", lambda case: 4 * own)
    found = measured("symplecticity", "pendulum", "gauss-2", steps=24)
    assert found["verdict"] == "pass" and found["left_out_step"] == float(4 * own)
