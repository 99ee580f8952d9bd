"""What every scheme must show: its order, symplecticity, momentum and energy."""

from __future__ import annotations

import json
import math
import shlex
from functools import cache

import numpy as np
import pytest

from discmech.integrators import scenes
from discmech.integrators.equations import SceneSymbols, energy_terms
from discmech.studies import NAMES, check, get
from discmech.studies.command.entry import _parser
from discmech.studies.command.options import choice_of
from discmech.studies.core import lookup
from discmech.studies.core.case import Case, Choice, worst
from discmech.studies.core.outcome import VERDICTS
from discmech.studies.core.result import SCHEMA
from discmech.studies.report.tables import plain
from discmech.studies.user.assertions import assert_momentum, assert_order, assert_symplectic
from tests.objects import named
from tests.studies.cached_results import (
    BUILT_IN,
    PAIRWISE,
    SMALL,
    charts_slowly,
    measured_once,
    result,
)

with_quantities = [
    (s, r) for s, r in BUILT_IN if any(q.to_roundoff for q in scenes.get(s).symmetries)
]
order_holds, symplectic_holds, momentum_holds = map(
    cache, (assert_order, assert_symplectic, assert_momentum)
)
DECLARED = {"rectangle": 1, "midpoint": 2, "trapezoidal": 2, "imex": 2, "own": 2}


def expected_order(scene, rule):
    """On a group L_d = h·l(u) by every rule; x∧v is the same all along a step."""
    free = scenes.get(scene).groupoid.kind == "group" or scene == "charged-particle"
    return 2 if free else DECLARED[rule]


def in_turn(k, schemes=BUILT_IN, every=12):
    """All schemes, of which each twelfth of `PAIRWISE`, from the k-th on, is in every run.

    So laws take scenes in turn. `make report`, which every change has to pass, has them all judged;
    here it is told in numbers what its judges have to see.
    """
    often = [s for s in PAIRWISE if s in schemes][k::every]
    return [pytest.param(*s, id="-".join(s), marks=() if s in often else pytest.mark.slow)
            for s in schemes]  # fmt: skip


def passes(found):
    assert found["verdict"] == "pass", found["reason"]
    assert found["reason"] == ""


def has_its_order(scene, rule, digits, tolerance, retraction=None):
    wanted = expected_order(scene, rule)
    found = order_holds(rule, scene, wanted, digits=digits, retraction=retraction)
    measured = found["measured"]
    expected = {"order": wanted, "tolerance": tolerance}
    if measured.get("multipliers") is not None:
        expected["multipliers"] = min(2, wanted)
    assert {k: v for k, v in found["expected"].items() if k != "local_order"} == expected
    assert abs(measured["order"] - wanted) <= tolerance
    low, high = measured["interval"]
    assert low <= measured["order"] <= high
    used = [row for row in found["rows"] if row["used"]]
    assert len(used) == measured["points"] >= 4
    for row in found["rows"]:
        assert row["used"] is not bool(row["why_not"])
    for row in found["rows"]:  # the parts belong to the whole
        parts = (row["error_x"] or 0) ** 2 + row["error_mu"] ** 2
        assert row["error"] ** 2 == pytest.approx(parts, rel=1e-12)


@pytest.mark.dear(but=("harmonic",))
@pytest.mark.parametrize(("scene", "rule"), in_turn(0))
def test_order_in_double_precision(scene, rule):
    has_its_order(scene, rule, 16, 0.05)


@pytest.mark.dear(but=("pendulum",))
@pytest.mark.parametrize(("scene", "rule"), in_turn(1))
def test_order_at_50_digits(scene, rule):
    has_its_order(scene, rule, 50, 0.01)


def is_symplectic(scene, rule, digits, limit, steps, retraction=None):
    found = symplectic_holds(rule, scene, digits=digits, steps=steps, retraction=retraction)
    assert found["expected"]["limit"] == pytest.approx(limit)
    given = scenes.get(scene)
    forced = given.force is not None or bool(given.no_form)
    for kind in ("pullback", "poisson", "residual"):
        if kind == "pullback" and given.all_constraints:
            assert found["measured"][kind] is None  # of a map on (x, μ)
            continue
        seen = [row[kind] for row in found["rows"] if row[kind] is not None]
        assert found["measured"][kind] == max(seen)
        # a force changes the form, by more than round-off, and need not keep it
        assert (found["measured"][kind] > 1e3 * limit) is (forced and kind != "residual")
        assert found["measured"][kind] <= limit or forced
    assert ("not_demanded" in found["expected"]) is forced
    tried = sorted({row["step"] for row in found["rows"]})
    assert float(scenes.get(scene).step) in tried
    assert max(tried) >= float(scenes.get(scene).step)
    return tried


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), in_turn(8))
def test_symplectic_in_double_precision(scene, rule):
    is_symplectic(scene, rule, 16, 1e-13, 8)


