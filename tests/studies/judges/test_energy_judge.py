"""The judge of energy: at its limits and beside them."""

import math

import numpy as np
import pytest

from discmech.studies import get
from discmech.studies.core.outcome import Measurement
from discmech.studies.core.result import result_of
from discmech.studies.energy import balance
from discmech.studies.energy import errors as energy
from discmech.studies.energy.judging_modified import is_told
from discmech.studies.energy.limits import LIMITS
from discmech.studies.report.tables import short, wanted
from discmech.studies.report.wording import scientific
from discmech.studies.systems.modified_change import Change
from tests.studies.judges.by_hand import ABOVE, case, judged


def energy_of(of=None, *, band=1e-2, slope=0.0, interval=(-1.0, 1.0), duration=100.0, **more):
    edges = more.pop("edge_slopes", None)
    measured = {"band": band, "slope": slope, "slope_interval": interval, "edge_slopes": edges}
    return judged("energy", of or case(), measured=measured, duration=duration, **more)


def test_a_slope_may_explain_a_tenth_of_the_band():
    limit = 1e-2 * 0.1 / 100
    for slope in (limit, -limit):
        assert energy_of(slope=slope, interval=(1, 2)) == ("pass", "", {"slope_limit": limit})
        verdict, reason, _ = energy_of(slope=ABOVE * slope, interval=(1, 2))
        assert verdict == "fail" and "over t = 100, which is 10% of its band" in reason
        assert f"drifts by {100 * slope:.2g}" in reason


@pytest.mark.parametrize(("slope", "drifts", "drift"), [
    (1e-4, [], 1e-2), (0.0, [[100.0, 1e-5, 0.9e-5, 1.1e-5], [800.0, 2e-5, 1e-5, 3e-5]], 0.016),
])  # fmt: skip
def test_the_drift_that_fails_is_the_one_that_is_shown(slope, drifts, drift):
    """Whatever the modified energy measures, as of a run too wide for it."""
    measured = {"band": 1e-2, "slope": slope, "slope_interval": (1, 2), "edge_slopes": None}
    given = {"measured": measured | {"drift": 1e-9}, "duration": 100.0, "drifts": drifts}
    told = get("energy").judge(case(), Measurement.of_json(given))
    assert told.verdict == "fail" and f"drifts by {drift:.2g} over" in told.reason
    shown = {"verdict": "fail", "why": told.why, "measured": {**given["measured"], **told.measured}}
    assert short(result_of("energy", shown)) == f"drifts by {scientific(drift)}"


def test_a_slope_of_round_off_is_none():
    for digits, eps in ((16, 2.0**-53), (50, 1e-50)):
        limit = 1e4 * eps / 100
        assert energy_of(case(digits), band=1e-99, slope=limit, interval=(1, 2))[0] == "pass"
        beyond = energy_of(case(digits), band=1e-99, slope=ABOVE * limit, interval=(1, 2))
        assert beyond[0] == "fail"


@pytest.mark.parametrize("interval", [(-1e-9, 1.0), (-1.0, 1e-9), (0.0, 1.0), (-1.0, 0.0)])
def test_a_slope_that_may_be_none_is_not_told(interval):
    verdict, reason, _ = energy_of(slope=1.0, interval=interval)
    assert verdict == "inconclusive" and "too short" in reason


def test_a_drift_goes_one_way_and_its_edges_with_it():
    to_and_fro = energy_of(slope=1.0, interval=(0.9, 1.1), steady=0.99 * LIMITS["steady"])
    assert to_and_fro[0] == "inconclusive" and "too short" in to_and_fro[1]
    assert energy_of(slope=1.0, interval=(0.9, 1.1), steady=LIMITS["steady"])[0] == "fail"
    limit = 1e-2 * 0.1 / 100
    for edges, verdict in (
        ([limit, -limit], "pass"), ([0.0, limit / 2], "pass"),
        ([0.0, -ABOVE * limit], "fail"), ([ABOVE * limit, 0.0], "fail"),
    ):  # fmt: skip
        assert energy_of(slope=1.0, interval=(0.9, 1.1), edge_slopes=edges)[0] == verdict


