"""The judge of momenta: at its limits and beside them."""

import math
from dataclasses import make_dataclass, replace
from types import SimpleNamespace

import numpy as np

from discmech import black_box
from discmech.studies.core.single_steps import Departure
from discmech.studies.evidence.judging import broken
from discmech.studies.evidence.laws import FORM
from discmech.studies.momentum import measuring as momentum
from discmech.studies.momentum.sight import key_of, seen
from tests.studies.judges.by_hand import ABOVE, BELOW, case, close, judged


def quantity(name, stretch=None):
    return SimpleNamespace(name=name, stretch=stretch)


def momentum_of(monkeypatch, drift, kept, measured=None, steps=10**6, substeps=1, **more):
    monkeypatch.setattr(momentum, "kept_in", lambda case: kept)
    monkeypatch.setattr(momentum, "measured_in", lambda case: measured or kept)
    of = case(more.pop("digits", 16), substeps=[1] * substeps,
              **{k: more.pop(k) for k in ("rule",) if k in more})  # fmt: skip
    return judged("momentum", of, measured={"drift": drift}, steps=steps, **more)


def test_a_momentum_walks_as_round_off_does(monkeypatch):
    kept, eps = [quantity("J")], 2.0**-53
    limit = eps * (5 / math.sqrt(3) * 1000 + 2)
    verdict, reason, expected = momentum_of(monkeypatch, {"J": BELOW * limit}, kept)
    assert (verdict, reason) == ("pass", "")
    assert expected["limits"]["J"] == close(limit)
    assert expected["limit"] == expected["limits"]["J"]
    assert expected["random_walk"] == close(eps * 1000)
    assert expected["over"] == {"J": 10**6}
    verdict, reason, _ = momentum_of(monkeypatch, {"J": ABOVE * limit}, kept)
    assert verdict == "fail"
    assert reason == "J drifts by 3.2e-13, more than 3.2e-13 in 1000000 steps."
    assert momentum_of(monkeypatch, {"J": expected["limit"]}, kept)[0] == "pass"
    assert momentum_of(monkeypatch, {"J": math.nan}, kept)[0] == "fail"


def test_what_round_off_does_to_it_and_substeps_count(monkeypatch):
    eps, units = 2.0**-53, {"J": (3.0, 7.0)}
    limit = eps * (5 / math.sqrt(3) * math.sqrt(5e6) * 3 + 2 * 7)
    found = momentum_of(monkeypatch, {"J": 0.0}, [quantity("J")], units=units, substeps=5)
    assert found[2]["limit"] == close(limit)
    none = momentum_of(monkeypatch, {"J": 0.0}, [quantity("J")], units=units, substeps=0)
    assert none[2]["limit"] == close(eps * (5 / math.sqrt(3) * 3000 + 14))


def test_stretches_and_worked_quantities_are_followed_less_long(monkeypatch):
    kept, worked = [quantity("J"), quantity("K", 100)], [quantity("W")]
    drift = dict.fromkeys("JKW", 0.0)
    _, _, expected = momentum_of(monkeypatch, drift, kept, [*kept, *worked])
    assert expected["over"] == {"J": 10**6, "K": 200_000, "W": 1}
    ratio = expected["limits"]["K"] / expected["limits"]["W"]
    c = 5 / math.sqrt(3)
    assert ratio == close((10 * c + 2) / (c + 2))
    assert expected["random_walk"] == close(2.0**-53 * 1000)


def test_the_quantity_that_drifts_farthest_is_told(monkeypatch):
    kept = [quantity("J"), quantity("K")]
    reason = momentum_of(monkeypatch, {"J": 1e-3, "K": 1e-2}, kept)[1]
    assert reason.startswith("K drifts by 0.01")
    unknown = momentum_of(monkeypatch, {"J": 0.0, "E": 1.0}, kept)[1]
    assert unknown.startswith("E drifts by 1, more than 3.2e-13.")
    assert momentum_of(monkeypatch, {"J": 0.0, "E": 3.1e-13}, kept)[0] == "pass"


def test_what_lost_digits_can_add_up_to_is_not_told(monkeypatch):
    def told(drift, **more):
        kept = [quantity(name) for name in drift]
        return momentum_of(monkeypatch, drift, kept, lost=1e-8, **more)

    assert told({"J": 1e-8})[0] == "inconclusive" and told({"J": 1e-8 * ABOVE})[0] == "fail"
    assert told({"J": 1e-8, "K": 2e-8})[0] == "fail"
    assert told({"J": 3e-8}, units={"J": (3.0, 1.0)})[0] == "inconclusive"
    assert told({"J": 9e-9}, units={"J": (0.5, 1.0)})[0] == "inconclusive"
    assert told({"J": 2e-8}, units={"J": (0.5, 3.0)})[0] == "fail"


def test_a_quantity_with_the_name_of_a_law_has_its_own_words():
    one = Departure(1e-3, 1e-20, "form", 0.1, "x = (1)", on_motion=True)
    said = broken(key_of("form"), one, 7)
    assert "the run keeps form, but a step" in said and "drawn on the motion (seed 7)" in said
    assert "changes form by 0.001" in said and "defect" not in said
    beside = broken(FORM.name, replace(one, name="poisson", on_motion=False), 7)
    assert "has a poisson defect of 0.001" in beside and "drawn beside the motion" in beside


def test_a_program_may_round_alike_as_far_as_shorter_steps_show_it(monkeypatch):
    """By twice what they lose, and never by more than four roundings a step."""
    kept, eps = [quantity("J")], 2.0**-53
    own = black_box(order=2, name="program", keeps="J")(lambda q, p, h: (q, p))
    limit = eps * (5 / math.sqrt(3) * math.sqrt(8e6) + 2)  # each step rounds eight times
    for lost, most in ((1e-12, 2e-12), (1e-6, 4e6 * eps)):
        for side, verdict in ((BELOW, "pass"), (ABOVE, "fail")):
            drift = {"J": side * (limit + most)}
            told = momentum_of(monkeypatch, drift, kept, lost=lost, rule=own)
            assert told[0] == verdict
            if verdict == "pass":
                assert told[2]["limit"] == told[2]["limits"]["J"] == close(limit + most)


def test_a_fault_of_a_total_momentum_is_seen_whatever_directions_are_drawn():
    """Moved in opposite ways, two alike momenta have the sum of before."""
    run = make_dataclass("Run", ["base", "mu", "u"])
    still = run(np.zeros((8, 0)), np.full((8, 2), 0.3), np.zeros((8, 0)))

    def total(run):
        return run.mu.sum(axis=1)[:, None], abs(run.mu).sum(axis=1)[:, None]

    changes = [seen(total, still, 1e-12, 16, str(seed)).change for seed in range(60)]
    assert min(changes) > 4e-12
