"""The flow of a lattice with contact at its sites (`site_contact`): rows, impulses, impacts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..compiler import OK
from ..errors import BadInput, CannotMeasure, StepFailure
from .lattice_flow import NUMBERS, LatticeFlow, LatticeTrajectory
from .lattice_run import LatticeRun
from .site_contact import Moment, SiteContactSteps, SiteImpact
from .site_gaps import SiteGaps


@dataclass(frozen=True)
class SiteImpacts:
    """The impacts of a run, each (i,): t, the site and which of its gaps, and its impulse.

    approach, rebound: the rates of the gap before and after, rebound = −e · approach where no other
    gap of the site has a part in it.
    """

    t: np.ndarray
    site: np.ndarray
    gap: np.ndarray
    impulse: np.ndarray
    approach: np.ndarray
    rebound: np.ndarray


@dataclass(frozen=True)
class ContactLatticeTrajectory(LatticeTrajectory):
    """Rows of a run with contact, as of any lattice, with what the contacts did.

    gaps (r, N, K): φ. impulses (r, N, K): what each gap gave in the step that leaves a row, along
    φ′ρ̂. impacts: all impacts, with or without a row.
    """

    gaps: np.ndarray
    impulses: np.ndarray
    impacts: SiteImpacts


class ContactLatticeFlow(LatticeFlow):
    """The flow of a lattice with contact at its sites. It has no forms and no checkpoints.

    Raises `BadInput` for a negative step and a start inside the obstacle.
    """

    def __init__(self, scheme: Any, step: Any, digits: int = 16) -> None:
        super().__init__(scheme, step, digits)
        if self.step < 0:
            raise BadInput(f"{self.lattice.name}: an impact has no unique past, so a lattice with "
                           "contact takes positive steps only.")  # fmt: skip
        self.gaps.check(self.lattice.start[0])

    @cached_property
    def gaps(self) -> SiteGaps:
        """The gaps of all sites."""
        return SiteGaps(self)

    def _start(self, x0: Any, mu0: Any) -> tuple[np.ndarray, np.ndarray]:
        x, mu = super()._start(x0, mu0)
        if x0 is not None:
            self.gaps.check(x)
        return x, mu

    def _run(
        self, x: np.ndarray, mu: np.ndarray, steps: int, every: int, checkpoint: Any, progress: Any
    ) -> ContactLatticeTrajectory:
        """A run; raises `BadInput` for a checkpoint."""
        if checkpoint is not None:
            raise BadInput(f"{self.lattice.name}: a run with contact keeps no checkpoint; leave it "
                           "out.")  # fmt: skip
        return _Run(self, x, mu, steps, every, progress).taken()

    def _refused(self, *given: Any, **named: Any) -> Any:
        """Not defined where a step holds impulses, or not kept: raises `CannotMeasure`."""
        raise CannotMeasure(f"{self.lattice.name} has contact: forms are not defined where a step "
                            "holds impulses, and rows come by trajectory alone.")  # fmt: skip

    poisson_defect = blocks = _refused


class _Run:
    """A run as it goes."""

    def __init__(
        self, flow: Any, x: np.ndarray, mu: np.ndarray, steps: int, every: int, progress: Any
    ) -> None:
        self.flow, self.gaps, self.h = flow, flow.gaps, float(flow.step)
        self.steps, self.every, self.progress = steps, every, progress
        self.index, self.made = 0, 0
        e = float(flow.lattice.restitution)
        self.contact = SiteContactSteps(flow.gaps, self._free_step, self.h, e)
        self.run = LatticeRun(flow, x.copy(), mu.copy())
        self.moment = Moment(
            self.gaps.at_start(x), mu * flow.lattice.free[:, None],
            np.zeros((len(x), self.gaps.count)),
        )  # fmt: skip
        shapes = (x.shape, mu.shape, mu.shape, *[(len(x), self.gaps.count)] * 2)
        #: x, u, μ, φ, impulses
        self.rows = [np.zeros((steps // every + 1, *shape)) for shape in shapes]
        self.impacts: list[tuple[int, SiteImpact]] = []

    def taken(self) -> ContactLatticeTrajectory:
        """The trajectory; raises `StepFailure` with the rows so far."""
        try:
            while self.index < self.steps:
                before = self.moment
                self.moment, u, P, struck = self.contact.step(before)
                self._write(before, u, P)
                self.impacts += [(self.index, e) for e in struck]
                self.index += 1
                if self.progress is not None:
                    self.progress(self.index)
            m = self.moment
            self._write(m, self._free_step(m.place.x, m.mu)[2], 0)
        except (StepFailure, CannotMeasure) as failure:
            raise self._failed(failure) from None
        return self._trajectory(self.steps // self.every + 1)

    def _free_step(
        self, x: np.ndarray, mu: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(y, μ′, u) after a step without contact, of which u left x."""
        run = self.run
        run.x[:], run.mu[:] = x, mu
        run.begin()
        status = run.status if run.status != OK else run.show()
        u = run.u.copy()
        if status == OK:
            status = run.advance(1)
        if status == OK:
            status = run.show()
        run.checked(status)
        self.made += 1
        return run.x.copy(), run.mu.copy(), u

    # -- rows ------------------------------------------------------------------------------------

    def _write(self, m: Moment, u: np.ndarray, P: Any) -> None:
        """The row of now, if it has one."""
        if self.index % self.every == 0:
            row = self.index // self.every
            values = (m.place.x, u, m.mu, m.place.phi, P)
            for column, value in zip(self.rows, values, strict=True):
                column[row] = value

    def _failed(self, failure: Exception) -> StepFailure:
        flow, cause = self.flow, getattr(failure, "cause", str(failure))
        rows = self._trajectory(-(-self.index // self.every))
        place, mu = self.moment.place, self.moment.mu
        i = int(place.phi.min(axis=1).argmin())  # the site that is nearest to its obstacle
        state = getattr(failure, "state", {"x": place.x[i], "mu": mu[i]})
        return StepFailure(flow.lattice.name, flow.scheme.rule.name, self.index,
                           self.h * self.index, state, cause, rows)  # fmt: skip

    def _trajectory(self, count: int) -> ContactLatticeTrajectory:
        x, u, mu, phi, P = (e[:count] for e in self.rows)
        numbers = np.arange(count, dtype=np.int64)
        t = NUMBERS.multiples(self.flow.step, numbers * self.every)
        none = np.zeros((count, len(self.flow.lattice.pairs), 0))
        return ContactLatticeTrajectory(
            t, x, u, mu, none, self.made / max(1, self.index), 0, self.index, self.flow.step,
            gaps=phi, impulses=P, impacts=self._impacts(),
        )  # fmt: skip

    def _impacts(self) -> SiteImpacts:
        each = [(np.full(len(e.impulses), (k + e.share) * self.h), *e.where, *e[2:])
                for k, e in self.impacts]  # fmt: skip
        empty = [(np.zeros(0), *[np.zeros(0, dtype=np.int64)] * 2, *[np.zeros(0)] * 3)]
        return SiteImpacts(*map(np.concatenate, zip(*(each or empty), strict=True)))
