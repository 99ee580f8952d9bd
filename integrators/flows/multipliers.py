"""Multipliers of constraints as accurate as the rows of a run."""

from __future__ import annotations

import numpy as np

from ..errors import BadInput
from ..numbers import Matrix
from ..rules import adjoint
from ..runs import Trajectory
from .flow import Flow
from .scheme import Scheme


def mean_multipliers(flow: Flow, run: Trajectory) -> Matrix:
    """Return λ at every row of a run, (r, k), to second order in h: the mean of both sides' λ.

    `run.multipliers` is the λ of the step h that leaves a row, λ + c h + O(h²) if the rule is
    self-adjoint; on the side that arrives it is the λ of the adjoint's step −h from the same row,
    which undoes the step before it, λ − c h + O(h²). Their mean is even in h, so its error is O(h²)
    plus the error of the row itself. A rule that is not self-adjoint distributes the force of a
    step unevenly to its two ends, and the constraint reacts to that: no single λ is near the force
    of the constraint, but their mean is, to O(h). A composition of such a rule and its adjoint has
    the uneven ends of both at a row: there the mean is over the λ that leave by a step h and a step
    −h of both, again even in h. It costs one step per row, or four. Raises `BadInput` if there are
    no constraints and for a run of another flow, `StepFailure` if a step back cannot be solved.
    """
    scheme = flow.scheme
    if not isinstance(scheme, Scheme) or not run.multipliers.shape[1]:
        raise BadInput(f"{scheme.scene.name} has no constraints, so no multipliers.")
    if run.step != flow.step:
        raise BadInput(
            f"{scheme.scene.name}: that run is of another flow; ask the flow that made it."
        )
    composed = bool(scheme.substeps) and not scheme.base.self_adjoint
    if composed:
        steps = [(part, sign) for part in (scheme.base, scheme.adjoint) for sign in (1, -1)]
    else:
        own = scheme.self_adjoint
        steps = [(scheme if own else Scheme(scheme.scene, adjoint(scheme.rule)), -1)]
    flows = [part.flow(sign * flow.step, flow.digits) for part, sign in steps]
    sums = 0 * run.multipliers if composed else run.multipliers.copy()
    for total, x, mu, u in zip(sums, run.base, run.mu, run.u, strict=True):
        for each in flows:
            total += each.trajectory(0, x0=x, mu0=mu, u0=u).multipliers[0]
    return np.asarray(sums / (len(flows) + (not composed)))
