"""Quantities that drift: the study of momenta must say no, and name them."""

import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, discretisation, one_step, pair, scenes
from discmech.integrators.extensions.contact import ContactFlow
from discmech.integrators.rules import midpoint, trapezoidal
from discmech.integrators.rules.maps import rkmk_4
from discmech.integrators.scene import Conserved
from discmech.studies import check, get
from discmech.studies.causes.round_off import lost_one_way
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.result import result_of
from discmech.studies.evidence.measuring import single_steps
from discmech.studies.momentum import measuring as momentum
from discmech.studies.momentum.view import VIEW
from discmech.tests.bench.power.catalogue import everything
from discmech.tests.bench.power.faults import scene_of
from discmech.tests.bench.power.sites import FaultyCase
from tests.objects import PLAIN, with_wrong_force
from tests.studies import contact_trials
from tests.studies.as_json import run_case
from tests.studies.cached_results import measured
from tests.studies.programs import methods


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "quantity", "digits"),
    [("lagrange-top", "μ·Γ", 50), ("kepler", "angular momentum", 50),
     ("kepler", "angular momentum", 16)],
)  # fmt: skip
def test_a_wrong_update_makes_momentum_fail(wrong_gain, name, quantity, digits):
    found = measured("momentum", scenes.get(name).with_values(), midpoint, digits, 100)
    assert found["verdict"] == "fail" and quantity in found["reason"]
    drift, limit = found["measured"]["drift"], found["expected"]["limit"]
    assert drift[quantity] > limit
    if name == "lagrange-top":  # what Γ alone decides is none of this update's business
        assert drift["|Γ|²"] <= limit


@pytest.mark.dear(but=("trapezoidal",))
@pytest.mark.sampled
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rule", ["rectangle", "midpoint", "trapezoidal"])
def test_a_quantity_that_is_not_conserved_fails_by_name(rule, digits):
    scene = scenes.get("kepler").with_values(
        symmetries=[
            *scenes.get("kepler").symmetries,
            Conserved("first momentum", lambda x, mu, p: mu[0]),
        ]
    )
    found = measured("momentum", scene, rule, digits, 100)
    assert found["verdict"] == "fail"
    assert found["reason"].startswith("first momentum drifts by")
    assert "angular" not in found["reason"]
    assert found["measured"]["drift"]["angular momentum"] <= found["expected"]["limit"]


def test_first_integrals_are_not_asked_to_be_exact():
    only = Conserved("Hamiltonian", lambda x, mu, p: mu[0] ** 2, kind="first integral")
    scene = scenes.get("pendulum").with_values(symmetries=[only])
    with pytest.raises(BadInput, match="a first integral belongs to the motion, and no"):
        check("momentum", [scene], ["midpoint"])


@pytest.mark.parametrize("numeric", [False, True])
def test_first_integrals_are_asked_of_motions_beside_the_scenes_own(numeric):
    """Motions on an axis of an oval well have no angular momentum, and others change theirs."""
    rule, start = trapezoidal, {"x0": [1, 0], "duration": 1, "step": "1/20"}
    if numeric:
        start |= {"numeric_hamiltonian": lambda q, p: p @ p / 2 + q @ (q * [1, 2]), "mu0": [1, 0]}
        rule = methods.verlet
        scene = Scene("well", pair(2), gradient=lambda q, p: (q * [2, 4], p), **start)
    else:
        scene = Scene("well", pair(2), lambda x, v, p: v.dot(v) / 2 - x[0] ** 2 - 2 * x[1] ** 2,
                      v0=[1, 0], **start)  # fmt: skip
    weight = 0.5

    def along(x, mu, p):
        return sympy.cos(
            1000 * (weight * mu[0] ** 2 + x[0] ** 2)
        )  # its end is unsure by 1000 times

    kept = Conserved("along", along, kind="first integral")
    lost = Conserved("L", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0], kind="first integral")
    single_steps(Case("order", scene.with_values(symmetries=[kept]), rule, 16))
    weight = 1.0
    with pytest.raises(BadInput, match="along is declared a first integral, but the motion"):
        single_steps(Case("order", scene.with_values(symmetries=[kept]), rule, 16))
    weight = 0.5
    with pytest.raises(BadInput, match="L is declared a first integral, but the motion from x ="):
        single_steps(Case("order", scene.with_values(symmetries=[kept, lost]), rule, 16))


