"""Policies for steps that reach the edge of their chart (paper, section 4).

    refuse   an error that names the step
    bisect   the step continues in the chart of another translate, if L_d is given on the group
    shrink   the step is replaced by two of half its size, and so on

A translate or a shorter step changes only the coefficients of the kernels (`prepare`). `bisect`
searches the solutions of F⁻(x, g) = hμ through the cover and takes the one on the branch of the
last step, in the translate whose chart has it farthest from its edge.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..compiler import Entry, KernelsAtStep, Run, Status, Step
from ..errors import BadInput
from ..geometry import StepContext
from ..groupoids import GroupChart
from ..numbers.types import Matrix, Number, Vector

CAUSES: dict[int, str] = {
    Status.EDGE: "the step is at or beyond the edge of its chart, where coordinates lose their "
    "digits",
    Status.STRAYED: "Newton found a solution on another branch than the last step's, and no other",
}
# statuses that another chart or a shorter step can cure
CURABLE = (Status.NOT_CONVERGED, Status.SINGULAR, Status.EDGE, Status.STRAYED)
MOST_HALVINGS = 20  # to a millionth of the step: a step that needs smaller ones fails at any size
SPREAD = 24  # number of elements between the cover's: a few for each of at most 16 translates


@dataclass(frozen=True)
class Solution:
    """A solution of F⁻(x, g) = hμ: g = τ(hu) B of a translate, and the number of its branch."""

    translate: int
    u: Vector
    element: Matrix
    branch: Number


class EdgePolicy:
    """Limits that a run checks after each step, and its continuation after the driver stops.

    system: returns the step as data, for the key of a checkpoint. stages: the kernels of
    collocation or None: Newton's take over if they do not contract.
    """

    #: statuses of the driver that `resume` may cure
    handles: tuple[int, ...] = ()

    def __init__(
        self, context: StepContext, made: Callable[[], KernelsAtStep], system: Callable[[], Step],
        stages: Any = None,
    ) -> None:  # fmt: skip
        self.context, self._made, self.system, self.stages = context, made, system, stages
        constants = context.numbers.namespace()
        self.huge, self.root_eps = constants["HUGE"], constants["ROOT_EPS"]

    @cached_property
    def machine(self) -> KernelsAtStep:
        """The kernels of Newton's method, compiled when a step needs them."""
        return self._made()

    @property
    def chart(self) -> GroupChart:
        """Cayley's chart and its translates; raises `BadInput` if there is none."""
        return self.context.chart

    @cached_property
    def reach(self) -> Number:
        """The largest size (`Groupoid.extents`) that a step may have."""
        return self.context.scene.groupoid.reach

    def coefficients(self, translate: int) -> Matrix:
        """Return the kernels' coefficients in the chart of a translate; e has the number 0."""
        return self.machine.c

    def place(self, g: Matrix) -> tuple[int, Vector]:
        """Return (translate, u) of an element; only `Bisect` uses translates other than e."""
        return 0, self.in_own_chart(g)

    def in_own_chart(self, g: Matrix) -> Vector:
        """Return u with g = τ(hu); raises `BadInput` at the edge, where u has too few digits."""
        u = self.context.coordinates(g)
        if u is None:
            raise BadInput(
                f"{self.context.scene.name}: a step lies at the edge of its chart, where "
                'det(e + g) = 0 and u is infinite; take flow(step, on_edge="bisect") and its '
                "trajectory."
            )
        return u

    @cached_property
    def begun(self) -> Vector:
        """The counters of a run at its beginning, with the limits of `watch`."""
        totals: Vector = self.context.numbers.zeros(len(Entry))
        totals[Entry.REACH], totals[Entry.BRANCH] = self.reach, self.huge
        totals[Entry.SLACK] = self.slack
        return totals

    @cached_property
    def slack(self) -> Number:
        """The largest change of the branch number in a step; HUGE if it is not checked.

        It is checked if the map conserves it: round-off may change half the digits, less six bits.
        The substeps of a composition differ in size, and each changes the number of the others.
        """
        watched = self._conserved and not self.context.substeps
        return self.scale * self.root_eps * 64 if watched else self.huge

    @property
    def _conserved(self) -> bool:
        """True if the map conserves the branch number exactly."""
        element = self.context.equations.element
        return element is not None and element.given.kept

    @cached_property
    def scale(self) -> Number:
        """The largest size of the branch number at the cover's elements where it has a value."""
        x, zero = self.context.vectors(self.context.scene.x0, [0] * self.chart.m)
        sizes = [self.context.numbers.number(0)]
        for J in range(len(self.chart.translates)):
            with suppress(ArithmeticError, ValueError):  # for example log tr g at half turns
                sizes.append(abs(self.context.geometry_in(J).branch(x, zero)))
        return max(size for size in sizes if size < self.huge)

    def resume(self, run: Run, status: int) -> int:
        """Bring the run past the step; return `OK`, or the status that remains."""
        return status


