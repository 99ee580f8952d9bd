"""The kernels of a composition at work: each substep has its coefficients and its memory."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .kernels_at_step import Machine


class ComposedMachine(Machine):
    """Kernels, coefficients and buffers of a flow with substeps (`composed_driver.advance`).

    A state holds x, μ, their compensations, the carried functions, then a row of memory a substep.
    """

    def __init__(self, flow: Any) -> None:
        super().__init__(flow)
        self.parts, equations = flow.parts, flow.context.equations
        self.kinds = np.array([p.equations is not equations for p in self.parts], dtype=np.int64)

    @cached_property
    def kernels(self) -> dict[str, Any]:  # type: ignore[override]
        """The functions and constants of the generated module, `advance` on one array of state."""
        given = self.flow._kernels

        def advance(state: Any, c: Any, *rest: Any) -> Any:
            return given["advance"](state, self._memory(state), c, self.kinds, *rest)

        return {**given, "advance": advance, "SHAPE": given["SHAPES"][0]}

    def _memory(self, state: Any) -> Any:
        """The solvers' memories as a view of the state, one row a substep."""
        rows = 5 * self._shape["solved"] + 4
        return state[len(state) - len(self.parts) * rows :].reshape(-1, rows)

    def coefficients(self, key: int = 0, translate: Any = None, halvings: int = 0) -> Any:
        """One row of coefficients each substep at its share of h/2^halvings, filled up."""
        if (key, halvings) not in self._known:
            prepare = [self.kernels["prepare"], self.kernels["prepare_of_adjoint"]]
            rows = [self.prepared(prepare[kind], [part.h / 2**halvings, *part.q[1:]])
                    for kind, part in zip(self.kinds, self.parts, strict=True)]  # fmt: skip
            table = self.numbers.zeros(len(rows), max(map(len, rows)))
            for j, row in enumerate(rows):
                table[j, : len(row)] = row
            self._known[key, halvings] = table
        return self._known[key, halvings]

    def lead(self, x: Any, mu: Any, c: Any, guess: Any) -> tuple[Any, ...]:
        """(state, c) at (x, μ), nothing lost yet, one guess of each substep's u."""
        n, m, memory = self.n, self.m, len(self.parts) * (5 * self._shape["solved"] + 4)
        carried = sum(shape["carried"] for shape in self.kernels["SHAPES"])
        state = self.numbers.zeros(2 * (n + m) + carried + memory)
        state[:n], state[n : n + m] = x, mu
        self.recarry(state, c)
        self.seed(state, guess)
        return state, c

    def recarry(self, state: Any, c: Any) -> None:
        """Compute the carried functions anew; where kinds differ the driver does so itself."""
        if not self.kinds.any():
            at = 2 * (self.n + self.m)
            x = state[: self.n]
            state[at : at + self._shape["carried"]] = self.kernels["carry_at_start"](x, c[0])

    def seed(self, state: Any, guess: Any) -> None:
        """Newton starts from the guess, m entries, or a row of them each substep."""
        memory = self._memory(state)
        for row, of_substep in zip(memory, np.broadcast_to(guess, (len(memory), self.m)),
                                   strict=True):  # fmt: skip
            self.remember(row, of_substep, self._shape["solved"])
            row[-4:-2] = [0, 0]

    def _past(self, state: Any) -> list[Any]:
        """The past solutions, latest first, (substeps, m) each."""
        solved, memory = self._shape["solved"], self._memory(state)
        return [memory[:, i * solved : i * solved + self.m] for i in range(5)]

    def last_solution(self, lead: tuple[Any, ...]) -> dict[str, Any]:
        """That of the first substep."""
        return {} if self._shape["affine"] else {"u": self._past(lead[0])[0][0]}
