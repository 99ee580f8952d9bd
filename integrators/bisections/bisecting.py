"""Bisections at work: a run goes on in the chart of another translate (paper, section 4.3).

Where a step reaches the edge of its chart, or strays from its branch, the solutions of
F⁻(x, g) = hμ are searched through the cover; the one on the branch of the last step is taken, in
the translate that holds it best.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler.kernels_at_step import OK, Run
from ..errors import BadInput
from ..groupoids.chart_margin import chart_reach
from .edge_policies import EDGE, STRAYED, Refuse

if TYPE_CHECKING:
    from ..flows.flow import Flow


@dataclass(frozen=True)
class Solution:
    """A solution of F⁻(x, g) = hμ: g = τ(hu) B of a translate, and the number of its branch."""

    translate: int
    u: Any
    element: Any
    branch: Any

    def as_public(self, numbers: Any) -> Solution:
        """The same in the numbers that are handed out."""
        u, element = numbers.public(self.u), numbers.public(self.element)
        return Solution(self.translate, u, element, numbers.public([self.branch])[0])


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

    @property
    def reach(self) -> Any:
        return chart_reach(self.flow.scheme.scene.groupoid)

    def branch(self, x: Any, u: Any, translate: int) -> Any:
        """The number of the branch at g = τ(hu) B."""
        return self.flow.geometry_in(translate).branch(x, u)

    def coefficients(self, translate: int) -> Any:
        """The kernels' coefficients in the chart of a translate."""
        return self.flow.machine.coefficients(translate, self.chart.translates[translate])

    @cached_property
    def slack(self) -> Any:
        """The same, and a tenth of the scale where the number is not kept."""
        kept = self.flow.scheme.element.given.kept
        return self._kept_slack if kept else self.scale / 10

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
