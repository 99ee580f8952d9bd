"""scipy's initial value solvers, with a compiled right-hand side and the exact Jacobian."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure

from ..contestants import MOST_ROWS, Contestant, NoEnd, Problem, States

IMPLICIT = ("Radau", "LSODA")  # those that take a Jacobian
TOLERANCES = [10.0**-k for k in range(2, 14)]  # scipy takes no rtol below 100 units of round-off


class ScipyRun:
    """One call of solve_ivp, without output between: that is its fastest form."""

    def __init__(self, contestant: ScipyContestant, tolerance: float) -> None:
        self.contestant, problem = contestant, contestant.problem
        self.span = (0.0, float(problem.duration))
        self.options: dict[str, Any] = {
            "method": contestant.name,
            "rtol": tolerance,
            "atol": tolerance * contestant.scale,
        }
        if contestant.name in IMPLICIT:
            self.options["jac"] = contestant.df

    def __call__(self) -> Any:
        return self._solved(self.contestant.f)

    def _solved(self, f: Any, **more: Any) -> Any:
        from scipy.integrate import solve_ivp

        return solve_ivp(f, self.span, self.contestant.start, **self.options, **more)

    def _watched(self) -> Any:
        """The right-hand side with an end to the patience: what falls into a centre, since its
        tolerance is loose, takes ever smaller steps."""
        contestant, begun = self.contestant, time.process_time()

        def f(t: float, z: np.ndarray) -> Any:
            if time.process_time() - begun > contestant.problem.patience:
                raise NoEnd(contestant.name)
            return contestant.f(t, z)

        return f

    def states(self) -> States:
        """Its own steps; at the checkpoints before the end its own dense output, as a user gets."""
        contestant, problem = self.contestant, self.contestant.problem
        found = self._solved(self._watched())
        if not found.success:
            raise CannotMeasure(f"{contestant.name}: {found.message}")
        checkpoints = np.zeros((0, len(contestant.start)))
        if problem.checkpoints:
            times = [float(t) for t in problem.times]
            dense = self._solved(contestant.f, t_eval=times)
            checkpoints = np.array(dense.y.T)
            checkpoints[-1] = found.y[:, -1]
        stride = max(1, -(-found.y.shape[1] // MOST_ROWS))
        path = np.vstack([found.y.T[::stride], found.y.T[-1:]])
        return States(checkpoints, path, len(found.t) - 1, int(found.nfev))


class ScipyContestant(Contestant):
    """solve_ivp by one method; the settings are relative tolerances."""

    settings, run = TOLERANCES, ScipyRun

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        self.name, self.problem, self.f, self.df = name, problem, equations.f, equations.df
        self.start = problem.start
        begun = time.perf_counter()
        self.f(0.0, self.start), self.df(0.0, self.start)
        self.setup = time.perf_counter() - begun
        # the absolute tolerance is that much of each block's own size: x and μ have their units
        n = len(problem.scheme.x)
        sizes = [np.abs(self.start[part]).max(initial=0.0) for part in (slice(n), slice(n, None))]
        sizes = [size or max(sizes) for size in sizes]
        self.scale = np.repeat(sizes, [n, len(self.start) - n])
