"""Errors of a run in every metric, and their floor by rounding."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators.errors import CannotMeasure

from ..systems.runs import energy_with_terms, relative_drifts, with_terms
from .contestants import Problem, States

UNIT = 2.0**-53


class Yardstick:
    """The scale for the states of a run: reference, energy, momenta.

    Errors in (x, μ), x and μ are ‖got − wanted‖₂ over ‖(x̂, μ̂)‖₂ at the same time; energy and
    momenta are relative to the sum of the absolute values of their terms. `floors` has, metric by
    metric, the error that remains when only the start is rounded to double precision.
    """

    def __init__(self, problem: Problem, equations: Any) -> None:
        self.problem, self.n = problem, len(problem.scheme.x)
        s = problem.scheme.s
        self.reference: np.ndarray | None = None
        self.floors: dict[str, float] = {}
        if problem.checkpoints:
            self.reference = reference_of(problem)
            self.floors |= self._rounded_start(equations)
        self.energy = energy_with_terms(problem.scheme, 16)
        exact = (q for q in problem.scene.symmetries if q.to_roundoff)
        kept = [q for q in exact if not (q.attitude or q.of_step)]
        self.momenta = [with_terms(problem.scheme, s.conserved(q), 16) for q in kept]
        for name in ("energy", "momentum") if kept else ("energy",):
            self.floors |= {name: UNIT, f"{name}-max": UNIT}

    def errors(self, states: States) -> dict[str, float]:
        """Return every metric that exists here, not finite where the run is not; and "growth".

        That is the power of time with which the largest energy error grows from half the run to all
        of it: 0 for a steady band, 1 for a drift.
        """
        metrics: dict[str, float] = {}
        if self.reference is not None and len(states.checkpoints):
            gap = states.checkpoints[:, self.problem.places]
            metrics |= self._against_reference(gap - self._reference_for(gap))
        path: Any = SimpleNamespace(x=states.path[:, : self.n], mu=states.path[:, self.n :])
        with np.errstate(all="ignore"):
            drifts = [("energy", relative_drifts(self.energy(path), 16))]
            if self.momenta:
                each = [relative_drifts(q(path), 16) for q in self.momenta]
                drifts.append(("momentum", np.max(each, axis=0)))
        for name, drift in drifts:
            metrics |= {name: float(drift[-1]), f"{name}-max": float(drift.max())}
        half = float(drifts[0][1][: len(path.x) // 2 + 1].max())
        metrics["growth"] = math.log2(metrics["energy-max"] / half) if half > 0 else 0.0
        return metrics

    def _reference_for(self, rows: np.ndarray) -> np.ndarray:
        """Return the reference at as many equal distances as there are rows."""
        assert self.reference is not None
        stride = len(self.reference) // len(rows)
        return self.reference[stride - 1 :: stride]

    def _against_reference(self, gap: np.ndarray) -> dict[str, float]:
        """Return metrics of differences in (x, μ) at the checkpoints, a row each."""
        size, n = np.linalg.norm(self._reference_for(gap), axis=1), self.problem.scheme.s.n
        parts = {"": gap, "-mu": gap[:, n:]} | ({"-x": gap[:, :n]} if n else {})
        metrics: dict[str, float] = {}
        for name, part in parts.items():
            errors = np.linalg.norm(part, axis=1) / size
            metrics |= {f"error{name}": float(errors[-1]), f"error{name}-max": float(errors.max())}
        return metrics

    def _rounded_start(self, equations: Any) -> dict[str, float]:
        """Return the growth of half a unit in each z₀, by the variational equation Ż = Df(z) Z."""
        from scipy.integrate import solve_ivp

        start = self.problem.start
        size = len(start)

        def field(t: float, y: np.ndarray) -> np.ndarray:
            z, tangent = y[:size], y[size:].reshape(size, size)
            return np.concatenate([equations.f(t, z), (equations.df(t, z) @ tangent).ravel()])

        times = [float(t) for t in self.problem.times]
        whole = np.concatenate([start, np.eye(size).ravel()])
        solution = solve_ivp(
            field, (0.0, times[-1]), whole, method="DOP853", rtol=1e-6, atol=1e-9, t_eval=times
        )
        if not solution.success:
            raise CannotMeasure(f"the variational equation was not solved: {solution.message}")
        tangents = solution.y[size:].T.reshape(-1, size, size)
        rounding = UNIT * np.abs(start)
        grown = np.linalg.norm(tangents * rounding, axis=2)
        floors = self._against_reference(grown[:, self.problem.places])
        # the result is rounded too
        return {name: max(value, UNIT) for name, value in floors.items()}


def reference_of(problem: Problem) -> np.ndarray:
    """Return certified (x, μ) at the checkpoints, rounded once, (k, n+m)."""
    solutions = reference.solutions(problem.scene, problem.times, digits=20, proof=False)
    worst = min(s.certain_digits for s in solutions)
    if worst < 17:
        raise CannotMeasure(f"the reference has {worst} certain digits where 17 are needed.")
    return np.array([[float(v) for v in (*s.x, *s.mu)] for s in solutions])