def test_a_quantity_of_several_components_drifts_if_one_of_them_does():
    pair_of_both = Conserved(
        "both", lambda x, mu, p: sympy.Matrix([x[0] * mu[1] - x[1] * mu[0], mu[0]])
    )
    scene = scenes.get("kepler").with_values(symmetries=[pair_of_both])
    found = measured("momentum", scene, midpoint, 16, 100)
    assert found["verdict"] == "fail"


def test_a_rule_that_breaks_a_symmetry_loses_its_momentum():
    """The potential is taken at a point moved sideways: translations stay, rotations do not."""

    @discretisation()
    def sideways(L, G, x, u, h):
        z = G.target(x, u, h / 2)
        return h * L(z + h * sympy.Matrix([0, sympy.Rational(1, 10)]), u)

    found = measured("momentum", "kepler", sideways, 16, 100)
    assert found["verdict"] == "fail" and "angular momentum" in found["reason"]
    symplectic = measured("symplecticity", "kepler", sideways, 16, 24)
    assert symplectic["verdict"] == "pass"  # still variational: only the symmetry is gone


def test_a_quantity_in_stretches_says_over_how_many_steps_it_was_followed(monkeypatch):
    """On sl2 the spatial momentum: three stretches of 20 steps here, in the rows where they are."""
    monkeypatch.setattr(momentum, "MOST_STRETCHES", 3)
    monkeypatch.setattr(momentum, "interval", lambda steps: 5)
    monkeypatch.setattr("discmech.studies.systems.runs.interval", lambda steps: 5)
    found = measured("momentum", "sl2", midpoint, 16, 100)
    over = found["expected"]["over"]
    assert over.pop("spatial momentum") == 60 and over and set(over.values()) == {100}
    assert found["expected"]["random_walk"] == pytest.approx(2.0**-53 * 10)
    followed = [r["step"] for r in found["rows"] if r["drift"]["spatial momentum"] is not None]
    assert max(followed) == 60 and max(row["step"] for row in found["rows"]) == 100
    found["expected"]["over"]["spatial momentum"] = 60
    shown = dict(VIEW.columns)["Largest drift"](result_of("momentum", found))
    assert "(60 steps)" in shown and "(100 steps)" not in shown


def along_gravity(x, v, p):
    """Friction of the motion that is no turn about the vertical: Γ × (Γ × Ω), which keeps μ·Γ."""
    return list(x.cross(x.cross(v)) / 5)


def rubbed_top(force):
    return scenes.get("heavy-top").with_values(name="rubbed-top", force=force)


RUBBED_BODY = scenes.get("rigid-body").with_values(
    name="rubbed-body", force=lambda x, v, p: [-v[i] / (4 + i) for i in range(3)]
)


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["rectangle", "gauss-2", *PLAIN[1:]])
def test_a_force_that_keeps_a_symmetry_keeps_its_momentum(rule):
    found = measured("momentum", rubbed_top(along_gravity), rule, steps=2000)
    assert found["verdict"] == "pass"
    assert found["expected"]["over"] == {"μ·Γ": 2000, "|Γ|²": 2000}
    assert found["measured"]["drift"]["μ·Γ"] < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rule", "digits"),
    [(rule, digits) for rule in ("rectangle", "midpoint", "trapezoidal") for digits in (16, 50)]
    + [pytest.param("gauss-2", 16, marks=pytest.mark.slow)],
)
def test_another_momentum_changes_by_the_work_of_the_force(rule, digits):
    found = measured("momentum", "driven-heavy-top", rule, digits, steps=100)
    assert found["verdict"] == "pass"
    assert found["expected"]["over"] == {"μ·Γ": 1, "|Γ|²": 100}
    assert found["measured"]["drift"]["μ·Γ"] < (1e-13 if digits == 16 else 1e-45)


