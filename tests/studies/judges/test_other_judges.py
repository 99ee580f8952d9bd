"""The judge of optimal control, contact, savings and races: at its limits and beside them."""

import math
from types import SimpleNamespace

import pytest

from discmech.studies.contact import judging as contact
from discmech.studies.contact.measuring import MODES
from discmech.studies.steps.limits import LIMITS as OF_STEPS
from discmech.studies.work_precision.limits import LIMITS as OF_RACES
from discmech.tests.bench.savings.limits import LIMITS as OF_SAVINGS
from tests.studies.judges.by_hand import ABOVE, case, judged

STALLED, SAME = OF_RACES["stalled"], OF_SAVINGS["same"]


def optimal(orders, exact=(), expected=2):
    measured = {"orders": orders, "exact": exact}
    return judged("optimality", case(order=expected), rows=[], measured=measured, floor=1e-9)


def test_optimal_motions_have_the_order_of_the_rule():
    right = {"states": 2.0, "controls": 2.05}
    assert optimal(right) == ("pass", "", {"order": 2, "tolerance": 0.05})
    verdict, reason, _ = optimal({"states": 2.0, "controls": 1.9})
    assert verdict == "fail" and reason.startswith("the controls are of order 1.900, below the exp")
    assert "above the expected 2 by more than 0.05" in optimal({"states": 2.1})[1]
    assert optimal({"states": 0.05}, expected=0)[0] == "pass"  # the tolerance itself
    assert optimal({"states": 1.9}, exact=("states",))[0] == "pass"
    assert optimal({"states": 1.0}, expected=None)[0] == "pass"
    assert "no order" in optimal({"states": None}, expected=None)[2]["not_demanded"]
    verdict, reason, _ = optimal({"states": None, "controls": None, "costates": 2.0})
    assert verdict == "inconclusive" and "states and controls" in reason and "1e-09" in reason
    assert optimal({"states": None, "controls": 1.0})[0] == "fail"


@pytest.mark.parametrize(("changes", "verdict"), [
    ((9, 1, 1.21, 1.46), "inconclusive"), ((1, 1.21, 1.46), "inconclusive"),
    ((1, 1.2, 1.44), "pass"), ((1, 1.21, 1.4), "pass"), ((1, 0.9, 1.2), "pass"), ((1, 2), "pass"),
    ((4, 2, 1), "pass"), ((), "pass"),
])  # fmt: skip
def test_controls_that_change_by_more_and_more_have_no_optimum(changes, verdict):
    rows = [{"controls": change} for change in changes]
    for exact, wanted in (((), verdict), (("controls",), "pass")):
        measured = {"orders": {"controls": 2.0}, "exact": exact}
        told = judged("optimality", case(), rows=rows, measured=measured, floor=1e-9)
        assert told[0] == wanted and ("grow without bound" in told[1]) == (wanted != "pass")


def bounce(**more):
    mode = dict.fromkeys(contact.WORDS, 0.0) | {"rises": [0.0]}
    found = {
        "late": 0.5,
        "order": 2.0,
        "time_error": 1e-9,
        "rests": False,
        "form": {"across": None},
        "touched": True,
        "apart": "",
        "scaled": [],
        "local": {
            "order": 2.0,
            "component": "x[0]",
            "place": "x = (1)",
            "step": 1e-15,
            "laws": {"form": {"size": 0.0, "limit": 1e-13, "place": "x = (1)"}},
        },
    }
    found |= {mode_name: dict(mode) for mode_name in MODES}
    for name, value in more.items():
        if name in found["stepped"]:
            found["located"][name] = value
        elif name in found["form"]:
            found["form"][name] = value
        else:
            found[name] = value
    return found


def contact_of(of=None, **more):
    return judged("contact", of or case(), measured=bounce(**more))


