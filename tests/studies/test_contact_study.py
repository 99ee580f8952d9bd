"""The study of contact: it passes what is right, catches what is wrong, and says what it leaves."""

from dataclasses import replace

import pytest
from sympy import Rational

from discmech import BadInput, Scene, one_step, pair, scenes
from discmech.integrators import rules
from discmech.reference import ReferenceFailure, solution
from discmech.studies import check, get
from discmech.studies.contact import measuring
from discmech.studies.contact.faults import CONTROLS
from discmech.studies.contact.limits import LIMITS
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.fingerprint import of_case
from discmech.studies.symplecticity.limits import limit
from discmech.studies.user.assertions import NotApplicable, assert_order
from tests.integrators.extensions.contact import motions
from tests.studies import contact_trials
from tests.studies.as_json import run_case

STUDY = get("contact")
SPRING = motions.SPRING.with_values(impacts="stepped", step="0.1", duration=4)


@pytest.mark.parametrize("control", CONTROLS)
def test_faults_are_caught(control):
    case = Case(
        "contact", scenes.get(CONTROLS[control][0]), rules.get("midpoint"), 16, 120, control
    )
    found = run_case(STUDY, case)
    assert found["verdict"] == "pass", found["reason"]
    honest = {"contact that sticks": "pull", "friction of the wrong sign": "friction",
              "missed impact": "penetration"}  # fmt: skip
    broken = [k for k, v in found["measured"].items() if v > 1e3 * limit(16)]
    assert broken == [honest[control]]


@pytest.mark.slow
def test_a_rule_of_order_two_keeps_the_form_across_an_impact_to_that_order():
    found = run_case(STUDY, Case("contact", SPRING, rules.get("midpoint"), 16, 40))
    assert found["verdict"] == "pass", found["reason"]
    coarse, fine, _ = found["measured"]["form"]["across"]
    assert coarse / fine > 2.5 and abs(found["measured"]["order"] - 2) < 0.4
    assert 0 <= found["measured"]["late"] <= 1


def balls(mass=2, apart=1, wall=0):
    """Two balls in the air, or blocks before a wall: free flight and impacts are exact."""
    return Scene(
        "balls", pair(2), lambda x, v, p: (v[0] ** 2 + mass * v[1] ** 2) / 2, restitution=1,
        contact=lambda x, p: [x[1] - x[0], x[0]] if wall else [x[1] - x[0]], step="1/100",
        x0=[wall, wall + Rational(apart)], v0=[0, -1] if wall else [1, 0], duration=2,
    )  # fmt: skip


def across(scene, change=None):
    """The defects of Ω across the first impact, with a change in each flow."""
    with contact_trials.changed(change):
        case = Case("contact", scene, rules.get("midpoint"), 16)
        run = measuring._flow(case, 1, "located").trajectory(150)
        return measuring._across(case, run)


@pytest.mark.dear(but=("1.003",))
@pytest.mark.parametrize(("apart", "mass", "wall"), [
    ("1", 2, 0), ("1", 100, 1), ("1", 10**6, 1), ("1.0000000000003", 2, 0),
    ("0.9999999999997", 100, 1), ("0.01", 2, 0), ("1.003", 2, 0),
])  # fmt: skip
def test_an_impact_keeps_the_form_wherever_it_is_in_its_step(apart, mass, wall):
    """On a row, and nearer to one than the differences reach, the step has no derivative."""
    assert max(across(balls(mass, apart, wall))) < LIMITS["form"]


def rebound(flow):
    own = flow._steps
    made = contact_trials.WrongRebound(own.gaps, own.h, own.part, own.e, own.stepped, size=1e-9)
    flow.__dict__["_steps"] = made


def turned(flow):
    flow.gaps_kind = type("Tilted", (contact_trials.Turned,), {"size": 1e-9})


@pytest.mark.slow
@pytest.mark.parametrize("apart", ["1", "1.003"])
@pytest.mark.parametrize("fault", [rebound, turned])
def test_an_impact_that_is_wrong_in_the_ninth_digit_fails(fault, apart):
    assert min(across(balls(2, apart), fault)) > 1e-11
    verdict = contact_trials.judged(balls(2, apart), rules.get("midpoint"), fault)
    assert verdict["verdict"] == "fail", verdict["reason"]


def late(flow):
    own = flow._steps
    made = contact_trials.LateImpact(own.gaps, own.h, own.part, own.e, own.stepped, size=1e-9)
    flow.__dict__["_steps"] = made


@one_step(order=2, implicit=True, reversible=True)
def there_and_back(s, z, Z, h):
    return Z - z - h * s.f((z + Z) / 2)