@pytest.mark.slow
def test_a_quadratic_casimir_obeys_the_same_identity():
    found = measured("momentum", RUBBED_BODY, "midpoint", steps=100)
    assert found["verdict"] == "pass" and 1 in found["expected"]["over"].values()


@pytest.mark.dear(but=("top-\\u03bc\\xb7\\u0393-1-0.999",))
@pytest.mark.sampled
@pytest.mark.parametrize(("at_start", "at_end"), [(-1, -1), (2, 0), (0, 2), (1, 0.999)])
@pytest.mark.parametrize(("name", "moved"), [("driven-heavy-top", "μ·Γ"), ("rubbed-body", "|μ|²")])
def test_a_wrong_discrete_force_is_caught(name, moved, at_start, at_end, monkeypatch):
    """Flipped, at one end only, or a little too small at one: of a linear momentum and of a
    quadratic one. What the study holds a step against is not made of F±."""
    scene = RUBBED_BODY if name == "rubbed-body" else scenes.get(name)
    wrong = with_wrong_force(Scheme(scene, trapezoidal), at_start, at_end)
    monkeypatch.setattr(momentum, "scheme_for", lambda case, attitude: wrong)
    only = [q for q in scene.symmetries if q.name == moved]
    found = measured("momentum", scene.with_values(symmetries=only), "trapezoidal", steps=100)
    assert found["verdict"] == "fail" and moved in found["reason"]


@pytest.mark.dear("lobatto-3", "midpoint")
@pytest.mark.parametrize("rule", ["midpoint", "gauss-2", "lobatto-3"])
def test_stages_are_displaced_with_the_symmetry_too(rule):
    """On pairs a turn of the plane turns the stages: the force at the nodes works there."""
    plane = Scene(
        "rubbed-plane", pair(2), lambda x, v, p: v.dot(v) / 2 - x.dot(x) ** 2 / 4,
        x0=[1, "0.3"], v0=["0.2", "0.7"], duration=5, step="0.05",
        force=lambda x, v, p: [x[1] / 7 - v[0] / 5, -v[1] * (1 + x[0] ** 2) / 6],
        symmetries=[Conserved("about the origin", lambda x, mu, p: angular(x, mu))],
    )  # fmt: skip
    found = measured("momentum", plane, rule, steps=100)
    assert found["verdict"] == "pass" and "in 100 steps, to t = 5, and in" in found["reason"]


@pytest.mark.slow
def test_constraints_do_no_work_on_a_symmetry_that_they_have():
    rubbed = scenes.get("double-spherical-pendulum").with_values(
        name="rubbed-rods", force=lambda x, v, p: [-v[i] / (5 + i) for i in range(6)]
    )
    assert measured("momentum", rubbed, "midpoint", steps=100)["verdict"] == "pass"


def angular(x, mu):
    return x[0] * mu[1] - x[1] * mu[0]


@pytest.mark.parametrize("constant", [0, 10**12])
def test_what_is_kept_passes_with_any_constant(constant):
    kept = Conserved("kept", lambda x, mu, p: angular(x, mu) + constant)
    scene = scenes.get("kepler").with_values(symmetries=[kept])
    assert measured("momentum", scene, midpoint, 16, 100)["verdict"] == "pass"


def far(offset):
    """Kepler's problem seen from a point that far away."""
    kepler = scenes.get("kepler")

    def centre(x):
        return x - sympy.Matrix([offset, 0])

    about = Conserved("about the centre", lambda x, mu, p: angular(centre(x), mu))
    return kepler.with_values(
        name="far-kepler", lagrangian=lambda x, v, p: kepler.lagrangian(centre(x), v, p),
        x0=[kepler.x0[0] + offset, kepler.x0[1]], symmetries=[about],
    )  # fmt: skip


@discretisation()
def drifting_aside(L, G, x, u, h):
    """The midpoint rule with a push across, of a part in 10¹²."""
    return h * L(G.target(x, u, h / 2), u) + h * x[1] / 10**12


