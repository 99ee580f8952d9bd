"""The flow of a lattice at one step size: its state as arrays, advanced by machine code."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ...compiler import (
    KNOWN_ZEROS,
    Entry,
    LatticeStages,
    NoShortForm,
    Status,
    at_nodes,
    cached_text,
    file_name,
    of_each,
    run_kernels,
    text_key,
    text_of_stages,
)
from ...equations import SceneSymbols, momentum, on_constraints
from ...errors import BadInput, StepFailure, arguments_checked
from ...numbers import (
    Arithmetic,
    Matrix,
    Number,
    Numbers,
    Vector,
    arithmetic,
    exact_rational,
    finite,
    numeric,
    whole_number,
)
from ...numbers.types import Function, Given, Namespace, Rows
from ...rules import adjoint
from ...runs import Allocate, File, FlowRuns, Progress, Stepper, Trajectory, allocated, run
from ...scene import Again
from .as_scene import scene_of
from .blocks import at_ends, of_all
from .dual_step import poisson_defect
from .lattice import Lattice, floats
from .lattice_run import LatticeRun, LatticeScheme
from .lattice_text import LatticeSystem, lattice_text
from .restricted_step import step_derivative


class LatticeFlow(FlowRuns):
    """The one-step map (x, μ) ↦ (b, μ′) of a lattice by a rule.

    digits: 16 for compiled double precision; otherwise Python runs the same driver, on numbers of
    more digits or, for 7, of single precision. Raises `BadInput` for a step of 0.
    """

    def __init__(self, scheme: LatticeScheme, step: Given, digits: int = 16) -> None:
        self.scheme, self.lattice = scheme, scheme.lattice
        self.numbers = arithmetic(digits, single=True)
        self.step = exact_rational(step, "step")
        if self.step == 0:
            raise BadInput("step is 0: give a non-zero number.")

    def __reduce__(self) -> Again:
        """Return the pickled form: the flow is made again from its scheme and step."""
        return type(self), (self.scheme, self.step, self.numbers.digits)

    @property
    def name(self) -> str:
        """The lattice's name."""
        return str(self.lattice.name)

    @property
    def kernels(self) -> LatticeKernels:
        """The compiled kernels with which a run begins."""
        return self.of_stages or self.newton

    @property
    def newton(self) -> LatticeKernels:
        """The compiled kernels of Newton's method, or of sites that are solved separately."""
        return compile_lattice(
            self.scheme.system, self.lattice.shape, bool(self.scheme.substeps), self.numbers
        )

    @cached_property
    def of_stages(self) -> LatticeKernels | None:
        """The compiled kernels of a fixed point of the stages, with which a run begins, or None."""
        stages = self.scheme.stages
        with suppress(NoShortForm):
            return None if stages is None else compile_lattice_stages(stages, self.numbers)
        return None

    @arguments_checked
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
    ) -> Trajectory:
        """Run `steps` steps from the lattice's start, or from x0 (shaped like the lattice's) and
        mu0 (N, m), at the time t0.

        checkpoint: a file. The rows are then numpy arrays on disk beside it, and the state is saved
        in it about once a second: the same call continues a killed run with the same numbers (to
        round-off, if a sparse factorisation solves). progress: called with the number of steps done
        so far. Raises `BadInput` for wrong shapes or counts and for the checkpoint of another run,
        `StepFailure` (with the rows so far) if a step cannot be solved.
        """

        def stepper() -> Stepper:
            t = exact_rational(t0, "t0")
            return self.stepper(*self._start(x0, mu0, t), t)

        return self._run(stepper, steps, every, progress, checkpoint)

    def stepper(self, x: Matrix, mu: Matrix, t0: Number) -> Stepper:
        """Return a run from a start, for the loop `runs.run`."""
        return LatticeStepper(LatticeRun(self, x, mu, t0), checked=True)

    def blocks(self, steps: int, every: int = 1, *, size: int = 1) -> Iterator[Trajectory]:
        """Yield the rows of `trajectory(steps, every)` in blocks of `size` rows; the last may be
        shorter.

        Blocks that are not kept do not fill the memory, however long the run is. Raises like
        `trajectory`, with the rows of the block.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        left, size = steps // every + 1, whole_number("size", size, 1)
        with self.numbers.working():
            made = LatticeRun(self, *self._start(None, None))
        while left > 0:
            left -= size
            # the steps to the next block's first row belong to this one, as do the last steps
            count = size * every if left > 0 else steps - made.index
            with self.numbers.working():  # not while the caller has the block
                stepper = LatticeStepper(made)
                block = run(stepper, count, every)
                block = block if left <= 0 else stepper.rows_of(size)
            yield block

    def _start(
        self, x0: Rows | None, mu0: Rows | None, t0: Number = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        lattice: Lattice = self.lattice
        # a start on constraints is dear: it is made only where a part of it is asked for
        x, v = self.start if x0 is None or mu0 is None else lattice.start
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

    @property
    def own_start(self) -> tuple[np.ndarray, np.ndarray]:
        """x (N, n) and μ (N, m) of the lattice's own start; fixed sites have no μ."""
        x, mu = self._start(None, None)
        mu[~self.lattice.free] = 0
        return x, mu

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

    def exact(self, rows: Rows) -> np.ndarray:
        """Return a copy of an array as numbers of the flow."""
        if self.numbers.dtype is not object:
            return np.array(rows, dtype=self.numbers.dtype)
        array = np.array(rows, dtype=object)
        with self.numbers.working():
            return self.numbers.array(list(map(self.numbers.number, array.ravel())), *array.shape)

    @arguments_checked
    def poisson_defect(
        self, x: Rows, mu: Rows, *, t: Given = 0, pairs: int = 3, seed: int = 0,
        bracket_sign: int = 1,
    ) -> float:  # fmt: skip
        """Return how far the step from (x, μ) at t, x (N, n) and μ (N, m), is from a Poisson map.

        This is (Mᵀα)·Π(Mᵀβ) − α·Π′β for random pairs of covectors, over the sum of its absolute
        terms: a few units of round-off for a correct step (`dual_step`). With constraints it is
        ω′(Pa, Pb) − ω(a, b) for random vectors that they admit (`restricted_step`), and (x, μ) must
        be a row of a run. Of a composition it is the largest of its substeps. bracket_sign = −1
        flips the bracket, as a negative control.
        """
        pairs, worst = whole_number("pairs", pairs, 1), 0.0
        after, time = self._start(x, mu), float(exact_rational(t, "t"))
        for part in self.parts:
            step = step_derivative(part, *after, time)
            after, time = step.after, time + float(part.step)
            worst = float(np.maximum(worst, poisson_defect(step, pairs, seed, bracket_sign)))
        return worst

    @cached_property
    def parts(self) -> list[LatticeFlow]:
        """The flows of a composition's substeps, one after another; of one step the flow itself."""
        scheme, digits = self.scheme, self.numbers.digits
        if not scheme.substeps:
            return [self]
        base = scheme.rule.of_step
        schemes = {kind: type(scheme)(self.lattice, adjoint(base) if kind else base)
                   for kind in {s.adjoint for s in scheme.substeps}}  # fmt: skip
        return [schemes[s.adjoint].flow(self.step * exact_rational(s.coefficient(digits + 30), ""),
                                        digits) for s in scheme.substeps]  # fmt: skip

    def momenta(self, x: np.ndarray, v: np.ndarray, t: Number = 0) -> np.ndarray:
        """Return μ = ∂l/∂ξ at rows of x (N, n) and v (N, m), including bonds with velocities."""
        x, v = self.exact(x), self.exact(v)
        moving, momenta = v * self.lattice.free[:, None], self.numbers.zeros(*v.shape)
        with self.numbers.working():
            number = self.numbers.number
            terms = self.scheme.terms_at(number(t), number)
            for s, p, ends in terms[: 1 + self.lattice.bonds_move]:
                # a bond sees both its ends; fixed ends are at rest
                at = at_ends(ends, x, v if ends.shape[1] == 1 else moving)
                values = [self.exact(e)[()] for e in p]
                (made,) = of_all(_momentum(s, self.numbers), len(ends), *at, values,
                                 dtype=self.numbers.dtype)  # fmt: skip
                np.add.at(momenta, ends, made[:, 0].T.reshape(*ends.shape, v.shape[1]))
        return momenta

    @cached_property
    def projection(self) -> LatticeFlow:
        """A flow whose 'step' projects momenta onto those that the constraints admit."""
        return LatticeFlow(self.scheme.projection, self.step, self.numbers.digits)


