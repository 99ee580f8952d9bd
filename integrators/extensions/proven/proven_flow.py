"""A flow whose runs are proven: every digit that is asked for is one of the exact discrete run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from ...errors import BadInput, StepFailure, arguments_checked
from ...flows import Flow, Scheme, Start
from ...geometry import StepContext, StepMap, map_text
from ...numbers import Arithmetic, LazyModule, Tracked, from_balls, rounded, solve, tracked
from ...numbers.types import Ball, Numbers, Vector
from ...runs import Stepper, Trajectory
from ...scene import Again

flint: Any = LazyModule("flint")
#: sizes of W over the largest unknown of the same kind, for which a proof is tried in turn; then W
#: is twice the error, so often
SIZES = (1e-3, 1e-6, 1e-12)
INFLATIONS = 8
AT_ONCE = 16  # steps between two reports of progress


@dataclass(frozen=True)
class Proof:
    """What is proven of a run.

    radius (r, n + m): bounds of the distance of each row's (x, μ) from the exact run, that of the
    discrete equations from the first row as it stands. unique: in each step no other solution is
    nearer than this part of the largest of velocities, of stages, of slopes; 0 where that is proven
    of the solution's own ball alone.
    """

    radius: np.ndarray
    unique: float


class NotProven(ArithmeticError):
    """No solution of a step is proven."""


@dataclass(frozen=True)
class States:
    """The states c + Q r: middle is c, basis the matrix Q of doubles, part the balls r."""

    middle: Vector
    basis: np.ndarray
    part: Tracked
    numbers: Arithmetic

    @classmethod
    def at(cls, state: Vector, numbers: Arithmetic) -> States:
        """Return one state."""
        return cls(state, np.eye(len(state)), tracked(numbers.zeros(len(state))), numbers)

    @property
    def balls(self) -> Tracked:
        """The states as a vector of balls."""
        return tracked(self.middle) + tracked(self.basis.astype(object)) @ self.part

    def mapped(self, of_middle: Tracked, derivative: Tracked) -> States:
        """Return the image, from that of the middle and a derivative over all states."""
        moved = derivative @ tracked(self.basis.astype(object))
        c = of_middle.value
        sizes = np.array([float(abs(e).upper()) for e in self.part.balls])
        turned = np.array([[float(e.mid()) for e in row] for row in moved.balls])
        largest = np.argsort(-sizes * np.linalg.norm(turned, axis=0))
        basis = np.linalg.qr(turned[:, largest])[0]
        if not np.isfinite(basis).all():
            raise NotProven("the derivative of a step is not finite")
        into = tracked(basis.astype(object))
        part = solve(self.numbers, into, moved) @ self.part
        rest = solve(self.numbers, into, of_middle - tracked(c))
        return States(c, basis, part + rest, self.numbers)


class StepInBalls(StepMap):
    """A step's rows, their slope and its increment on balls."""

    def __init__(self, part: StepContext) -> None:
        super().__init__(part.equations, part.numbers, part.q)
        self.part = part
        self.kinds = [kind for kind, letters in self.equations.unknowns for _ in letters]
        if self.equations.element is not None:
            self._refuse("its discrete Lagrangian is a function of the group element")
        if not map_text(part.equations, "one_step").lstrip().startswith("def function("):
            self._refuse("the retraction is a series, whose rest has no ball here: take cayley")

    def _refuse(self, why: str) -> None:
        raise BadInput(f"{self.part.scene.name}: no run in balls: {why}.")

    def start(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """Return Newton's start from the velocity of the step before."""
        return super().start(x, mu, near) if len(near) == self.m else near

    def solutions(self, z: Tracked, c: Vector, near: Vector) -> tuple[Tracked, Tracked, float]:
        """Return w in balls for the states z, and for their middle c, and the size of W.

        Raises `NotProven` where that is not shown, and as Newton's method does.
        """
        n = self.n
        w = self.unknowns(c[:n], c[n:], self.start(c[:n], c[n:], near))
        slope = self._value("rows", c[:n], c[n:], w, self.q)[1]
        at, rows = tracked(w), self._at(z, tracked(w))[0]
        error = solve(self.numbers, tracked(slope), rows).balls
        units = self._widths(w, flint.arb(2) ** -self.numbers.bits)
        for size in (*SIZES, *[0.0] * INFLATIONS):
            twice = (2 * abs(e).upper() + unit for e, unit in zip(error, units, strict=True))
            widths = self._widths(w, size) if size else [*twice]
            W = [flint.arb(e, r) for e, r in zip(at.balls, widths, strict=True)]
            of_W = self._at(z, self._balls(W))[1]
            error = solve(self.numbers, of_W, rows).balls
            N = at.balls - error
            if all(a.contains_interior(b) for a, b in zip(W, N, strict=True)):
                middle = at - solve(self.numbers, of_W, self._at(tracked(c), at)[0])
                return self._balls(N), middle, size
        raise NotProven("no ball is mapped into itself")

    def _balls(self, entries: Sequence[Ball]) -> Tracked:
        return from_balls(self.numbers, list(entries), len(entries))

    def _widths(self, w: Vector, size: float | Ball) -> list[Ball]:
        """Return the radii of W: a part of the largest unknown of the same kind, and a trifle."""
        kinds, least = self.kinds, flint.arb(2) ** -self.numbers.bits
        largest = [max(abs(e) for e, f in zip(w, kinds, strict=True) if f == k) for k in kinds]
        return [(e + least) * size for e in tracked(np.array(largest, dtype=object)).balls]

    def moved(self, z: Tracked, c: Vector, w: Tracked, of_c: Tracked) -> tuple[Tracked, Tracked]:
        """Return (the state after the step from c, the step's derivative over z), in balls."""
        _, slope, rows_z, _, by_w, by_z = self._at(z, w)
        one = self.numbers.identity(len(c))
        derivative = one + by_z - by_w @ solve(self.numbers, slope, rows_z)
        return tracked(c) + self._at(tracked(c), of_c)[3], derivative

    def _at(self, z: Tracked, w: Tracked) -> Any:
        return self._errors("one_step")(z[: self.n], z[self.n :], w, self._twice_rounded)

    @cached_property
    def _twice_rounded(self) -> Tracked:
        """The step and the parameters; those that are irrational are rounded twice."""
        q = np.array(self.q, dtype=self.numbers.dtype)
        return rounded(q, 2 * abs(q))


class ProvenMotion:
    """A run in balls (`runs.Stepper`), without a checkpoint."""

    ended = False
    key = ""

    def __init__(self, context: StepContext, start: Start) -> None:
        self.context, self.numbers, self.start = context, context.numbers, start
        self.name = context.scene.name
        self.steps_of = [StepInBalls(part) for part in context.parts]
        self.states = States.at(np.concatenate([start.x, start.mu]), self.numbers)
        self.near, self.unique, self.index = start.guess, SIZES[0], 0

    def begin(self, steps: int, every: int, allocate: object = None) -> None:
        """Prepare a run; its rows are lists, which nothing else makes."""
        self.steps, self.every = steps, every
        self.rows: list[tuple[Vector, ...]] = []

    @property
    def whole(self) -> int:
        """The number of complete rows."""
        return len(self.rows)

    def advance(self) -> int:
        """Make some steps; return 1 where no solution of the next one is proven."""
        with flint.ctx.workprec(self.numbers.bits):
            for _ in range(AT_ONCE):
                try:
                    self._advance()
                except ArithmeticError:  # also where Newton diverges, or a slope is singular
                    return 1
                if self.ended:
                    break
        return 0

    def _advance(self) -> None:
        """Make one step, or prove the step that leaves the last row."""
        states = self.states
        for k, step in enumerate(self.steps_of):
            z = states.balls
            w, of_middle, size = step.solutions(z, states.middle, self.near)
            self.unique = min(self.unique, size)
            if k == 0 and self.index % self.every == 0:
                self._keep(w, z, step)
            if self.index == self.steps:
                self.ended = True
                return
            self.near = w.value[: step.m] if step.equations.arrows is not None else w.value
            states = states.mapped(*step.moved(z, states.middle, w, of_middle))
        self.states, self.index = states, self.index + 1

    def _keep(self, w: Tracked, z: Tracked, step: StepInBalls) -> None:
        c = self.states.middle
        apart = (z - tracked(c)).balls
        radius = np.array([float(abs(e).upper()) for e in apart])
        kinds, h = step.kinds, step.q[0]
        each = zip(w.value, kinds, strict=True)
        multipliers = np.array([2 * e / h for e, kind in each if kind == "multiplier"], object)
        u = w.value[: step.m]
        if set(kinds[: step.m]) != {"velocity"}:
            near = self.context.vector(self.context.scene.v0, step.m)
            u = step.velocities(c[None, : step.n], c[None, step.n :], near[None])[0]
        # rounded up to a double, also where it is too small for one
        above = np.where([e == 0 for e in apart], 0.0, np.nextafter(radius, np.inf))
        self.rows.append((c, u, multipliers, above))

    @property
    def state(self) -> Mapping[str, np.ndarray]:
        """Nothing: a proven run has no checkpoint."""
        return {}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Do nothing: a proven run has no checkpoint."""

    def failure(self, status: int) -> StepFailure:
        """Return the failure of the coming step, with the rows so far."""
        n = len(self.start.x)
        cause = "the balls of arb prove no solution of the step"
        where: dict[str, Numbers] = {"x": self.states.middle[:n], "mu": self.states.middle[n:]}
        return self.context.failure(cause, where, self.index, self.trajectory())

    def trajectory(self) -> Trajectory:
        """Return the rows: the middles of the balls, and what is proven of them."""
        context, public, s = self.context, self.numbers.public, self.context.equations.s
        n, count, t0 = len(self.start.x), len(self.rows), self.start.t0
        columns = [[row[k] for row in self.rows] for k in range(4)]
        z, u, multipliers = (np.array(e, dtype=object).reshape(count, -1 if count else 0)
                             for e in columns[:3])  # fmt: skip
        times = self.numbers.multiples(context.step, np.arange(count) * self.every)
        base = public(z[:, :n])
        return Trajectory.of_rows(
            public(times + self.numbers.number(t0)), base[:, : s.n], public(u), public(z[:, n:]),
            base=base, multipliers=public(multipliers), steps=self.index, step=context.step,
            scheme=context.scheme, proof=Proof(np.array(columns[3]), self.unique),
        )  # fmt: skip


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
