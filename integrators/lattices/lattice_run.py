"""The state of a lattice while it runs, as the driver of machine code takes it."""

from __future__ import annotations

import hashlib
from functools import partial
from typing import Any

import numpy as np

from ..compiler import (
    CORRECTIONS,
    KAPPA,
    LAST_SIZE,
    LATTICE_ENTRIES,
    MOST,
    NOT_CONVERGED,
    OK,
    PLACE,
    SCALE,
    SINGULAR,
)
from ..errors import BadInput, StepFailure
from .segments import ranges_of, segments_of
from .sparse_steps import SparseMatrix, SparseSteps

BEGIN, RUN, SHOW, ASSEMBLE, UPDATE, RELAX = range(6)  # tasks of the driver


class LatticeRun:
    """The state of a run: x, ν, the unknowns of the last steps, and counters."""

    def __init__(self, flow: Any, x: np.ndarray, mu: np.ndarray) -> None:
        self.flow, self.x, self.mu = flow, np.ascontiguousarray(x), np.ascontiguousarray(mu)
        lattice, kernels, scheme = flow.lattice, flow.kernels, flow.scheme
        N, S = lattice.sites, kernels.widths["w"]
        self.nu, self.totals = np.zeros_like(self.mu), np.zeros(LATTICE_ENTRIES)
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
        #: what of a run is in its arrays
        self.digest = hashlib.sha256()
        for array in (self.x, self.mu, own, of_bond, c, ranges, segments):
            self.digest.update(array.tobytes())
        self.index, self.solved = 0, 0
        self.u = np.zeros_like(self.mu)
        self.totals[KAPPA] = 1e300
        self.status = kernels.advance(BEGIN, 0, *self.arguments)[1]
        self.sparse: SparseSteps | None = None
        if lattice.shape == "list" and not scheme.local:
            matrix = SparseMatrix(lattice.pairs[order], free, S)
            assemble, update = (partial(self._task, task) for task in (ASSEMBLE, UPDATE))
            self.sparse = SparseSteps(
                self._relax, assemble, update, self.past, work, ties, matrix, len(q), self._floor
            )
            self.status = self.sparse.solve(0)

    def _relax(self, j: int) -> tuple[float, float]:
        self._task(RELAX, j)
        return float(self.totals[LAST_SIZE]), float(self.totals[SCALE])

    def _floor(self) -> float:
        return float(2.0**-49 * abs(self.x).sum(axis=1).max() / abs(self.flow.step))

    def _task(self, task: int, j: int) -> None:
        self.flow.kernels.advance(task, j, *self.arguments)

    def advance(self, steps: int) -> int:
        """So many steps; the status."""
        if self.status != OK:
            return self.status
        if self.sparse is not None:
            done, status = self.sparse.steps(steps)
            self.totals[[CORRECTIONS, MOST]] = self.sparse.corrections, self.sparse.most
        else:
            done, status = self.flow.kernels.advance(RUN, steps, *self.arguments)
        self.index += done
        self.solved += done * (len(self.x) if self.flow.scheme.local else 1)
        return status

    @property
    def state(self) -> dict[str, np.ndarray]:
        """All that the steps to come depend on."""
        arrays = {"x": self.x, "nu": self.nu, "totals": self.totals}
        counts = [self.index, self.solved, *(self.sparse.counts if self.sparse else ())]
        return {**arrays, **{f"w{i}": w for i, w in enumerate(self.past)},
                "counts": np.array(counts)}  # fmt: skip

    def restore(self, state: Any) -> None:
        """Go on from a state."""
        for name, array in self.state.items():
            if name != "counts":
                array[:] = state[name]
        self.index, self.solved, *counts = map(int, state["counts"])
        if self.sparse is not None:
            self.sparse.counts = counts

    def show(self) -> int:
        """μ and u of now, into `mu` and `u`; the status.

        Where no iteration would find it, this looks whether the state is finite.
        """
        _, status = self.flow.kernels.advance(SHOW, 0, *self.arguments)
        self.mu[~self.free] = 0
        bad = np.flatnonzero(~np.isfinite(self.mu).all(axis=1))
        if status == OK and len(bad):
            self.totals[PLACE], status = bad[0], SINGULAR
        self.u[:] = self.past[int(self.flow.scheme.local)][:, : self.u.shape[1]]
        return status

    def checked(self, status: int) -> None:
        """Raise `StepFailure` unless the status is that all is well."""
        if status != OK:
            raise self.failure(status, None)

    def failure(self, status: int, rows: Any) -> StepFailure:
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
