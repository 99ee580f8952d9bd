"""The judge of forms, and of reversibility: at its limits and beside them."""

import math

import pytest

from discmech import black_box
from discmech.studies import get
from discmech.studies.core.outcome import Measurement
from discmech.studies.core.result import result_of
from discmech.studies.report.tables import columns, got, short
from discmech.studies.report.wording import scientific
from discmech.studies.symplecticity import limits as symplecticity
from discmech.studies.symplecticity.in_numbers import FINE, may_hide
from tests.studies.judges.by_hand import ABOVE, BELOW, case, close, judged


def form_of(of=None, **defects):
    row = {"step": 0.5, "time": 2.0, "pullback": 0.0, "poisson": 0.0, "residual": 0.0} | defects
    first = {k: (v if k in ("step", "time") else 0.0) for k, v in row.items()} | {"step": 0.25}
    kinds = ("pullback", "poisson", "residual", *defects)
    measured = {k: row[k] for k in kinds}
    return judged("symplecticity", of or case(), measured=measured, rows=[first, row])


@pytest.mark.parametrize(("digits", "form", "own"), [(16, 1e-13, 64 * 2.0**-53), (50, 1e-45, None)])
def test_forms_are_kept_to_round_off(digits, form, own):
    limits = symplecticity.limits(digits)
    assert limits["poisson"] == limits["volume"] == close(form)
    assert own is None or limits["residual"] == limits["constraint"] == own
    for kind in ("pullback", "poisson", "residual"):
        verdict, reason, expected = form_of(case(digits), **{kind: limits[kind]})
        assert (verdict, reason) == ("pass", "")
        assert expected == {"limit": limits["poisson"], "residual": limits["residual"]}
        verdict, reason, _ = form_of(case(digits), **{kind: ABOVE * limits[kind]})
        assert verdict == "fail" and f"the {kind} defect is" in reason
        assert "at step 0.5, t = 2" in reason and f"at most {limits[kind]:.0e}" in reason
    assert "poisson defect is nan" in form_of(case(digits), poisson=math.nan, pullback=1.0)[1]


@pytest.mark.parametrize(("scene", "kinds", "said"), [
    ({}, ("pullback", "poisson", "residual"), None),
    ({"force": 1}, ("change", "volume", "residual"), "forced"),
    ({"force": 1, "all_constraints": (1,)}, ("change", "residual", "constraint"), "forced"),
    ({"all_constraints": (1,)}, ("pullback", "poisson", "residual", "constraint"), None),
    ({"no_form": "nonholonomic", "all_constraints": (1,)}, ("residual", "constraint"),
     "nonholonomic"),
    ({"no_form": "nonholonomic", "all_constraints": (1,), "force": 1}, ("residual", "constraint"),
     "nonholonomic"),
])  # fmt: skip
def test_what_is_demanded_under_forces_and_constraints(scene, kinds, said):
    of = case(scene=scene)
    for kind in ("pullback", "poisson", "change", "volume", "residual", "constraint"):
        verdict, _, expected = form_of(of, **{kind: 1.0})
        assert (verdict == "fail") == (kind in kinds)
        assert ("demanded" in expected) == bool(said)
    if said:
        assert expected["not_demanded"].startswith(said) and set(expected["demanded"]) == set(kinds)


@pytest.mark.parametrize(("digits", "least"), [(16, 1e-10), (50, 1e-25)])
def test_a_control_is_caught_a_thousandfold(digits, least):
    of = case(digits, control="wrong")
    measured = {"pullback": ABOVE * least, "poisson": None}
    told = judged("symplecticity", of, measured=measured, rows=[])
    assert told == ("pass", "", {"at_least": close(least)})
    measured = {"pullback": 0.0, "poisson": BELOW * 0.99 * least}
    verdict, reason, _ = judged("symplecticity", of, measured=measured, rows=[])
    assert verdict == "fail" and f"its defect is {0.99 * least:.2g}" in reason


@pytest.mark.parametrize(("fault", "claims", "key", "shown"), [
    ({"run": {"steps": 256, "broken": 64, "certain": 0.0065}}, {"symplectic": True}, "run",
     "along a run 6.5×10⁻³"),
    ({"volume": {"certain": 0.02, "measured": 0.03}}, {"keeps": ("volume",)}, "volume",
     "volume 0.03"),
    ({"derivatives": [{"what": "jacobian", "off": 0.04}]}, {"symplectic": True}, "jacobian",
     "its jacobian 0.04"),
])  # fmt: skip
def test_the_number_that_fails_a_program_is_among_those_that_are_shown(fault, claims, key, shown):
    row = {"step": 0.1, "time": 2.0, "poisson": 4e-16, "certain": 0.0, "resolution": 1e-13,
           "left": 1.0, "noise": 1e-12} | fault  # fmt: skip
    measured = {"poisson": 4e-16, "certain": 0.0, "resolution": 1e-13, "residual": 0.0}
    box = black_box(order=2, **claims)(lambda q, p, h: (q, p))
    given = {"measured": measured, "rows": [row], "run": fault.get("run", {})}
    told = get("symplecticity").judge(case(rule=box, s=None), Measurement.of_json(given))
    assert told.verdict == "fail" and "not smooth" not in told.reason
    figures = {**measured, **told.measured}
    result = result_of("symplecticity", {"verdict": "fail", "measured": figures})
    assert key in told.measured and short(result) == shown and shown in got(result)
    assert any(text(result) == shown.rpartition(" ")[2] for _, text in columns("symplecticity"))