class Refuse(EdgePolicy):
    """The edge is an error; a run goes as near to it as half the digits allow."""

    @cached_property
    def reach(self) -> Number:
        """The largest size at which u has any digits."""
        return 1 / self.context.numbers.eps


class Shrink(EdgePolicy):
    """Steps beyond the reach, twice that of a cover, are halved, with all their substeps."""

    handles = CURABLE

    def resume(self, run: Run, status: int) -> int:
        machine, full = self.machine, run.c
        run.changes += 1
        start, past = run.state.copy(), machine.history(run.state)
        # a solution beyond the edge is no start: take the one before it
        last = past[status in (Status.EDGE, Status.STRAYED)] if past else ()
        for level in range(1, MOST_HALVINGS + 1):
            run.c = machine.coefficients(halvings=level)
            machine.recarry(run.state, run.c)
            machine.seed(run.state, last)
            run.totals[Entry.BRANCH] = self.huge  # the branch number depends on the step
            status = self._substeps(run, 2**level)
            if status == Status.OK:
                break
            run.state[:] = start
        run.c, run.totals[Entry.BRANCH] = full, self.huge
        machine.recarry(run.state, run.c)
        return status

    def _substeps(self, run: Run, count: int) -> int:
        """Take one step in `count` parts; only the first part writes a row."""
        machine, here = self.machine, run.index
        status = machine.one_step(run)
        if status != Status.OK or here == run.steps:
            return status
        rest = machine.buffers(run.resume_point, count, 2 * count)
        rest.count_in(run.totals)
        status = machine.advance(rest, count - 1)  # not `count`: its last row is not reached
        if status != Status.OK:
            run.index = here
        return status


