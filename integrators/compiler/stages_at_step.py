"""The kernels of collocation at one step size, and the change of a run to other kernels."""

from __future__ import annotations

from ..numbers import Matrix, Numbers, Vector
from .kernels_at_step import KernelsAtStep, ResumePoint, Run


class StagesAtStep(KernelsAtStep):
    """Kernels of collocation; a run may change between these and those of Newton's method.

    If `alone` is True, it may not change: it fails, and nothing is compiled for Newton's method.
    """

    alone = False

    def start_at(self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers) -> ResumePoint:
        """Return (state, c) at (x, μ); a fixed point does not use the guess."""
        at = self.layout
        state = self.numbers.zeros(at.memory + at.row)
        self.place(state, x, mu, c)
        return state, c

    def history(self, state: Vector) -> list[Vector]:
        """Return [the last u], or [] before the first step."""
        first = self.layout.memory + 1
        return [state[first : first + self.layout.m].copy()] if state[first - 1] else []


def taken_over(run: Run, one: KernelsAtStep, other: KernelsAtStep, guess: Numbers) -> None:
    """Continue a run of the kernels `one` with `other`, keeping the rounding errors of its sums.

    guess: the u to begin with if no step was taken yet.
    """
    past = one.history(run.state)
    x, mu, *lost = (run.state[part].copy() for part in one.layout.parts[:4])
    run.state, run.c = other.start_at(x, mu, other.c, past[0] if past else guess)
    for part, value in zip(other.layout.parts[2:4], lost, strict=True):
        run.state[part] = value
