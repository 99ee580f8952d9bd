"""The compiled kernels of a scheme at one step size, with the arrays they work on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import BadInput
from .edge_guard import GUARD
from .tuple_operations import state_length

OK = 0


@dataclass
class Run:
    """The arrays that the driver works on, and where it is; rows as in `running.Trajectory`.

    `translates`: of each row, the translate that its u is written in; `changes`: how often an edge
    was met.
    """

    lead: tuple[Any, ...]
    steps: int
    every: int
    xs: Any
    us: Any
    mus: Any
    counts: Any
    totals: Any
    translates: Any
    index: int = 0
    translate: int = 0
    changes: int = 0

    @property
    def state(self) -> Any:
        """What begins with x and μ."""
        return self.lead[0]

    @property
    def c(self) -> Any:
        """The coefficients in use."""
        return self.lead[1]

    @c.setter
    def c(self, value: Any) -> None:
        self.lead = (self.lead[0], value, *self.lead[2:])


class Machine:
    """Kernels, coefficients and buffers of a flow."""

    def __init__(self, flow: Any) -> None:
        self.flow, self.numbers = flow, flow.numbers
        self.n, self.m = len(flow.scheme.x), len(flow.scheme.u)
        self._known: dict[tuple[Any, int], Any] = {}

    @property
    def kernels(self) -> dict[str, Any]:
        """The functions and constants of the generated module."""
        return self.flow._kernels

    @property
    def _shape(self) -> dict[str, Any]:
        return dict(self.kernels["SHAPE"])

    def q_of(self, translate: Any = None, halvings: int = 0) -> list[Any]:
        """q at h/2^halvings and a translate (B, B⁻¹); None is e."""
        q = [self.flow.context.h / 2**halvings, *self.flow.context.q[1:]]
        if translate is not None:
            letters = [e for matrix in translate for e in matrix.ravel()]
            q[len(q) - len(letters) :] = letters
        return q

    @cached_property
    def c(self) -> Any:
        """The coefficients of a whole step, in the chart of e."""
        return self.coefficients()

    def coefficients(self, key: int = 0, translate: Any = None, halvings: int = 0) -> Any:
        """c at h/2^halvings and the translate number `key`.

        Raises `BadInput` if a coefficient is not finite.
        """
        if (key, halvings) not in self._known:
            q = self.q_of(translate, halvings)
            self._known[key, halvings] = self.prepared(self.kernels["prepare"], q)
        return self._known[key, halvings]

    def prepared(self, prepare: Any, q: list[Any]) -> Any:
        """c of q, by one of the module's functions; raises `BadInput` as `coefficients` does."""
        try:
            return np.array(prepare(q), dtype=self.numbers.dtype)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            scheme = self.flow.scheme
            raise BadInput(
                f"{scheme.scene.name} with {scheme.rule.name}: FL is singular or a coefficient is "
                f"not finite ({error}); every velocity needs its kinetic energy, and parameters "
                "their proper units."
            ) from None

    # -- the state: x, μ, their compensations, carried functions, the solver's memory -----------

    def buffers(self, lead: tuple[Any, ...], steps: int, every: int) -> Run:
        """Empty rows for a run; raises `BadInput` if they do not fit into memory."""
        rows, dtype = steps // every + 1, self.numbers.dtype
        try:
            xs, us, mus = (np.zeros((rows, k), dtype=dtype) for k in (self.n, self.m, self.m))
            counts, translates = np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=np.int64)
        except (MemoryError, ValueError):  # ValueError: more than an array can be told to hold
            raise BadInput(
                f"{rows} rows do not fit into memory: keep fewer (every=, --every)."
            ) from None
        zero = self.numbers.number(0)
        totals = np.zeros(GUARD) if dtype is np.float64 else [0, 0, *[zero] * (GUARD - 2)]
        totals[4] = totals[5] = totals[6] = self.kernels["HUGE"]
        return Run(lead, steps, every, xs, us, mus, counts, totals, translates)

    def lead(self, x: Any, mu: Any, c: Any, guess: Any) -> tuple[Any, ...]:
        """What `advance` takes first: (state, c) at (x, μ), nothing lost yet, one guess of u."""
        n, m, shape = self.n, self.m, self._shape
        kept, solved, affine = shape["carried"], shape["solved"], shape["affine"]
        state = self.numbers.zeros(state_length(n, m, solved, kept, affine))
        state[:n], state[n : n + m] = x, mu
        self.recarry(state, c)
        self.seed(state, guess)
        return state, c

    def point(self, state: Any) -> tuple[Any, Any]:
        """(x, μ) of a state."""
        return state[: self.n].copy(), state[self.n : self.n + self.m].copy()

    def recarry(self, state: Any, c: Any) -> None:
        """Compute the carried functions of x anew."""
        at = 2 * (self.n + self.m)
        state[at : at + self._shape["carried"]] = self.kernels["carry"](state[: self.n], c)

    def seed(self, state: Any, guess: Any) -> None:
        """Forget past solutions: Newton starts from the guess."""
        if self._shape["affine"]:
            return
        at = 2 * (self.n + self.m) + self._shape["carried"]
        self.remember(state[at:], guess, self._shape["solved"])
        state[-4:-2] = [0, 0]

    def remember(self, memory: Any, guess: Any, solved: int) -> None:
        """Fill a solver's memory: the guess five times, with stages of 0 (a straight path)."""
        for i in range(5):
            memory[i * solved : i * solved + len(guess)] = guess
        memory[-2], memory[-1] = self.kernels["HUGE"], sum(abs(g) for g in guess)

    def history(self, state: Any) -> list[Any]:
        """The past solutions, latest first (none where no step is solved iteratively)."""
        return [] if self._shape["affine"] else [past.copy() for past in self._past(state)]

    def last_solution(self, lead: tuple[Any, ...]) -> dict[str, Any]:
        """{"u": that from which Newton started}, empty where no step is solved iteratively."""
        return {} if self._shape["affine"] else {"u": self._past(lead[0])[0]}

    def _past(self, state: Any) -> list[Any]:
        at = 2 * (self.n + self.m) + self._shape["carried"]
        solved = self._shape["solved"]
        return [state[at + i * solved : at + i * solved + self.m] for i in range(5)]

    # -- steps ----------------------------------------------------------------------------------

    def advance(self, run: Run, stop: int, last: int | None = None) -> int:
        """Run the compiled loop up to `stop`; returns the status it ended with.

        The row at `last` (the run's end) gets its u, but no step.
        """
        first, last = -(-run.index // run.every), run.steps if last is None else last
        run.index, status = self.kernels["advance"](
            *run.lead, run.index, stop, last, run.every,
            run.xs, run.us, run.mus, run.counts, run.totals,
        )  # fmt: skip
        beyond = run.index + (status == OK and stop == last)
        if run.translate:
            run.translates[first : -(-beyond // run.every)] = run.translate
        return int(status)

    def one_step(self, run: Run) -> int:
        """One step and no more; at the run's end the u of its last row."""
        if run.index == run.steps:
            return self.advance(run, run.steps)
        return self.advance(run, run.index + 1, last=run.steps + 1)

    def solve(self, x: Any, mu: Any, c: Any, guess: Any) -> tuple[Any, Any] | None:
        """(u, number of its branch) of F⁻ = hμ from a guess, in the chart of c; None if not found.

        Nothing is watched, so the chart's edge is no obstacle.
        """
        run = self.buffers(self.lead(x, mu, c, guess), 0, 1)
        status = self.advance(run, 0)
        return None if status != OK else (run.us[0], run.totals[5])
