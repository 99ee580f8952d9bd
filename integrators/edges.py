"""What a run does where a step reaches the edge of its chart (paper, section 4).

    refuse   an error that names the step
    bisect   the step goes on in the chart of another translate, where L_d is given on the group
    shrink   the step is taken as two of half its size, and so on

A translate changes the coefficients of the kernels (`prepare`), a shrunk step too; nothing is
derived or compiled again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .charts import GroupChart, chart_reach
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
        """(translate, u) of an element; here there is only e.

        Raises `BadInput` if g has no coordinates, or too few digits of them.
        """
        scene, numbers = self.flow.scheme.scene, self.flow.numbers
        chart = GroupChart(scene.groupoid, numbers)
        try:
            xi = chart.coordinates(g)
            off = abs(chart.element(xi) - g).max()
        except ZeroDivisionError:
            off = None
        if off is None or not off <= 2**20 * numbers.eps * (1 + abs(g).max()):
            raise BadInput(
                f"{scene.name}: element0 lies at the edge of its chart, where det(e + g) = 0; "
                'take flow(step, on_edge="bisect").'
            )
        return 0, xi / self.flow._h

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

    handles = (1, 2, EDGE)  # 1, 2: not solved at all

    @property
    def reach(self) -> Any:
        """Twice what a cover would allow, as for bisections."""
        return chart_reach(self.flow.scheme.scene.groupoid)

    def mend(self, run: Run, status: int) -> int:
        machine, full = self.flow.machine, run.c
        run.changes += 1
        start, farthest = run.state.copy(), run.totals[3]
        for level in range(1, MOST_HALVINGS + 1):
            run.c = machine.coefficients(halvings=level)
            machine.recarry(run.state, run.c)
            status = self._substeps(run, 2**level)
            if status == OK:
                break
            run.state[:] = start
        if run.totals[3] != farthest:  # of a substep: what u is in a whole one
            run.totals[7:] = [u / 2**level for u in run.totals[7:]]
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


def policy(flow: Flow, on_edge: str) -> Refuse:
    """What to do at the edge, by name; raises `BadInput` for an unknown one."""
    if on_edge not in ON_EDGE:
        raise BadInput(f"on_edge is {on_edge!r}: give {', '.join(map(repr, ON_EDGE))}.")
    from .bisecting import Bisect

    return {"refuse": Refuse, "bisect": Bisect, "shrink": Shrink}[on_edge](flow)
