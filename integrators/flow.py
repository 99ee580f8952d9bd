"""A scheme at one step size and one precision: steps, trajectories and defects."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import edges
from .arithmetic import arithmetic
from .charts import GroupChart
from .checks import check_momentum, check_start
from .compiling import load_kernels
from .continuous import initial_momentum
from .edges import Refuse, policy
from .equations import Scheme
from .errors import SMALLER, BadInput, StepFailure
from .exact import exact_rational
from .machine import Machine, Run
from .neighbourhoods import margin_of
from .singular import singular_direction
from .tangent import LocalGeometry, StagesNotFound, frobenius, newton, relative_defect

if TYPE_CHECKING:
    from .bisecting import Solution

_CAUSES = {
    **edges.CAUSES,
    1: "Newton did not converge",
    2: "FL is singular or the numbers are no longer finite",
}


@dataclass(frozen=True)
class Trajectory:
    """Rows of a run: the first is the start, then each every-th step.

    t (r,), x (r, n), u (r, m), mu (r, m): row k holds x_k, μ_k = F⁻/h in the natural basis, and the
    u that leaves x_k. iterations (r,): Newton corrections of that row's step. newton_mean and
    newton_max: over all steps, kept or not; newton_residual: size of the last correction.
    margin: the smallest of all steps in the charts of groups (`neighbourhoods.Position`; 1 where
    there is no edge; a lower bound for the exponential where it has no closed form). edges: how
    often the edge was met and mended; translates (r,): the number of the element B of the cover
    with g = τ(hu) B, 0 for e.
    """

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    mu: np.ndarray
    iterations: np.ndarray
    newton_mean: float
    newton_max: int
    newton_residual: float
    steps: int
    step: Fraction
    margin: float
    edges: int
    translates: np.ndarray


#: x, μ, and a guess of the first solution: (number of its translate, u)
Start = tuple[np.ndarray, np.ndarray, tuple[int, np.ndarray]]
TINIEST = Fraction(1, 10**100)  # steps whose squares and inverses are far from over- and underflow


class Flow:
    """The one-step maps of a scheme: (x, μ) ↦ (b, μ′) on the dual, Ψ: (x, u) ↦ (y, v) on G.

    step: a non-zero number (exact: a float is its binary value; "0.1" is one tenth); a negative
    step runs Φ₋ₕ, which is the inverse only of a self-adjoint rule. digits = 16 is compiled double
    precision; more gives mpmath numbers. on_edge: what is done where a step reaches the edge of its
    chart, "refuse", "bisect" or "shrink" (`integrators.edges`). Raises `BadInput` for a step of 0
    or a non-finite one, and another on_edge.
    """

    #: savings that the kernels do not make (`kernels.SAVINGS`), so that they can be measured
    without: frozenset[str] = frozenset()

    def __init__(
        self, scheme: Scheme, step: Any, digits: int = 16, on_edge: str = "refuse"
    ) -> None:
        self.scheme, self.digits, self.on_edge = scheme, digits, on_edge
        self.step = exact_rational(step, "step")
        if on_edge not in edges.ON_EDGE:
            choices = ", ".join(map(repr, edges.ON_EDGE))
            raise BadInput(f"on_edge is {on_edge!r}: give one of {choices}.")
        if self.step == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        if not TINIEST <= abs(self.step) <= 1 / TINIEST:
            raise BadInput("the step is beyond 1e-100 or 1e100: choose units that fit the motion.")
        self.numbers = arithmetic(digits)
        with self.numbers.working():
            self._q = scheme.s.q_values(self.step, self.numbers)
            self._h = self._q[0]

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
            start = self._start(x0, mu0, u0, element0)
            if mu0 is not None:
                check_momentum(self.scheme, *start[:2])
            return self._run(int(steps), int(every), *start, progress)

    def elements(self, run: Trajectory) -> np.ndarray:
        """The group elements g = τ(hu) B of a run's rows, (r, N, N); in Cayley's chart only.

        Raises `BadInput` for other charts and for a run of another flow.
        """
        if run.step != self.step or run.u.shape[1:] != (len(self.scheme.u),):
            raise BadInput(
                f"{self.scheme.scene.name}: that run is of another flow; ask the flow that made it."
            )
        with self.numbers.working():
            chart = self.edge.chart
            rows = zip(run.u, run.translates, strict=True)
            number = self.numbers.number
            found = [chart.element(self._h * np.array([number(e) for e in u]), B) for u, B in rows]
            return self.numbers.public(np.array(found))

    def evolve(self, x: Any, u: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ψ: the (y, v) with y = b(x, u) and F⁻(y, v) = F⁺(x, u) (paper, section 2.4)."""
        with self.numbers.working():
            x, u = self._vectors(x, u)
            y, v = self._evolve(self._arrow(x, u), x, u)
            return self.numbers.public(y), self.numbers.public(v)

    def devolve(self, y: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ψ⁻¹: the (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v), by Newton in (x, u).

        Raises `StepFailure` if Newton does not converge.
        """
        with self.numbers.working():
            y, v = self._vectors(y, v)
            wanted = np.concatenate([y, self._arrow(y, v)["minus"]])
            n = len(y)
            point = np.concatenate([y - self._arrow(y, v)["rho"] @ v, v])

            def change(point: np.ndarray) -> np.ndarray:
                here = self.geometry.at(point[:n], point[n:])
                matrix = np.vstack(
                    [
                        np.hstack([here["target_x"], here["target_u"]]),
                        np.hstack([here["plus_x"], here["plus_u"]]),
                    ]
                )
                gap = wanted - np.concatenate([here["target"], here["plus"]])
                found = np.asarray(self.numbers.solve(matrix, gap))
                if self.scheme.element is not None:
                    found[n:] = self._along_group(here["R"], found[n:], point[n:])
                return found

            found = newton(change, point, 0, self.numbers.eps)
            if found is not None:
                return self.numbers.public(found[:n]), self.numbers.public(found[n:])
            raise self._failure(0, {"y": y, "v": v}, "the inverse step was not found", None)

    def dual_step(self, x: Any, mu: Any) -> tuple[np.ndarray, np.ndarray]:
        """(x, μ) ↦ (b, μ′) on the dual algebroid, with u from F⁻(x, u) = hμ."""
        with self.numbers.working():
            run = self._run(1, 1, *self._start(x, mu, None), None)
            return run.x[-1], run.mu[-1]

    def inverse_legendre(self, x: Any, mu: Any) -> np.ndarray:
        """A u with F⁻(x, u) = hμ: where F⁻ folds, the one that Newton reaches from v0."""
        with self.numbers.working():
            return self.numbers.public(
                self._own_u(self._run(0, 1, *self._start(x, mu, None), None))
            )

    def solutions(self, x: Any, mu: Any) -> list[Solution]:
        """The elements g with F⁻(x, g) = hμ that Newton finds through the cover (section 4.3).

        Several where F⁻ folds; each with its translate, u, and the number of its branch. Raises
        `BadInput` unless on_edge is "bisect".
        """
        from .bisecting import Bisect

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
            here = self._arrow(x, u)
            there = self._arrow(*self._evolve(here, x, u))
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
            return self._poisson(x, mu, self._legendre_step(x, mu, u0), bracket_sign)

    def _poisson(self, x: Any, mu: Any, step: tuple[Any, Any, Any], bracket_sign: int = 1) -> Any:
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
            *wanted, m = self._legendre_step(x, mu, u0)
            gap = np.concatenate(wanted) - np.concatenate(taken)
            size = frobenius(np.concatenate([x, mu])) + frobenius(np.concatenate(wanted))
            return self._number(frobenius(gap) / (frobenius(m) * size) if size else frobenius(gap))

    def tangent(self, x: Any, u: Any) -> np.ndarray:
        """TΨ at (x, u), (n+m)×(n+m)."""
        with self.numbers.working():
            x, u = self._vectors(x, u)
            here = self._arrow(x, u)
            there = self._arrow(*self._evolve(here, x, u))
            return self.numbers.public(self.geometry.tangent(here, there))

    # -- inner ----------------------------------------------------------------------------------

    def _arrow(self, x: Any, u: Any) -> dict[str, np.ndarray]:
        """The scheme's maps and derivatives at (x, u); raises `StepFailure` without stages."""
        try:
            return self.geometry.at(x, u)
        except StagesNotFound:
            where = {"x": self.numbers.public(x), "u": self.numbers.public(u)}
            raise self._failure(0, where, "the internal stages were not found", None) from None
        except (ArithmeticError, ValueError):  # Python's own functions outside their domain
            where = {"x": self.numbers.public(x), "u": self.numbers.public(u)}
            raise self._failure(0, where, "L_d or a derivative of it is no number", None) from None

    @cached_property
    def _kernels(self) -> dict[str, Any]:
        return load_kernels(self.scheme.origin, self.numbers, self.without)

    @cached_property
    def machine(self) -> Machine:
        """The compiled kernels at this step, and what they work on."""
        return Machine(self)

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

    def _element(self, g: Any) -> np.ndarray:
        """An N×N matrix that lies in the group, to a thousand round-offs."""
        chart, scene = GroupChart(self.scheme.scene.groupoid, self.numbers), self.scheme.scene
        try:
            g = chart.array(g)
            J = chart.best(g)
            off = np.max(abs(chart.element(chart.coordinates(g, J), J) - g))
        except (TypeError, ValueError, IndexError, ZeroDivisionError):
            off = None
        if off is None or not off <= 2**20 * self.numbers.eps * (1 + np.max(abs(g))):
            raise BadInput(
                f"{scene.name}: element0 is no element of {scene.groupoid.name}; give an "
                f"{chart.size}×{chart.size} matrix of that group."
            )
        return g

    def _along_group(self, R: np.ndarray, du: np.ndarray, u: np.ndarray) -> np.ndarray:
        """The change of u that follows R⁻¹du in the group (as in `kernels`), m."""
        chart, h = GroupChart(self.scheme.scene.groupoid, self.numbers), self._h
        along = chart.element(h * self.numbers.solve(R, du))
        return np.asarray(chart.coordinates(along @ chart.element(h * u)) / h - u)

    @cached_property
    def _c(self) -> Any:
        return self._prepared(self._kernels["prepare"], self._q)

    def _prepared(self, prepare: Any, q: list[Any]) -> np.ndarray:
        """The coefficients of one step size."""
        try:
            return np.array(prepare(q), dtype=self.numbers.dtype)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            scheme = self.scheme
            raise BadInput(
                f"{scheme.scene.name} with {scheme.rule.name}: FL is singular or a coefficient is "
                f"not finite ({error}); every velocity needs its kinetic energy, and parameters "
                "their proper units."
            ) from None

    def _number(self, value: Any) -> Any:
        return self.numbers.public([value])[0]

    def _vectors(self, *vectors: Any) -> list[np.ndarray]:
        lengths = (len(self.scheme.x), len(self.scheme.u))
        out = []
        for vector, length in zip(vectors, lengths, strict=True):
            listed = isinstance(vector, Iterable) or hasattr(vector, "shape")
            if vector is not None and (isinstance(vector, str) or not listed):
                raise BadInput(
                    f"{self.scheme.scene.name}: {vector!r} was given where a list of {length} "
                    "numbers is needed."
                )
            entries = [] if vector is None else list(vector)
            if len(entries) != length:
                raise BadInput(
                    f"{self.scheme.scene.name}: a vector of {len(entries)} entries was given "
                    f"where {length} are needed."
                )
            out.append(
                np.array([self.numbers.number(e) for e in entries], dtype=self.numbers.dtype)
            )
        return out

    def _start(self, x0: Any, mu0: Any, u0: Any, element0: Any = None) -> Start:
        if element0 is not None:
            if mu0 is not None or u0 is not None:
                raise BadInput(
                    f"{self.scheme.scene.name}: element0 says what mu0 and u0 are; leave these out."
                )
            return self._start_at(element0, x0)
        if x0 is None and mu0 is None and u0 is None:
            return self._own_start
        return self._start_from(x0, mu0, u0)

    @cached_property
    def _own_start(self) -> Start:
        """The scene's start, rounded once for all runs of this flow."""
        return self._start_from(None, None, None)

    def _start_from(self, x0: Any, mu0: Any, u0: Any) -> Start:
        scene = self.scheme.scene
        guess = scene.v0 if u0 is None else u0
        if mu0 is None:
            if x0 is not None:
                scene = scene.with_values(x0=x0)
                check_start(self.scheme, scene)
            mu0 = initial_momentum(self.scheme, scene, self.numbers)
        x, guess = self._vectors(scene.x0 if x0 is None else x0, guess)
        _, mu = self._vectors(scene.x0, mu0)
        return x, mu, (0, guess)

    def _start_at(self, element: Any, x0: Any) -> Start:
        """(x, F⁻(x, g)/h, where g lies) of a first step g."""
        scheme = self.scheme
        if scheme.element is None:
            raise BadInput(
                f"{scheme.scene.name}: element0 is the first step of a discrete Lagrangian given "
                "on the group; give mu0 (and u0) instead."
            )
        g, (x, _) = self._element(element), self._vectors(x0 or scheme.scene.x0, scheme.scene.v0)
        translate, u = self.edge.place(g)
        mu = self.geometry_in(translate).at(x, u)["minus"] / self._h
        # where FL is singular at g, μ does not tell g apart, and the run would begin elsewhere
        solved = self.machine.solve(x, mu, self.edge.coefficients(translate), u)
        far = self.edge.root_eps * (1 + max(abs(u)))
        if solved is None or not max(abs(solved[0] - u)) <= far:
            where = {"x": self.numbers.public(x), "mu": self.numbers.public(mu)}
            raise self._failure(0, where, "FL is singular at the first step element0", None)
        return x, mu, (translate, u)

    def _run(
        self,
        steps: int,
        every: int,
        x: Any,
        mu: Any,
        start: tuple[int, Any],
        progress: Any,
        branch: Any = None,
    ) -> Trajectory:
        machine, edge = self.machine, self.edge
        translate, guess = start
        lead = self._lead(x, mu, guess)
        if translate:
            lead = machine.lead(x, mu, edge.coefficients(translate), guess)
        run = machine.buffers(lead, steps, every)
        run.translate = translate
        edge.begin(run, branch)
        chunk = 2**19 if self.numbers.dtype is np.float64 else 64
        while True:
            status = machine.advance(run, min(steps, run.index + chunk))
            ended = run.index == steps
            if status in edge.handles:
                status = edge.mend(run, status)
            if progress is not None:
                progress(run.index)
            if status or ended:
                break
        kept = steps // every + 1 if not status else -(-run.index // every)
        found = self._trajectory(run, kept)
        if status:
            x, mu = machine.point(run.state)
            last = self._last_solution(run.lead)
            where = {"x": x, "mu": mu, **last}
            where = {name: self.numbers.public(value) for name, value in where.items()}
            if status not in edges.CAUSES:
                u = last.get("u", self._guess(None))  # where none is printed, FL is without u
                if singular := singular_direction(self, x, u, run.translate):
                    told, mend = singular
                    told = f"{_CAUSES[1]}, for {told}" if status == 1 else told
                    raise self._failure(run.index, where, told, found, mend)
            raise self._failure(run.index, where, _CAUSES[int(status)], found)
        return found

    @property
    def first_substep(self) -> Flow:
        """The flow that takes a step's first part: this one."""
        return self

    def _lead(self, x: Any, mu: Any, guess: Any) -> tuple[Any, ...]:
        """What `advance` takes first: the state, which begins with x and μ, and coefficients."""
        return self.machine.lead(x, mu, self._c, guess)

    def _remember(self, memory: Any, guess: Any, solved: int) -> None:
        """Fill the solver's memory: the guess five times, with stages of 0 (a straight path)."""
        for i in range(5):
            memory[i * solved : i * solved + len(guess)] = guess
        memory[-2], memory[-1] = self._kernels["HUGE"], sum(abs(g) for g in guess)

    def _last_solution(self, lead: tuple[Any, ...]) -> dict[str, Any]:
        """The u from which Newton started, where there is one."""
        n, m, shape = len(self.scheme.x), len(self.scheme.u), self._kernels["SHAPE"]
        at = 2 * (n + m) + shape["carried"]
        return {} if shape["affine"] else {"u": lead[0][at : at + m]}

    def _trajectory(self, run: Run, kept: int) -> Trajectory:
        index, public = np.arange(kept, dtype=np.int64) * run.every, self.numbers.public
        totals = run.totals
        return Trajectory(
            t=public(self.numbers.multiples(self.step, index)),
            x=public(run.xs[:kept]),
            u=public(run.us[:kept]),
            mu=public(run.mus[:kept]),
            iterations=run.counts[:kept],
            newton_mean=float(totals[0]) / (run.index + 1),
            newton_max=int(totals[1]),
            newton_residual=float(totals[2]),
            steps=run.index,
            step=self.step,
            margin=margin_of(totals[3]),
            translates=run.translates[:kept],
            edges=run.changes,
        )

    def _solve(self, x: Any, mu: Any, guess: Any = None, branch: Any = None) -> np.ndarray:
        """The u with F⁻(x, u) = hμ, on the branch of that number if one is given."""
        guess = self._vectors(x, self.scheme.scene.v0 if guess is None else guess)[1]
        return self._own_u(self._run(0, 1, x, mu, (0, guess), None, branch))

    def _own_u(self, run: Trajectory) -> np.ndarray:
        """u of a run's first row in the chart of e; raises `BadInput` where that chart ends."""
        u = np.array([self.numbers.number(e) for e in run.u[0]], dtype=self.numbers.dtype)
        if not (J := int(run.translates[0])):
            return u
        element = self.edge.chart.element(self._h * u, J)
        return np.asarray(edges.in_own_chart(self, element))

    def _legendre_step(self, x: Any, mu: Any, u0: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(x′, μ′) by the Legendre maps, no kernel used, and the derivative of the step."""
        return self._step_at(self._arrow(x, self._arrow_of(x, mu, self._guess(u0))))

    def _step_at(self, here: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return here["target"], here["plus"] / self._h, self.geometry.dual_step(here, self._h)

    def _guess(self, u0: Any) -> np.ndarray:
        return self._vectors(self.scheme.scene.x0, self.scheme.scene.v0 if u0 is None else u0)[1]

    def _arrow_of(self, x: Any, mu: Any, guess: Any) -> np.ndarray:
        """The u with F⁻(x, u) = hμ, by Newton from the guess with the maps' own derivatives."""

        def change(u: np.ndarray) -> np.ndarray:
            here = self.geometry.at(x, u)
            du = np.asarray(self.numbers.solve(here["minus_u"], self._h * mu - here["minus"]))
            return du if self.scheme.element is None else self._along_group(here["R"], du, u)

        found = newton(change, guess, 0, self.numbers.eps)
        if found is None:
            where = {"x": self.numbers.public(x), "mu": self.numbers.public(mu)}
            raise self._failure(0, where, "the step was not found", None)
        return found

    def _evolve(self, here: dict[str, Any], x: Any, u: Any) -> tuple[np.ndarray, np.ndarray]:
        y, branch = here["target"], None
        if self.scheme.element is not None:
            branch = self.geometry.branch(x, u)
        return y, self._solve(y, here["plus"] / self._h, u, branch)

    def _failure(
        self, index: int, state: Any, cause: str, trajectory: Any, mend: str = SMALLER
    ) -> StepFailure:
        scheme = self.scheme
        return StepFailure(
            scheme.scene.name,
            scheme.rule.name,
            index,
            float(self.step * index),
            state,
            cause,
            trajectory,
            mend,
        )


def _is_whole(value: Any) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)
