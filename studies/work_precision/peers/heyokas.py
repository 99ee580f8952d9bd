"""heyoka: Taylor's method of a high order, compiled for each system (Biscani, Izzo 2021)."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import sympy

from ..contestants import MOST_ROWS, Contestant, NoEnd, Problem, States

TOLERANCES = [10.0**-k for k in range(3, 16, 2)] + [2.0**-52]  # the last is its own default
#: below round-off and with compensated sums, as its documentation advises for long runs, so that
#: the energy's error is a random walk (Brouwer's law)
BROUWER = 1e-18
MANY = 10_000  # steps between two checks of the clock


def _expression(e: Any) -> Any:
    """Return heyoka's expression for sympy's, with whole powers above the square as products.

    Its own power of an x that is 0 is not finite from the third on (fpu at rest).
    """
    import heyoka

    known: dict[Any, Any] = {}
    powers = [p for p in e.atoms(sympy.Pow) if p.exp.is_Integer and p.exp > 2]
    for power in sorted(powers, key=lambda p: (p.count_ops(), sympy.default_sort_key(p))):
        base = heyoka.from_sympy(power.base, known)
        product = base
        for _ in range(int(power.exp) - 1):
            product = product * base
        known[power] = product
    return heyoka.from_sympy(e, known)


class HeyokaContestant(Contestant):
    """taylor_adaptive, compiled once per tolerance; the settings are tolerances."""

    what = "tol"

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        import heyoka

        self.name, self.problem, self.start = name, problem, problem.start
        self.end = float(problem.duration)
        #: in a race without checkpoints also below round-off
        self.settings = TOLERANCES if problem.checkpoints else [*TOLERANCES, BROUWER]
        variables = heyoka.make_vars(*map(str, equations.states))
        if len(equations.states) == 1:
            variables = [variables]
        self.system = [(v, _expression(e)) for v, e in zip(variables, equations.field, strict=True)]

    def told(self, setting: float) -> dict[str, Any]:
        """Return the tolerance for a row of the result."""
        told = super().told(setting)
        sums = ", compensated" if setting == BROUWER else ""
        return {**told, "setting": told["setting"] + sums}

    def made(self, tolerance: float) -> Any:
        """Return the integrator, compiled for that tolerance; it is used repeatedly."""
        import heyoka

        begun, exact = time.perf_counter(), tolerance == BROUWER
        made = heyoka.taylor_adaptive(
            self.system, self.start.tolist(), tol=tolerance, high_accuracy=exact
        )
        self.setup += time.perf_counter() - begun
        return made

    def _rewound(self, integrator: Any, start: Any = None) -> Any:
        integrator.time = 0.0
        integrator.state[:] = self.start if start is None else start
        return integrator

    def solve(self, integrator: Any, start: np.ndarray) -> Any:
        """Run propagate_until from the start."""
        return self._rewound(integrator, start).propagate_until(self.end)

    def _watched(self, integrator: Any) -> int:
        """Do the same run within the patience; return its number of steps."""
        begun, steps = time.process_time(), 0
        self._rewound(integrator)
        while True:
            outcome, _, _, more, *_ = integrator.propagate_until(self.end, max_steps=MANY)
            steps += more
            if "time_limit" in str(outcome):
                return steps
            if "step_limit" not in str(outcome):
                raise CannotMeasure(f"heyoka: stopped with {outcome}")
            if time.process_time() - begun > self.problem.patience:
                raise NoEnd("heyoka")

    def states(self, integrator: Any) -> States:
        """Return states on a grid, by its steps' Taylor polynomials, as accurate as the steps."""
        steps = self._watched(integrator)
        last = integrator.state.copy()
        parts = max(1, self.problem.checkpoints)
        inside = max(1, min(4 * steps, MOST_ROWS) // parts)
        grid = np.linspace(0.0, self.end, parts * inside + 1)
        path = np.array(self._rewound(integrator).propagate_grid(grid)[-1])
        path[-1] = last
        return States.along(self.problem, path, steps)