@pytest.mark.dear("pass")
@pytest.mark.parametrize(("rule", "verdict"), [(midpoint, "pass"), (drifting_aside, "fail")])
def test_a_far_frame_hides_nothing_at_50_digits(rule, verdict):
    """In double precision a state that far away knows no better."""
    assert measured("momentum", far(10**10), rule, 50, 50)["verdict"] == verdict
    if rule is midpoint:
        assert measured("momentum", far(10**10), midpoint, 16, 500)["verdict"] == "pass"


@pytest.mark.slow
@pytest.mark.parametrize(("grown", "verdict"), [(0, "pass"), (3, "fail")])
def test_a_step_has_the_round_off_of_the_parts_of_its_sums(grown, verdict):
    """Ad* by a product of matrices rounds some ten times; a growth of 3ε a step is none of that."""

    @one_step(order=4, groupoids="lie_group")
    def coadjoint(s, z, h):
        x, mu = s.split(rkmk_4.formula(s, z, h))
        return s.join(x, mu * (1 + sympy.Rational(grown, 10**62)))

    casimir = scenes.get("sl2").with_values(symmetries=scenes.get("sl2").symmetries[:1])
    assert measured("momentum", casimir, coadjoint, 50, 100)["verdict"] == verdict


@pytest.mark.dear(but=("pass-16",))
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(("push", "verdict"), [(0, "pass"), (1, "fail")])
def test_two_fast_bodies_far_away_keep_a_small_momentum(push, verdict, digits):
    """Their momenta are of 10⁶ each, with a sum of 1/7; a push of one of them is a part in 10¹¹."""

    @discretisation()
    def pushed(L, G, x, u, h):
        aside = push * h * (x[0] + x[1]) / 10**5
        return h * L(G.target(x, u, h / 2), u) + aside

    far = Scene(
        "far", pair(2), lambda x, v, p: v.dot(v) / 2 - (x[1] - x[0]) ** 2 / 2,
        x0=[10**6, 10**6 + 1], v0=[10**6, "-999999.857142857"], duration=5, step="0.05",
        symmetries=[Conserved("sum", lambda x, mu, p: mu[0] + mu[1])],
    )  # fmt: skip
    assert measured("momentum", far, pushed, digits, 400)["verdict"] == verdict


@pytest.mark.dear(but=("pass-16",))
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(("part", "verdict"), [(4, "pass"), (3, "fail")])
def test_a_quantity_may_depend_on_the_step(part, verdict, digits):
    """Störmer–Verlet keeps μ² + (1 − h²/4) x² of the oscillator, at each step another."""
    modified = Conserved(
        "modified energy", lambda x, mu, p, h: mu[0] ** 2 + (1 - h**2 / part) * x[0] ** 2
    )
    scene = scenes.get("harmonic").with_values(
        lagrangian=lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2, symmetries=[modified]
    )
    found = measured("momentum", scene, "trapezoidal", digits, 100)
    assert found["verdict"] == verdict


@pytest.mark.slow
def test_what_a_loose_solver_loses_is_no_excuse():
    """It ends at the root of round-off: with 34 digits its drift would be below double precision's
    limit, so a run with more digits would excuse it. F± by themselves do not."""
    name = "rigid-body midpoint: solver, Newton stops at the root of round-off"
    (fault,) = (f for f in everything() if f.name == name)
    scene = scene_of(fault.scene)
    by_digits = {digits: FaultyCase("momentum", scene, midpoint, digits, 1000, fault=fault)
                 for digits in (16, 34)}  # fmt: skip
    found = {k: run_case(get("momentum"), of, causes=False) for k, of in by_digits.items()}
    assert found[16]["verdict"] == "fail" and lost_one_way(by_digits[16], 1000) == 0
    assert found[34]["measured"]["drift"]["|μ|²"] < found[16]["expected"]["limit"]


