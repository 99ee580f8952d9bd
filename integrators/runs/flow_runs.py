"""What every flow does with its steps: a run from a start, one step, many runs at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import CannotMeasure, check_progress
from ..numbers import Arithmetic, Vector, whole_number
from ..numbers.types import Numbers, Rows
from .ensemble import Ensemble, ensemble
from .stepper import File, Progress, Stepper, run
from .trajectory import Trajectory


class FlowRuns:
    """The runs of a flow, whose `trajectory` takes its own kinds of starts."""

    numbers: Arithmetic
    scheme: Any
    #: True if members of an ensemble are run one after another
    in_turn = False

    @property
    def name(self) -> str:
        """The name of the system, for messages."""
        return str(self.scheme.scene.name)

    def trajectory(self, *arguments: Any, **named: Any) -> Trajectory:
        """Run from a start; see the flow's own."""
        raise NotImplementedError

    def _run(
        self,
        stepper: Callable[[], Stepper],
        steps: int,
        every: int,
        progress: Progress,
        checkpoint: File,
    ) -> Trajectory:
        """Run from a start, which `stepper` reads, after the other arguments are checked."""
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        check_progress(progress)
        with self.numbers.working():
            return run(stepper(), steps, every, progress, checkpoint)

    def dual_step(self, x: Numbers, mu: Numbers) -> tuple[Vector, Vector]:
        """Return (b, μ′), the step from (x, μ)."""
        rows = self.trajectory(1, x0=x, mu0=mu)
        return rows.base[-1], rows.mu[-1]

    def ensemble(
        self,
        x0s: Rows | None = None,
        mu0s: Rows | None = None,
        steps: Any = None,
        every: int = 1,
        **arguments: Any,
    ) -> Ensemble:
        """Run from many starts at once, on all cores; rows as in `trajectory`, members along axis
        0. Programs run one after another.

        x0s (k, n) and mu0s (k, m), of a lattice (k, N, n) and (k, N, m); None takes the system's
        own for all. steps must be given. arguments: those of `trajectory`, for all members; each
        member has a checkpoint of its own, FILE.0 and so on. A member that fails does not stop the
        others (`Ensemble.failures`). Raises `BadInput` for starts that do not fit.
        """

        def member(index: int, x0: Numbers | None, mu0: Numbers | None) -> Trajectory:
            own = dict(arguments)
            if own.get("checkpoint") is not None:
                own["checkpoint"] = f"{own['checkpoint']}.{index}"
            return self.trajectory(steps, every, x0=x0, mu0=mu0, **own)

        return ensemble(member, x0s, mu0s, self.numbers, self.name, self.in_turn)


#: what a flow has whose step is one map of arrows (x, u), or of (x, μ)
OF_ONE_MAP = frozenset((
    "arrow", "derivatives", "devolve", "elements", "evolve", "gradient", "inverse_legendre",
    "next_arrow", "poisson_defect", "pullback_defect", "solutions", "step_defect", "tangent",
))  # fmt: skip


class NoMap(CannotMeasure, AttributeError):
    """What is measured on a map is asked of a flow whose step is not one."""


class NotOneMap:
    """A flow whose step is not one map, so that it has no form, inverse or Legendre map."""

    @property
    def why_not_one_map(self) -> str:
        """Why, as a sentence."""
        raise NotImplementedError

    def __getattr__(self, name: str) -> Any:
        if name in OF_ONE_MAP:
            raise NoMap(f"there is no {name}: {self.why_not_one_map}")
        raise AttributeError(f"{type(self).__name__} has no {name}", name=name, obj=self)