@pytest.mark.parametrize("law", contact.WORDS)
def test_each_law_of_contact_holds_to_round_off(law):
    limit = contact.LIMITS["turn"] if law == "slip" else contact.limit(16)
    assert contact_of(**{law: limit})[:2] == ("pass", "")
    for wrong in (ABOVE * limit, math.nan):
        verdict, reason, _ = contact_of(**{law: wrong})
        assert verdict == "fail" and reason.startswith(f"located, {contact.WORDS[law]}: {law} is")


#: a single step between impacts
STEP = bounce()["local"] | {"exact": False, "unknown": "", "seed": 1}


@pytest.mark.parametrize(("change", "verdict", "words"), [
    ({"local": {**STEP, "order": 0.0}}, "fail", "between impacts, of"),
    ({"local": {**STEP, "order": 1.0}}, "fail", "of order 1.00 in x[0], below the expected 2"),
    ({"local": {**STEP, "order": None, "unknown": "why"}}, "inconclusive", "why"),
    ({"touched": False}, "inconclusive", "no gap ever closes"),
    ({"scaled": ["gap 0 is no distance"]}, "inconclusive", "distance"),
    ({"apart": "impact 2 of the located run"}, "inconclusive", "impact 2"),
])  # fmt: skip
def test_what_is_asked_of_contact_beside_its_laws(change, verdict, words):
    told = contact_of(**change)
    assert told[0] == verdict and words in told[1]


def test_what_is_expected_of_contact():
    expected = {"limit": contact.limit(16), "slip": 0.125, "late": 1.0, "order": 1.6}
    assert contact_of() == ("pass", "", expected | {"local_order": 2.0})
    assert contact_of(case(order=4), order=3.6)[2]["order"] == 3.6
    assert contact_of(case(order=4), rests=True)[2]["order"] == 1.6
    assert contact_of(case(order=1), rests=True, order=1.0)[2]["order"] == 0.6
    assert "order" not in contact_of(case(order=None), order=0.1)[2]
    assert contact_of(case(order=None), order=0.1)[0] == "pass"
    verdict, reason, _ = contact_of(time_error=None)
    assert verdict == "inconclusive" and "take a smaller step" in reason


def test_energies_that_rise_fall_with_the_step():
    limit = contact.limit(16)
    assert contact_of(rises=[limit])[0] == "pass" and contact_of(rises=[ABOVE * limit])[0] == "fail"
    assert "no number" in contact_of(rises=[math.nan])[1]
    assert contact_of(rises=[3e-3, 2e-3])[0] == "pass"
    verdict, reason, _ = contact_of(rises=[3e-3, 2.01e-3])
    assert verdict == "fail"
    assert "rises by 0.003 of its terms, with half the step by 0.002" in reason
    for scene in ({"force": 1}, {"timed": True}):
        assert contact_of(case(scene=scene), rises=[3e-3, 3e-3])[0] == "pass"


@pytest.mark.parametrize(("late", "verdict"), [
    (0.0, "pass"), (1.0, "pass"), (-1e-6, "pass"), (1 + 1e-6, "pass"), (None, "pass"),
    (-1.1e-6, "fail"), (1 + 1.1e-6, "fail"), (math.nan, "fail"),
])  # fmt: skip
def test_a_stepped_impact_is_late_by_less_than_a_step(late, verdict):
    told = contact_of(late=late)
    assert told[0] == verdict and bool(told[1]) == (verdict == "fail")


def test_located_impacts_have_an_order_and_keep_the_form():
    assert contact_of(order=1.6)[0] == "pass" and contact_of(order=None)[0] == "pass"
    told = contact_of(order=1.59)
    assert told[0] == "fail" and "order 1.59, where 1.6 is the least" in told[1]
    form = {"size": 1e-13, "limit": 1e-13, "place": "x = (1)", "name": "poisson"}
    assert contact_of(local={"laws": {"form": form}})[0] == "pass"
    told = contact_of(local={"laws": {"form": {**form, "size": ABOVE * 1e-13}}})
    assert told[0] == "fail" and "has a poisson defect of 1e-13, where" in told[1]
    across = contact_of(across=[1e-3, 3e-3, 2.01e-3])
    assert across[0] == "fail" and "is 0.003, with an eighth of the step 0.002:" in across[1]
    for kept in ([3e-3, 1e-3, 2e-3], [1e-20, 1e-21, 1e-20], []):
        assert contact_of(across=kept)[0] == "pass"
    told = contact_of(across=[3e-3, None, 1.0])
    assert told[0] == "inconclusive" and "Ω was not judged across an elastic impact" in told[1]
    assert contact_of(across=[1e-20, 1e-20, 1.1e-20])[0] == "fail"


