"""What a certified reference costs: seconds against digits and time, with the growth law.

A step of order N costs N^2/2 products of numbers of D digits for each product of the equations; N
grows like 1.15 D (Jorba, Zou 2005), the number of steps does not. With M(D) the cost of a product,
D^2 M(D) is expected: slope 2 while numbers are short, 3 to 3.6 when products are schoolbook's or
Karatsuba's. Against time the cost is linear, and a little more where errors grow.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.studies.core.case import Case, Choice, Progress, silent
from discmech.studies.core.result import StudyResult

NAME, SCENE = "references", "heavy-top"
NEEDS = "it is about references, and not about a scene."
DIGITS = (15, 30, 50, 100, 200, 400, 700, 1000)
SHORT = Fraction(1, 2)  # the time at which digits are compared
TIMES = (1, 2, 5, 10, 20, 50, 100)
USUAL = 6  # of each, unless time is no matter
SURE = 0.5  # seconds of processor time, beside which what disturbs a run is small
COMMAND = "discmech references --thorough"


@dataclass(frozen=True)
class Integration(Case):
    """One certified integration to a time, against digits or against time; of no rule."""

    kind: str = field(kw_only=True)
    time: Fraction = field(kw_only=True)
    rests_on: tuple[()] = ()

    @property
    def label(self) -> str:
        """No rule takes part."""
        return ""

    @property
    def command(self) -> str:
        """What makes the same reference."""
        return f"discmech reference {SCENE} --time {float(self.time):g} --digits {self.digits}"


def cases(choice: Choice) -> list[Case]:
    """By digits and then by time."""
    most = None if choice.thorough else USUAL
    wanted = [("digits", digits, SHORT) for digits in DIGITS[:most]]
    wanted += [("time", 50, Fraction(t)) for t in TIMES[:most]]
    scene, rule = scenes.get(SCENE), discretisations.midpoint
    return [Integration(NAME, scene, rule, d, kind=kind, time=t) for kind, d, t in wanted]


def together(case: Case) -> str:
    """All of them: their times are compared with each other."""
    return NAME


def notes(choice: Choice) -> list[str]:
    """Where there is more."""
    return [] if choice.thorough else [f"{COMMAND} goes on to more."]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """One certified integration, without any table or cache; the better of two if it is short."""
    from discmech.reference.answer.bounded import bounded_integration
    from discmech.reference.equations import equations_of
    from discmech.reference.taylor import compile_series

    assert isinstance(case, Integration)
    equations = equations_of(case.scene)
    program = compile_series(equations)
    best = math.inf
    for _ in range(2):
        begun = time.process_time()
        findings, sweep, _ = bounded_integration(equations, program, [case.time], case.digits)
        best = min(best, time.process_time() - begun)
        if best > SURE:
            break
    found = findings[case.time]
    row = {
        "digits": case.digits, "time": float(case.time), "seconds": best, "steps": sweep.steps,
        "order": sweep.order, "proven": found.certain, "certainty": found.certainty,
    }  # fmt: skip
    return {"measured": row, "rows": [row], "kind": case.kind}


def complete(result: StudyResult) -> StudyResult:
    """The slopes of all cases, and the law of growth beside them."""
    slopes = {}
    for kind in ("digits", "time"):
        rows = [case.figures for case in result.cases if case.details.kind == kind]
        slopes[kind] = _slope(rows, kind)
    cases = [replace(case, figures={**case.figures, "growth": slopes[str(case.details.kind)]})
             for case in result.cases]  # fmt: skip
    return replace(result, command=COMMAND, notes=[law(slopes), *result.notes], cases=cases,
                   more={"slopes": slopes})  # fmt: skip


def law(slopes: dict[str, float | None]) -> str:
    """The growth that was measured beside the one that is expected."""
    return (
        f"Seconds grow like digits^{slopes['digits']} (law: D² M(D), slope 2 to 3.6) and like "
        f"t^{slopes['time']} (law: 1, a little more where errors grow)."
    )


def _slope(rows: Sequence[Mapping[str, Any]], by: str) -> float | None:
    """Of seconds in a log-log plot, over the upper half of the points."""
    import numpy as np

    upper = rows[len(rows) // 2 :]
    if len(upper) < 2:
        return None
    x, y = (np.log([row[name] for row in upper]) for name in (by, "seconds"))
    return round(float(np.polyfit(x, y, 1)[0]), 2)