@one_step(order=2, implicit=True, reversible=True)
def one_way(s, z, Z, h):
    """The implicit midpoint rule with a kick of 10⁻⁶ h⁴."""
    kick = [s.split(z + Z)[0][0] / 10**6] + [0] * (s.n - 1)
    return Z - z - h * s.f((z + Z) / 2) - h**4 * s.join([0] * s.n, kick)


@one_step(order=4, keeps="energy")
def of_no_form(s, z, h):
    """The classical Runge–Kutta method, which keeps neither form nor energy."""
    a = s.f(z)
    b = s.f(z + h * a / 2)
    c = s.f(z + h * b / 2)
    return z + h * (a + 2 * b + 2 * c + s.f(z + h * c)) / 6


RING = Scene(
    "ring", pair(2), lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2 + x[0] ** 3 / 9, restitution=1,
    contact=lambda x, p: [1 - (x[0] ** 2 + x[1] ** 2) ** Rational(1, 2)], step="1/20", duration=6,
    x0=["0.3", "0.1"], v0=["0.7", "1.1"],
)  # fmt: skip
#: with a magnetic field: L(x, −v) is another Lagrangian
FIELD = RING.with_values(
    lagrangian=lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2 + (x[0] * v[1] - x[1] * v[0]) / 3
)


