"""Computed states as blocks of mpf numbers, and error bounds of each block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mpmath
import sympy

from ..equations import Equations, to_mpf
from ..taylor import Sweep, compile_series
from ..taylor.balls import BallRates, around_zero, exact, largest
from .agreement import Blocks


def momentum_function(equations: Equations) -> Callable[..., list[Any]]:
    """Return dl/dv as a function of x, v and the time if it occurs, in mpmath."""
    blocks = (equations.states[equations.block(name)] for name in ("x", "v", "time"))
    return sympy.lambdify([z for part in blocks for z in part], list(equations.momentum), "mpmath")


def blocks_of(equations: Equations, state: list[Any], working: int, momentum: Any = None) -> Blocks:
    """Return one state (mpf numbers in the equations' order) as blocks, with its momentum."""
    at = equations.block
    with mpmath.workdps(working):
        mu = (momentum or momentum_function(equations))(
            *state[at("x")], *state[at("v")], *state[at("time")]
        )
        blocks = {"x": state[at("x")], "v": state[at("v")], "mu": [mpmath.mpf(c) for c in mu]}
    behind = {name: state[at(name)] for name in ("attitude", "time")}
    return blocks | {name: part for name, part in behind.items() if part}


def all_blocks(equations: Equations, sweep: Sweep, working: int) -> dict[Fraction, Blocks]:
    """Return every state of a sweep as blocks."""
    momentum = momentum_function(equations)
    return {
        t: blocks_of(equations, [to_mpf(value) for value in state], working, momentum)
        for t, state in sweep.states.items()
    }


class BlockBounds:
    """Converts bounds of |error| of a state to bounds of each block's worst entry."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.program = compile_series(replace(equations, assignments=(), rates=equations.momentum))

    def of(self, errors: list[Any], blocks: Blocks) -> dict[str, Any]:
        """Return one arb number for each block; the momentum's holds over the box of the errors.

        ``blocks`` are the computed state, with its momentum.
        """
        names = "x", "v", "attitude", "time"
        parts = {name: errors[self.equations.block(name)] for name in names}
        bounds = {name: largest(part) for name, part in parts.items() if part}
        state = [e for name in names for e in blocks.get(name, ())]
        box = [exact(z) + around_zero(e) for z, e in zip(state, errors, strict=True)]
        momentum, _ = BallRates(self.program)(box)
        wrong = (ball - exact(mu) for ball, mu in zip(momentum, blocks["mu"], strict=True))
        return bounds | {"mu": largest(wrong)}
