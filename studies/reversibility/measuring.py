"""Self-adjointness of a method as numbers: Φ₋ₕ after Φₕ, which is the identity for such a method.

`assert_reversible` measures it too.
"""

from __future__ import annotations

from discmech.integrators.flows import return_defect

from ..core.case import Case, Choice, Progress, plain_cases, silent
from ..evidence.laws import WAY_BACK
from ..evidence.measuring import single_steps
from ..symplecticity.measuring import POINTS, STEPS
from . import in_numbers
from .records import Found, FoundOfNumbers, Measured, Row

NAME = "reversibility"
NEEDS = (
    "it needs a rule that claims to be reversible, and a scene without contact: under contact "
    "`discmech contact` asks for ways back."
)


def cases(choice: Choice) -> list[Case]:
    """Return every scene with every rule that claims to be reversible."""
    return [c for c in plain_cases(NAME, choice, (16,))
            if c.rule.claims is not None and c.rule.claims.reversible]  # fmt: skip


def measure(case: Case, progress: Progress = silent) -> Found | FoundOfNumbers:
    """Return the defects of steps along a run, and of steps from drawn places.

    defect: the larger `return_defect` of the run's own steps and, to twice the digits, of the maps,
    which need no kernel. Each component is judged by its own round-off, so none hides behind a
    larger one.
    """
    if not case.rule.is_formula:
        return in_numbers.measure(case)
    forth = case.scheme.flow(case.scene.step, case.digits)
    back = case.scheme.flow(-case.scene.step, case.digits)
    run = forth.trajectory(case.steps or STEPS[case.digits == 16])
    spread = max(1, run.steps // POINTS)
    rows, worst = [], 0.0
    for k in range(0, run.steps, spread):
        progress(f"{case.scene.name} {case.label}: there and back", k / run.steps)
        start = run.base[k], run.mu[k], run.u[k]
        again = back.trajectory(1, x0=run.base[k + 1], mu0=run.mu[k + 1], u0=run.u[k])
        defect = float(return_defect(forth, back, *start, (again.base[-1], again.mu[-1])))
        worst = worst if defect <= worst else defect  # one that is not a number stays
        rows.append(Row(float(case.scene.step), k, float(run.t[k]), defect))
    return Found(rows, Measured(worst), single_steps(case, WAY_BACK))