@pytest.mark.parametrize(("time", "band", "told"), [
    (90.0, 1e-12, True), (90.0, 1e-11, False), (70.0, 1e-12, False), (None, 1e-12, False),
])  # fmt: skip
def test_no_longer_run_tells_more_of_what_is_round_off(time, band, told):
    """The round-off is that of the numbers: what a run loses in a step, its walk, is no measure."""
    rows = [] if time is None else [Change(time, 1e-11, 1e-11, 1e-9, 1e-12, walk=1e-10, path=1.0)]
    assert is_told(rows, band, 100.0) is told


def test_no_number_is_no_energy_and_nonholonomic_motion_has_no_band():
    for band in (math.inf, math.nan):
        assert energy_of(band=band)[:2] == ("fail", "the energy is no longer finite.")
    verdict, reason, expected = energy_of(case(scene={"no_energy": "nonholonomic"}), slope=1.0)
    assert (verdict, reason, list(expected)) == ("pass", "", ["not_demanded"])
    shown = result_of("energy", {"expected": expected})
    assert "nonholonomic" in expected["not_demanded"] and wanted(shown) == "only measured"


def test_a_certain_drift_is_told_inside_the_band():
    # last time, rate, interval of the rate
    once, again = [100.0, 1e-5, 0.9e-5, 1.1e-5], [800.0, 2e-5, 1.1e-5, 3e-5]
    for run, words in ((100.0, "the only one made"), (800.0, "not the same in one 8 times")):
        verdict, reason, _ = energy_of(drifts=[once], duration=run)
        assert verdict == "inconclusive" and words in reason
        assert "drifts by 0.001 over t = 100, 10.0% of its band" in reason
    verdict, reason, _ = energy_of(drifts=[once, again])
    assert verdict == "fail" and "drifts by 0.016 over t = 800, 160.0% of its band" in reason
    third = [3200.0, 1e-5, 5.0, 6.0]  # the first two decide
    assert energy_of(drifts=[once, again, third])[0] == "fail"
    assert energy_of(drifts=[once, [800.0, -1e-5, 1.11e-5, 3e-5]])[0] == "inconclusive"
    assert energy_of(drifts=[once, [800.0, 1e-5, 0.0, 0.89e-5]])[0] == "inconclusive"
    assert "-0.008" in energy_of(drifts=[once, [800.0, -1e-5, 0.0, 0.9e-5]])[1]
    assert "8.0%" in energy_of(drifts=[once, [800.0, -1e-5, 0.0, 0.9e-5]], band=0.1)[1]
    assert "all of its band" in energy_of(drifts=[once], band=0.0)[1]


def test_a_modified_energy_that_goes_one_way_does_so_in_more_than_its_last_state():
    def told(*changes, bound=1e-5):
        times = np.linspace(100 / len(changes), 100, len(changes))
        rows = [{"time": t, "modified": e, "bound": bound, "path": 1e-3}
                for t, e in zip(times, changes, strict=True)]  # fmt: skip
        return energy_of(modified=rows)

    verdict, reason, _ = told(1e-4, 3e-4, 4e-4, 8e-4)
    assert verdict == "inconclusive" and "only seems to oscillate" in reason
    assert "changes by 0.0008" in reason
    assert told(1e-7, -1e-7, -1e-7, 8e-4)[0] == "pass"  # on both sides before the last
    assert told(1e-4, 3e-4, 4e-4, 8e-4, bound=1e-3)[0] == "pass"