@pytest.mark.parametrize(("change", "verdict"), [(0.02, "fail"), (0.0, "pass")])
def test_a_claim_of_volume_alone_shows_what_volume_does(change, verdict):
    row = {"step": 0.1, "time": 2.0, "poisson": 0.5, "certain": 0.4, "resolution": 1e-13,
           "left": 1.0, "noise": 0.0, "volume": {
               "certain": change, "measured": change + 3e-15, "resolution": 1e-13}}  # fmt: skip
    measured = {"poisson": 0.5, "certain": 0.4, "resolution": 1e-13, "residual": 0.0}
    box = black_box(order=2, keeps=("volume",))(lambda q, p, h: (q, p))
    given = {"measured": measured, "rows": [row] * 3, "run": {}}
    told = get("symplecticity").judge(case(rule=box, s=None), Measurement.of_json(given))
    shown = {"verdict": told.verdict, "measured": measured | dict(told.measured),
             "expected": dict(told.expected)}  # fmt: skip
    result = result_of("symplecticity", shown)
    assert told.verdict == verdict and short(result) == f"volume {scientific(change + 3e-15)}"


def test_a_step_back_is_the_inverse():
    limit = 64 * 2.0**-53
    for defect, verdict in ((limit, "pass"), (ABOVE * limit, "fail"), (math.nan, "fail")):
        told = judged("reversibility", case(), measured={"defect": defect})
        assert (told[0], told[2]) == (verdict, {"limit": limit})
        assert bool(told[1]) == (verdict == "fail")
    said = judged("reversibility", case(), measured={"defect": 0.5})[1]
    assert "misses the start by 0.5 of the terms" in said and "would leave 7e-15" in said


@pytest.mark.parametrize(("left", "hidden"), [
    (1, 1e-9), (1e-2, FINE), (1e-4, FINE), (1e-10, 1e-12), (0, 0),
])  # fmt: skip
def test_a_pass_may_hide_a_part_of_what_other_methods_leave(left, hidden):
    program = case(rule=black_box(order=2, name="p")(lambda q, p, h: (q, p)))
    assert may_hide(program, left) == close(hidden)


def test_a_step_back_of_a_program_has_to_resolve_what_its_order_may_leave():
    program = case(rule=black_box(order=2, reversible=True, name="p")(lambda q, p, h: (q, p)))
    for hidden, verdict in ((may_hide(program, 0.1), "pass"), (0.1, "inconclusive")):
        told = judged("reversibility", program, measured={"resolution": hidden, "defect": 0.0,
                      "certain": 0.0}, rows=[], left=0.1)  # fmt: skip
        assert told[0] == verdict and bool(told[1]) == (verdict != "pass")
    rows = [{"step": 0.1, "time": 2.0, "certain": 0.0, "defect": 0.2}]
    told = judged("reversibility", program, measured={"resolution": 1e-12, "defect": 0.2,
                  "certain": 0.0}, rows=rows, left=0.1)  # fmt: skip
    assert told[:2] == ("pass", "From 1 of 1 places a step is too rough to tell, most at step 0.1, "
                        "t = 2, where 2.0e-01 of the motion is missed.")  # fmt: skip
    rows = [{"step": 0.1, "time": 2.0, "certain": 0.2, "entry": "mu[0]"}]
    told = judged("reversibility", program, measured={"certain": 0.2, "defect": 0.2}, rows=rows)
    assert told[0] == "fail" and "most in mu[0], at step 0.1, t = 2:" in told[1]


@pytest.mark.parametrize("study", ["symplecticity", "reversibility"])
def test_a_pass_needs_the_run_and_the_steps_from_drawn_places(study):
    at_place = {"name": "poisson", "limit": 1e-25, "step": 0.3, "place": "x = (2)"}
    law = "form" if study == "symplecticity" else "way back"
    measured = {"pullback": 0.0, "residual": 0.0} if study == "symplecticity" else {"defect": 0.0}
    for defect, verdict in ((1e-25, "pass"), (ABOVE * 1e-25, "fail"), (math.nan, "fail")):
        local = {"order": 2.0, "seed": 7, "laws": {law: at_place | {"size": defect}}}
        told = judged(study, case(), measured=measured, local=local)
        assert told[0] == verdict
        assert (verdict == "pass") or "from x = (2), a place that was drawn" in told[1]
