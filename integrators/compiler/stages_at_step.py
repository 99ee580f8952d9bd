"""The kernels of collocation at one step size, and how a run changes over to others."""

from __future__ import annotations

from ..numbers import Matrix, Numbers, Vector
from .kernels_at_step import KernelsAtStep, Lead, Run


class StagesAtStep(KernelsAtStep):
    """Kernels of collocation; a run may change between these and those of Newton's method.

    Where they go `alone` it may not: it fails, and nothing is compiled for Newton's method.
    """

    alone = False

    def lead(self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers) -> Lead:
        """(state, c) at (x, μ); a fixed point has no use for a guess."""
        at = self.layout
        state = self.numbers.zeros(at.memory + at.row)
        self.place(state, x, mu, c)
        return state, c

    def history(self, state: Vector) -> list[Vector]:
        """The last u, if there was a step."""
        first = self.layout.memory + 1
        return [state[first : first + self.layout.m].copy()] if state[first - 1] else []


def taken_over(run: Run, one: KernelsAtStep, other: KernelsAtStep, guess: Numbers) -> None:
    """Let a run of the kernels `one` go on with `other`, with all that its sums lost.

    guess: the u to begin with where no step was taken.
    """
    past = one.history(run.state)
    x, mu, *lost = (run.state[part].copy() for part in one.layout.parts[:4])
    run.state, run.c = other.lead(x, mu, other.c, past[0] if past else guess)
    for part, value in zip(other.layout.parts[2:4], lost, strict=True):
        run.state[part] = value
