"""Computed states as blocks of mpf numbers, and what one error bound means for each block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from .agreement import Blocks
from .exact import to_mpf

if TYPE_CHECKING:
    from .equations import Equations
    from .taylor import Sweep


def momentum_function(equations: Equations) -> Callable[..., list[Any]]:
    """dl/dv as a function of x and v, in mpmath."""
    import sympy

    states = equations.states[: equations.dim_x + equations.dim_u]
    return sympy.lambdify(states, list(equations.momentum), "mpmath")


def blocks_of(equations: Equations, state: list[Any], working: int, momentum: Any = None) -> Blocks:
    """One state (mpf numbers x, v, attitude) as blocks, with its momentum."""
    import mpmath

    n, m = equations.dim_x, equations.dim_u
    with mpmath.workdps(working):
        mu = (momentum or momentum_function(equations))(*state[: n + m])
        blocks = {"x": state[:n], "v": state[n : n + m], "mu": [mpmath.mpf(c) for c in mu]}
    if len(state) > n + m:
        blocks["attitude"] = state[n + m :]
    return blocks


def all_blocks(equations: Equations, sweep: Sweep, working: int) -> dict[Fraction, Blocks]:
    """Every state of a sweep."""
    momentum = momentum_function(equations)
    return {
        t: blocks_of(equations, [to_mpf(value) for value in state], working, momentum)
        for t, state in sweep.states.items()
    }


class BlockBounds:
    """Bounds of |error| of a state, as a bound of each block's worst entry."""

    def __init__(self, equations: Equations) -> None:
        from .series import compile_series

        self.equations = equations
        self.program = compile_series(replace(equations, assignments=(), rates=equations.momentum))

    def of(self, state: list[Any], errors: list[Any], blocks: Blocks, precision: int) -> Blocks:
        """One mpf a block; ``state`` in mpfr numbers of ``precision`` bits."""
        import mpmath

        n, m = self.equations.dim_x, self.equations.dim_u
        with mpmath.workdps(15):
            parts = {"x": errors[:n], "v": errors[n : n + m], "attitude": errors[n + m :]}
            found = {name: [max(part)] for name, part in parts.items() if part}
            found["mu"] = [max(self._momentum(state, errors, blocks["mu"], precision))]
        return found

    def _momentum(
        self, state: list[Any], errors: list[Any], mu: list[Any], precision: int
    ) -> list[Any]:
        """|d mu/dz| over the box times the errors, and the rounding of mu itself."""
        import gmpy2
        import mpmath
        import numpy as np

        from .balls import jacobian
        from .majorants import upward
        from .remainders import Remainders
        from .taylor import Step

        centre = np.array([[float(z) for z in state]])
        radius = np.array([[float(e) for e in errors]]) + 1e-15 * abs(centre)
        slope, spread = jacobian(self.program, centre, radius)
        most = (abs(slope) + spread)[0]
        with gmpy2.context(gmpy2.get_context(), precision=precision):
            constants = self.program.constants_at(precision)
            nodes = self.program.nodes(1, state, constants)
        with upward():
            step = Step(nodes, gmpy2.mpfr(0), [])
            known = Remainders(self.program, step, 1, precision)
            rounding = [to_mpf(known.form(form) + 0) for form in self.program.rates]
        return [
            sum(
                (mpmath.mpf(float(a)) * e for a, e in zip(most[i], errors, strict=True)),
                rounding[i],
            )
            + abs(mpmath.fsub(to_mpf(nodes[i][1]), mu[i], exact=True))
            for i in range(len(mu))
        ]
