"""The sentences of a step that fails: what stopped it, where, and the mend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..bisections import edge_policies as edges
from ..compiler import NOT_CONVERGED, SINGULAR
from ..errors import SMALLER, StepFailure
from .singular import singular_direction

if TYPE_CHECKING:
    from ..compiler.kernels_at_step import Run
    from .flow import Flow
    from .run import Trajectory

#: what the status that the driver ends with says
CAUSES = {
    **edges.CAUSES,
    NOT_CONVERGED: "Newton did not converge",
    SINGULAR: "FL is singular or the numbers are no longer finite",
}


def failure(
    flow: Flow,
    cause: str,
    state: dict[str, Any],
    index: int = 0,
    trajectory: Trajectory | None = None,
    mend: str = SMALLER,
) -> StepFailure:
    """The failure of step `index` at a state in the flow's own numbers."""
    where = {name: flow.numbers.public(value) for name, value in state.items()}
    names = flow.scheme.scene.name, flow.scheme.rule.name
    return StepFailure(*names, index, float(flow.step * index), where, cause, trajectory, mend)


def failure_of_run(flow: Flow, run: Run, status: int, found: Trajectory) -> StepFailure:
    """The failure that a run ended with; `found`: its rows so far."""
    x, mu = flow.machine.point(run.state)
    last = flow.machine.last_solution(run.lead)
    where, cause, mend = {"x": x, "mu": mu, **last}, CAUSES[status], SMALLER
    if status not in edges.CAUSES:
        u = last.get("u", flow._guess(None))  # where none is printed, FL is without u
        if singular := singular_direction(flow, x, u, run.translate):
            told, mend = singular
            cause = f"{cause}, for {told}" if status == NOT_CONVERGED else told
    return failure(flow, cause, where, run.index, found, mend)