def test_errors_that_half_a_step_ends_are_no_order():
    """Of a rule of order 2 at most 1.6 + 8; without an order 2 + 8."""
    for of, most in ((case(), 9.6), (case(order=None), 10.0)):
        assert contact_of(of, order=most)[0] == "pass"
        verdict, reason, _ = contact_of(of, order=most + 0.01)
        assert verdict == "inconclusive" and "2^10 times less, which is no order" in reason
        least = contact.limit(of.digits)
        for first, wanted in ((0.999, "pass"), (1.001, "inconclusive")):
            rises = [first * 2**most * least, least / 2, least / 3]
            assert contact_of(of, rises=rises)[0] == wanted


def test_a_control_of_contact_breaks_a_law_a_thousandfold():
    least = 1e3 * contact.limit(16)
    of = case(control="wrong")
    for law, value in (("pull", ABOVE * least), ("slip", ABOVE * 0.125), ("pull", math.nan)):
        assert judged("contact", of, measured={law: value}) == ("pass", "", {"at_least": least})
    for law, value in (("pull", least), ("pull", 0.0), ("slip", 0.125), ("slip", 0.1)):
        told = judged("contact", of, measured={law: value})
        assert told[0] == "fail" and "not caught" in told[1]


HONEST, SILENT = SimpleNamespace(reversible=True), SimpleNamespace(reversible=None)


def varied(way="poincare", back=1e-31, form=1e-26, order=2.0, control=None, claims=None, **more):
    base = SimpleNamespace(name="midpoint", claims=claims)
    rule = SimpleNamespace(way=way, base=base, claims=None)
    measured = {"order": order, "back": back, "form": form, "lost": more.pop("lost", None)}
    found = {"orders": [1.5, order], "self_adjoint": True, "energy": {}, "local": None} | more
    return judged("steps", case(rule=rule, control=control), measured=measured, **found)


@pytest.mark.parametrize(("wrong", "verdict", "word"), [
    ({}, "pass", ""), ({"order": 2.09}, "pass", ""), ({"order": 1.89}, "inconclusive", "below"),
    ({"order": 2.2, "orders": [2.2, 2.2]}, "fail", "above"),
    ({"order": None}, "inconclusive", "round-off"),
    ({"back": OF_STEPS["back"]}, "pass", ""), ({"back": OF_STEPS["back"] * ABOVE}, "fail", "miss"),
    ({"back": None}, "inconclusive", "way back"), ({"lost": "stops"}, "inconclusive", "stops"),
    ({"back": 1.0, "self_adjoint": False}, "pass", ""),
    ({"back": 1.0, "self_adjoint": False, "claims": HONEST}, "fail", "miss"),
    ({"back": 1.0, "self_adjoint": False, "claims": SILENT}, "pass", ""),
    ({"form": OF_STEPS["form"]}, "pass", ""), ({"form": OF_STEPS["form"] * ABOVE}, "fail", "form"),
    ({"form": None}, "inconclusive", "form"), ({"form": 1.0, "way": "reversible"}, "pass", ""),
    ({"way": "naive", "back": 1e-29}, "fail", "another one on the way back"),
    ({"way": "naive", "back": 1e-29, "self_adjoint": False}, "inconclusive", "not self-adjoint"),
    ({"energy": {"failed": "it stops"}}, "inconclusive", "it stops"),
    ({"energy": {"failed": "it stops"}, "way": "reversible"}, "pass", ""),
    ({"control": "naive", "way": "naive", "back": 1e-29}, "fail", "by its energy"),
    ({"control": "naive", "way": "naive", "back": 0.0}, "fail", "by the way back"),
])  # fmt: skip
def test_steps_that_vary_keep_what_their_way_keeps(wrong, verdict, word):
    said = varied(**wrong)
    assert said[0] == verdict and word in said[1], said


