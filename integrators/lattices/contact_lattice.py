"""The flow of a lattice with contact at its sites (`site_gaps`): rows, impulses, impacts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..contact import ContactRun, ContactSteps, FreeSteps, Impact, Moment, Place
from ..errors import BadInput, CannotMeasure, StepFailure
from ..numbers import Matrix, Number
from ..numbers.types import Given, Rows
from .lattice_flow import File, LatticeFlow, LatticeTrajectory, Progress
from .lattice_run import LatticeRun
from .site_gaps import SiteGaps


@dataclass(frozen=True)
class SiteImpacts:
    """The impacts of a run, (i,) each: t, the site, the number of its gap, and the impulse.

    approach, rebound: the rates of the gap before and after; rebound = −e · approach unless another
    gap of the site takes part.
    """

    t: np.ndarray
    site: np.ndarray
    gap: np.ndarray
    impulse: np.ndarray
    approach: np.ndarray
    rebound: np.ndarray


@dataclass(frozen=True)
class ContactLatticeTrajectory(LatticeTrajectory):
    """Rows of a run with contact: those of any lattice, gaps and impulses.

    gaps (r, N, K): φ. impulses (r, N, K): the impulse of each gap, along φ′ρ̂, in the step that
    leaves a row. impacts: all impacts, whether their step has a row or not.
    """

    gaps: np.ndarray
    impulses: np.ndarray
    impacts: SiteImpacts


class ContactLatticeFlow(LatticeFlow):
    """The flow of a lattice with contact at its sites. It has no forms and no checkpoints.

    Raises `BadInput` for a negative step and for a start inside the obstacle.
    """

    def __init__(self, scheme: Any, step: Given, digits: int = 16) -> None:
        super().__init__(scheme, step, digits)
        if digits != 16:
            raise BadInput(f"{self.lattice.name}: a lattice with contact runs in double precision; "
                           "leave digits= out, or run its scene, lattices.scene_of.")  # fmt: skip
        if self.step < 0:
            raise BadInput(f"{self.lattice.name}: an impact has no unique past, so a lattice with "
                           "contact takes positive steps only.")  # fmt: skip
        self.gaps.check(self.lattice.start[0])

    @cached_property
    def gaps(self) -> SiteGaps:
        """The gaps of all sites."""
        return SiteGaps(self)

    def _start(self, x0: Rows | None, mu0: Rows | None) -> tuple[np.ndarray, np.ndarray]:
        x, mu = super()._start(x0, mu0)
        if x0 is not None:
            self.gaps.check(x)
        return x, mu

    def _run(
        self, x: Matrix, mu: Matrix, steps: int, every: int, checkpoint: File, progress: Progress
    ) -> ContactLatticeTrajectory:
        """Do a run; raises `BadInput` for a checkpoint."""
        if checkpoint is not None:
            raise BadInput(f"{self.lattice.name}: a run with contact keeps no checkpoint; leave it "
                           "out.")  # fmt: skip
        return _Run(self, x, mu, steps, every, progress).trajectory_of_run()

    def _refused(self, *given: Any, **named: Any) -> Any:
        """Raise `CannotMeasure`: no form is defined if a step has impulses, no block is kept."""
        raise CannotMeasure(f"{self.lattice.name} has contact: forms are not defined where a step "
                            "holds impulses, and rows come by trajectory alone.")  # fmt: skip

    poisson_defect = blocks = _refused


class _Run(ContactRun):
    """One run of a lattice with contact."""

    def __init__(
        self, flow: ContactLatticeFlow, x: Matrix, mu: Matrix, steps: int, every: int,
        progress: Progress,
    ) -> None:  # fmt: skip
        self.flow, self.h, self.made, gaps = flow, float(flow.step), 0, flow.gaps
        self.run = LatticeRun(flow, x.copy(), mu.copy())
        free = FreeSteps(self.h, self._free_step)
        contact = ContactSteps(gaps, free, float(flow.lattice.restitution))
        mu = (mu * flow.lattice.free[:, None]).ravel()
        moment = Moment(gaps.at_start(x), mu, 0 * mu, contact.no_noise())
        super().__init__(contact, moment, steps, every, progress)

    def _free_step(
        self, share: Number, x: np.ndarray, mu: np.ndarray, near: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (y, μ′, u) after a step without contact; u leaves x."""
        run = self.run
        run.x[:], run.mu[:] = x.reshape(run.x.shape), mu.reshape(run.mu.shape)
        run.begin()
        run.checked(run.status)
        run.checked(run.show())
        u = run.u.ravel().copy()
        run.stepped()
        self.made += 1
        return run.x.ravel().copy(), run.mu.ravel().copy(), u

    def component(self, name: str, k: int) -> str:
        """Return the name of entry k of x or mu, with its site."""
        width = (self.run.x if name == "x" else self.run.mu).shape[1]
        return f"{name}[{k % width}] at site {k // width}"

    def advance(self) -> None:
        """Take one step, and split its impacts by sites."""
        before, first = self.moment.place, len(self.impacts)
        super().advance()
        after = self.moment.place
        self.impacts[first:] = [(k, self._at_sites(e, before if e.share == 0 else after))
                                for k, e in self.impacts[first:]]  # fmt: skip

    def _at_sites(self, e: Impact, place: Place) -> tuple[np.ndarray, ...]:
        """Return (share of the step, sites, gaps, impulses, approaches, rebounds) of an impact."""
        gaps, P = self.flow.gaps, e.impulses[:, 0]
        where = np.flatnonzero(P > 0)
        rates = (place.normal[where] @ gaps.velocity(e.x, mu) for mu in (e.before, e.after))
        return e.share, gaps.sites[where // gaps.K], where % gaps.K, P[where], *rates

    def failure(self, failure: Exception, rows: Any) -> StepFailure:
        """Return the failure of the coming step, at the site that is nearest to its obstacle."""
        flow, cause = self.flow, getattr(failure, "cause", str(failure))
        place, mu = self.moment.place, self.moment.mu
        i = flow.gaps.sites[place.phi.argmin() // flow.gaps.K]
        here = {"x": place.x.reshape(self.run.x.shape)[i], "mu": mu.reshape(self.run.mu.shape)[i]}
        return StepFailure(flow.lattice.name, flow.scheme.rule.name, self.index,
                           self.h * self.index, getattr(failure, "state", here), cause, rows
                           )  # fmt: skip

    def trajectory(self, count: int) -> ContactLatticeTrajectory:
        """Return the first `count` rows as a trajectory."""
        flow, gaps = self.flow, self.flow.gaps
        x, mu, u = (e[:count].reshape(count, gaps.N, e.shape[1] // gaps.N) for e in self.rows)
        numbers = np.arange(count, dtype=np.int64)
        P = np.zeros((count, gaps.N, gaps.K))
        P[:, gaps.sites] = self.impulses[:count].reshape(count, len(gaps.sites), gaps.K)
        return ContactLatticeTrajectory(
            flow.numbers.multiples(flow.step, numbers * self.every), x, u, mu,
            np.zeros((count, len(flow.lattice.pairs), 0)), self.made / max(1, self.index), 0,
            self.index, flow.step, None, gaps=gaps.phi(x), impulses=P, impacts=self._impacts(),
        )  # fmt: skip

    def _impacts(self) -> SiteImpacts:
        each = [(np.full(len(site), (k + share) * self.h), site, *more)
                for k, (share, site, *more) in self.impacts]  # fmt: skip
        empty = [(np.zeros(0), *[np.zeros(0, dtype=np.int64)] * 2, *[np.zeros(0)] * 3)]
        return SiteImpacts(*map(np.concatenate, zip(*(each or empty), strict=True)))
