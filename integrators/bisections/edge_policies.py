"""What a run does where a step reaches the edge of its chart (paper, section 4).

    refuse   an error that names the step
    bisect   the step goes on in the chart of another translate, where L_d is given on the group
    shrink   the step is taken as two of half its size, and so on

A translate changes the coefficients of the kernels (`prepare`), a shrunk step too; nothing is
derived or compiled again.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..compiler.kernels_at_step import OK, Run
from ..errors import BadInput
from ..groupoids.chart_margin import chart_reach
from .translates import GroupChart

if TYPE_CHECKING:
    from ..flows.flow import Flow

EDGE, STRAYED = 3, 4
ON_EDGE = ("refuse", "bisect", "shrink")
CAUSES = {
    EDGE: "the step is at or beyond the edge of its chart, where coordinates lose their digits",
    STRAYED: "Newton found a solution on another branch than the last step's, and no other",
}
MOST_HALVINGS = 20


class Refuse:
    """The edge is an error; a run goes as near to it as half the digits allow."""

    handles: tuple[int, ...] = ()

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        kernels = flow.machine.kernels
        self.huge, self.root_eps = kernels.huge, kernels.root_eps

    @cached_property
    def chart(self) -> GroupChart:
        """The Cayley chart and its translates; raises `BadInput` where there is none."""
        return GroupChart(self.flow.scheme.scene.groupoid, self.flow.numbers)

    def coefficients(self, translate: int) -> Any:
        """The kernels' coefficients in the chart of a translate: here there is only e."""
        return self.flow.machine.c

    def place(self, g: Any) -> tuple[int, Any]:
        """(translate, u) of an element; here there is only e (`in_own_chart`)."""
        return 0, in_own_chart(self.flow, g)

    @property
    def reach(self) -> Any:
        """The largest size (`neighbourhoods.chart_extents`) that a step may have."""
        return 1 / self.flow.numbers.eps

    def begin(self, run: Run, branch: Any = None) -> None:
        """Set what `watch` compares with; `branch`: the number of the step before, if known."""
        run.totals[4], run.totals[5] = self.reach, self.huge if branch is None else branch
        run.totals[6] = self.slack

    @cached_property
    def slack(self) -> Any:
        """The largest change of the branch's number in a step (HUGE: not watched).

        In one chart it is watched where the map keeps the number: there any change is an error. Of
        a composition each substep has a number of its own size, which the others do not keep.
        """
        element, one = self.flow.scheme.element, len(self.flow.parts) == 1
        watched = element is not None and element.given.kept and one
        return self._kept_slack if watched else self.huge

    @property
    def _kept_slack(self) -> Any:
        """What round-off may make of a number that is kept."""
        return self.scale * self.root_eps * 64

    @cached_property
    def scale(self) -> Any:
        """The largest size of the branch's number at the cover's elements."""
        x, zero = self.flow._vectors(self.flow.scheme.scene.x0, [0] * self.chart.m)
        family = range(len(self.chart.translates))
        return max(abs(self.flow.geometry_in(J).branch(x, zero)) for J in family)

    def mend(self, run: Run, status: int) -> int:
        """Bring the run past the step; the status that remains if it cannot be."""
        return status


class Shrink(Refuse):
    """Steps beyond the reach are taken in halves; the rest keep their size."""

    handles = (1, 2, EDGE, STRAYED)  # 1, 2: not solved at all

    @property
    def reach(self) -> Any:
        """Twice what a cover would allow, as for bisections."""
        return chart_reach(self.flow.scheme.scene.groupoid)

    def mend(self, run: Run, status: int) -> int:
        machine, full = self.flow.machine, run.c
        run.changes += 1
        start, past = run.state.copy(), machine.history(run.state)
        # what Newton found beyond the edge is no start: the solution before it is
        last = past[status in (EDGE, STRAYED)] if past else None
        for level in range(1, MOST_HALVINGS + 1):
            run.c = machine.coefficients(halvings=level)
            machine.recarry(run.state, run.c)
            machine.seed(run.state, last)
            run.totals[5] = self.huge  # a branch's number depends on the step
            status = self._substeps(run, 2**level)
            if status == OK:
                break
            run.state[:] = start
        run.c, run.totals[5] = full, self.huge
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


def in_own_chart(flow: Flow, g: Any) -> Any:
    """u with g = τ(hu); raises `BadInput` at the chart's edge, where u has too few digits."""
    scene, numbers, chart = flow.scheme.scene, flow.numbers, flow.edge.chart
    try:
        xi = chart.coordinates(g)
        off = abs(chart.element(xi) - g).max()
    except ZeroDivisionError:
        off = None
    if off is None or not off <= 2**20 * numbers.eps * (1 + abs(g).max()):
        raise BadInput(
            f"{scene.name}: a step lies at the edge of its chart, where det(e + g) = 0 and u is "
            'infinite; take flow(step, on_edge="bisect") and its trajectory.'
        )
    return xi / flow._h


def policy(flow: Flow, on_edge: str) -> Refuse:
    """What to do at the edge, by one of the names in ON_EDGE."""
    from .bisecting import Bisect

    return {"refuse": Refuse, "bisect": Bisect, "shrink": Shrink}[on_edge](flow)
