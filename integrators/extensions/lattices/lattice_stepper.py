"""A lattice's run as a stepper: it shows the state at each row."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...compiler import Entry, Status, text_key
from ...errors import BadInput, StepFailure
from ...numbers import Vector, finite
from ...runs import Allocate, Trajectory, allocated
from .lattice_run import LatticeRun

PIECE = 2**24  # steps, times sites, between two checks of progress, interrupts and checkpoint


class LatticeStepper:
    """Rows of a run from its present state (`runs.Stepper`); steps are counted from there.

    checked: True if the start has to satisfy the constraints, as one that a user gives.
    """

    def __init__(self, run: LatticeRun, checked: bool = False) -> None:
        self.run, self.first, self.checked = run, run.index, checked
        self.name, self.numbers, self.ended = run.flow.lattice.name, run.numbers, False

    @property
    def index(self) -> int:
        """The number of steps done."""
        return self.run.index - self.first

    @property
    def whole(self) -> int:
        """The number of complete rows."""
        return self.index // self.every + 1

    def begin(self, steps: int, every: int, allocate: Allocate | None) -> None:
        """Prepare a run of `steps` steps, and write its first row.

        Raises `StepFailure` if the u that leaves the start is not found.
        """
        self.steps, self.every, run = steps, every, self.run
        columns = {word: (a.shape, a.dtype) for word, a in run.columns.items()}
        mu = run.mu.copy()
        status, count = run.show(), steps // every + 1
        self.rows = allocated(columns, 0, self.numbers)
        if status:
            raise self.failure(status)
        if self.checked and run.flow.scheme.constraints:
            self._check_start(mu)
        if allocate is None:
            self.rows = allocated(columns, count, self.numbers)
        else:
            self.rows = allocate(columns, count)
        self._write()

    def _write(self) -> None:
        for word, values in self.run.columns.items():
            self.rows[word][self.index // self.every] = values

    def _check_start(self, mu: np.ndarray) -> None:
        """Raise `BadInput` unless x of the start satisfies the constraints and μ is projected.

        The start may be a row of a run, so μ may be off by up to 2⁻²⁶ (as in
        `equations.check_momentum`) of the largest momentum, or of that of the velocity u.
        """
        run, flow = self.run, self.run.flow
        flow.scheme.check_start(run.x, np.zeros_like(mu), self.numbers.eps)
        off = abs(mu - run.mu)[flow.lattice.free].max()
        largest = max(abs(mu).max(), abs(flow.momenta(run.x, run.u, run.t)).max())
        if not off <= max(2.0**-26, 64 * self.numbers.eps) * largest:
            raise BadInput(
                f"{self.name}: mu0 is {float(off):.3g} from momenta that the constraints admit at "
                "x0; give a row of a run, or a start with A(x0) v0 = 0."
            )

    def advance(self) -> int:
        run, piece = self.run, max(1, PIECE // len(self.run.x))
        next_row = self.whole * self.every
        status = run.advance(min(self.steps, next_row, self.index + piece) - self.index)
        if status == Status.OK and self.index == next_row:
            status = run.show()
            if status == Status.OK:
                self._write()
        if status == Status.OK and self.index == self.steps:
            status, self.ended = run.end(), True
        return status

    @property
    def key(self) -> str:
        run = self.run
        stages = run.flow.scheme.stages if run.by_stages else None
        made_of = (run.flow.scheme.system,) if stages is None else stages.key
        words = run.digest.hexdigest(), run.flow.lattice.shape, str(self.numbers.digits)
        return text_key(*made_of, *words)

    @property
    def state(self) -> Mapping[str, np.ndarray]:
        return self.run.state

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        self.run.restore(state)
        self.ended = self.index == self.steps

    def failure(self, status: int) -> StepFailure:
        """Return the failure of the coming step, at the site where it begins."""
        run, count = self.run, min(-(-self.index // self.every), len(self.rows["x"]))
        rows, here = self.rows_of(count), run
        lost = not (finite(run.x).all() and finite(run.nu).all())
        if count > 0 and (run.flow.scheme.local or lost):
            x, mu = (self.rows[word][count - 1] for word in ("x", "mu"))
            here = run.traced(x, mu, self.first + (count - 1) * self.every)
        return here.failure(status, rows)

    def trajectory(self) -> Trajectory:
        return self.rows_of(self.whole)

    def rows_of(self, count: int) -> Trajectory:
        """Return the first `count` rows."""
        run, flow, numbers = self.run, self.run.flow, self.numbers
        x, u, mu, *more = (numbers.public(e[:count]) if numbers.dtype is object else e[:count]
                           for e in self.rows.values())  # fmt: skip
        index = self.first + np.arange(count, dtype=np.int64) * self.every
        t: Vector = numbers.multiples(flow.step, index) + run.t0
        return Trajectory.of_rows(
            numbers.public(t), x, u, mu, steps=run.index, step=flow.step, scheme=flow.scheme,
            multipliers=more[0] if more else np.zeros((count, len(flow.lattice.pairs), 0)),
            newton_mean=float(run.totals[Entry.CORRECTIONS] / max(1, run.solved)),
            newton_max=int(run.totals[Entry.MOST]),
            newton_residual=float(run.totals[Entry.LAST_SIZE]),
            newton_since=run.newton_since if run.newton_since >= 0 else None,
            solver="fixed point" if run.by_stages else "Newton",
        )  # fmt: skip
