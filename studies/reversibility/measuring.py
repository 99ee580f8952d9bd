"""Self-adjointness of a method as numbers: Φ₋ₕ after Φₕ, which is the identity of such a method.

Not a study of its own: what `assert_reversible` measures.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..causes.round_off import size
from ..core.case import Case, Progress, Verdict, silent
from ..symplecticity.measuring import POINTS, limit

NAME = "reversibility"


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {step, index, time, defect}; defect: ‖Φ₋ₕ(Φₕ(x, μ)) − (x, μ)‖ / ‖(x, μ)‖ along a run."""
    count = POINTS[case.digits == 16]
    forth = case.scheme.flow(case.scene.step, case.digits)
    back = case.scheme.flow(-case.scene.step, case.digits)
    run = forth.trajectory(case.steps or 8 * count)
    spread = max(1, run.steps // count)
    whole = size(np.hstack([run.x, run.mu]))
    rows = []
    for k in range(0, run.steps, spread):
        progress(f"{case.scene.name} {case.label}: there and back", k / run.steps)
        again = back.trajectory(1, x0=run.x[k + 1], mu0=run.mu[k + 1], u0=run.u[k])
        gap = np.concatenate([again.x[-1] - run.x[k], again.mu[-1] - run.mu[k]])
        rows.append({"step": float(case.scene.step), "index": k, "time": float(run.t[k]),
                     "defect": float(abs(gap).max()) / whole})  # fmt: skip
    return {"rows": rows, "measured": {"defect": max(row["defect"] for row in rows)}}


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """Round-off, as the symplecticity study has it."""
    defect, wanted = measurement["measured"]["defect"], limit(case.digits)
    if defect <= wanted:
        return Verdict("pass", "", {"limit": wanted})
    said = f"a step back misses the start by {defect:.2g}, where round-off would leave "
    said += f"{wanted:.0e}: Φ₋ₕ is not the inverse of Φₕ."
    return Verdict("fail", said, {"limit": wanted})
