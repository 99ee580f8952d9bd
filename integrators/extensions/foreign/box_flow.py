"""A black box on a scene at one step size: its runs, its steps, and its derivative."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from ...equations import initial_momentum
from ...errors import BadInput, StepFailure, arguments_checked, shown
from ...flows import StepChoice, Trajectory
from ...numbers import Matrix, Numbers, Vector, arithmetic, exact_rational
from ...numbers.types import Exact, Given, Number
from ...runs import File, FlowRuns, Progress
from .box_motion import BoxMotion
from .calls import Box, BoxRaised, Calls
from .differences import Map, MapOfRows

#: a `BoxScheme`, whose file comes after this one
BoxOnScene: TypeAlias = Any

ALSO_ALONE = 2  # number of states of a vectorised call that are also computed one by one
#: largest relative difference between the two: arrays round differently from single numbers, and a
#: motion near a pole enlarges that thousands of times
ALIKE = 2.0**-36


#: what a scene in numbers tells a box of itself, beside its equations
DATA = {"n", "m", "t", "name", "parameters", "_clocked"}


class _Heard:
    """A scene in numbers that counts what is asked of it beside its data."""

    def __init__(self, system: Any) -> None:
        self._system, self._asked = system, 0

    def __getattr__(self, name: str) -> Any:
        self._asked += name not in DATA
        return getattr(self._system, name)


class BoxFlow(FlowRuns):
    """The steps of a black box, on (x, μ) like those of every flow: `trajectory`, `dual_step`.

    step: exact; a negative one runs back. digits = 16 is double precision (single, for a box of
    float32); more needs a box with numbers="any". Raises `BadInput` for a step of 0.
    """

    #: how the step was chosen: a program's step is always given
    choice: StepChoice | None = None

    #: the last answer, in the box's own coordinates, the number of its step, and the first time
    _last: tuple[Vector, Vector, int, Exact]

    in_turn = True  # a program, and its system's time, are one for all runs
    #: no fixed point of stages: a program solves its own equations
    stages = None

    def __init__(self, scheme: BoxOnScene, step: Given, digits: int = 16) -> None:
        self.scheme, self.digits = scheme, digits
        self.step = exact_rational(step, "step")
        if self.step == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        self.numbers = arithmetic(digits)
        box = scheme.rule
        single = np.float32 if box.numbers == "float32" else None
        self.kind: type = single or (float if digits == 16 else object)
        self.system = scheme.in_numbers(self.numbers, single)
        with self.numbers.working():
            size = self.numbers.number(self.step)
            h = self._public([size])[0]
        #: a float of Python, as users write it, or of the numbers that they ask for
        self.h = h if self.kind is object else (single or float)(h)
        self._calls = Calls(box, box.form.asked(self.system), self.h, self.kind, scheme.scene.name)

    @arguments_checked
    def trajectory(
        self, steps: int, every: int = 1, *, x0: Numbers | None = None,
        mu0: Numbers | None = None, u0: Numbers | None = None, t0: Given = 0,
        checkpoint: File = None, progress: Progress = None,
    ) -> Trajectory:  # fmt: skip
        """Run `steps` steps from the scene's start (or from x0, mu0), with a row every `every`
        steps.

        See `Flow.trajectory`; u is ξ(x, μ) of each row. u0 is ignored. A checkpoint needs a box
        whose steps are functions of the state, of which a change can be detected. Raises
        `StepFailure`, with the rows so far, if the box raises or returns numbers that are not
        finite, and `BadInput` for answers of another kind.
        """

        def stepper() -> BoxMotion:
            return BoxMotion(self, *self._start(x0, mu0, t0))

        with self.numbers.user_working():
            return self._run(stepper, steps, every, progress, checkpoint)

    def dual_step(self, x: Numbers, mu: Numbers, t0: Given = 0) -> tuple[Vector, Vector]:
        """Return (x′, μ′), one step after (x, μ)."""
        run = self.trajectory(1, x0=x, mu0=mu, t0=t0)
        return run.x[-1], run.mu[-1]

    def questions(self) -> int:
        """Return how often a step of the box asks the scene for more than its data."""
        heard = _Heard(self.system)
        box = self.scheme.rule
        calls = Calls(box, box.form.asked(heard), self.h, self.kind, self.scheme.scene.name)
        x, mu, t0 = self._start(None, None, 0)
        with self.numbers.user_working(), suppress(BadInput, BoxRaised):
            q, p = self._written(x, mu, t0)
            calls.run(q, p, 1, 1, lambda k: self._at(k, t0), lambda k, q, p: None)
        return heard._asked

    @property
    def answer(self) -> Vector:
        """The box's last numbers, in its own coordinates (q, p)."""
        return np.concatenate([part.ravel() for part in self._last[:2]])

    def moved_by(self, sizes: Vector) -> Vector:
        """Return by how much (x, μ) change if each number of `answer` changes by its size."""
        last, answer, q = self._last, self.answer, self._last[0]
        own, changes = np.concatenate(self._read(*last)), np.zeros(self.system.n + self.system.m)
        for i in np.flatnonzero(sizes):
            moved = answer + sizes[i] * (np.arange(len(answer)) == i)
            parts = moved[: q.size].reshape(q.shape), moved[q.size :]
            changes += np.abs(np.concatenate(self._read(*parts, *last[2:])) - own)
        self._last = last
        return changes

    def settled(self, z: Vector, t0: Given = 0) -> Vector:
        """Return a state z = (x, μ) after its way into the box's own coordinates and back."""
        n = self.system.n
        return np.concatenate(self._read(*self._written(z[:n], z[n:], t0), 0, t0))

    def map_of(self, steps: int = 1, t0: Given = 0, rows: int = 1) -> Map:
        """Return the map z ↦ Z of `steps` steps on states z = (x, μ), (n+m,), for differences.

        With several `rows` it gives the states after equal parts of the run, one after another,
        not numbers where a step fails. For a vectorised box it can map many states in one call
        (`MapOfRows`). It works in double precision and checks only the answers of the box. Raises
        `StepFailure`.
        """
        n = self.system.n

        def image(z: Vector) -> Vector:
            states: list[Vector] = []

            def row(k: int, q: Vector, p: Vector) -> None:
                if k:
                    states.extend(self._read(q, p, k, t0))

            q, p = self._written(z[:n], z[n:], t0)
            try:
                self._calls.run(q, p, steps, steps // rows, lambda k: self._at(k, t0), row)
            except BoxRaised as error:
                if rows > 1:
                    missing = rows * len(z) - sum(map(len, states))
                    return np.concatenate([*states, np.full((missing, *z.shape[1:]), np.nan)])
                first = z.reshape(len(z), -1)[:, :1].T
                raise self._failure(error, first[:, :n], first[:, n:], 1, t0) from error
            return np.concatenate(states)

        return self._of_rows(image) if self.scheme.rule.vectorised else image

    def _of_rows(self, image: Map) -> MapOfRows:
        """Return a map of rows that calls a map of columns, and checks some states one by one."""
        drawn = np.random.default_rng(0)

        def rows(points: Matrix) -> Matrix:
            images = image(np.ascontiguousarray(points.T)).T
            for k in drawn.integers(len(points), size=ALSO_ALONE):
                alone = image(points[k])
                with np.errstate(all="ignore"):
                    off = np.abs(alone - images[k]) > ALIKE * np.abs(images).max(axis=0)
                if off.any():
                    raise BadInput(
                        f"the black box {self.scheme.rule.name} says vectorised, but of "
                        f"{len(points)} states at once, q of the shape "
                        f"{(self.system.n, len(points))}, it gives something else than of one "
                        "alone: let each column be a state of its own, or leave vectorised out."
                    )
            return images

        return MapOfRows(image, rows)

    def _public(self, values: Numbers) -> Vector:
        """Return numbers of the flow's own arithmetic in the form that the box and the user get."""
        return self.numbers.public(np.array(values, dtype=self.numbers.dtype))

    def _start(
        self, x0: Numbers | None, mu0: Numbers | None, t0: Given
    ) -> tuple[Vector, Vector, Exact]:
        scheme, numbers = self.scheme, self.numbers
        scene, s = scheme.scene, scheme.s
        t0 = t0 if type(t0) is int else exact_rational(t0, "t0")
        if x0 is not None and s.clocked and _length(x0) == s.n + 1:
            *x0, last = x0
            t0 = exact_rational(last, "the time in x0")
        if mu0 is None:
            at = scene if x0 is None else scene.with_values(x0=list(x0))
            mu0 = initial_momentum(s, at, numbers, t0)
        x0 = scene.x0 if x0 is None else x0
        parts = []
        with numbers.working():
            for entries, length, name in ((x0, s.n, "x"), (mu0, len(s.mu), "μ")):
                if _length(entries) != length:
                    raise BadInput(
                        f"{scene.name}: {name} has {length} entries; got {shown(entries)}."
                    )
                values = [numbers.number(e, name) for e in entries]
                parts.append(self._public(values).reshape(length))
        return parts[0], parts[1], t0

    def _at(self, k: int, t0: Exact) -> None:
        """Set the time of the scene in numbers to the beginning of step k."""
        self.system.when = partial(self._time, k, t0)

    def _time(self, k: int, t0: Exact) -> Number:
        time = t0 + k * self.step if k else t0
        if self.digits == 16:
            return float(time)
        with self.numbers.working():
            return self._public([self.numbers.number(time)])[0]

    def _written(self, x: Vector, mu: Vector, t0: Exact) -> tuple[Vector, Vector]:
        """Return (x, μ) in the box's own coordinates and numbers."""
        box = self.scheme.rule
        self._at(0, t0)
        p = self.system.velocity(x, mu) if box.form.second == "v" else mu
        q = box.form.written(x)
        q, p = (q, p) if box.write is None else _checked(box, "write", box.write(q, p))
        return np.array(q, dtype=self.kind), np.array(p, dtype=self.kind)

    def _read(self, q: Vector, p: Vector, k: int, t0: Exact) -> tuple[Vector, Vector]:
        """Return (x, μ) from the box's own coordinates."""
        box = self.scheme.rule
        self._last = q, p, k, t0
        if box.read is not None:
            q, p = _checked(box, "read", box.read(q.copy(), p.copy()))
        q = box.form.read(q)
        if q.shape[:1] != (self.system.n,) or p.shape[:1] != (self.system.m,):
            raise BadInput(
                f"the black box {box.name}: read gives shapes {q.shape} and {p.shape}, but x and μ "
                f"of {self.scheme.scene.name} have {self.system.n} and {self.system.m} entries."
            )
        if self.kind is np.float32:
            q, p = q.astype(float), p.astype(float)
        if box.form.second == "v":
            if self.scheme.s.clocked:
                self._at(k, t0)
            p = self.system.momentum(q, p)
        return q, p

    def _rows(self, xs: Matrix, mus: Matrix, steps: int, every: int, t0: Exact) -> Trajectory:
        numbers, s, count = self.numbers, self.scheme.s, len(xs)
        with numbers.working():
            times = numbers.multiples(self.step, np.arange(count, dtype=np.int64) * every)
            t = numbers.public(times + numbers.number(t0) if t0 else times)
        base = np.hstack([xs, t[:, None]]) if s.clocked else xs
        return Trajectory.of_rows(
            t, xs, self.system.velocities(base, mus), mus, base=base, steps=steps, step=self.step,
            solver="black box", scheme=self.scheme,
        )  # fmt: skip

    def _failure(
        self, error: BoxRaised, xs: Matrix, mus: Matrix, every: int, t0: Exact
    ) -> StepFailure:
        scheme, k = self.scheme, error.index
        rows = self._rows(xs, mus, (len(xs) - 1) * every, every, t0)
        last = {"x": xs[-1], "mu": mus[-1]}
        time = float(t0 + k * self.step)
        return error.failure(
            scheme.scene.name, scheme.rule.name, k, time, last, error.said, rows, error.fix
        )


def _length(values: Numbers) -> int:
    return len(values) if np.iterable(values) else -1


def _checked(box: Box, word: str, pair: object) -> tuple[Vector, Vector]:
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise BadInput(f"the black box {box.name}: {word}= must give a pair of arrays.")
    return np.asarray(pair[0]), np.asarray(pair[1])