RING = Scene(
    "ring", pair(2), lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2, restitution=1,
    contact=lambda x, p: [1 - sympy.sqrt(x.dot(x))], impacts="located", duration=6, step="1/20",
    x0=["0.3", "0.1"], v0=["0.7", "1.1"],
    symmetries=[Conserved("about the origin", lambda x, mu, p: angular(x, mu))],
)  # fmt: skip
DAMPING = {"force": lambda x, v, p: [-v[0] / 9, -v[1] / 9]}
ROUGH = {"friction": "1/5", "restitution": "4/5"}
PLANE = {"contact": lambda x, p: [x[0] + x[1] / 5 + sympy.Rational(1, 2)]}
OVAL = {"lagrangian": lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2 + x[0] ** 2 / 10**7}


@discretisation(order=2)
def pulled_aside(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u) + h**3 * x[0] ** 2 / 10**6


def turned_normal(flow):
    flow.gaps_kind = type("Tilted", (contact_trials.Turned,), {"size": 1e-6})


def lost_at_impacts(flow):
    own = flow._steps
    made = contact_trials.LostMomentum(own.gaps, own.h, own.part, own.e, own.stepped, size=1e-6)
    flow.__dict__["_steps"] = made


@pytest.mark.parametrize(("more", "rule", "fault", "verdict"), [
    ({}, midpoint, None, "pass"), ({}, pulled_aside, None, "fail"),
    ({}, midpoint, turned_normal, "fail"), ({}, midpoint, lost_at_impacts, "fail"),
    (PLANE, midpoint, None, "pass"), (PLANE, midpoint, lost_at_impacts, "fail"),
    *(pytest.param(*row, marks=pytest.mark.slow) for row in [
        ({"impacts": "stepped"}, midpoint, None, "pass"), (OVAL, midpoint, None, "fail"),
        (PLANE, midpoint, turned_normal, "fail"), (PLANE, pulled_aside, None, "fail"),
        (ROUGH, midpoint, None, "pass"), (ROUGH, midpoint, turned_normal, "fail"),
        (DAMPING, midpoint, None, "pass"), (DAMPING, midpoint, turned_normal, "fail"),
    ]),
])  # fmt: skip
@pytest.mark.parametrize("digits", [16, pytest.param(50, marks=pytest.mark.slow)])
def test_momenta_go_through_impacts(more, rule, fault, verdict, digits, monkeypatch):
    """A wall with the symmetry keeps a momentum, and changes any other one by its impulses."""
    honest = Scheme.flow

    def flow(*given, **how):
        made = honest(*given, **how)
        if fault is not None and isinstance(made, ContactFlow):
            fault(made)
        return made

    monkeypatch.setattr(Scheme, "flow", flow)
    case = Case("momentum", RING.with_values(**more), rule, digits, 100)
    assert get("momentum").cases(Choice((case.scene,), (rule,), digits=(digits,)))
    found = run_case(get("momentum"), case)
    assert found["verdict"] == verdict, found["reason"]
    if fault is None and verdict == "pass":
        assert found["reason"].count(" impact") and "has 0 impacts" not in found["reason"]


@pytest.mark.parametrize(("height", "rebound", "verdict", "words"), [
    (0, 0, "inconclusive", "in 40 of the steps a gap stays closed"),
    ("1/1000", "1/2", "inconclusive", "in 38 of the steps a gap stays closed"),  # 2 with impacts
    ("1/100", 0, "pass", "in 2 of 40 steps"), ("1/100", 0, "pass", "in 38 of the steps a gap"),
])  # fmt: skip
def test_a_gap_that_stays_closed_leaves_nothing_to_judge(height, rebound, verdict, words):
    """Where in a step the impulses of friction act is nowhere told."""
    floor = RING.with_values(lagrangian=lambda x, v, p: v.dot(v) / 2 - x[1], friction="1/5",
                             contact=lambda x, p: [x[1]], x0=[0, height], v0=[3, 0],
                             restitution=rebound,
                             symmetries=[Conserved("along", lambda x, mu, p: mu[0])])  # fmt: skip
    found = measured("momentum", floor, midpoint, 16, 40)
    assert found["verdict"] == verdict and words in found["reason"], found["reason"]
