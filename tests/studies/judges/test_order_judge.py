"""The judge of orders: at its limits and beside them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from discmech import black_box
from discmech.integrators.rules import get as rule
from discmech.studies.core.records import encoded
from discmech.studies.order import judging, window
from discmech.studies.order.limits import tolerance
from discmech.studies.order.records import Row
from tests.studies.judges.by_hand import ABOVE, BELOW, case, close, judged


def ladder(errors, used=(), ratio=2.0):
    return [
        {"step": ratio**-k, "error": error, "used": k in used, "why_not": "", "cause": None}
        for k, error in enumerate(errors)
    ]


def order_of(found, of=None, rows=(), certain=14, **more):
    return judged(
        "order", of or case(), measured={"order": found}, rows=list(rows), certain=certain, **more
    )


@pytest.mark.parametrize(("digits", "tolerance"), [(16, 0.05), (50, 0.01)])
def test_order_is_judged_from_both_sides(digits, tolerance):
    for side in (-1, 1):
        inside, outside = (2 + side * tolerance * f for f in (0.999, 1.001))
        passed = order_of(inside, case(digits), ladder([]))
        assert passed == ("pass", "", {"order": 2, "tolerance": tolerance})
        verdict, reason, _ = order_of(outside + side * 0.2, case(digits), ladder([]))
        assert verdict == "fail" and ("below" if side < 0 else "above") in reason
        assert f"order {outside + side * 0.2:.3f}" in reason and str(tolerance) in reason


def test_a_pass_of_runs_that_were_cut_says_up_to_when():
    """The runs with more digits take a fortieth of the duration by themselves."""
    whole = case(scene={"duration": 40, "contact": None})
    assert order_of(2.0, whole, ladder([]), duration=1.0)[:2] == ("pass", "")
    verdict, reason, _ = order_of(2.0, whole, ladder([]), duration=0.99)
    assert verdict == "pass" and "the order up to t = 0.99 of 40: " in reason


@pytest.mark.parametrize(("order", "found", "digits", "verdict"), [
    (8, 8.07, 16, "inconclusive"), (8, 8.49, 16, "inconclusive"), (8, 8.51, 16, "fail"),
    (8, 7.93, 16, "fail"), (8, 8.07, 50, "fail"), (4, 4.07, 16, "fail"),
])  # fmt: skip
def test_a_high_order_in_doubles_may_be_that_of_a_sum_of_powers(order, found, digits, verdict):
    said = order_of(found, case(digits, order=order), ladder([]))
    assert said[0] == verdict and ("8 and 9, as the order" in said[1]) == (verdict != "fail")


def test_as_far_as_the_tolerance_is_near_enough():
    assert order_of(0.05, case(order=0))[0] == "pass" and tolerance(16) == 0.05
    assert order_of(0.05 * ABOVE, case(order=0), ladder([]))[0] == "fail"


def test_an_order_may_be_undeclared_or_lost_in_the_chart():
    verdict, reason, expected = order_of(7.0, case(order=None))
    assert (verdict, reason, expected["order"]) == ("pass", "", None)
    assert "declares no order" in expected["not_demanded"]
    exact = order_of(None, case(order=None), ladder([0.0, 0.0]))
    assert exact[0] == "pass" and exact[2]["not_demanded"] == expected["not_demanded"]
    of = case()
    of.rule = replace(of.rule, order=4)
    assert order_of(2.0, of)[2] == {"order": 2, "tolerance": 0.05, "declared": 4}
    of.rule = replace(of.rule, order=2)
    assert "declared" not in order_of(2.0, of)[2]


@pytest.mark.parametrize(("found", "error", "verdict"), [
    (2.24, 1.1e-4, "inconclusive"), (1.76, 1.1e-4, "inconclusive"), (2.26, 1.1e-4, "fail"),
    (1.76, 1e-4, "fail"), (2.24, 1e-5, "fail"),
])  # fmt: skip
def test_a_program_beside_its_order_is_not_told_where_errors_are_large(found, error, verdict):
    """More steps may bring it there; a formula is judged at 50 digits."""
    rows = ladder([1.0, error])
    program = case(rule=black_box(order=2, name="program")(lambda q, p, h: (q, p)))
    told = order_of(found, program, rows)
    assert told[0] == verdict and ("take more --steps" in told[1]) == (verdict != "fail")
    assert order_of(found, case(), rows)[0] == "fail"


@pytest.mark.parametrize(("digits", "order", "growing"), [(16, 5, 15), (16, 6, -9), (50, 4, 11)])
def test_a_sum_of_powers_reaches_an_order_that_a_line_misses(digits, order, growing):
    """The next powers of the step are told from a lower one of 15 % of the finest error."""
    double, of, reached = digits == 16, case(digits, order=order), 0
    steps = 0.15 * 2.0 ** (-np.arange(14) / 2) if double else 0.02 * 2.0 ** -np.arange(7)
    counts = np.round(10 / steps)
    for seed in range(8):
        drawn = np.random.default_rng(seed)
        factors = drawn.uniform(1, 1.5, 5) * float(growing) ** np.arange(5)
        noise = double * 2.0**-53 * np.sqrt(counts) * drawn.normal(size=len(steps))
        sound = np.abs(sum(c * steps ** (order + k) for k, c in enumerate(factors)) + noise)
        last = np.flatnonzero(sound > window.floor(of, 60))[-1]
        lower = sound[last] * (steps / steps[last]) ** (order - 1)
        for share, of_x in [*((e, 0.1 * e) for e in (0, 0.15, -0.15, 0.3, 1, -3, 30)), (0, 1)]:
            mu = np.abs(sound + share * lower)
            x = 0.1 * np.abs(sound + of_x * lower)
            parts = np.array([counts, steps, np.hypot(x, mu), x, mu])
            rows = [Row(*row) for row in parts.T.tolist()]
            rows, found = window.fit(of, rows, 60)
            verdict, reason, _ = order_of(found.order, of, [encoded(row) for row in rows], 60)
            told = verdict == "pass" and not share and not of_x
            assert f"order {order} is reached" not in reason or told
            assert share or of_x or verdict != "fail"
            reached += "is reached" in reason
    assert reached


@pytest.mark.parametrize(("local", "verdict"), [
    ((3.968, 3.981, 3.989, 3.994), "inconclusive"), ((3.985, 3.98, 3.975, 3.97), "fail"),
    ((3.983, 3.983, 3.983, 3.983), "fail"),
])  # fmt: skip
def test_few_errors_that_come_nearer_ask_for_smaller_steps(local, verdict):
    """Five are too few for a sum of powers; by a lower power the local orders go away."""
    of, errors = case(50, order=4), 1e-8 * 2.0 ** -np.cumsum([0, *local])
    rows = [Row(8 * 2**k, 0.125 / 2**k, float(error)) for k, error in enumerate(errors)]
    fitted, line = window.fit(of, rows, 60)
    assert window.decided(of, rows, 60) == (verdict == "fail")
    told = order_of(line.order, of, [encoded(row) for row in fitted], 60)
    assert told[0] == verdict and ("take more --steps" in told[1]) == (verdict == "inconclusive")


def test_runs_without_an_order():
    failed = [{"error": None, "why_not": "failed", "cause": f"cause {k}"} for k in range(3)]
    assert order_of(None, rows=failed)[:2] == ("fail", "every run failed: cause 0.")
    some = [*failed, *ladder([1e-3, 1e-4])]
    verdict, reason, _ = order_of(None, rows=some)
    assert verdict == "inconclusive" and "the reference has 14 certain digits), or" in reason
    assert reason.endswith("judge it by --digits 50.")
    assert order_of(None, case(50), rows=some)[1].endswith("judge it by --digits 80.")
    floor = window.floor(case(), 14)
    for factor, said in ((1.0, "exact on this scene"), (ABOVE, "fewer than four")):
        verdict, reason, _ = order_of(None, rows=ladder([0.0, factor * floor]))
        assert verdict == "inconclusive" and said in reason


def by_local_orders(*local, first=1e-2, unknown=0, ratio=2.0):
    errors = [first]
    for p in local:
        errors.append(errors[-1] / ratio**p)
    rows = ladder(errors, used=range(len(errors)), ratio=ratio)
    for _ in range(unknown):
        rows.insert(1, {"step": 0.7, "error": None, "used": False, "why_not": "failed"})
    return rows


@pytest.mark.parametrize(("local", "said"), [
    ((1.7, 1.02, 1.01, 1.015), "settles beside the expected 2: 1.02, 1.01, 1.01 at"),
    ((2.9, 3.0, 2.98, 2.99), "settles beside the expected 2: 3.00, 2.98, 2.99 at"),
    ((1.8, 1.6, 1.3), "goes away from the expected 2: 1.80, 1.60, 1.30 at"),
    ((2.2, 2.4, 2.7), "goes away from"),
    ((1.5, 1.5, 1.5), "goes away from"),
    ((1.5, 1.4, 1.48), "settles beside"),  # within a quarter of what is missed
    ((1.5, 1.7, 1.8), ""),  # comes nearer
    ((1.8, 2.3, 1.6), ""),  # on both sides
    ((1.6, 1.4, 1.5), ""),  # neither
    ((1.91, 1.9, 1.89), ""),  # as near as that is near
    ((1.89, 1.88, 1.87), "goes away from"),
    ((1.0, 1.0), ""),  # three errors are too few
])  # fmt: skip
def test_errors_on_no_line_may_belong_to_another_order(local, said):
    for unknown in (0, 2):
        verdict, reason, _ = order_of(None, rows=by_local_orders(*local, unknown=unknown))
        assert verdict == ("fail" if said else "inconclusive")
        assert (said or "fewer than four") in reason
    assert order_of(None, case(order=None), rows=by_local_orders(*local))[0] == "inconclusive"
    coarser = order_of(None, rows=by_local_orders(*local, ratio=4.0))
    assert (said or "fewer than four").partition(":")[0] in coarser[1]


def test_errors_that_all_the_steps_did_not_bring_down():
    stuck = by_local_orders(0, 0.1, 0, 0.1, first=0.1)
    verdict, reason, _ = order_of(None, rows=stuck)
    assert verdict == "fail"
    assert reason.startswith("the runs do not converge: 4 halvings of the step leave an error of")
    assert "of 0.087, where order 2 is expected" in reason
    elsewhere = ladder([0.5, 0.3, 0.21, 0.2, 0.2 / ABOVE])  # the last two agree to a hundredth
    assert "the runs converge, to another motion: 4" in order_of(None, rows=elsewhere)[1]
    half = by_local_orders(1.5, 0.5, 1.0, first=1.0)  # 1 = 2/2 altogether
    assert "do not converge" not in order_of(None, rows=half)[1]
    assert "do not converge" in order_of(None, rows=by_local_orders(1.4, 0.5, 1.0, first=1.0))[1]
    third = by_local_orders(1.7, 1.7, 1.7, first=10.0)
    assert "do not converge" not in order_of(None, case(order=3), rows=third)[1]
    just = ladder([1.5e-2, 1.35e-2, 1.2e-2, 1e-2])  # a hundredth is not beyond it
    assert "do not converge" not in order_of(None, rows=just)[1]
    assert "do not converge" in order_of(None, rows=ladder([r["error"] * ABOVE for r in just]))[1]
    small = by_local_orders(1.4, 0.5, 1.0, first=7e-2)  # ends below a hundredth
    assert "do not converge" not in order_of(None, rows=small)[1]
    bent = window.BENT * window.floor(case(), 14)
    low = by_local_orders(1.8, 1.6, 1.3, first=0.99 * bent * 2.0**4.7)
    assert order_of(None, rows=low)[0] == "inconclusive"  # its last error is too near round-off


def test_a_wrong_coefficient_of_a_composition_is_seen():
    triple = rule("triple-jump:midpoint")
    assert order_of(4.0, case(order=4, rule=triple))[0] == "pass"

    class Off(type(triple)):
        method = SimpleNamespace(name="triple", order=4, defect=lambda digits: 2 * 10.0**-13)
        name = "off"

    wrong = object.__new__(Off)
    verdict, reason, _ = order_of(4.0, case(order=4, rule=wrong))
    assert verdict == "fail" and "triple miss a condition of order 4 by 2e-13" in reason
    Off.method.defect = lambda digits: 0.99 * 10.0 ** (3 - digits)
    assert order_of(4.0, case(order=4, rule=wrong))[0] == "pass"
    Off.method.defect = lambda digits: 1.01 * 10.0 ** (3 - digits)
    assert order_of(4.0, case(50, order=4, rule=wrong))[0] == "fail"


def test_one_step_denies_what_runs_do_not_see():
    def local(found, component="x", step=1e-6):
        return {"order": found, "component": component, "step": step}

    beside = judging.BESIDE
    assert order_of(2.0, local=local(2 - 0.99 * beside))[0] == "pass"
    verdict, reason, expected = order_of(2.0, local=local(1.0))
    assert verdict == "fail" and expected["local_order"] == 1.0
    assert "order 1.00 in x, below the expected 2" in reason and "O(h^2.00)" in reason
    assert order_of(2.0, local=local(2 - 1.01 * beside))[0] == "fail"
    assert order_of(2.0, local={"order": None})[2] == {"order": 2, "tolerance": 0.05}
    undeclared = case(order=None)
    assert order_of(2.0, undeclared, local=local(1.0))[0] == "pass"
    verdict, reason, _ = order_of(2.0, undeclared, local=local(0.0))
    assert verdict == "fail" and "not consistent" in reason
    exact = ladder([0.0, 0.0])
    told = order_of(None, rows=exact, local=local(3.0))
    assert told[0] == "inconclusive" and "one step is of order 3.00 in x: take another" in told[1]
    told = order_of(None, rows=exact, local=local(2.0))  # as at rest
    assert told[0] == "pass" and "single steps, also beside the motion, are of order 2.0" in told[1]
    program = case()  # it may count its steps
    program.rule = black_box(order=2)(lambda q, p, h, s: (q, p))
    assert order_of(None, program, rows=exact, local=local(2.0))[0] == "inconclusive"
    # runs that fail keep their own reason, and are told of a higher order only above
    below = order_of(1.5, local=local(1.0))[1]
    assert below.startswith("order 1.500 is below") and "higher than declared" not in below
    above = order_of(3.0, local=local(2 + 1.01 * beside))
    assert above[0] == "fail" and "higher than declared" in above[1]
    # the claim of a rule with an open number is that of all its values, among which one looks for
    # a better one
    value = case(rule=replace(rule("midpoint"), name="mine:w=1/6"))
    told = order_of(4.0, value, local=local(4.0))
    assert told[0] == "pass" and told[1].startswith("order 4.000, above the claimed 2")
    assert told[2]["or_above"] and order_of(1.0, value, local=local(1.0))[0] == "fail"
    assert order_of(4.0, value, local=local(1.0))[0] == "fail"
    assert "higher than declared" not in order_of(3.0, local=local(2 + 0.99 * beside))[1]
    assert "higher than declared" not in order_of(1.5, local=local(3.0))[1]
    assert "higher than declared" not in order_of(None, rows=ladder([1e-3]), local=local(3.0))[1]


def test_single_steps_whose_errors_add_up_excuse_runs_that_resolve_nothing():
    """By 2⁻³ of the state here: the rate times the duration and the square of the finest step."""
    rows = ladder([0.9, 0.8, 0.7, 0.6])
    for rate, verdict in ((0.32, "inconclusive"), (0.32 * BELOW, "fail"), (None, "fail")):
        local = {"order": 2.0, "component": "x", "step": 1e-6, "rate": rate}
        whole = case(scene={"duration": 4, "contact": None})
        told = order_of(1.0, whole, rows, local=local, duration=4.0)
        assert told[0] == verdict and ("up to 0.02 of" in told[1]) == (verdict != "fail")


def test_an_effective_order_has_its_own_steps():
    declared = case(rule=replace(rule("midpoint"), effective=4))
    steps = {"order": 2.0, "component": "x", "step": 1e-6}
    assert order_of(2.0, declared, local=steps)[0] == "inconclusive"
    for reached, verdict in ((4.0, ""), (2.0, "fail")):
        effective = {"verdict": verdict, "reason": "so", "reached": reached}
        told = order_of(2.0, declared, local={**steps, "effective": effective})
        assert (told[0], told[1]) == (verdict or "measured", "so")


def test_multipliers_on_no_line():
    """They fail where the finest is above a hundredth and fell more slowly than half the order."""

    def told(*errors, found=None):
        rows = [row | {"multipliers": e} for row, e in zip(ladder([1.0] * 4), errors, strict=True)]
        measured = {"order": 2.0, "multipliers": found}
        return judged("order", case(50), measured=measured, rows=rows, certain=50)

    verdict, reason, expected = told(0.28, 0.22, 0.3, 0.036)  # fell by less than 2³
    assert verdict == "fail" and expected["multipliers"] == 2
    assert "do not converge, with errors of 0.28, 0.22, 0.3, 0.036" in reason
    for errors in ((0.28, 0.22, 0.3, 0.034), (1e-2, 1.0, 1.0, 1e-2), (None, None, None, 0.1)):
        verdict, reason, _ = told(*errors)
        assert verdict == "inconclusive" and "fewer than four errors of the multipliers" in reason
    tiny = window.floor(case(50), 50)
    assert told(*[tiny] * 4)[0] == "pass" and told(*[tiny * ABOVE] * 4)[0] == "inconclusive"
    assert told(*[1.0] * 4, found=1.991)[0] == "pass"
    assert told(*[1.0] * 4, found=1.989)[0] == "fail"


@pytest.mark.parametrize(("digits", "certain", "least"), [
    (16, 20, 32 * 2.0**-53), (16, 10, 1e-8), (50, 60, 1e-47), (50, 40, 1e-38),
])  # fmt: skip
def test_nothing_below_round_off_or_the_reference_is_the_methods(digits, certain, least):
    assert window.floor(case(digits), certain) == close(least)


@pytest.mark.parametrize(("digits", "straight"), [(16, 0.012), (50, 0.005)])
def test_an_error_is_bent_where_round_off_moves_it_off_a_line(digits, straight):
    error = 1e-9 / (2**straight - 1)  # log₂ of (error + 1e-9) is `straight` higher
    row = {"error": error, "round_off": 1e-9}
    assert window.is_bent(case(digits), Row(**row))
    assert not window.is_bent(case(digits), Row(**row | {"error": ABOVE * error}))
    assert not window.is_bent(case(digits), Row(error=1e-300))


def test_recorded_runs_are_excused_by_a_motion_that_enlarges_errors():
    """Only where the growth was measured, and is large; the steps have their order in both."""
    held = SimpleNamespace(name="rows", order=2, effective=None, method=None, is_recorded=True,
                           is_formula=False, runs_at=lambda digits: digits == 16,
                           unit=lambda digits: 2.0**-53)  # fmt: skip
    rows = ladder([0.5, 0.48, 0.5, 0.49])
    told = [order_of(None, case(rule=held), rows=rows, local={"order": 2.0}, grown=grown)
            for grown in (None, 9.0, 11.0)]  # fmt: skip
    assert [verdict for verdict, *_ in told] == ["fail", "fail", "inconclusive"]
    assert "enlarges a change of its start 11 times" in told[2][1]
