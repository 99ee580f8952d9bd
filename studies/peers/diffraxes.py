"""diffrax: Runge–Kutta methods compiled by JAX, in double precision (Kidger 2021)."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from integrators.errors import CannotMeasure

from ..contestants import MOST_ROWS, Problem, States

TOLERANCES = [10.0**-k for k in range(3, 14)]
MOST_STEPS = 2**22


def contestant(name: str, problem: Problem, equations: Any) -> DiffraxContestant:
    """Dopri8 with its PID step size controller."""
    return DiffraxContestant(name, problem, equations)


class DiffraxContestant:
    """diffeqsolve under jit, the tolerance an argument; the settings are tolerances."""

    kind = "peer"

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        import jax
        import sympy

        jax.config.update("jax_enable_x64", True)
        import diffrax
        import jax.numpy as jnp

        self.name, self.problem = name, problem
        self.start = jnp.asarray(problem.start)
        function = sympy.lambdify([equations.states], list(equations.field), "jax", cse=True)
        term = diffrax.ODETerm(lambda t, z, args: jnp.stack([*map(jnp.asarray, function(z))]))
        end = float(problem.duration)

        def solve(tolerance: Any, start: Any, times: Any = None) -> Any:
            saved = diffrax.SaveAt(t1=True) if times is None else diffrax.SaveAt(ts=times)
            found = diffrax.diffeqsolve(
                term, diffrax.Dopri8(), 0.0, end, None, start, saveat=saved, throw=False,
                stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
                max_steps=MOST_STEPS,
            )  # fmt: skip
            return found.ys, found.stats["num_steps"], found.result == diffrax.RESULTS.successful

        self.solve = jax.jit(solve)
        begun = time.perf_counter()
        self.solve(1e-3, self.start)[0].block_until_ready()
        self.setup = time.perf_counter() - begun

    def ladder(self) -> Iterator[float]:
        """Tolerances from 1e-3 on."""
        return iter(TOLERANCES)

    def told(self, setting: float) -> dict[str, Any]:
        """Its tolerance."""
        return {"setting": f"rtol {setting:.0e}", "tolerance": setting}

    def prepare(self, setting: float) -> DiffraxRun:
        """The compiled call."""
        return DiffraxRun(self, setting)


class DiffraxRun:
    """One compiled solve; JAX answers at once, so the result is waited for."""

    def __init__(self, contestant: DiffraxContestant, tolerance: float) -> None:
        self.contestant, self.tolerance = contestant, tolerance

    def __call__(self) -> Any:
        return self.contestant.solve(self.tolerance, self.contestant.start)[0].block_until_ready()

    def states(self) -> States:
        """On a grid, by its own dense output; the end is that of the timed run."""
        contestant, problem = self.contestant, self.contestant.problem
        last, steps, fine = contestant.solve(self.tolerance, contestant.start)
        if not bool(fine):
            raise CannotMeasure(f"diffrax: no end within {MOST_STEPS} steps")
        parts = max(1, problem.checkpoints)
        inside = max(1, MOST_ROWS // 16 // parts)
        grid = np.linspace(0.0, float(problem.duration), parts * inside + 1)
        path = np.array(contestant.solve(self.tolerance, contestant.start, grid)[0])
        path[-1] = np.array(last)[-1]
        checkpoints = path[inside::inside] if problem.checkpoints else path[:0]
        return States(checkpoints, path, int(steps), None, None)
