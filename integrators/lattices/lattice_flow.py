"""A lattice at one step size: its state as arrays, advanced by machine code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..compiler import (
    CORRECTIONS,
    MOST,
    NOT_CONVERGED,
    OK,
    SINGULAR,
    LatticeKernels,
    compile_lattice,
)
from ..equations import momentum
from ..errors import BadInput, StepFailure
from ..numbers import Double, exact_rational, numeric
from .lattice import Lattice
from .segments import ranges_of, segments_of
from .sparse_steps import SparseMatrix, SparseSteps

BEGIN, RUN, SHOW, ASSEMBLE, UPDATE = range(5)  # tasks of the driver
PLACE, KAPPA = 3, 4  # where in `totals` the site is whose step was not found, and κ
NUMBERS = Double()


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
        progress: Callable[[int], None] | None = None,
    ) -> LatticeTrajectory:
        """Run `steps` steps from the lattice's start, or from x0 (N, n) and mu0 (N, m).

        Raises `BadInput` for wrong shapes or counts, `StepFailure` (with the rows so far) if a step
        cannot be solved.
        """
        for name, value, least in (("steps", steps, 0), ("every", every, 1)):
            if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
                raise BadInput(f"{name} is {value!r}: give a whole number from {least}.")
        run = _Run(self, *self._start(x0, mu0))
        rows = steps // every + 1
        N, n, m = self.lattice.sites, run.x.shape[1], run.nu.shape[1]
        x, u, mu = (np.empty((rows, N, width)) for width in (n, m, m))
        for k in range(rows):
            status = run.advance(every if k else 0)
            if status == OK:
                status = run.show()
            if status != OK:
                raise run.failure(status, self._trajectory(run, x[:k], u[:k], mu[:k], every))
            x[k], u[k], mu[k] = run.x, run.u, run.mu
            if progress is not None:
                progress(run.index)
        if (status := run.advance(steps - run.index)) != OK:
            raise run.failure(status, self._trajectory(run, x, u, mu, every))
        return self._trajectory(run, x, u, mu, every)

    def _trajectory(self, run: Any, x: Any, u: Any, mu: Any, every: int) -> LatticeTrajectory:
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
            array = default() if value is None else np.array(value, dtype=np.float64)
            wanted = (lattice.sites, (x if word == "x0" else v).shape[1])
            if array.shape != wanted or not np.isfinite(array).all():
                raise BadInput(f"{lattice.name}: {word} must be finite, of the shape {wanted}.")
            given.append(array.copy())
        return given[0], given[1]

    def momenta(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """μ = ∂l/∂ξ at rows of x (N, n) and v (N, m)."""
        s = self.scheme.equations.site.s
        values = self.scheme.site_columns
        f = numeric({"x": s.x, "u": s.u, "p": list(values)}, [momentum(s)], NUMBERS, columns=True)
        made = f(list(x.T), list(v.T), list(values.values()))
        rows = np.broadcast_to(made.reshape(len(s.u), -1), (len(s.u), len(x)))
        return np.ascontiguousarray(rows.T)


class _Run:
    """The state of a run: x, ν, the unknowns of the last steps, and counters."""

    def __init__(self, flow: LatticeFlow, x: np.ndarray, mu: np.ndarray) -> None:
        self.flow, self.x, self.mu = flow, np.ascontiguousarray(x), np.ascontiguousarray(mu)
        lattice, kernels, scheme = flow.lattice, flow.kernels, flow.scheme
        N, S = lattice.sites, kernels.widths["w"]
        self.nu, self.totals = np.zeros_like(self.mu), np.zeros(16)
        self.past = [np.zeros((N, S)) for _ in range(4)]
        work = np.zeros((1 if scheme.local else N, kernels.widths["work"]))
        v0 = lattice.start[1]
        for w in self.past:
            w[:, : v0.shape[1]] = v0
        order, segments = segments_of(lattice.pairs)
        ranges, free = ranges_of(lattice.free), lattice.free
        self.mu[~free] = 0
        for w in self.past:
            w[~free] = 0
        self.free = free
        ties = np.zeros((1 if scheme.local else len(order), kernels.widths["ties"]))
        own, of_bond = scheme.own_rows(order)
        q = [[float(e) for e in row] for row in scheme.q_values(flow.step)]
        c = np.zeros((len(q), kernels.widths["coefficients"]))
        for row, (kind, values) in enumerate(zip(scheme.kinds, q, strict=True)):
            try:
                made = kernels.prepare[kind](values)
            except ArithmeticError:
                raise BadInput(
                    f"{lattice.name} with {scheme.rule.name}: its equations have no finite "
                    f"coefficients at the step {float(flow.step):g}; take another step."
                ) from None
            c[row, : len(made)] = made
        kinds = np.array(scheme.kinds, dtype=np.int64)
        self.arguments = (
            self.x, self.nu, self.mu, *self.past, work, ties, own, of_bond, c, kinds, len(q),
            ranges, len(ranges), segments, len(segments), self.totals,
        )  # fmt: skip
        self.index, self.solved = 0, 0
        self.u = np.zeros_like(self.mu)
        self.totals[KAPPA] = 1e300
        self.status = kernels.advance(BEGIN, 0, *self.arguments)[1]
        self.sparse: SparseSteps | None = None
        if lattice.shape == "list" and not scheme.local:
            matrix = SparseMatrix(lattice.pairs[order], free, S)
            assemble, update = (partial(self._task, task) for task in (ASSEMBLE, UPDATE))
            self.sparse = SparseSteps(
                assemble, update, self.past, work, ties, matrix, substeps=len(q)
            )
            self.status = self.sparse.solve(0)

    def _task(self, task: int, j: int) -> None:
        self.flow.kernels.advance(task, j, *self.arguments)

    def advance(self, steps: int) -> int:
        """So many steps; the status."""
        if self.status != OK:
            return self.status
        if self.sparse is not None:
            done, status = self.sparse.steps(steps)
            sparse = self.sparse.corrections, self.sparse.most, 0, self.sparse.place
            self.totals[:4] = sparse
        else:
            done, status = self.flow.kernels.advance(RUN, steps, *self.arguments)
        self.index += done
        self.solved += done * (len(self.x) if self.flow.scheme.local else 1)
        return status

    def show(self) -> int:
        """μ and u of now, into `mu` and `u`; the status.

        Where no iteration would find it, this looks whether the state is finite.
        """
        _, status = self.flow.kernels.advance(SHOW, 0, *self.arguments)
        bad = np.flatnonzero(~np.isfinite(self.mu).all(axis=1))
        if status == OK and len(bad):
            self.totals[PLACE], status = bad[0], SINGULAR
        self.u[:] = self.past[int(self.flow.scheme.local)][:, : self.u.shape[1]]
        return status

    def failure(self, status: int, rows: LatticeTrajectory) -> StepFailure:
        """The error of a step that was not found."""
        i = int(self.totals[PLACE])
        cause = ("Newton's method does not converge" if status == NOT_CONVERGED
                 else "a correction is not finite, as where FL is singular")  # fmt: skip
        flow, index = self.flow, self.index
        state = {"x": self.x[i], "mu": self.mu[i]}
        return StepFailure(
            flow.lattice.name, flow.scheme.rule.name, index, float(flow.step * index), state,
            f"{cause} at site {i}", rows,
        )  # fmt: skip