@pytest.mark.slow
def test_the_largest_stable_steps_are_really_larger():
    """Where only small steps are tried the test proves little; every scene allows larger ones."""
    for scene, rule in PAIRWISE:
        tried = is_symplectic(scene, rule, 16, 1e-13, 8)
        assert len(tried) == 2 and tried[1] >= 2 * tried[0], (scene, rule, tried)


@pytest.mark.dear(but=("henon",))
@pytest.mark.parametrize(("scene", "rule"), in_turn(4))
def test_symplectic_at_50_digits(scene, rule):
    is_symplectic(scene, rule, 50, 1e-45, 8)


def keeps_its_momenta(scene, rule, digits, limit, steps, retraction=None):
    found = momentum_holds(rule, scene, digits=digits, steps=steps, retraction=retraction)
    names = [q.name for q in scenes.get(scene).symmetries if q.to_roundoff]
    assert sorted(found["measured"]["drift"]) == sorted(names) and names
    assert max(found["measured"]["drift"].values()) <= limit
    assert found["expected"]["limit"] == pytest.approx(limit)
    for name, drift in found["measured"]["drift"].items():
        shown = [row["drift"][name] for row in found["rows"]]
        assert drift == max(value for value in shown if value is not None)
    if steps:
        assert found["rows"][-1]["step"] == steps


@pytest.mark.dear("top-")
@pytest.mark.parametrize(("scene", "rule"), in_turn(2, with_quantities, 5))
def test_momentum_over_ten_thousand_steps(scene, rule):
    keeps_its_momenta(scene, rule, 16, 1e-12, 10**4)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), in_turn(1, with_quantities, 5))
def test_momentum_at_50_digits(scene, rule):
    keeps_its_momenta(scene, rule, 50, 1e-46, None)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), [
    pytest.param(*pair, marks=() if pair == ("rigid-body", "midpoint") else pytest.mark.slow)
    for pair in BUILT_IN
    if pair[1] != "own" and scenes.get(pair[0]).groupoid.retraction
])  # fmt: skip
def test_the_laws_hold_with_the_exponential(scene, rule):
    has_its_order(scene, rule, 16, 0.05, "exponential")
    is_symplectic(scene, rule, 16, 1e-13, 24, "exponential")
    if (scene, rule) in with_quantities:
        keeps_its_momenta(scene, rule, 16, 1e-12, 1000, "exponential")


def keeps_energy_in_a_band(scene, rule, steps):
    found = result("energy", scene, rule, 16, steps)
    passes(found)
    measured, errors = found["measured"], [row["error"] for row in found["rows"]]
    # the rows keep the extremes of every stretch, so the band of all steps is in them
    assert max(errors) - min(errors) == pytest.approx(measured["band"], rel=1e-12)
    assert measured["band"] < 0.25
    assert measured["slope_interval"][0] <= measured["slope"] <= measured["slope_interval"][1]
    times = [row["time"] for row in found["rows"]]
    assert times == sorted(times) and len(times) <= 2000
    return measured["band"]


#: scenes whose energy nothing changes; against work it is measured in the tests of forces
CONSERVATIVE = [
    (s, r) for s, r in BUILT_IN
    if not (scenes.get(s).force or scenes.get(s).timed or scenes.get(s).nonholonomic)
]  # fmt: skip


@pytest.mark.dear("spring")
@pytest.mark.parametrize(("scene", "rule"), in_turn(1, CONSERVATIVE, 6))
def test_energy_over_ten_thousand_steps(scene, rule):
    keeps_energy_in_a_band(scene, rule, 10**4)


def conditioning(scene):
    """How much a relative error of the state weighs in the energy, Σ |∂H/∂zᵢ zᵢ| over its terms.

    At the start, at least 1. Of a charged particle 7: μ is far from mv, which alone has energy.
    """
    scene = scenes.get(scene)
    s = SceneSymbols(scene)
    lagrangian = s.lagrangian
    values = dict(zip([*s.x, *s.u, *s.parameter_list],
                      [*scene.x0, *scene.v0, *scene.parameter_values], strict=True))  # fmt: skip
    parts = [z * lagrangian.diff(z) for z in (*s.x, *s.u)]
    moved = sum(abs(float(part.subs(values))) for part in parts)
    return max(1.0, moved / float(energy_terms(s).subs(values)))


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), named(CONSERVATIVE))
def test_energy_over_a_million_steps(scene, rule):
    """Each quarter has half the band of all, or more, but for half a unit of rounding a step.

    The range of a random walk of n steps is (1.60 ± 0.47) √n (Feller, Ann. Math. Stat. 22, 1951);
    a drift of a hundredth of a unit a step is more than that. The state is what is rounded.
    """
    band = keeps_energy_in_a_band(scene, rule, None)
    errors = [row["error"] for row in result("energy", scene, rule, 16, None)["rows"]]
    quarters = [np.ptp(part) for part in np.array_split(errors, 4)]  # rows are spread evenly
    wandering = (1.60 + 3 * 0.47) * math.sqrt(10**6) * 2.0**-53 * conditioning(scene)
    assert band <= max(2 * min(quarters), wandering)


