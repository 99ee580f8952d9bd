"""Runs of a rule whose steps vary: the compiled driver, with the time in every row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...compiler import KernelsAtStep, Step
from ...equations import SceneSymbols, energy, legendre_inverse
from ...equations.legendre_inverse import LegendreInverse
from ...errors import SMALLER, BadInput, StepFailure, arguments_checked
from ...flows import FreeMotion, SceneRuns, Start
from ...geometry import StepContext
from ...numbers import (
    Arithmetic,
    Double,
    Number,
    Numbers,
    Vector,
    arithmetic,
    exact_rational,
    numeric,
    whole_number,
)
from ...numbers.types import Function, Given, Matrix
from ...runs import NotOneMap, Trajectory
from ...scene import Scene, remembered


@dataclass(frozen=True, eq=False)
class _Context(StepContext):
    """The context of a step that varies: its failures give the physical time."""

    varied: Any = None

    def failure(
        self, cause: str, state: dict[str, Numbers], index: int = 0,
        trajectory: Trajectory | None = None, fix: str = SMALLER,
        look: Callable[[], tuple[str, str]] | None = None,
    ) -> StepFailure:  # fmt: skip
        """Return a failure with the time of the state, and σ where it is not positive there."""
        n, x = len(self.equations.x), state["x"]
        where = {**state, "x": x[:n]}
        p = [self.numbers.number(e) for e in self.scene.parameter_values]
        try:
            sigma, grows = self.varied.control(self.numbers)(x[:n], state["mu"], p)
        except (ArithmeticError, ValueError):
            sigma = grows = self.numbers.number(0)
        if not sigma > 0:
            cause = f"sigma is {float(sigma):.3g}, not positive,"
            fix = "give a sigma that stays positive, or take a smaller step"
        elif self.varied.controlled and not (zeta := x[n + 1] + self.h * grows) > 0:
            cause = f"the step density becomes {float(zeta):.3g}, not positive,"
            fix = "take a smaller step, or a sigma that changes more slowly"
        shown = {name: self.numbers.public(value) for name, value in where.items()}
        names = self.varied.scene.name, self.varied.rule.name
        return StepFailure(*names, index, float(x[n]), shown, cause, trajectory, fix)


class VariedFlow(NotOneMap, SceneRuns):
    """The steps of a rule that vary, of the size `step` in the time τ.

    digits = 16 is compiled double precision; more gives mpmath numbers. A negative step runs back,
    and undoes a step of a self-adjoint base in the way "reversible". Raises `BadInput` as `Flow`
    does.
    """

    #: the step density and E₀ of the start, if they are given
    density0: Given = None
    energy0: Given = None

    def __init__(self, varied: Any, step: Given, digits: int = 16) -> None:
        inner = varied.inner
        super().__init__(inner, step, digits, "refuse", inner.flow_substeps)
        self.scheme = self.varied = varied
        plain = self.context
        self.context = _Context(
            plain.scheme, plain.numbers, plain.step, plain.substeps, varied=varied
        )
        self.parts = self.context.parts

    @property
    def why_not_one_map(self) -> str:
        """Why no form is measured on a step."""
        return (
            f"{self.varied.rule.name} has steps that vary, and a step is no function of one arrow "
            "and one step size, on which forms and derivatives are measured; take trajectory, or "
            f"the flow of Scheme(scene, {self.varied.rule.base.name})."
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return VariedFlow, (self.varied, self.step, self.digits)

    @property
    def system(self) -> Step:
        """Return one step as the data that is compiled."""
        made: Step = self.varied.system
        return made

    @cached_property
    def machine(self) -> KernelsAtStep:
        """Return the compiled kernels at this step; only the first substep changes the density."""
        name = f"{self.varied.scene.name} with {self.varied.rule.name}"
        kinds = [int(part.equations is not self.context.equations) for part in self.parts]
        qs = [list(part.q) for part in self.parts]
        if not self.varied.by_poincare:
            with self.numbers.working():
                if len(kinds) > 1 and not any(kinds):
                    kinds[0] = 1  # the first substep
                first = self.step if self.varied.rule.way == "reversible" else 1
                for k, q in enumerate(qs):
                    q.append(self.numbers.number(0 if k else first))
        return KernelsAtStep(self._kernels, self.numbers, qs, kinds, name)

    @property
    def _collocation(self) -> tuple[None, str]:
        return None, "its steps vary"

    @arguments_checked
    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        density0: Given = None,
        energy0: Given = None,
        **arguments: Any,
    ) -> Trajectory:
        """Run `steps` steps from the scene's start (or from x0, mu0), with every `every`-th state a
        row.

        It works as `Flow.trajectory` does, with the same arguments, and t of the rows is the
        physical time. To continue a run, or to run it back, give what it has beside (x, μ):
        density0, the step density of a row, by "reversible" (default: 1/σ at the start), or
        energy0, E₀, by "poincare" (default: the energy of the start). Raises `StepFailure`, with
        the time and the rows so far, if a step cannot be made or σ is not positive.
        """
        varied = self.varied
        for word, value, wanted in (
            ("density0", density0, varied.controlled), ("energy0", energy0, varied.by_poincare),
        ):  # fmt: skip
            if value is not None and not wanted:
                raise BadInput(f"{varied.rule.name} has no {word[:-1]} of its own: leave it out.")
        flow = self
        if not density0 is energy0 is None:
            flow = object.__new__(VariedFlow)
            vars(flow).update(vars(self), edge=self.edge, density0=density0, energy0=energy0)
        return SceneRuns.trajectory(flow, steps, every, **arguments)

    def stepper(self, start: Start) -> _VariedMotion:
        flow, own = self, start is self.starting.own and self.energy0 is None
        if self.varied.by_poincare and not own:
            E = self._energy_of(start) if self.energy0 is None else self.energy0
            flow = VariedFlow(self.varied.with_energy(E), self.step, self.digits)
        more = flow._more(start, self.density0)
        return _VariedMotion(flow, start._replace(x=np.concatenate([start.x, more])))

    def until(self, time: Given, every: int = 1, most: int = 10**7, **start: Any) -> Trajectory:
        """Run to the first row whose physical time is `time` or more, with a positive step.

        start: as for `trajectory`. The number of steps is found from runs that end before. Raises
        `BadInput` for a time that is not after the start, and if `most` steps do not reach it, as
        where σ goes to 0.
        """
        wanted, t0 = float(exact_rational(time, "time")), float(start.get("t0", 0))
        if not wanted > t0 or self.step < 0:
            raise BadInput(f"{self.varied.scene.name}: give a time after {t0:g}, and a step > 0.")
        every, steps = whole_number("every", every, 1), 64
        while True:
            run = self.trajectory(-(-steps // every) * every, every, **start)
            reached = np.flatnonzero(run.t >= wanted)
            if len(reached):
                return _part(run, int(reached[0]) + 1, every)
            if run.steps >= most:
                raise BadInput(
                    f"{self.varied.scene.name} with {self.varied.rule.name}: {run.steps} steps end "
                    f"at t = {float(run.t[-1]):.6g}, before {wanted:g}: take a larger step, "
                    "another sigma, or more steps, until(time, most=...)."
                )
            passed = float(run.t[-1]) - t0
            share = (wanted - t0) / passed if passed > 0 else 16
            steps = min(int(run.steps * min(max(1.1, 1.02 * share), 16)) + every, most)

    def _more(self, start: Start, density0: Given) -> Vector:
        """Return the entries of the time and of the density behind x at a run's start."""
        numbers, t0 = self.numbers, self.numbers.number(start.t0)
        sigma, grows = self._control(start.x[None], start.mu[None])
        if not sigma[0] > 0:
            at = np.concatenate([start.x, [t0, numbers.number(1)]])
            raise self.context.failure("", {"x": at, "mu": start.mu})
        zeta = 1 / sigma[0] if density0 is None else numbers.number(density0, "density0")
        # a step takes the density half a step behind: ζ_{n−1/2}
        more = [t0, zeta - self._half * grows[0]][: 1 if self.varied.by_poincare else 2]
        return np.array(more, dtype=numbers.dtype)

    @property
    def _half(self) -> Number:
        """ε/2, in the flow's numbers."""
        return self.numbers.number(self.step / 2)

    def _control(self, x: Matrix, mu: Matrix) -> tuple[Vector, ...]:
        """Return σ and G of rows (r, n) and (r, m)."""
        numbers, f = self.numbers, self.varied.control(self.numbers)
        p = [numbers.number(e) for e in self.context.scene.parameter_values]
        if isinstance(numbers, Double):
            with np.errstate(all="ignore"):
                sigma, grows = f(x.T, mu.T, p)
        else:
            rows = [f(*at, p) for at in zip(x, mu, strict=True)]
            sigma, grows = zip(*rows, strict=True)
        kind = numbers.dtype
        return tuple(np.broadcast_to(np.array(e, kind), len(x)) for e in (sigma, grows))

    def with_time(self, run: Trajectory, judged: bool) -> Trajectory:
        """Return the rows with the time and the density as their own fields.

        judged: True if σ and the density have to be positive in all rows.
        """
        numbers, n = self.numbers, len(self.varied.inner.s.x)
        base, t = run.base[:, :n], run.base[:, n]
        x, mu = numbers.own(run.base), numbers.own(run.mu)
        sigma, grows = self._control(x[:, :n], mu)
        zeta = x[:, n + 1] + self._half * grows if self.varied.controlled else sigma
        positive = (sigma > 0) & (zeta > 0)
        if judged and not positive.all():
            k = int(np.argmin(positive))
            every = run.steps // max(1, len(t) - 1)
            raise self.context.failure("", {"x": x[k], "mu": mu[k]}, k * every)
        density = numbers.public(zeta if self.varied.controlled else 1 / sigma)
        return replace(run, t=t, base=base, scheme=self.varied, density=density)

    def _energy_of(self, start: Start) -> Number:
        """Return H at a start, which is rounded already, to twice the digits."""
        numbers, scene = arithmetic(2 * self.digits), self.varied.scene
        f, inverse = _energy(scene, numbers)
        with numbers.working():
            x, mu, near, p = map(numbers.own, (start.x, start.mu, scene.v0, scene.parameter_values))
            (xi,) = inverse(x[None], mu[None], list(p), near[None])
            return numbers.public([f(x, xi, mu, list(p))])[0]


class _VariedMotion(FreeMotion):
    """A run with steps that vary."""

    def __init__(self, flow: VariedFlow, start: Start) -> None:
        super().__init__(flow.edge, start)
        self.flow = flow

    def rows_of(self, count: int) -> Trajectory:
        at_end = self.ended and count == self.whole
        return self.flow.with_time(super().rows_of(count), judged=at_end)


@remembered(maxsize=16)
def _energy(scene: Scene, numbers: Arithmetic) -> tuple[Function, LegendreInverse]:
    """Return H(x, ξ, μ, parameters), and ξ(x, μ) by rows."""
    s = SceneSymbols(scene)
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return numeric(letters, [energy(s)], numbers), legendre_inverse(s, numbers)


def _part(run: Trajectory, count: int, every: int) -> Trajectory:
    """Return the first rows of a run."""
    words = ("t", "x", "u", "mu", "base", "iterations", "translates", "multipliers", "density")
    rows = {name: getattr(run, name)[:count] for name in words}
    return replace(run, **rows, steps=(count - 1) * every)
