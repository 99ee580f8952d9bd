"""Multipliers of constraints as accurate as the rows of a run."""

from __future__ import annotations

import numpy as np

from ..errors import BadInput
from ..numbers import Matrix
from ..rules import adjoint
from .flow import Flow
from .run import Trajectory
from .scheme import Scheme


def mean_multipliers(flow: Flow, run: Trajectory) -> Matrix:
    """λ at every row of a run, (r, k), to second order in h: the mean of both sides'.

    `run.multipliers` is the λ of the step h that leaves a row, λ + c h + O(h²) where the rule is
    self-adjoint; what arrives there is the λ of the adjoint's step −h from the same row, which
    undoes the step before it, λ − c h + O(h²). Their mean is even in h, so it is off by O(h²) and
    by what the row itself is off. A rule that is not self-adjoint leaves the force of a step to its
    two ends unevenly, and the constraint answers it so: no λ alone is near the force of the
    constraint, their mean is, to O(h). Costs a step a row. Raises `BadInput` where there are no
    constraints and for a run of another flow, `StepFailure` if a step back cannot be solved.
    """
    scheme = flow.scheme
    if not isinstance(scheme, Scheme) or not run.multipliers.shape[1]:
        raise BadInput(f"{scheme.scene.name} has no constraints, so no multipliers.")
    if run.step != flow.step:
        raise BadInput(
            f"{scheme.scene.name}: that run is of another flow; ask the flow that made it."
        )
    undoing = scheme if scheme.self_adjoint else Scheme(scheme.scene, adjoint(scheme.rule))
    back = undoing.flow(-flow.step, flow.digits)
    arriving = [
        back.trajectory(0, x0=x, mu0=mu, u0=u).multipliers[0]
        for x, mu, u in zip(run.base, run.mu, run.u, strict=True)
    ]
    return np.asarray((run.multipliers + np.array(arriving)) / 2)
