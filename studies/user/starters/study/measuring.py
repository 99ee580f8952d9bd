"""What is measured, of which cases, and what it means."""

from __future__ import annotations

from typing import Any

from discmech.studies.core.case import Case, Choice, Progress, Verdict, plain_cases, silent

NAME = "starter"
NEEDS = "it needs double precision."
DIGITS = (16,)
MOST = 10.0  # corrections: Newton doubles the digits with each, so a sound start needs four


def cases(choice: Choice) -> list[Case]:
    """Every chosen scene by every chosen rule."""
    return [c for c in plain_cases(NAME, choice, DIGITS) if c.digits == 16]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Numbers alone: measured {mean, most}, and rows, of which the tables are made."""
    run = case.scheme.flow(case.scene.step).trajectory(case.steps or 1000)
    measured = {"mean": float(run.newton_mean), "most": int(run.newton_max)}
    return {"measured": measured, "rows": [measured]}


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """No measuring here: what the numbers mean."""
    expected = {"limit": MOST}
    mean = measurement["measured"]["mean"]
    if mean <= MOST:
        return Verdict("pass", "", expected)
    return Verdict("fail", f"a step takes {mean:.1f} corrections in the mean.", expected)