def test_implicit_midpoint_keeps_the_quadratic_energy_exactly():
    """A law of its own: on the harmonic oscillator nothing but round-off is left of the band."""
    assert keeps_energy_in_a_band("harmonic", "midpoint", 10**4) < 1e-13


def usual_rule(study):
    """The midpoint rule, and of the study of varying steps with these."""
    return "reversible:midpoint" if study == "steps" else "midpoint"


@pytest.mark.dear("[lattices]", "[stability]", "[symplecticity]", "[contact]", "[optimality]",
                  "[order]", "energy", "momentum")  # fmt: skip
@pytest.mark.parametrize("study", [
    # work-precision and savings take times
    charts_slowly(name) for name in NAMES if name not in ("work-precision", "savings")
])  # fmt: skip
def test_results_are_the_same_when_measured_again(study):
    scene, steps = SMALL[study]
    with measured_once():
        (first,) = check(study, [scene], [usual_rule(study)], [16], steps)["cases"]
    (second,) = check(study, [scene], [usual_rule(study)], [16], steps)["cases"]
    when = {"seconds": 0, "measured_at": {}}
    assert first | when == second | when


RECORDED = {"python", "numpy", "mpmath", "mpmath_backend", "blas", "machine", "commit", "clean",
            "date", "settings"}  # fmt: skip


@pytest.mark.dear("[work-precision]", "contact", "symplecticity")
@pytest.mark.parametrize("study", [*map(charts_slowly, NAMES)])
def test_what_check_returns_is_what_the_design_says(study):
    scene, steps = SMALL[study]
    with measured_once():
        found = check(study, [scene], [usual_rule(study)], [16], steps)
    assert (found["study"], found["schema"]) == (study, SCHEMA)
    assert found["verdict"] in VERDICTS and set(found["record"]) >= RECORDED
    case, *peers = found["cases"]
    assert bool(peers) is (study == "work-precision")
    rule = "own" if study == "charts" else usual_rule(study)  # its L_d is given
    assert (case["scene"], case["rule"], case["digits"]) == (scene, rule, 16)
    assert case["retraction"] == lookup.scene_given(scene).groupoid.retraction
    assert set(case) >= {"verdict", "reason", "expected", "measured", "rows", "seconds"}
    json.dumps(plain(found), allow_nan=False)


@pytest.mark.parametrize(("verdicts", "wanted"), [
    ([], "inconclusive"),
    (["pass", "pass"], "pass"),
    (["pass", "inconclusive"], "inconclusive"),
    (["inconclusive", "fail", "pass"], "fail"),
])  # fmt: skip
def test_the_worst_verdict_counts(verdicts, wanted):
    assert worst(verdicts) == wanted


@pytest.mark.parametrize("study", NAMES)
def test_a_name_makes_no_scene_of_a_user_ours(study):
    """Under the name of one of ours it has the cases that it has under its own name."""

    def asked(scene, name):
        of_user = scene.with_values(name=name, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p))
        cases = get(study).cases(Choice(scenes=(of_user,)))
        return [(case.label, case.digits, case.control) for case in cases]

    # those of the studies' own tables: families, extremes, controls
    for name in ("harmonic", "pendulum", "kepler", "fpu", "spring-pendulum", "charged-particle",
                 "rigid-body", "lagrange-top", "heavy-top", "rotor-body", "beads", "sliding-block",
                 "bouncing-ball"):  # fmt: skip
        scene = scenes.get(name)
        assert asked(scene, name) == asked(scene, "mine"), name


@pytest.mark.sampled
@pytest.mark.parametrize("steps", [None, 32])
@pytest.mark.parametrize("study", NAMES)
def test_the_command_of_a_case_reproduces_that_case_and_no_other(study, steps):
    def told(case: Case):
        return (case.study, case.scene.name, case.label, case.digits, case.steps, case.control)

    parser = _parser()
    for case in get(study).cases(Choice(steps=steps)):
        words = shlex.split(case.command)
        assert words[0] == "discmech"
        options = parser.parse_args(words[1:])
        assert options.study == study
        again = get(study).cases(choice_of(options))
        if study == "work-precision":  # timed within its race, so that is what runs again
            assert told(case) in [told(c) for c in again]
            assert {c.command for c in again} == {case.command}
        else:
            assert [told(c) for c in again] == [told(case)]
