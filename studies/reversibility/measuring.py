"""Self-adjointness of a method as numbers: Φ₋ₕ after Φₕ, which is the identity of such a method.

Not a study of its own: what `assert_reversible` measures.
"""

from __future__ import annotations

from typing import Any

from discmech.integrators.flows import return_defect
from discmech.integrators.numbers import arithmetic

from ..core.case import Case, Choice, Progress, Verdict, plain_cases, silent
from ..core.claims import not_claimed
from ..symplecticity.measuring import POINTS, ROUND_OFFS
from . import in_numbers

NAME = "reversibility"


NEEDS = "it needs a rule that claims to be reversible."


def cases(choice: Choice) -> list[Case]:
    """Every scene by every rule that claims to be reversible."""
    return [c for c in plain_cases(NAME, choice, (16,))
            if c.rule.claims is not None and c.rule.claims.reversible]  # fmt: skip


def limit(digits: int) -> float:
    """What a step forth and a step back may miss of their own bound: as each step may."""
    return ROUND_OFFS * float(arithmetic(digits).eps)


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {step, index, time, defect} along a run; defect: the larger `return_defect` of the
    run's own steps and, to twice the digits, of the maps, in which no kernel has a part.

    Each component is judged by what round-off may do to it, so none hides behind a larger one.
    """
    if not case.rule.is_formula:
        return in_numbers.measure(case)
    count = POINTS[case.digits == 16]
    forth = case.scheme.flow(case.scene.step, case.digits)
    back = case.scheme.flow(-case.scene.step, case.digits)
    run = forth.trajectory(case.steps or 8 * count)
    spread = max(1, run.steps // count)
    rows = []
    for k in range(0, run.steps, spread):
        progress(f"{case.scene.name} {case.label}: there and back", k / run.steps)
        start = run.base[k], run.mu[k], run.u[k]
        again = back.trajectory(1, x0=run.base[k + 1], mu0=run.mu[k + 1], u0=run.u[k])
        defect = float(return_defect(forth, back, *start, (again.base[-1], again.mu[-1])))
        rows.append({"step": float(case.scene.step), "index": k, "time": float(run.t[k]),
                     "defect": defect})  # fmt: skip
    return {"rows": rows, "measured": {"defect": max(row["defect"] for row in rows)}}


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Round-off of two steps, as the symplecticity study has it of one."""
    if not case.rule.is_formula:
        return in_numbers.judge(case, measurement)
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {"not_demanded": reason})
    defect, wanted = measurement["measured"]["defect"], limit(case.digits)
    if defect <= wanted:
        return Verdict("pass", "", {"limit": wanted})
    said = f"a step back misses the start by {defect:.2g} of the terms that the two steps add up, "
    said += f"where round-off would leave {wanted:.0e}: Φ₋ₕ is not the inverse of Φₕ."
    return Verdict("fail", said, {"limit": wanted})
