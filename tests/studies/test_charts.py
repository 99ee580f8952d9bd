"""The study charts: what it shows of moser-veselov, and that it fails what is wrong."""

import math

import mpmath
import numpy as np
import pytest

from discmech.integrators import scenes
from discmech.studies import get
from discmech.studies.core.case import Choice
from discmech.studies.report.figures import plates
from discmech.tests.bench.charts import measuring as charts
from tests.studies.as_json import read, run_case
from tests.studies.cached_results import SMALL


def the_case(**more):
    (case,) = charts.cases(Choice(scenes=(scenes.get("moser-veselov"),), **more))
    return case


TURNS = (0.01, 0.2, 0.35, 0.49, 0.5, 0.51, 0.7, 0.99)


@pytest.fixture(scope="module")
def found():
    """By some turns about two axes; the slow tests and the report go by all about all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(charts, "AXES", 2)
        patch.setattr(charts, "TURNS", TURNS)
        patch.setattr(charts, "DRAWN", 2)
        patch.setattr(charts, "SIDE", 15)
        return run_case(get("charts"), the_case(digits=(16,), steps=SMALL["charts"][1]))


@pytest.mark.slow
def test_every_start_goes_through_and_all_translates_are_used(found):
    assert found["verdict"] == "pass", found["reason"]
    measured = found["measured"]
    assert measured["starts"] == 2 * len(TURNS) + 2 == len(found["rows"])
    assert set(measured["translates"]) == set("0123") and measured["changes"] > 0
    assert measured["stopped"] == 0
    assert measured["operator"] < 1e-14  # the evolution operator through bisections
    assert {row["turn"] for row in found["rows"]} >= {0.01, 0.5, 0.99}
    assert all(0 < row["margin"] <= 1 for row in found["rows"])


@pytest.mark.slow
def test_the_chart_bound_method_aliases(found):
    """τ(hΩ) by Cayley turns by less than half a turn, and its method by less than that."""
    for row in found["rows"]:
        bound = math.atan(math.pi * row["turn"]) / math.pi
        assert row["chart_turn"] <= bound + 1e-12
    last = [row["chart_turn"] for row in found["rows"] if row["turn"] == 0.99]
    assert max(last) < 0.3


@pytest.mark.slow
def test_at_thirty_digits_it_is_judged_by_thirty_digits(monkeypatch):
    """The starts too are rotations to thirty digits, and the distances are not those of doubles."""
    monkeypatch.setattr(charts, "TURNS", (0.2, 0.49))
    case = the_case(digits=(30,), steps=2)
    found = run_case(get("charts"), case)
    assert found["verdict"] == "pass", found["reason"]
    assert 0 < found["measured"]["distance"] < 1e-30
    rows = [{**row, "residual": 1e-20} for row in found["rows"]]
    verdict = get("charts").judge(case, {"rows": rows, "measured": found["measured"]})
    assert verdict.verdict == "fail" and "1e-27" in verdict.reason


def test_a_rotation_is_that_of_its_vector_at_any_precision():
    for turn in (0.01, 0.3, 0.5, 0.7):
        vector = 2 * np.pi * turn * charts.axis_of(2)
        g, finer = charts.rotation(vector), charts.rotation(vector, 30)
        assert np.allclose(g @ vector, vector, atol=1e-15)
        assert np.trace(g) == pytest.approx(1 + 2 * math.cos(2 * math.pi * turn), abs=1e-14)
        with mpmath.workdps(40):
            assert abs(finer @ finer.T - np.eye(3)).max() < 1e-37
            assert abs(finer - g).max() < 1e-14


@pytest.mark.slow
def test_the_singular_set_crosses_the_picture(found):
    det = np.array([[np.nan if e is None else e for e in row] for row in found["slice"]["det"]])
    assert np.nanmin(det) < 0 < np.nanmax(det)


@pytest.mark.slow
def test_it_is_drawn(found):
    result = {"study": "charts", "command": "discmech charts", "cases": [found]}
    (plate,) = plates(read(result), {}, {})
    assert len(plate.drawing.panels) == 4 and plate.drawing.files["svg"]


@pytest.mark.slow
def test_a_million_steps():
    case = the_case(own=(("thorough", True),))
    found = run_case(get("charts"), case)
    assert found["verdict"] == "pass", found["reason"]
    assert found["measured"]["steps"] >= 10**6
