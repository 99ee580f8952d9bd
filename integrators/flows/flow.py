"""A scheme at one step size and one precision: steps, trajectories and defects."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..bisections.edge_policies import ON_EDGE, Refuse, policy
from ..compiler import Kernels, System, compile
from ..compiler.kernels_at_step import KernelsAtStep
from ..equations.checks import check_momentum
from ..equations.discrete_equations import DiscreteEquations
from ..equations.step_system import step_system
from ..errors import BadInput
from ..geometry.local_geometry import LocalGeometry, frobenius, relative_defect
from ..numbers.arithmetic import arithmetic
from ..numbers.exact import exact_rational
from .initial_state import Start, Starting
from .newton_step import Step, arrow_before, maps_at, step_from
from .run import Trajectory, element_of, first_u, run_from

if TYPE_CHECKING:
    from ..bisections.bisecting import Solution

__all__ = ["Flow", "Trajectory"]

TINIEST = Fraction(1, 10**100)  # steps whose squares and inverses are far from over- and underflow


class Flow:
    """The one-step maps of a scheme: (x, μ) ↦ (b, μ′) on the dual, Ψ: (x, u) ↦ (y, v) on G.

    step: a non-zero number (exact: a float is its binary value; "0.1" is one tenth); a negative
    step runs Φ₋ₕ, which is the inverse only of a self-adjoint rule. digits = 16 is compiled double
    precision; more gives mpmath numbers. on_edge: what is done where a step reaches the edge of
    its chart, "refuse", "bisect" or "shrink" (`bisections.edge_policies`). Raises `BadInput` for a
    step of 0 or a non-finite one, and another on_edge.
    """

    #: savings that the kernels do not make (`savings.SAVINGS`), so that they can be measured
    without: frozenset[str] = frozenset()

    def __init__(
        self, scheme: DiscreteEquations, step: Any, digits: int = 16, on_edge: str = "refuse"
    ) -> None:
        self.scheme, self.digits, self.on_edge = scheme, digits, on_edge
        self.step = exact_rational(step, "step")
        if on_edge not in ON_EDGE:
            choices = ", ".join(map(repr, ON_EDGE))
            raise BadInput(f"on_edge is {on_edge!r}: give one of {choices}.")
        if self.step == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        if not TINIEST <= abs(self.step) <= 1 / TINIEST:
            raise BadInput("the step is beyond 1e-100 or 1e100: choose units that fit the motion.")
        self.numbers = arithmetic(digits)
        with self.numbers.working():
            self._q = scheme.s.q_values(self.step, self.numbers)
            self._h = self._q[0]
        #: the flows whose steps one after another are a step of this one: of one rule, itself
        self.parts: list[Flow] = [self]
        #: of each part, 0 for the rule and 1 for its adjoint
        self.kinds = [0]

    # -- runs -----------------------------------------------------------------------------------

    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Any = None,
        mu0: Any = None,
        u0: Any = None,
        element0: Any = None,
        progress: Callable[[int], None] | None = None,
    ) -> Trajectory:
        """Run `steps` steps from the scene's start (or from x0, mu0), keeping each every-th row.

        Memory grows with the rows kept, not with the steps. u0 is only the first guess of Newton.
        Where L_d is given on the group, element0 (N×N) may be the first step g instead: μ0 = F⁻/h.
        `progress` is called with the steps done so far. Raises `StepFailure` (with the rows so far)
        if a step cannot be solved, `BadInput` for wrong shapes or counts, and for a start that
        violates a constraint of the scene.
        """
        if not _is_whole(steps) or steps < 0:
            raise BadInput(f"steps is {steps!r}: give a whole number from 0.")
        if not _is_whole(every) or every < 1:
            raise BadInput(f"every is {every!r}: give a whole number from 1.")
        with self.numbers.working():
            start = self.starting.at(x0, mu0, u0, element0)
            if mu0 is not None:
                check_momentum(self.scheme, start.x, start.mu)
            return run_from(self, start, int(steps), int(every), progress)

    def elements(self, run: Trajectory) -> np.ndarray:
        """The group elements g = τ(hu) B of a run's rows, (r, N, N); in Cayley's chart only.

        Raises `BadInput` for other charts and for a run of another flow.
        """
        if run.step != self.step or run.u.shape[1:] != (len(self.scheme.u),):
            raise BadInput(
                f"{self.scheme.scene.name}: that run is of another flow; ask the flow that made it."
            )
        with self.numbers.working():
            found = [element_of(self, run, row) for row in range(len(run.u))]
            return self.numbers.public(np.array(found))

    def evolve(self, x: Any, u: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ψ: the (y, v) with y = b(x, u) and F⁻(y, v) = F⁺(x, u) (paper, section 2.4)."""
        with self.numbers.working():
            x, u = self._vectors(x, u)
            y, v = self._evolve(maps_at(self, x, u), x, u)
            return self.numbers.public(y), self.numbers.public(v)

    def devolve(self, y: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ψ⁻¹: the (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v), by Newton in (x, u).

        Raises `StepFailure` if Newton does not converge.
        """
        with self.numbers.working():
            y, v = self._vectors(y, v)
            x, u = arrow_before(self, y, v)
            return self.numbers.public(x), self.numbers.public(u)

    def dual_step(self, x: Any, mu: Any) -> tuple[np.ndarray, np.ndarray]:
        """(x, μ) ↦ (b, μ′) on the dual algebroid, with u from F⁻(x, u) = hμ."""
        with self.numbers.working():
            run = run_from(self, self.starting.at(x, mu), 1)
            return run.x[-1], run.mu[-1]

    def inverse_legendre(self, x: Any, mu: Any) -> np.ndarray:
        """A u with F⁻(x, u) = hμ: where F⁻ folds, the one that Newton reaches from v0."""
        with self.numbers.working():
            return self.numbers.public(first_u(self, self.starting.at(x, mu)))

    def solutions(self, x: Any, mu: Any) -> list[Solution]:
        """The elements g with F⁻(x, g) = hμ that Newton finds through the cover (section 4.3).

        Several where F⁻ folds; each with its translate, u, and the number of its branch. Raises
        `BadInput` unless on_edge is "bisect".
        """
        from ..bisections.bisecting import Bisect

        if not isinstance(self.edge, Bisect):
            raise BadInput('solutions are searched through a cover: take on_edge="bisect".')
        with self.numbers.working():
            x, mu = self._vectors(x, mu)
            found = self.edge.solutions(x, mu, [], more=True)
            return [s.as_public(self.numbers) for s in found]

    # -- defects --------------------------------------------------------------------------------

    def pullback_defect(self, x: Any, u: Any) -> Any:
        """‖PΨᵀ Ω PΨ − Ω‖ / (‖PΨ‖²‖Ω‖) at (x, u) (design of the symplecticity study)."""
        with self.numbers.working():
            x, u = self._vectors(x, u)
            here = maps_at(self, x, u)
            there = maps_at(self, *self._evolve(here, x, u))
            return self._pullback(here, there, self.geometry.tangent(here, there))

    def _pullback(self, here: Any, there: Any, tangent: np.ndarray) -> Any:
        p = self.geometry.prolongation(here, there, tangent)
        before, after = self.geometry.omega(here), self.geometry.omega(there)
        return self._number(relative_defect(p.T @ after @ p, before, p))

    def poisson_defect(self, x: Any, mu: Any, *, u0: Any = None, bracket_sign: int = 1) -> Any:
        """‖M Π Mᵀ − Π′‖ / (‖M‖²‖Π′‖) at (x, μ): M the derivative of the dual step.

        u0: where Newton starts; a run's own u is needed near a chart's edge (default: v0).
        bracket_sign = −1 flips the bracket of Π: a control, seen where there is a base and a group.
        """
        with self.numbers.working():
            x, mu = self._vectors(x, mu)
            return self._poisson(x, mu, step_from(self, x, mu, self._guess(u0)), bracket_sign)

    def _poisson(self, x: Any, mu: Any, step: Step, bracket_sign: int = 1) -> Any:
        after_x, after_mu, m = step
        before = self.geometry.poisson_tensor(x, mu, bracket_sign)
        after = self.geometry.poisson_tensor(after_x, after_mu, bracket_sign)
        return self._number(relative_defect(m @ before @ m.T, after, m))

    def step_defect(self, x: Any, mu: Any, after_x: Any, after_mu: Any, *, u0: Any = None) -> Any:
        """How far a step (x, μ) ↦ (after_x, after_mu) is from the discrete equations.

        ‖(x′, μ′) − (after_x, after_mu)‖ / (‖M‖ ‖(x, μ)‖) where (x′, μ′) is computed by the Legendre
        maps themselves and M is its derivative: no kernel has a part in it.
        """
        with self.numbers.working():
            (x, mu), taken = self._vectors(x, mu), self._vectors(after_x, after_mu)
            *wanted, m = step_from(self, x, mu, self._guess(u0))
            gap = np.concatenate(wanted) - np.concatenate(taken)
            size = frobenius(np.concatenate([x, mu])) + frobenius(np.concatenate(wanted))
            return self._number(frobenius(gap) / (frobenius(m) * size) if size else frobenius(gap))

    def tangent(self, x: Any, u: Any) -> np.ndarray:
        """TΨ at (x, u), (n+m)×(n+m)."""
        with self.numbers.working():
            x, u = self._vectors(x, u)
            here = maps_at(self, x, u)
            there = maps_at(self, *self._evolve(here, x, u))
            return self.numbers.public(self.geometry.tangent(here, there))

    # -- inner ----------------------------------------------------------------------------------

    @cached_property
    def _system(self) -> System:
        return step_system(self.scheme.origin)

    @cached_property
    def _kernels(self) -> Kernels:
        return compile(self._system, self.numbers, self.without)

    @cached_property
    def starting(self) -> Starting:
        """Where runs begin."""
        return Starting(self)

    @cached_property
    def machine(self) -> KernelsAtStep:
        """The compiled kernels at this step, and what they work on."""
        name = f"{self.scheme.scene.name} with {self.scheme.rule.name}"
        qs = [part._q for part in self.parts]
        return KernelsAtStep(self._kernels, self.numbers, qs, self.kinds, name)

    @cached_property
    def edge(self) -> Refuse:
        """What is done where a step reaches the edge of its chart."""
        return policy(self, self.on_edge)

    @cached_property
    def geometry(self) -> LocalGeometry:
        """The scheme's maps and derivatives as numbers at this step."""
        return LocalGeometry(self.scheme, self.numbers, self._q)

    def geometry_in(self, translate: int) -> LocalGeometry:
        """The same in the chart of another translate."""
        if translate == 0:
            return self.geometry
        q = self.machine.q_of(self.edge.chart.translates[translate])
        return LocalGeometry(self.scheme, self.numbers, q)

    def _number(self, value: Any) -> Any:
        return self.numbers.public([value])[0]

    def _vectors(self, *vectors: Any) -> list[np.ndarray]:
        return self.starting.rounded(*vectors)

    def _guess(self, u0: Any) -> np.ndarray:
        scene = self.scheme.scene
        return self._vectors(scene.x0, scene.v0 if u0 is None else u0)[1]

    def _evolve(self, here: dict[str, Any], x: Any, u: Any) -> tuple[np.ndarray, np.ndarray]:
        y, branch = here["target"], None
        if self.scheme.element is not None:
            branch = self.geometry.branch(x, u)
        return y, first_u(self, Start(y, here["plus"] / self._h, u), branch)


def _is_whole(value: Any) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)
