"""What a run does where a step reaches the edge of its chart (paper, section 4).

    refuse   an error that names the step
    bisect   the step goes on in the chart of another translate, where L_d is given on the group
    shrink   the step is taken as two of half its size, and so on

A translate changes the coefficients of the kernels (`prepare`), a shrunk step too; nothing is
derived or compiled again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .charts import GroupChart
from .errors import BadInput
from .machine import OK, Run

if TYPE_CHECKING:
    from .flow import Flow

EDGE, STRAYED = 3, 4
ON_EDGE = ("refuse", "bisect", "shrink")
CAUSES = {
    EDGE: "the step is at the edge of its chart, where coordinates lose half their digits",
    STRAYED: "Newton found a solution on another branch than the last step's, and no other",
}
MOST_HALVINGS = 20


@dataclass(frozen=True)
class Solution:
    """A solution of F⁻(x, g) = hμ: g = τ(hu) B of a translate, and the number of its branch."""

    translate: int
    u: Any
    element: Any
    branch: Any


class Refuse:
    """The edge is an error; a run goes as near to it as half the digits allow."""

    handles: tuple[int, ...] = ()

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self.chart: Any = None
        self.huge, self.root_eps = (flow.machine.kernels[k] for k in ("HUGE", "ROOT_EPS"))

    def coefficients(self, translate: int) -> Any:
        """The kernels' coefficients in the chart of a translate: here there is only e."""
        return self.flow.machine.coefficients()

    def place(self, g: Any) -> tuple[int, Any]:
        """(translate, u) of an element; here there is only e."""
        chart = GroupChart(self.flow.scheme.scene.groupoid, self.flow.numbers)
        return 0, chart.coordinates(g) / self.flow._h

    @property
    def reach(self) -> Any:
        """The largest extent of the chart that a step may have."""
        return 1 / self.flow.numbers.eps

    def begin(self, run: Run) -> None:
        """Set what `watch` compares with."""
        run.totals[4], run.totals[5] = self.reach, self.huge
        run.totals[6] = self.slack

    @property
    def slack(self) -> Any:
        """The largest change of the branch's number in a step (HUGE: not watched)."""
        return self.huge

    def mend(self, run: Run, status: int) -> int:
        """Bring the run past the step; the status that remains if it cannot be."""
        return status


class Shrink(Refuse):
    """Steps beyond the reach are taken in halves; the rest keep their size."""

    handles = (EDGE,)

    @property
    def reach(self) -> Any:
        """Twice what a cover would allow, as for bisections."""
        return chart_reach(self.flow)

    def mend(self, run: Run, status: int) -> int:
        machine, full = self.flow.machine, run.c
        run.changes += 1
        start = run.state.copy()
        for level in range(1, MOST_HALVINGS + 1):
            run.c = machine.coefficients(halvings=level)
            machine.recarry(run.state, run.c)
            status = self._substeps(run, 2**level)
            if status != EDGE:
                break
            run.state[:] = start
        run.c = full
        machine.recarry(run.state, run.c)
        return status

    def _substeps(self, run: Run, count: int) -> int:
        """One step in `count` parts: the first keeps its row, the others none."""
        machine, here = self.flow.machine, run.index
        status = machine.one_step(run)
        if status != OK or here == run.steps:
            return status
        rest = machine.buffers(run.lead, count, 2 * count)
        rest.totals = run.totals
        status = machine.advance(rest, count - 1)  # of `count`: its last row is not reached
        if status != OK:
            run.index = here
        return status