@lru_cache(maxsize=32)
def _momentum(s: SceneSymbols, numbers: Arithmetic) -> Function:
    letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
    return numeric(letters, [momentum(s)], numbers, columns=True)


# Kernels of a lattice: those of a site and of a bond, and their driver.


@dataclass(frozen=True, eq=False)
class LatticeKernels:
    """The functions of a lattice (`lattice_driver`): `advance`, and `prepare` of each system.

    widths: columns of the arrays that `advance` takes. affine: True if a site that is solved by
    itself needs no iteration. huge: a number larger than any size.
    """

    advance: Callable[..., tuple[int, int]]
    prepare: tuple[Callable[[Numbers], Sequence[Number]], ...]
    widths: dict[str, int]
    affine: bool
    huge: Number


@lru_cache(maxsize=512)
def compile_lattice(
    system: LatticeSystem, shape: str, composed: bool, numbers: Arithmetic
) -> LatticeKernels:
    """Return the kernels and the driver of a lattice, like `compile` for a system.

    shape: "chain", "ring" or "list", the arrangement of the bonds; composed: True if a step has
    several substeps.
    """
    path = f"{file_name(system)}_lattice_{text_key(system, shape, composed)}.py"
    text = cached_text(path, lambda: lattice_text(system, shape, composed))
    return _lattice_kernels(run_kernels(system, text, numbers, KNOWN_ZEROS))


@lru_cache(maxsize=512)
def compile_lattice_stages(system: LatticeStages, numbers: Arithmetic) -> LatticeKernels:
    """Return the kernels of a lattice's collocation; raises `NoShortForm` like `compile_stages`."""
    source = system.source
    path = f"{file_name(source)}_lattice_stages_{text_key(*system.key)}.py"
    text = cached_text(path, lambda: text_of_stages(system.site, system))
    return _lattice_kernels(run_kernels(source, text, numbers, *at_nodes(source, numbers)))


def _lattice_kernels(names: Namespace) -> LatticeKernels:
    affine = all(of_each("affine", names))
    return LatticeKernels(
        names["advance"], of_each("prepare", names), names["WIDTHS"], affine, names["HUGE"]
    )


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
