"""Cases and measurements made by hand, for judges by themselves.

`make mutants` changes the judges one operator, number or branch at a time; the tests here notice.
"""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from discmech.integrators.rules import get as rule
from discmech.studies import every_study

#: the next number above and below
ABOVE, BELOW = 1 + 2.0**-40, 1 - 2.0**-40


def close(value):
    """Equal but for rounding, however small: `approx` alone takes all below 1e-12 for one."""
    return pytest.approx(value, rel=1e-12, abs=0)


def case(digits=16, order=2, control=None, scene=None, **others):
    """What judges ask of a case."""
    plain = {"step": "0.2", "force": None, "timed": False, "lagrangian": None,
             "all_constraints": (), "no_form": "", "no_energy": "", "name": "by-hand"}  # fmt: skip
    own = others.pop("rule", replace(rule("midpoint"), order=order))
    scheme = SimpleNamespace(**{"order": order, "rule": own, "substeps": [1], **others})
    return SimpleNamespace(
        digits=digits, control=control, scheme=scheme, order=order, rule=own,
        scene=SimpleNamespace(**plain | (scene or {})),
    )  # fmt: skip


def judged(study, of, **measurement):
    """(the verdict, its reason, what was expected)."""
    told = every_study()[study].judge(of, measurement)
    return told.verdict, told.reason, told.expected
