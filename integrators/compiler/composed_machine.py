"""The kernels of a composition at work: each substep has its coefficients and its memory."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from .kernels_at_step import Machine

if TYPE_CHECKING:
    from ..flows.composed_flow import ComposedFlow


class ComposedMachine(Machine):
    """Kernels, coefficients and buffers of a composed flow (`composed_driver.advance`)."""

    def __init__(self, flow: ComposedFlow) -> None:
        super().__init__(flow)
        self.kinds, self.parts = flow.kinds, flow.parts

    @cached_property
    def c(self) -> Any:
        """One row of coefficients each substep, shorter ones filled up."""
        prepare = [self.kernels["prepare"], self.kernels["prepare_of_adjoint"]]
        rows = [self.prepared(prepare[kind], part._q)
                for kind, part in zip(self.kinds, self.parts, strict=True)]  # fmt: skip
        table = self.numbers.zeros(len(rows), max(map(len, rows)))
        for j, row in enumerate(rows):
            table[j, : len(row)] = row
        return table

    def lead(self, x: Any, mu: Any, c: Any, guess: Any) -> tuple[Any, ...]:
        """(state, memory, c, kinds) at (x, μ), nothing lost yet, one guess of each substep's u."""
        shape, other = self.kernels["SHAPES"]
        n, m = self.n, self.m
        state = self.numbers.zeros(2 * (n + m) + shape["carried"] + other["carried"])
        state[:n], state[n : n + m] = x, mu
        if not self.kinds.any():  # else they are computed where a substep follows another kind
            at = 2 * (n + m)
            state[at : at + shape["carried"]] = self.kernels["carry_at_start"](x, c[0])
        solved = shape["solved"]
        memory = self.numbers.zeros(len(self.parts), 5 * solved + 4)
        for row in memory:
            self.remember(row, guess, solved)
        return state, memory, c, self.kinds

    def last_solution(self, lead: tuple[Any, ...]) -> dict[str, Any]:
        """That of the first substep."""
        affine = self.kernels["SHAPES"][0]["affine"]
        return {} if affine else {"u": lead[1][0][: self.m]}
