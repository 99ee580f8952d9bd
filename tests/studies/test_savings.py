"""What kernels leave out: the same results without each saving, and work that is really counted."""

import pytest

from discmech.integrators import midpoint, scenes, trapezoidal
from discmech.integrators.compiler import SAVINGS
from discmech.studies import get
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.report import tables
from discmech.tests.bench.savings import measuring as savings
from tests.studies.as_json import read, run_case
from tests.studies.cached_results import case


def measured(scene, rule):
    found = run_case(get("savings"), case("savings", scene, rule))
    return found, {row["variant"]: row for row in found["rows"]}


@pytest.mark.slow
def test_every_saving_of_the_pendulum_by_stormer_verlet():
    found, rows = measured("pendulum", trapezoidal)
    assert found["verdict"] == "pass", found["reason"]
    assert set(rows) == {"none", *SAVINGS, savings.ALL}
    assert rows[savings.ALL]["operations"] > max(rows[name]["operations"] for name in SAVINGS)
    assert rows["none"]["corrections"] == 1 and rows["none"]["times"] == 1
    assert rows["direct"]["bytes"] > rows["none"]["bytes"]  # Newton's memory
    for name in (*SAVINGS, savings.ALL):
        assert rows[name]["operations"] > rows["none"]["operations"], name
        assert rows[name]["difference"] < 1e-12


@pytest.mark.slow
def test_a_group_with_its_base():
    found, rows = measured("rigid-body", midpoint)
    assert found["verdict"] == "pass" and set(rows) == {"none", "coefficients", "no base"}
    assert rows["no base"]["bytes"] >= rows["none"]["bytes"] + 2 * 9 * 8
    assert rows["no base"]["operations"] > rows["none"]["operations"]


def test_a_variant_with_other_results_fails(monkeypatch):
    """Kernels of the midpoint rule in the place of those without a saving."""
    right = savings.variants

    def swapped(of):
        wrong = scheme_of(of.scene, midpoint).flow(of.scene.step)
        return [right(of)[0], savings.Variant("carried", wrong)]

    monkeypatch.setattr(savings, "variants", swapped)
    found, _ = measured("pendulum", trapezoidal)
    assert found["verdict"] == "fail" and "momenta differ" in found["reason"]


def test_variants_stand_line_by_line():
    from io import StringIO

    from rich.console import Console

    rows = [{"variant": name, "operations": 1.0, "corrections": 1.0, "bytes": 8, "seconds": 1e-8,
             "times": 1.0} for name in ("none", "direct", savings.ALL)]  # fmt: skip
    case = {"scene": "s", "rule": "r", "verdict": "pass", "rows": rows, "measured": {"times": {}}}
    result = {"study": "savings", "verdict": "pass", "cases": [case]}
    shown = Console(file=StringIO(), width=150)
    shown.print(tables.terminal_table(*read(result)))
    lines = shown.file.getvalue().splitlines()
    for name in ("none", "direct"):
        assert next(x for x in lines if name in x).count("1.00×") == 1


def test_operations_are_those_of_the_text():
    """Störmer–Verlet on the pendulum: h/2·g sin x of both ends, the step, the losses taken off."""
    solve, update = savings.operations(scheme_of(scenes.get("pendulum"), trapezoidal).flow("0.1"))
    assert 2 <= solve <= 6 and 5 <= update <= 16


def test_which_cases_there_are():
    named = {c.scene.name for c in savings.cases(Choice())}
    assert named == set(savings.SHOWN)
    every = savings.cases(Choice(own=(("thorough", True),)))
    assert {c.scene.name for c in every} > named
    assert savings.cases(Choice(digits=(50,))) == []


@pytest.mark.slow
@pytest.mark.parametrize("scene", [s for s in scenes.names() if scenes.get(s).lagrangian])
def test_savings_change_no_result_anywhere(scene):
    found, _ = measured(scene, midpoint)
    assert found["verdict"] == "pass", found["reason"]
