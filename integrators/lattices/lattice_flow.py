"""A lattice at one step size: its state as arrays, advanced by machine code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from ..compiler import CORRECTIONS, MOST, OK, LatticeKernels, compile_lattice, text_key
from ..equations import momentum
from ..errors import BadInput
from ..numbers import Double, exact_rational, numeric, whole_number
from .checkpoint import Checkpoint
from .dual_step import poisson_defect
from .lattice import Lattice, floats
from .lattice_run import LatticeRun

NUMBERS = Double()
PIECE = 2**24  # steps of a site between two looks at progress, at interrupts and at a checkpoint


@dataclass(frozen=True)
class LatticeTrajectory:
    """Rows of a run: the first is the start, then each every-th step.

    t (r,), x (r, N, n), u and mu (r, N, m): row k holds x_k, μ_k in the natural basis and the u
    that leaves x_k; both are 0 at fixed sites. newton_mean: corrections a step (of a site,
    where sites are solved by themselves), newton_max: the most of one step.
    """

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    mu: np.ndarray
    newton_mean: float
    newton_max: int
    steps: int
    step: Fraction


class LatticeFlow:
    """The one-step map (x, μ) ↦ (b, μ′) of a lattice by a rule, in double precision.

    substeps: (kind, share of the step) of each, kind 1 the adjoint. Raises `BadInput` for a step of
    0, and for digits other than 16.
    """

    def __init__(self, scheme: Any, step: Any, digits: int = 16) -> None:
        self.scheme, self.lattice = scheme, scheme.lattice
        if digits != 16:
            raise BadInput(f"{self.lattice.name}: lattices run in double precision; leave digits "
                           "out, or take the same system as a Scene.")  # fmt: skip
        self.step = exact_rational(step, "step")
        if self.step == 0:
            raise BadInput("step is 0: give a non-zero number.")

    @cached_property
    def kernels(self) -> LatticeKernels:
        """The compiled kernels."""
        return compile_lattice(self.scheme.system, self.lattice.shape, bool(self.scheme.substeps))

    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Any = None,
        mu0: Any = None,
        checkpoint: Any = None,
        progress: Callable[[int], None] | None = None,
    ) -> LatticeTrajectory:
        """Run `steps` steps from the lattice's start, or from x0 (N, n) and mu0 (N, m).

        checkpoint: a file. The rows are then on disk beside it, as arrays of numpy's, and the state
        is kept in it about once a second: the same call goes on where a run was killed, to the same
        numbers (to round-off, where a sparse factorisation solves). progress: called with the steps
        done so far. Raises `BadInput` for wrong shapes or counts and for the checkpoint of another
        run, `StepFailure` (with the rows so far) if a step cannot be solved.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        run = LatticeRun(self, *self._start(x0, mu0))
        kept = None
        if checkpoint is not None:
            key = text_key(self.scheme.system, run.digest.hexdigest(), str((steps, every)))
            kept = Checkpoint(checkpoint, key, self.lattice.name)
        shape = (steps // every + 1, self.lattice.sites)
        widths = {"x": run.x.shape[1], "u": run.u.shape[1], "mu": run.u.shape[1]}
        rows = [
            np.empty((*shape, width)) if kept is None else kept.rows(word, (*shape, width))
            for word, width in widths.items()
        ]
        if kept is not None and kept.state is not None:
            run.restore(kept.state)
        else:
            self._write(run, rows, every)
        piece = max(1, PIECE // self.lattice.sites)
        while run.index < steps:
            next_row = (run.index // every + 1) * every
            status = run.advance(min(steps, next_row, run.index + piece) - run.index)
            if status != OK:
                raise self._failed(run, status, rows, every)
            if run.index == next_row:
                self._write(run, rows, every)
            if kept is not None:
                kept.save(run.state, rows, last=run.index == steps)
            if progress is not None:
                progress(run.index)
        return self._trajectory(run, rows, every)

    def _write(self, run: LatticeRun, rows: list[np.ndarray], every: int) -> None:
        """The row of now; raises `StepFailure` if the u that leaves it is not found."""
        if (status := run.show()) != OK:
            raise self._failed(run, status, rows, every)
        for column, values in zip(rows, (run.x, run.u, run.mu), strict=True):
            column[run.index // every] = values

    def _failed(self, run: LatticeRun, status: int, rows: list[np.ndarray], every: int) -> Any:
        count = -(-run.index // every)
        return run.failure(status, self._trajectory(run, [c[:count] for c in rows], every))

    def _trajectory(self, run: LatticeRun, rows: Any, every: int) -> LatticeTrajectory:
        x, u, mu = rows
        t = NUMBERS.multiples(self.step, np.arange(len(x), dtype=np.int64) * every)
        mean = run.totals[CORRECTIONS] / max(1, run.solved)
        return LatticeTrajectory(t, x, u, mu, mean, int(run.totals[MOST]), run.index, self.step)

    def _start(self, x0: Any, mu0: Any) -> tuple[np.ndarray, np.ndarray]:
        lattice: Lattice = self.lattice
        x, v = lattice.start
        given = []
        for value, word, default in (
            (x0, "x0", lambda: x),
            (mu0, "mu0", lambda: self.momenta(x, v)),
        ):
            array = default() if value is None else floats(value, f"{lattice.name}: {word}")
            wanted = (lattice.sites, (x if word == "x0" else v).shape[1])
            if array.shape != wanted:
                raise BadInput(f"{lattice.name}: {word} must be of the shape {wanted}.")
            given.append(array.copy())
        return given[0], given[1]

    def poisson_defect(
        self, x: Any, mu: Any, *, pairs: int = 3, seed: int = 0, bracket_sign: int = 1
    ) -> float:
        """How far the step from (x, μ), x (N, n) and μ (N, m), is from a Poisson map.

        (Mᵀα)·Π(Mᵀβ) − α·Π′β for random pairs of covectors, over the sum of its absolute terms: a
        few units of round-off if nothing is wrong (`dual_step`). bracket_sign = −1 flips the
        bracket: a control. Raises `CannotMeasure` for compositions.
        """
        return poisson_defect(self, *self._start(x, mu), pairs, seed, bracket_sign)

    def momenta(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """μ = ∂l/∂ξ at rows of x (N, n) and v (N, m)."""
        s = self.scheme.equations.site.s
        values = self.scheme.site_columns
        f = numeric({"x": s.x, "u": s.u, "p": list(values)}, [momentum(s)], NUMBERS, columns=True)
        made = f(list(x.T), list(v.T), list(values.values()))
        rows = np.broadcast_to(made.reshape(len(s.u), -1), (len(s.u), len(x)))
        return np.ascontiguousarray(rows.T)
