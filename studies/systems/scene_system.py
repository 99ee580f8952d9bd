"""A scene with a rule, a one-step map, or another program's integrator."""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators.flows import restricted_form_defect
from discmech.integrators.numbers import mpmath

from ..core.case import Progress
from .constraint_work import constraints_work
from .runs import energy_errors, energy_with_terms, gap, long_run, usual_steps
from .system import End, System


class SceneSystem(System):
    """A scheme of a scene; see `System`."""

    def steps_for(self, step: Any) -> int:
        """Return the number of steps of that size in the scene's duration."""
        return self.case.scene.steps_for(step)

    def end(self, time: Any, digits: int) -> End:
        """Return the end by a certified reference."""
        scene = self.scheme.scene  # with the start of recorded runs
        solution = reference.solution(scene, time, digits=digits)
        certain = solution.certain_digits
        agreed = certain if self.case.scene.in_numbers else None
        return End(solution.x, solution.mu, certain, answer=solution, agreed=agreed)

    def error(self, x: Any, mu: Any, end: Any) -> tuple[float, float | None, float | None]:
        """Return ‖(x, μ) − (x̂, μ̂)‖₂ / ‖(x̂, μ̂)‖₂ and its parts, computed in mpmath."""
        dx, of_x = gap(x, end.x)
        dmu, of_mu = gap(mu, end.mu)
        size = mpmath.sqrt(of_x**2 + of_mu**2) or 1  # at rest at 0 errors are not relative
        of_base = float(dx / size) if len(end.x) else None
        return float(mpmath.sqrt(dx**2 + dmu**2) / size), of_base, float(dmu / size)

    def single_steps(self) -> Any:
        """Return the scheme itself.

        None for a control, which is judged by being caught, and for a map of one step, whose motion
        need not be the scene's.
        """
        judged = self.case.control is None and self.case.rule.follows_motion
        return self.scheme if judged else None

    def usual_steps(self, claimed: bool = True) -> int:
        """Return a million steps, or as many as a program makes soon."""
        return usual_steps(self.case, claimed)

    def long_run(self, steps: int, progress: Progress) -> Any:
        """Return the rows of `runs.long_run`."""
        return long_run(self.case, self.scheme, steps, progress)

    @property
    def energy_changes(self) -> bool:
        """By a force, constraints, in time and at impacts; a discrete Lagrangian alone has none."""
        scene = self.case.scene
        changed = scene.force is not None or scene.timed or super().energy_changes
        changed = changed or constraints_work(self.scheme.s)
        return changed or not scene.is_continuous

    def energy(self, run: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the energy and its terms by `runs.energy_with_terms`."""
        values, terms = energy_with_terms(self.scheme, self.case.digits)(run)
        return values[:, 0], terms[:, 0]

    def energy_errors(self, run: Any) -> np.ndarray:
        """Return errors relative to the energy that moves."""
        return energy_errors(self.scheme, run, self.case.digits)

    def form_defect(self, flow: Any, x: Any, mu: Any, u: Any = None, seed: int = 0) -> float | None:
        """Return the defect of the form on the dual.

        Under constraints it is that on the states they leave free, None over substeps.
        """
        if not self.case.scene.all_constraints:
            return float(flow.poisson_defect(x, mu, u0=u))
        return None if self.scheme.substeps else float(restricted_form_defect(flow, x, mu, u))

    def step_defects(
        self, flow: Any, x: Any, mu: Any, taken: Any = None, u: Any = None
    ) -> dict[str, float | None]:
        """Return the defect of the step that the run has taken in the equations of the rule."""
        return {"residual": float(flow.step_defect(x, mu, *taken, u0=u))}
