"""A flow whose runs are proven: every digit that is asked for is one of the exact discrete run."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from ...errors import BadInput, StepFailure, arguments_checked
from ...flows import Flow, Scheme, Start
from ...runs import Stepper, Trajectory
from ...scene import Again
from .proven_motion import ProvenMotion

MOST = 2000  # digits of the balls: a run whose balls grow faster ends in a sentence


class ProvenFlow(Flow):
    """A scheme at one step size whose runs are made in balls (`proven_motion`)."""

    scheme: Scheme

    def stepper(self, start: Start) -> Stepper:
        """Return a run in balls from a start."""
        return ProvenMotion(self.context, start)

    @arguments_checked
    def trajectory(
        self, steps: int, every: int = 1, *, checkpoint: object = None, **more: Any
    ) -> Trajectory:
        """Run as `Flow.trajectory` does, with `proof` (`Proof`): every step is proven.

        Balls grow by some factor in each step, so the run is made again with more digits until the
        radius is below 10^-digits of the largest entry of x, and of μ, over the run. Raises
        `StepFailure` with the rows so far where no solution of a step is proven, `BadInput` as
        `Flow.trajectory` does, for a checkpoint, and where `MOST` digits do not suffice.
        """
        if checkpoint is not None:
            raise BadInput("a proven run has no checkpoint: leave checkpoint= out.")
        digits = self.digits
        while digits <= MOST:
            working = ProvenFlow(self.scheme, self.step, digits, substeps=self.scheme.flow_substeps)
            failure = None
            try:
                run = Flow.trajectory(working, steps, every, **more)
            except StepFailure as error:
                failure, run = error, error.trajectory
            missing = self.digits - _certain_digits(run)
            if missing <= 0:
                if failure is not None:
                    raise failure
                return run
            # where a step fails the rows before it show too little
            digits += math.ceil(missing) + 1 if failure is None else digits
        raise BadInput(
            f"{self.scheme.scene.name}: {MOST} digits do not suffice for {steps} proven steps, "
            "since the balls grow in each of them: take fewer steps."
        )

    def __reduce__(self) -> Again:
        """Return the pickled form: the flow is made again from its scheme, step and digits."""
        return partial(self.scheme.flow, proven=True), (self.step, self.digits)


def _certain_digits(run: Trajectory) -> float:
    """Return the digits of the row that is known least, over the largest entry of x and of μ."""
    n, radius = run.base.shape[1], run.proof.radius
    shares = [
        radius[:, part].max() / (float(abs(values).max()) or math.ulp(0))
        for values, part in ((run.base, slice(n)), (run.mu, slice(n, None)))
        if values.size
    ]
    return -math.log10(max((e for e in shares if e), default=math.ulp(0)))
