"""The flow of a lattice at one step size: its state as arrays, advanced by machine code."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ..compiler import (
    Entry,
    LatticeKernels,
    NoShortForm,
    Status,
    compile_lattice,
    compile_lattice_stages,
    text_key,
)
from ..equations import SceneSymbols, momentum, on_constraints
from ..errors import BadInput, StepFailure, check_progress
from ..numbers import (
    Arithmetic,
    Matrix,
    Number,
    arithmetic,
    exact_rational,
    finite,
    numeric,
    whole_number,
)
from ..numbers.types import Given, Rows
from ..runs import Progress
from ..runs.checkpoint import Checkpoint
from ..scene import Again
from .as_scene import scene_of
from .blocks import at_ends, of_all
from .dual_step import poisson_defect
from .lattice import Lattice, floats
from .lattice_run import LatticeRun
from .restricted_step import step_derivative

File: TypeAlias = str | Path | None
PIECE = 2**24  # steps, times sites, between two checks of progress, interrupts and checkpoint


@dataclass(frozen=True)
class LatticeTrajectory:
    """Rows of a run: the first is the start, then every `every`-th step.

    t (r,), x (r, N, n), u and mu (r, N, m): row k holds x_k, μ_k in the natural basis and the u
    that leaves x_k; both are 0 at fixed sites. multipliers (r, B, k): λ of each bond's constraint
    in the step that leaves the row (k = 0 without constraints). newton_mean: corrections per step
    (per site, if sites are solved separately; sweeps, if stages are a fixed point); newton_max: the
    most in one step. newton_since: the step from which Newton's method replaced a fixed point of
    the stages that failed or was slower; else None.
    """

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    mu: np.ndarray
    multipliers: np.ndarray
    newton_mean: float
    newton_max: int
    steps: int
    step: Fraction
    newton_since: int | None


class LatticeFlow:
    """The one-step map (x, μ) ↦ (b, μ′) of a lattice by a rule.

    digits: 16 for compiled double precision; otherwise Python runs the same driver, on numbers of
    more digits or, for 7, of single precision. Raises `BadInput` for a step of 0.
    """

    def __init__(self, scheme: Any, step: Given, digits: int = 16) -> None:
        self.scheme, self.lattice = scheme, scheme.lattice
        self.numbers = arithmetic(digits, single=True)
        self.step = exact_rational(step, "step")
        if self.step == 0:
            raise BadInput("step is 0: give a non-zero number.")

    def __reduce__(self) -> Again:
        """Return the pickled form: the flow is made again from its scheme and step."""
        return type(self), (self.scheme, self.step, self.numbers.digits)

    @cached_property
    def by_stages(self) -> bool:
        """True if a run begins with a fixed point of its stages, not with Newton's method."""
        return self._of_stages is not None

    @property
    def kernels(self) -> LatticeKernels:
        """The compiled kernels with which a run begins."""
        return self._of_stages if self.by_stages and self._of_stages else self.newton

    @property
    def newton(self) -> LatticeKernels:
        """The compiled kernels of Newton's method, or of sites that are solved separately."""
        return compile_lattice(
            self.scheme.system, self.lattice.shape, bool(self.scheme.substeps), self.numbers
        )

    @cached_property
    def _of_stages(self) -> LatticeKernels | None:
        stages = self.scheme.stages
        with suppress(NoShortForm):
            return None if stages is None else compile_lattice_stages(stages, self.numbers)
        return None

    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Rows | None = None,
        mu0: Rows | None = None,
        t0: Given = 0,
        checkpoint: File = None,
        progress: Progress = None,
    ) -> LatticeTrajectory:
        """Run `steps` steps from the lattice's start, or from x0 (shaped like the lattice's) and
        mu0 (N, m), at the time t0.

        checkpoint: a file. The rows are then numpy arrays on disk beside it, and the state is saved
        in it about once a second: the same call continues a killed run with the same numbers (to
        round-off, if a sparse factorisation solves). progress: called with the number of steps done
        so far. Raises `BadInput` for wrong shapes or counts and for the checkpoint of another run,
        `StepFailure` (with the rows so far) if a step cannot be solved.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        check_progress(progress)
        t = exact_rational(t0, "t0")
        return self._run(*self._start(x0, mu0, t), steps, every, checkpoint, progress, t)

    def _run(
        self, x: Matrix, mu: Matrix, steps: int, every: int, checkpoint: File, progress: Progress,
        t0: Number = 0,
    ) -> LatticeTrajectory:  # fmt: skip
        count = steps // every + 1
        with self.numbers.working():
            return next(self._blocks(x, mu, steps, every, count, checkpoint, progress, t0))

    def blocks(self, steps: int, every: int = 1, *, size: int = 1) -> Iterator[LatticeTrajectory]:
        """Yield the rows of `trajectory(steps, every)` in blocks of `size` rows; the last may be
        shorter.

        Blocks that are not kept do not fill the memory, however long the run is. Raises like
        `trajectory`, with the rows of the block.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        size = whole_number("size", size, 1)
        made = self._blocks(*self._start(None, None), steps, every, size)
        while True:
            with self.numbers.working():  # not while the caller has the block
                block = next(made, None)
            if block is None:
                return
            yield block

    def _blocks(
        self, x: np.ndarray, mu: np.ndarray, steps: int, every: int, size: int,
        checkpoint: File = None, progress: Progress = None, t0: Number = 0,
    ) -> Iterator[LatticeTrajectory]:  # fmt: skip
        """Yield the `blocks` from a start; with a checkpoint there is only one block."""
        run, kept, first = LatticeRun(self, x, mu.copy(), t0), None, 0
        zeros = self.numbers.zeros
        rows = [zeros(0, *a.shape) for a in run.columns.values()]

        def made(count: int) -> LatticeTrajectory:
            return self._trajectory(run, [column[:count] for column in rows], every, first)

        def failed(status: int) -> StepFailure:
            rows = made(count := -(-run.index // every) - first)
            last = (first + count - 1) * every
            lost = not (finite(run.x).all() and finite(run.nu).all())
            known = (self.scheme.local or lost) and count > 0
            here = run.traced(rows.x[-1], rows.mu[-1], last) if known else run
            return here.failure(status, rows)

        def write() -> None:
            for column, values in zip(rows, run.columns.values(), strict=True):
                column[run.index // every - first] = values

        if checkpoint is not None and self.numbers.dtype is not np.float64:
            raise BadInput(f"{self.lattice.name}: a checkpoint keeps numbers of double precision; "
                           "leave digits= or checkpoint= out.")  # fmt: skip
        if checkpoint is not None:
            counts = str((steps, every, self.lattice.shape))
            stages = self.scheme.stages if run.by_stages else None
            made_of = (self.scheme.system,) if stages is None else stages.key
            key = text_key(*made_of, run.digest.hexdigest(), counts)
            kept = Checkpoint(checkpoint, key, self.lattice.name, self.numbers)
        state = None if kept is None else kept.state
        if state is not None:
            run.restore(state)
        elif (status := run.show()) != Status.OK:  # the u that leaves the start is not found
            raise failed(status)
        elif self.scheme.constraints:
            self._check_start(mu, run)
        shapes = {word: (size, *a.shape) for word, a in run.columns.items()}
        if kept is None:
            rows = [zeros(*e) for e in shapes.values()]
        else:
            columns = {word: (a.shape, a.dtype) for word, a in run.columns.items()}
            rows = [*kept.columns(columns, size).values()]
        if state is None:
            write()
            if kept is not None:  # a state is saved as soon as there are rows
                kept.save(run.state, 1, at_once=True)
        for is_row, status in self._stops(run, steps, every):
            if is_row and run.index // every == first + size:
                yield made(size)
                first, rows = first + size, [zeros(*a.shape) for a in rows]
            if status != Status.OK:
                raise failed(status)
            if is_row:
                write()
            if kept is not None:
                kept.save(run.state, run.index // every + 1, at_once=run.index == steps)
            if progress is not None:
                progress(run.index)
        if (status := run.end()) != Status.OK:
            raise failed(status)
        yield made(run.index // every + 1 - first)

    def _stops(self, run: LatticeRun, steps: int, every: int) -> Iterator[tuple[bool, int]]:
        """Advance to step `steps`; yield (True for a row, status) at each stop; rows are shown."""
        piece = max(1, PIECE // self.lattice.sites)
        while run.index < steps:
            next_row = (run.index // every + 1) * every
            status = run.advance(min(steps, next_row, run.index + piece) - run.index)
            is_row = status == Status.OK and run.index == next_row
            yield is_row, run.show() if is_row else status

    def _check_start(self, mu: np.ndarray, run: LatticeRun) -> None:
        """Raise `BadInput` unless x of a run's start satisfies the constraints and μ is projected.

        The start may be a row of a run, so μ may be off by up to 2⁻²⁶ (as in
        `equations.check_momentum`) of the largest momentum, or of that of the velocity u.
        """
        self.scheme.check_start(run.x, np.zeros_like(mu))
        off = abs(mu - run.mu)[self.lattice.free].max()
        largest = max(abs(mu).max(), abs(self.momenta(run.x, run.u, run.t)).max())
        if not off <= 2.0**-26 * largest:
            raise BadInput(
                f"{self.lattice.name}: mu0 is {off:.3g} from momenta that the constraints admit at "
                "x0; give a row of a run, or a start with A(x0) v0 = 0."
            )

    def _trajectory(
        self, run: LatticeRun, rows: Sequence[np.ndarray], every: int, first: int = 0
    ) -> LatticeTrajectory:
        public, numbers = self.numbers.public, self.numbers
        x, u, mu, *more = map(public, rows) if numbers.dtype is object else rows
        multipliers = more[0] if more else np.zeros((len(x), len(self.lattice.pairs), 0))
        index = np.arange(first, first + len(x), dtype=np.int64)
        t = public(numbers.multiples(self.step, index * every) + run.t0)
        mean = float(run.totals[Entry.CORRECTIONS] / max(1, run.solved))
        return LatticeTrajectory(
            t, x, u, mu, multipliers, mean, int(run.totals[Entry.MOST]), run.index, self.step,
            run.newton_since if run.newton_since >= 0 else None,
        )  # fmt: skip

    def _start(
        self, x0: Rows | None, mu0: Rows | None, t0: Number = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        lattice: Lattice = self.lattice
        x, v = self.start
        if mu0 is None:
            mu = self.momenta(x, v, t0)
        elif (checked := floats(mu0, f"{lattice.name}: mu0")).shape != v.shape:
            raise BadInput(f"{lattice.name}: mu0 must be of the shape {v.shape}.")
        else:
            mu = self.exact(mu0 if self.numbers.dtype is object else checked)
        if x0 is not None:
            x = lattice.positions(x0)
            x = np.array(x0, dtype=object).reshape(x.shape) if self.numbers.dtype is object else x
        return self.exact(x), mu

    @cached_property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """The lattice's start, x (N, n) and v (N, m), as numbers of the flow.

        With constraints and more than 16 digits it is that of the lattice's scene, which meets the
        constraints in all of them.
        """
        x, v = map(self.exact, self.lattice.start)
        if self.scheme.constraints and self.numbers.digits > 16:
            scene = scene_of(self.lattice)
            scene = on_constraints(SceneSymbols(scene), scene)
            free = self.lattice.free
            x[free], v[free] = (self.exact(e).reshape(a[free].shape) for e, a in
                                ((scene.x0, x), (scene.v0, v)))  # fmt: skip
        return x, v

    def exact(self, given: Rows) -> np.ndarray:
        """Return a copy of an array as numbers of the flow."""
        if self.numbers.dtype is not object:
            return np.array(given, dtype=self.numbers.dtype)
        array = np.array(given, dtype=object)
        with self.numbers.working():
            return self.numbers.array(list(map(self.numbers.number, array.ravel())), *array.shape)

    def poisson_defect(
        self, x: Rows, mu: Rows, *, t: Given = 0, pairs: int = 3, seed: int = 0,
        bracket_sign: int = 1,
    ) -> float:  # fmt: skip
        """Return how far the step from (x, μ) at t, x (N, n) and μ (N, m), is from a Poisson map.

        This is (Mᵀα)·Π(Mᵀβ) − α·Π′β for random pairs of covectors, over the sum of its absolute
        terms: a few units of round-off for a correct step (`dual_step`). With constraints it is
        ω′(Pa, Pb) − ω(a, b) for random vectors that they admit (`restricted_step`), and (x, μ) must
        be a row of a run. bracket_sign = −1 flips the bracket, as a negative control. Raises
        `CannotMeasure` for compositions.
        """
        step = step_derivative(self, *self._start(x, mu), float(exact_rational(t, "t")))
        return poisson_defect(step, pairs, seed, bracket_sign)

    def momenta(self, x: np.ndarray, v: np.ndarray, t: Number = 0) -> np.ndarray:
        """Return μ = ∂l/∂ξ at rows of x (N, n) and v (N, m), including bonds with velocities."""
        moving, found = v * self.lattice.free[:, None], self.numbers.zeros(*v.shape)
        with self.numbers.working():
            for s, p, ends in self.scheme.terms_at(self.numbers.number(t))[
                : 1 + self.lattice.bonds_move
            ]:
                # a bond sees both its ends; fixed ends are at rest
                at = at_ends(ends, x, v if ends.shape[1] == 1 else moving)
                values = [self.exact(e)[()] for e in p]
                (made,) = of_all(_momentum(s, self.numbers), len(ends), *at, values,
                                 dtype=self.numbers.dtype)  # fmt: skip
                np.add.at(found, ends, made[:, 0].T.reshape(*ends.shape, v.shape[1]))
        return found

    @cached_property
    def projection(self) -> LatticeFlow:
        """A flow whose 'step' projects momenta onto those that the constraints admit."""
        return LatticeFlow(self.scheme.projection, self.step, self.numbers.digits)


@lru_cache(maxsize=32)
def _momentum(s: SceneSymbols, numbers: Arithmetic) -> Callable[..., Any]:
    letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
    return numeric(letters, [momentum(s)], numbers, columns=True)