@pytest.mark.parametrize(("slope", "steady"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_large_error_of_the_first_half_alone_is_no_band(slope, steady):
    def told(band=0.8, second=0.0, still=True):
        quarters = [band, band / 2, second, second / 2]
        of = {"quarters": quarters, "still": still, "steady": steady, "slope": slope}
        return energy_of(band=band, **of)

    else_told = energy_of(band=0.8, slope=slope, steady=steady)
    assert told()[0] == "fail" and "comes to rest" in told()[1]
    assert told(still=False)[0] == "inconclusive" and "no band" in told(still=False)[1]
    assert told(second=0.2 / ABOVE)[0] == "fail" and told(second=0.2) == else_told
    assert told(LIMITS["wide"] * ABOVE)[0] == "fail"
    assert (
        told(LIMITS["wide"])[0] == "fail" and told(LIMITS["wide"], still=False)[0] == else_told[0]
    )


@pytest.mark.parametrize(("drift", "said"), [
    (0.1, ("fail", "over t = 50, which is 50% of its band.")),
    (0.01, ("inconclusive", "half of the run has 25.0% of the error of the energy")),
])  # fmt: skip
def test_a_drift_of_half_of_the_run_is_one_of_a_run_whose_error_grows(drift, said):
    """A longer run takes no drift back, although its last quarters have most of its error."""
    half = {"band": 0.2, "slope": drift / 50, "slope_interval": (1e-9, 1), "edge_slopes": None}
    before = {"measured": half, "duration": 50.0}
    verdict, reason, _ = energy_of(band=ABOVE * 0.8, quarters=[0.1, 0.2, 0.3, 0.4], before=before)
    assert (verdict, said[1] in reason) == (said[0], True)
    assert energy_of(band=0.8, quarters=[0.1, 0.2, 0.3, 0.4], before=before)[0] == "pass"


def test_the_balance_of_energy_and_work(monkeypatch):
    of = case(scene={"force": 1})
    monkeypatch.setattr(balance, "wanted", lambda case, *_: {"balance_order": 1.95})

    def told(found, orders=(), way=1.0, band=1e-3, digits=16, steps=100):
        of.digits = digits
        return judged(
            "energy", of, measured={"band": band, "balance_order": found, "slope": 0.0},
            way=way, steps=steps, balance_orders=list(orders), duration=1.0,
        )  # fmt: skip

    assert told(1.95) == told(2.5) == ("pass", "", {"balance_order": 1.95})
    verdict, reason, _ = told(1.9, (1.8, 1.9))
    assert verdict == "inconclusive" and "after 1.80 at" in reason
    verdict, reason, _ = told(1.5, (1.45, 1.5))
    assert verdict == "fail" and reason.endswith("sinks with the step's power 1.50 only.")
    assert told(1.5, (1.95, 1.5))[0] == "inconclusive"  # as far off as the orders differ
    assert told(1.25, (2.0, 1.25))[0] == "inconclusive"
    assert told(1.25, (1.75, 1.25))[0] == "fail"
    assert "does not sink" in told(None)[1] and told(None)[0] == "inconclusive"
    monkeypatch.setattr(balance, "wanted", lambda case, *_: {"balance_order": 0.95})
    assert told(None)[0] == "inconclusive" and told(0.95)[0] == "pass"  # a rule of order 1
    assert told(2.0, band=math.nan)[:2] == ("fail", "the energy is no longer finite.")
    for digits, eps in ((16, 2.0**-53), (50, 1e-50)):
        limit = 16 * eps * 100
        assert told(0.5, (0.5, 0.5), way=limit, digits=digits)[0] == "pass"
        assert told(0.5, (0.5, 0.5), way=ABOVE * limit, digits=digits)[0] == "fail"


def test_a_balance_has_the_order_of_its_rule_up_to_that_of_the_sum():
    wanted = balance.wanted
    for order, least in ((None, 0.95), (1, 0.95), (2, 1.95), (4, 1.95)):
        assert wanted(case(order=order)) == {"balance_order": least}
    assert not balance.applies(case())
    assert balance.applies(case(scene={"force": 1}))
    assert balance.applies(case(scene={"lagrangian": lambda x, v, p, t: v[0]}))


def series(total, count=2560, spikes=0.0, rate=1.0):
    """(times, errors) up to t = 4: a line, and in each fortieth a spike up and one down."""
    times, chance = np.linspace(0, 4, count), np.random.default_rng(1)
    errors = total * (times / 4) ** rate
    for first in range(0, count - 40, 40):
        up, down = chance.uniform(0, spikes, 2) if spikes else (0, 0)
        errors[first + 7] += up
        errors[first + 21] -= down
    return times, errors


def test_a_drift_is_certain_where_mean_and_edges_go_along():
    for total in (1e-6, -1e-6):
        found = energy.certain_drift(case(), *series(total, 256))
        assert found.slope == pytest.approx(total / 4, rel=1e-9)
        assert energy.certain_drift(case(), *series(total, 255)) is None  # too few
    for digits, eps in ((16, 2.0**-53), (50, 1e-50)):
        for factor in (0.99, 1.01):  # of what round-off may make
            found = energy.certain_drift(case(digits), *series(factor * 1e4 * eps))
            assert (found is None) == (factor < 1)
    times, errors = series(1e-6)
    for bad in (math.nan, math.inf):
        errors[99] = bad
        assert energy.certain_drift(case(), times, errors) is None


def test_a_drift_is_not_certain_where_an_edge_may_stand(monkeypatch):
    wide = series(1e-3, spikes=1e-2)
    assert energy.certain_drift(case(), *wide) is None
    monkeypatch.setattr(energy, "CERTAIN", 0.5)
    assert energy.certain_drift(case(), *wide) is not None
    times, errors = series(1e-3)
    band = np.where(np.arange(len(times)) % 2, 1e-3, 0)  # between edges that stand
    assert energy.certain_drift(case(), times, np.clip(errors, 0, 1e-3) * 0 + band) is None
    for edge in (np.minimum, np.maximum):
        stands = edge(errors + 2 * band - 1e-3, 5e-4)
        assert energy.certain_drift(case(), times, stands) is None


def test_a_period_that_nearly_divides_a_part_is_no_drift(monkeypatch):
    """Means of 8 parts, and the extremes that steps meet, move with the phase; not those of 7."""
    times = np.arange(10_000) / 10_000
    band = -1e-3 * np.cos(math.pi * 64.24 * times) ** 2
    assert energy.certain_drift(case(), times, band) is None
    assert energy.certain_drift(case(), times, band + 1e-3 * times).slope > 0
    monkeypatch.setattr(energy, "PARTITIONS", (8,))
    assert energy.certain_drift(case(), times, band) is not None


def test_what_goes_to_and_fro_is_not_steady():
    def told(*means):
        return energy._steadiness(np.repeat(np.array(means, dtype=float), 5))

    assert told(*range(8)) == told(*range(0, -8, -1)) == told(*[3] * 8) == 1
    assert told(0, 1, 2, 3, 4, 5, 6, 4) == 0.5 and told(0, 1, 0, 1, 0, 1, 0, 1) == 1 / 7
    assert told(0, 1, 2, 3, 4, 5, 6, math.inf) == 1
    times, errors = series(1e-3)
    back = np.where(times < 3, errors, 2 * 0.75e-3 - errors)  # a quarter of its way
    assert energy._steadiness(back) < LIMITS["steady"]
    assert energy.certain_drift(case(), times, back) is None


def test_edges_are_lines_through_the_extremes_of_eight_parts():
    times = np.arange(160) / 10
    sign = np.where(np.arange(160) % 2, 1.0, -1.0)
    assert energy._edge_slopes(times, 3 * times + sign) == pytest.approx([3, 3], rel=1e-3)
    assert energy._edge_slopes(times, sign * times) == pytest.approx([-1, 1], rel=1e-2)
    above = energy._edge_slopes(times, np.where(sign > 0, times, 0))
    assert above == pytest.approx([0, 1], abs=1e-2)
    assert energy._edge_slopes(times[:7], sign[:7]) is None
    assert energy._edge_slopes(times, sign * math.nan) is None
