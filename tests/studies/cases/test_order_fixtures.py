"""An assertion is its study's verdict: all precisions; an order that is asked for drops no fail."""

import pytest

from discmech.integrators import rules, scenes
from discmech.studies.core.case import Choice
from discmech.studies.core.result import result_of
from discmech.studies.core.study import every_study
from discmech.studies.user import assertions
from discmech.studies.user.assertions import Missed, assert_order
from tests.imports import ROOT

ATTACKS = str(ROOT / "docs/attacks/")


@pytest.fixture
def judged(monkeypatch):
    """Give every case one result; returns (what changes of that result, the cases asked for)."""
    changed, asked = {}, []

    def run(study, case):
        asked.append(case)
        plain = {"study": study.name, "scene": case.scene.name, "rule": case.rule.name,
                 "digits": case.digits, "verdict": "pass", "reason": ""}  # fmt: skip
        return result_of(study.name, plain | changed)

    monkeypatch.setattr(assertions, "run_case", run)
    monkeypatch.setattr(assertions, "smallest", lambda *_: None)
    return changed, asked


@pytest.mark.parametrize(
    ("study", "name"),
    [("order", "order"), ("order", "converges"), ("symplecticity", "symplectic"),
     ("momentum", "momentum"), ("energy", "energy"), ("reversibility", "reversible")],
)  # fmt: skip
def test_an_assertion_asks_for_every_precision_of_its_study(study, name, judged):
    changed, asked = judged
    changed |= {"measured": {"order": 2.0}, "expected": {"tolerance": 0.05}}
    assertion = getattr(assertions, f"assert_{name}")
    told = assertion("midpoint", "kepler")
    own = every_study()[study]
    chosen = Choice((scenes.get("kepler"),), (rules.get("midpoint"),))
    found = {case.digits for case in own.cases(chosen)} or set(own.digits)
    assert [case.digits for case in asked] == sorted(found) and told["digits"] == max(found)
    changed["verdict"] = "fail"
    with pytest.raises(Missed):
        assertion("midpoint", "kepler")


def test_an_order_that_is_asked_for_drops_no_failure(judged):
    """A fail with the right slope and single steps is a fail, whatever order was derived."""
    changed, asked = judged
    changed |= {"verdict": "fail", "reason": "the multipliers do not converge.",
                "measured": {"order": 2.0}, "expected": {"order": 4, "tolerance": 0.05},
                "local": {"order": 2.0}}  # fmt: skip
    with pytest.raises(Missed, match="multipliers do not converge"):
        assert_order("midpoint", "kepler", 2)
    assert asked[0].order == 2