@pytest.mark.parametrize(("scene", "rule", "fault", "verdict", "said"), [
    (RING, there_and_back, None, "pass", ""), (RING, one_way, None, "fail", "and back misses it"),
    (RING, there_and_back, rebound, "fail", ""),
    *(pytest.param(*row, marks=pytest.mark.slow) for row in [
        (FIELD, there_and_back, None, "pass", ""),
        (FIELD, there_and_back, late, "fail", ""),
        (RING, replace(of_no_form, claims=replace(of_no_form.claims, keeps=())), None, "pass", ""),
        (RING, of_no_form, None, "fail", "changes the energy by"),
        (RING.with_values(restitution="1/2"), there_and_back, None, "pass", "loses energy"),
    ]),
])  # fmt: skip
def test_a_rule_under_contact_is_judged_by_what_it_claims(scene, rule, fault, verdict, said):
    found = contact_trials.judged(scene, rule, fault)
    assert found["verdict"] == verdict and said in found["reason"], found["reason"]
    if rule is there_and_back and scene.restitution == 1:
        backs = [back["missed"] for back in found["measured"]["back"]]
        assert len(backs) > 1 and (max(backs) < 1e-35 if fault is None else min(backs) > 1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("scene", scenes.CONTACT)
def test_every_scene_with_contact_passes(scene):
    found = check("contact", [scene], ["midpoint", "trapezoidal"])
    assert found["verdict"] == "pass", [c["reason"] for c in found["cases"]]


def test_other_studies_and_references_leave_contact_alone(ask):
    for study in ("order", "symplecticity", "momentum", "energy", "stability", "extremes"):
        with pytest.raises(BadInput, match="judged by `discmech contact`"):
            check(study, ["bouncing-ball"], ["midpoint"], [16], 20)
    found = check("energy", ["bouncing-ball", "harmonic"], ["midpoint"], [16], 200)
    assert [c["scene"] for c in found["cases"]] == ["harmonic"]
    assert any("judged by `discmech contact`" in note for note in found["notes"])
    found = check("energy", ["harmonic", *scenes.CONTACT, "cradle"], ["midpoint"], [16], 200)
    (note,) = (said for said in found["notes"] if "by `discmech contact`" in said)  # one for all
    assert note.startswith("7 systems are judged by") and "since each has contact: b" in note
    assert any(said.startswith("cradle is a lattice with contact") for said in found["notes"])
    with pytest.raises(ReferenceFailure, match="has contact"):
        solution("bouncing-ball", 1)
    code, _, err = ask("verify", "midpoint", "--scene", "bouncing-ball", "--study", "order")
    assert code == 2 and "judged by `discmech contact`" in err
    with pytest.raises(NotApplicable, match="judged by `discmech contact`"):
        assert_order(rules.get("midpoint"), scenes.get("bouncing-ball"))
    with pytest.raises(BadInput, match="scene with contact"):
        check("contact", ["harmonic"], ["midpoint"])


def test_a_folder_has_no_place_for_figures_and_the_table_says_until_when(ask, tmp_path):
    """A run of this study may be shorter than one of the scene, and have fewer impacts."""
    asked = ("contact", "bouncing-ball", "--rule", "midpoint", "--steps", "60", "--digits", "16")
    code, out, _ = ask(*asked, "--folder", str(tmp_path / "c"))
    assert code == 0 and "1, 1 to t = 3" in out
    assert {path.name for path in (tmp_path / "c").glob("[!.]*")} == {"index.html", "tables"}


def test_controls_by_name():
    asked = Choice(own=(("control", ("missed impact",)),))
    (case,) = STUDY.cases(asked)
    assert (case.scene.name, case.control) == ("bouncing-ball", "missed impact")
    with pytest.raises(BadInput, match="bouncing-ball"):
        STUDY.cases(replace(asked, scenes=(scenes.get("beads"),)))


def ball(**more):
    given = {"contact": lambda x, p: [x[1]], "restitution": "1/2", "duration": 2, "step": "0.1",
             "x0": [0, 1], "v0": [0, 0], **more}  # fmt: skip
    return Scene("ball", pair(2), lambda x, v, p: v.dot(v) / 2 - x[1], **given)


@pytest.mark.parametrize("more", [
    {"restitution": "0.9"}, {"friction": "0.5"}, {"impacts": "located"},
    {"contact": lambda x, p: [x[1] - x[0] ** 2 / 9]}, {"contact": lambda x, p: [(x[1], [x[0]])]},
])  # fmt: skip
def test_a_result_is_that_of_its_obstacle(more):
    keys = {of_case(STUDY, Case("contact", scene, rules.get("midpoint"), 16), False)
            for scene in (ball(), ball(**more))}  # fmt: skip
    assert len(keys) == 2


@pytest.mark.dear("40]")
@pytest.mark.parametrize(("name", "given", "steps"), [
    ("falling-stick", {"x0": [0, 0, 0], "v0": ["0.2", 0, 0], "step": "0.05"}, 30),
    ("tumbling-box", {"x0": [0, 0, "0.8", 1, 0, 0, 0, 1, 0, 0, 0, 1], "step": "0.05",
                      "v0": ["0.02", "0.1", 0, 0, 0, "1.3"]}, 40),
])  # fmt: skip
def test_a_slip_that_ends_or_turns_in_a_step_is_no_defect(name, given, steps):
    """The velocity that is left of one that ended is a round-off; near its centre a turn is a big
    part of a step, and the friction of each end is against its own slip."""
    scheme = Case("contact", scenes.get(name), rules.get("midpoint"), 16).scheme_on(
        scenes.get(name).with_values(**given)
    )
    run = scheme.flow(given["step"], impacts="located").trajectory(steps)
    assert measuring.defects(scheme, run, 16)["slip"] < 1e-13


@pytest.mark.slow
def test_friction_on_a_curved_obstacle_stays_in_the_cones_of_both_ends():
    bowl = ball(contact=lambda x, p: [x[1] - x[0] ** 2 / 2], friction="0.3", restitution=0,
                x0=["0.6", "0.18"], duration=1, step="0.02")  # fmt: skip
    found = run_case(STUDY, Case("contact", bowl, rules.get("midpoint"), 16, 30))
    assert found["verdict"] == "pass", found["reason"]
    assert found["measured"]["rests"]


@pytest.mark.slow
def test_a_closed_gap_is_of_order_two_by_any_rule():
    bowl = ball(contact=lambda x, p: [x[1] - x[0] ** 2 / 2], restitution=0, x0=["0.6", "0.18"],
                duration=1, step="0.05")  # fmt: skip
    found = run_case(STUDY, Case("contact", bowl, rules.get("gauss-2"), 16, 20))
    assert found["verdict"] == "pass", found["reason"]
    assert found["expected"]["order"] == pytest.approx(1.6)
    assert abs(found["measured"]["order"] - 2) < 0.4


def test_a_start_on_the_obstacle_is_not_moved_into_it():
    start = ball(x0=[0, 0], v0=[0, -1], restitution=1)
    found = run_case(STUDY, Case("contact", start, rules.get("midpoint"), 16, 10))
    assert found["measured"]["form"]["across"] == [None] * 3
    assert found["verdict"] == "inconclusive" and "Ω was not judged" in found["reason"]


def test_a_control_goes_with_a_rule_that_is_asked_for():
    asked = Choice(rules=(rules.get("trapezoidal"),), own=(("control", ("missed impact",)),))
    (case,) = measuring.cases(asked)
    assert (case.control, case.rule.name) == ("missed impact", "trapezoidal")


def test_a_run_says_its_impacts_and_no_energy_error(ask):
    """A stepped run has one impact of a gap in a step at most: 11 of 314 of Galperin's blocks."""
    code, out, err = ask("run", "bouncing-ball", "--steps", "40")
    assert code == 0 and "resolve" not in err and "energy error" not in out
    assert "impacts (located): " in out and "skipped" not in out
    code, out, _ = ask("run", "cradle", "--steps", "300")
    assert code == 0 and "impacts (stepped): " in out and "others are skipped" in out