def test_savings_change_no_digit():
    def told(*differences):
        rows = [{"difference": d, "variant": f"v{k}"} for k, d in enumerate(differences)]
        return judged("savings", None, rows=rows)

    assert told(0.0, SAME) == ("pass", "", {"limit": SAME})
    for wrong in (ABOVE * SAME, math.nan):
        assert told(0.0, wrong)[0] == "fail" and "saving 'v1'" in told(0.0, wrong)[1]


def race(errors, metric="error", floor=None, periods=None, causes=(), steps=None, cut="the budget"):
    rows = [{metric: e, "cause": None} for e in errors]
    rows += [{metric: None, "cause": cause, "steps": steps} for cause in causes]
    return judged(
        "work-precision", None, rows=rows, floor=floor or {}, periods=periods,
        measured={"cut": cut},
    )  # fmt: skip


def test_errors_of_long_steps_are_no_other_problem():
    """An energy that is lost at the rate c h ends off by 1 − exp(−c h): c h falls by halves."""
    share = OF_RACES["sinking"]
    for last, verdict in ((0.9, "inconclusive"), (ABOVE * share, "inconclusive"), (0.65, "pass")):
        assert race([1 - (1 - last) ** 2**k for k in (3, 2, 1, 0)])[0] == verdict
    for stops, verdict in ((share * ABOVE, "inconclusive"), (share, "fail"), (0.3, "fail")):
        told = race([stops] * 5)
        assert told[0] == verdict and ("resolves" in told[1]) == (verdict != "fail")
    assert race([0.9] * 5, cut="")[0] == "fail"  # the ladder came to its shortest steps


def test_a_method_in_a_race_comes_to_the_truth():
    assert race([1.0, 1e-1, 1e-2, STALLED]) == ("pass", "", {"limit": STALLED})
    verdict, reason, _ = race([1e-1, 1e-2, 1e-2, 1e-2])
    assert verdict == "fail" and "at 0.01: it solves another problem" in reason
    assert race([1e-2, 1e-2, 1e-2])[0] == "inconclusive"  # three runs speak against nothing
    assert "(1, the best with an error of 0.01): --budget" in race([1e-2])[1]
    assert race([30, 20, 1e-2])[0] == "inconclusive" and race([1.0, STALLED])[0] == "pass"
    assert race([1.0, 1.0, 1e-2, 0.99])[0] == "pass"  # it still sinks
    assert race([1.0, 1.0, 0.7, 0.9])[0] == "pass" and race([0.5, 0.5, 0.36, 0.4])[0] == "fail"
    assert race([1.0, 0.5, 0.9, 0.9])[0] == "fail" and race([0.5, 1.0, 0.9, 0.9])[0] == "fail"
    assert race([1.0, 1.0, 0.9, 0.9, 0.2])[0] == "pass"
    # the limit is a thousand floors, of the metric in use
    floor = {"error": 1e-3, "energy-max": 1e-6}
    assert race([1.0] * 4, floor=floor) == ("pass", "", {"limit": 1.0})
    told = race([0.3] * 4, metric="energy-max", floor=floor, periods=5)
    assert told[0] == "fail" and told[2] == {"limit": pytest.approx(1e-3)}
    verdict, reason, _ = race([], causes=(None, "first", "second", "last"))
    assert (verdict, reason) == ("inconclusive", "no run came to its end: last.")
    assert race([])[1] == "no run came to its end: the budget."
    assert race([], causes=("one", "two"), steps=0)[:2] == ("fail", "no run makes a step: two.")
    assert race([], causes=("one", "two"), steps=1)[0] == "inconclusive"
