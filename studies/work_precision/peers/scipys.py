"""scipy's initial value solvers, with a compiled right-hand side and the exact Jacobian."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure

from ..contestants import MOST_ROWS, Contestant, NoEnd, Problem, States

IMPLICIT = ("Radau", "LSODA")  # methods that take a Jacobian
TOLERANCES = [10.0**-k for k in range(2, 14)]  # scipy takes no rtol below 100 units of round-off


class ScipyContestant(Contestant):
    """solve_ivp by one method; the settings are relative tolerances."""

    settings = TOLERANCES

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        self.name, self.problem, self.f, self.df = name, problem, equations.f, equations.df
        self.start = problem.start
        begun = time.perf_counter()
        self.f(0.0, self.start), self.df(0.0, self.start)
        self.setup = time.perf_counter() - begun
        # the absolute tolerance is that share of each block's own size: x and μ have their units
        n = len(problem.scheme.x)
        sizes = [np.abs(self.start[part]).max(initial=0.0) for part in (slice(n), slice(n, None))]
        sizes = [size or max(sizes) for size in sizes]
        self.scale = np.repeat(sizes, [n, len(self.start) - n])

    def made(self, tolerance: float) -> dict[str, Any]:
        """Return the options of the call."""
        jacobian = {"jac": self.df} if self.name in IMPLICIT else {}
        atol = tolerance * self.scale
        return {"method": self.name, "rtol": tolerance, "atol": atol, **jacobian}

    def solve(self, options: dict[str, Any], start: np.ndarray) -> Any:
        """Solve without output in between, its fastest form."""
        return self._solved(self.f, options, start)

    def _solved(self, f: Any, options: dict[str, Any], start: np.ndarray) -> Any:
        from scipy.integrate import solve_ivp

        return solve_ivp(f, (0.0, float(self.problem.duration)), start, **options)

    def states(self, options: dict[str, Any]) -> States:
        """Return its own steps; at earlier checkpoints its dense output, as a user gets."""
        problem, begun = self.problem, time.process_time()

        def watched(t: float, z: np.ndarray) -> Any:
            """Return f, and give up a run of ever smaller steps, such as a fall into a centre."""
            if time.process_time() - begun > problem.patience:
                raise NoEnd(self.name)
            return self.f(t, z)

        solution = self._solved(watched, options, self.start)
        if not solution.success:
            raise CannotMeasure(f"{self.name}: {solution.message}")
        checkpoints = np.zeros((0, len(self.start)))
        if problem.checkpoints:
            times = [float(t) for t in problem.times]
            dense = self._solved(self.f, {**options, "t_eval": times}, self.start)
            checkpoints = np.array(dense.y.T)
            checkpoints[-1] = solution.y[:, -1]
        stride = max(1, -(-solution.y.shape[1] // MOST_ROWS))
        path = np.vstack([solution.y.T[::stride], solution.y.T[-1:]])
        return States(checkpoints, path, len(solution.t) - 1, int(solution.nfev))