class Bisect(EdgePolicy):
    """Another translate takes over; of several solutions the one on the last step's branch is
    taken.

    A `Bisection` cannot serve: its arrows need coordinates in the chart of e, and a half turn has
    none.
    """

    handles = CURABLE

    def __init__(self, context: StepContext, *arguments: Any) -> None:
        super().__init__(context, *arguments)
        name = context.scene.name
        if context.equations.element is None:
            raise BadInput(
                f"{name}: bisections continue a discrete Lagrangian given on the "
                'group (on_group); for one in a chart take on_edge="shrink" or "refuse".'
            )
        if context.substeps:
            raise BadInput(
                f"{name}: {context.scheme.rule.name} is a composition, whose substeps lie in "
                'different translates; take on_edge="shrink" or "refuse".'
            )

    def coefficients(self, translate: int) -> Matrix:
        return self.machine.coefficients(translate, self.chart.translates[translate])

    @cached_property
    def slack(self) -> Number:
        """The largest change of the branch number: a tenth of its scale if it may change."""
        return super().slack if self._conserved else self.scale / 10

    def elements(self, velocities: Iterable[Vector], translate: int) -> Iterable[Matrix]:
        """Yield the elements g = τ(hu) B, except for u so large that τ(hu) has no digits."""
        for u in velocities:
            with suppress(ArithmeticError):
                yield self.chart.element(self.context.h * np.asarray(u), translate)

    def place(self, g: Matrix) -> tuple[int, Vector]:
        """Return the translate whose chart has g farthest from its edge, and u in it."""
        J = self.chart.best(g)
        return J, self.chart.coordinates(g, J) / self.context.h

    def resume(self, run: Run, status: int) -> int:
        run.changes += 1
        solved, before = self.machine.history(run.state)[:2]
        # Newton's method accepted the step, but `watch` did not
        accepted = status in (Status.EDGE, Status.STRAYED)
        starts = list(self.elements((before, solved)[not accepted :], run.translate))
        if status == Status.EDGE and starts:
            status = self._step(run, *self.place(starts[-1]))
            if status == Status.OK:
                return Status.OK
        nearest = self._nearest(*self.machine.point(run.state), starts, run.totals)
        return status if nearest is None else self._step(run, nearest.translate, nearest.u)

    def _nearest(
        self, x: Vector, mu: Vector, starts: list[Matrix], totals: Vector
    ) -> Solution | None:
        """Return the solution on the branch of the last step, or None if the search fails."""
        last, known = totals[Entry.BRANCH], totals[Entry.BRANCH] < self.huge
        # the branch has one solution, so the first one found on it is right
        if known and self._conserved:
            for s in self._newton(x, mu, map(self.place, starts)):
                if abs(s.branch - last) <= self.slack:
                    return s
        best = None
        for more in (False, True):
            solutions = self.solutions(x, mu, starts, more)
            best = min(solutions, key=lambda s: abs(s.branch - last), default=None)
            if best is not None and (not known or abs(best.branch - last) <= self.slack):
                return best
        if best is None or (known and self._conserved):
            return None
        totals[Entry.BRANCH] = self.huge  # this is the nearest solution, although the number jumped
        return best

    def _step(self, run: Run, translate: int, u: Vector) -> int:
        """Take one step from a solution in another chart, however near that chart's edge is."""
        run.translate, run.c = translate, self.coefficients(translate)
        self.machine.recarry(run.state, run.c)
        self.machine.seed(run.state, u)
        run.totals[Entry.REACH] = 1 / self.context.numbers.eps
        status = self.machine.one_step(run)
        run.totals[Entry.REACH] = self.reach
        return status

    def solutions(
        self, x: Vector, mu: Vector, starts: Iterable[Matrix] = (), more: bool = True
    ) -> list[Solution]:
        """Return distinct solutions of F⁻(x, g) = hμ, by Newton from `starts` and the cover's
        elements.

        With `more` it also starts from elements between these. Each solution is given in the
        translate of `place`.
        """
        family = range(len(self.chart.translates))
        tries = [self.place(g) for g in starts]
        tries += [(J, self.context.numbers.zeros(self.chart.m)) for J in family]
        if more:
            tries += [(J, u / self.context.h) for J in family for u in self._between]
        distinct: list[Solution] = []
        for s in self._newton(x, mu, tries):
            if not any(self.chart.alike(s.element, t.element, self.root_eps) for t in distinct):
                distinct.append(s)
        return distinct

    def _newton(
        self, x: Vector, mu: Vector, tries: Iterable[tuple[int, Vector]]
    ) -> Iterable[Solution]:
        """Yield solutions from these (translate, u) for which u determines half of g's digits."""
        for J, u in tries:
            solved = self.machine.solve(x, mu, self.coefficients(J), u)
            if solved is not None:
                for g in self.elements([solved[0]], J):
                    if self.context.coordinates(g, J) is not None:
                        yield Solution(*self.place(g), g, solved[1])

    @cached_property
    def _between(self) -> list[Vector]:
        """Coordinates ξ spread over the chart, the same in every run."""
        numbers, generator = self.context.numbers, np.random.default_rng(7)
        draws = generator.uniform(-2, 2, (SPREAD, self.chart.m))  # a right angle is ξ = 2
        return [numbers.number(1) * d.astype(numbers.dtype) for d in draws]


POLICIES = {"refuse": Refuse, "bisect": Bisect, "shrink": Shrink}
