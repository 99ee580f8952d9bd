"""diffrax: Runge–Kutta methods compiled by JAX, in double precision (Kidger 2021).

Its adaptive methods are Tsit5, which its documentation recommends in general, and Dopri8, which it
recommends for accuracy; its symplectic one is the semi-implicit Euler method with constant steps,
for equations ẋ = f(μ), μ̇ = g(x).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from discmech.integrators.numbers import sympy

from ..contestants import MOST_ROWS, Contestant, NoEnd, Problem, States

TOLERANCES = [10.0**-k for k in range(3, 14)]
MOST_STEPS = 2**31 - 1  # limit of its counter


def _bound(steps: int) -> int:
    """Return a power of four above a number of steps: each is compiled, so they are few."""
    bound = 4
    while bound <= steps:
        bound *= 4
    return bound


class DiffraxContestant(Contestant):
    """diffeqsolve under jit, with the setting as an argument; the settings are tolerances."""

    settings = TOLERANCES
    fastest = 2e-7  # least seconds of a step: it limits the number that the patience allows

    def __init__(self, name: str, problem: Problem, equations: Any) -> None:
        import jax

        jax.config.update("jax_enable_x64", True)
        import diffrax
        import jax.numpy as jnp

        self.name, self.problem = name, problem
        self.most_steps = int(min(problem.patience / self.fastest, MOST_STEPS))
        self.start = self.begun(None, problem.start)
        self.terms = self._terms(equations)

        def run(setting: Any, start: Any, saved: Any, most: int) -> Any:
            solution = diffrax.diffeqsolve(
                self.terms, y0=start, t0=0.0, t1=float(problem.duration), saveat=saved,
                max_steps=most, throw=False, **self._method(setting),
            )  # fmt: skip
            done = solution.result == diffrax.RESULTS.successful
            return solution.ys, solution.stats["num_steps"], done

        def end(setting: Any, start: Any) -> Any:
            return run(setting, start, diffrax.SaveAt(t1=True), self.most_steps)

        def look(setting: Any, start: Any, bound: int) -> Any:
            own = diffrax.SubSaveAt(t0=True, steps=max(1, bound // MOST_ROWS))
            times = [float(t) for t in problem.times] if problem.checkpoints else [0.0]
            saved = diffrax.SaveAt(subs=[own, diffrax.SubSaveAt(ts=jnp.asarray(times))])
            return run(setting, start, saved, bound)[0]

        self.end = jax.jit(end)
        self.look = jax.jit(look, static_argnums=2)
        begun = time.perf_counter()
        self.solve(next(self.ladder()), self.start)
        self.setup = time.perf_counter() - begun

    def begun(self, made: Any, start: np.ndarray) -> Any:
        """Return (x, μ) in the shape that the method takes."""
        import jax.numpy as jnp

        return jnp.asarray(start)

    def _terms(self, equations: Any) -> Any:
        import diffrax

        function = _compiled([equations.states], equations.field)
        return diffrax.ODETerm(lambda t, z, args: function(z))

    def _method(self, tolerance: Any) -> dict[str, Any]:
        """Return the solver and its steps."""
        import diffrax

        controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)
        solver = diffrax.Tsit5() if self.name.endswith("tsit5") else diffrax.Dopri8()
        return {"solver": solver, "dt0": None, "stepsize_controller": controller}

    def solve(self, setting: Any, start: Any) -> Any:
        """Return one compiled solve; JAX returns at once, so the result is waited for."""
        import jax

        return jax.block_until_ready(self.end(setting, start)[0])

    def states(self, setting: Any) -> States:
        """Return its own steps; at earlier checkpoints its dense output, as a user gets."""
        last, steps, fine = self.end(setting, self.start)
        if not bool(fine):
            raise NoEnd(self.name, f" ({self.most_steps} steps)")
        own, dense = self.look(setting, self.start, _bound(int(steps)))
        path, end = _joined(own), _joined(last)[-1:]
        path = np.vstack([path[np.isfinite(path).all(axis=1)], end])  # unfilled rows are ∞
        checkpoints = path[:0]
        if self.problem.checkpoints:
            checkpoints = _joined(dense)
            checkpoints[-1] = end
        return States(checkpoints, path, int(steps))


class SymplecticContestant(DiffraxContestant):
    """SemiImplicitEuler: x by the old μ, then μ by the new x; the settings are numbers of steps."""

    fastest = 1e-8

    def begun(self, made: Any, start: np.ndarray) -> Any:
        """Return x and μ."""
        n = len(self.problem.scheme.x)
        return super().begun(made, start[:n]), super().begun(made, start[n:])

    def _terms(self, equations: Any) -> Any:
        import diffrax

        n = len(self.problem.scheme.x)
        x, mu = equations.states[:n], equations.states[n:]
        speed, force = _compiled([mu], equations.field[:n]), _compiled([x], equations.field[n:])
        return (
            diffrax.ODETerm(lambda t, mu, args: speed(mu)),
            diffrax.ODETerm(lambda t, x, args: force(x)),
        )

    def _method(self, steps: Any) -> dict[str, Any]:
        import diffrax

        return {"solver": diffrax.SemiImplicitEuler(), "dt0": float(self.problem.duration) / steps}

    def ladder(self) -> Iterator[int]:
        """Yield the steps of the scene, doubled repeatedly while diffrax can count them."""
        first = max(1, math.floor(self.problem.duration / self.problem.scene.step))
        return (first * 2**k for k in range(40) if first * 2**k <= MOST_STEPS)


def _joined(states: Any) -> np.ndarray:
    """Return rows (x, μ), given whole or in two parts."""
    parts = states if isinstance(states, tuple) else [states]
    return np.hstack([np.array(part) for part in parts])


def _compiled(arguments: list[Any], entries: Any) -> Any:
    """Return a function of one array for JAX."""
    import jax.numpy as jnp

    function = sympy.lambdify(arguments, list(entries), "jax", cse=True)
    return lambda z: jnp.stack([*map(jnp.asarray, function(z))])