class Bisect(Refuse):
    """Another translate takes over; of several solutions the one on the last step's branch."""

    handles = (1, 2, EDGE, STRAYED)

    def __init__(self, flow: Flow) -> None:
        super().__init__(flow)
        if flow.scheme.element is None:
            raise BadInput(
                f"{flow.scheme.scene.name}: bisections continue a discrete Lagrangian given on the "
                'group (on_group); for one in a chart take on_edge="shrink" or "refuse".'
            )
        self.chart = GroupChart(flow.scheme.scene.groupoid, flow.numbers)

    @property
    def reach(self) -> Any:
        return chart_reach(self.flow)

    @cached_property
    def scale(self) -> Any:
        """The largest size of the branch's number at the cover's elements."""
        x, zero = self.flow._vectors(self.flow.scheme.scene.x0, [0] * self.chart.m)
        family = range(len(self.chart.translates))
        return max(abs(self.branch(x, zero, J)) for J in family)

    def branch(self, x: Any, u: Any, translate: int) -> Any:
        """The number of the branch at g = τ(hu) B."""
        return self.flow._geometry(translate).branch(x, u)

    def coefficients(self, translate: int) -> Any:
        """The kernels' coefficients in the chart of a translate."""
        return self.flow.machine.coefficients(translate, self.chart.translates[translate])

    @property
    def slack(self) -> Any:
        kept = self.flow.scheme.element.given.kept
        return self.scale * (self.root_eps * 64 if kept else 0.1)

    def element(self, u: Any, translate: int) -> np.ndarray:
        """g = τ(hu) B."""
        return self.chart.element(self.flow._h * np.asarray(u), translate)

    def place(self, g: np.ndarray) -> tuple[int, np.ndarray]:
        """The translate that holds g best, and u in it."""
        J = self.chart.best(g)
        return J, self.chart.coordinates(g, J) / self.flow._h

    def mend(self, run: Run, status: int) -> int:
        machine = self.flow.machine
        run.changes += 1
        solved, before = machine.history(run.state)[:2]
        accepted = status in (EDGE, STRAYED)  # by Newton, and not by `watch`
        starts = [self.element(before if accepted else solved, run.translate)]
        if accepted:
            starts.append(self.element(solved, run.translate))
        if status == EDGE:
            status = self._step(run, *self.place(starts[-1]))
            if status == OK:
                return OK
        found = self._nearest(*machine.point(run.state), starts, run.totals)
        return status if found is None else self._step(run, found.translate, found.u)

    def _nearest(self, x: Any, mu: Any, starts: list[np.ndarray], totals: Any) -> Solution | None:
        """The solution on the branch of the last step, or None if that is not found."""
        last, known = totals[5], totals[5] < self.huge
        kept = known and self.flow.scheme.element.given.kept
        if kept:  # the branch has one solution, so the first that is met will do
            for g in starts:
                for s in self.newton(x, mu, [self.place(g)]):
                    if abs(s.branch - last) <= self.slack:
                        return s
        best = None
        for more in (False, True):
            found = self.solutions(x, mu, starts, more)
            best = min(found, key=lambda s: abs(s.branch - last), default=None)
            if best is not None and (not known or abs(best.branch - last) <= self.slack):
                return best
        if best is None or kept:
            return None
        totals[5] = self.huge  # the nearest there is, though the number jumped
        return best

    def _step(self, run: Run, translate: int, u: Any) -> int:
        """One step from a solution in another chart, however near to that chart's edge."""
        machine = self.flow.machine
        run.translate, run.c = translate, self.coefficients(translate)
        machine.recarry(run.state, run.c)
        machine.seed(run.state, u)
        run.totals[4] = 1 / self.flow.numbers.eps
        status = machine.one_step(run)
        run.totals[4] = self.reach
        return status

    def solutions(
        self, x: Any, mu: Any, starts: list[np.ndarray], more: bool = False
    ) -> list[Solution]:
        """Solutions of F⁻(x, g) = hμ that Newton finds from the cover and from `starts`.

        With `more` also from elements between those of the cover. Each is given in the translate
        that holds it best; two are told apart by their elements.
        """
        chart = self.chart
        family = range(len(chart.translates))
        tries = [self.place(g) for g in starts]
        tries += [(J, self.flow.numbers.zeros(chart.m)) for J in family]
        if more:
            tries += [(J, u / self.flow._h) for J in family for u in self._between]
        return self.newton(x, mu, tries)

    def newton(self, x: Any, mu: Any, tries: list[tuple[int, Any]]) -> list[Solution]:
        """The different solutions that Newton finds from these (translate, u)."""
        found: list[Solution] = []
        for J, u in tries:
            solved = self.flow.machine.solve(x, mu, self.coefficients(J), u)
            if solved is None:
                continue
            element = self.element(solved[0], J)
            if all(np.max(abs(element - s.element)) > self.root_eps for s in found):
                found.append(Solution(*self.place(element), element, solved[1]))
        return found

    @cached_property
    def _between(self) -> list[np.ndarray]:
        """Coordinates ξ spread over the chart, fixed once and for all."""
        generator = np.random.default_rng(7)
        draws = generator.uniform(-2, 2, (24, self.chart.m))
        return [self.flow.numbers.number(1) * d.astype(self.flow.numbers.dtype) for d in draws]


POLICIES: dict[str, type[Refuse]] = {"refuse": Refuse, "bisect": Bisect, "shrink": Shrink}


def policy(flow: Flow, on_edge: str) -> Refuse:
    """What to do at the edge, by name; raises `BadInput` for an unknown one."""
    if on_edge not in POLICIES:
        raise BadInput(f"on_edge is {on_edge!r}: give {', '.join(map(repr, ON_EDGE))}.")
    return POLICIES[on_edge](flow)


def chart_reach(flow: Flow) -> Any:
    """The extent at which a chart is left: twice what a cover leaves at most.

    Some translate has det(e + g B⁻¹) ≥ 2 (4 on SE(n), whose last diagonal entry is always 1), and
    det(e − ξ/2) det(e + τ(ξ)) = 2ᴺ. Twice, so that a trajectory near the limit does not change
    charts at every step. For other retractions a rotation by half a turn.
    """
    groupoid = flow.scheme.scene.groupoid
    if groupoid.retraction_name == "cayley" and hasattr(groupoid, "algebra"):
        return flow.numbers.number(2**groupoid.algebra.size)
    return flow.numbers.number(10)
