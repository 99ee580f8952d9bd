"""The flow of a lattice with contact at its sites: all impulses of a step at once, as arrays.

A step is that of a scene with contact, stepped and without friction (`contact.contact_step`): free
steps of the whole lattice between impulses. A site's impulse opens its own gaps as its own mass has
it, W, and other sites' through the bonds. With P ← (P ≥ 0 at which U₀ + W P ≥ 0, U₀ = φ/h − W P)
an error shrinks by (hω)²/(4 + (hω)²) (midpoint, ω the fastest motion), or is gone at once
where forces are of the ends of the step. So a step takes a number of free steps that does not grow
with the sites.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..compiler import OK
from ..contact import AGAIN, LEFT_OVER, NOISE, NOT_FOUND, STAGNANT
from ..errors import BadInput, CannotMeasure, StepFailure
from ..numbers import whole_number
from .lattice_flow import NUMBERS, LatticeFlow, LatticeTrajectory
from .lattice_run import LatticeRun
from .site_gaps import EPS, SiteGaps, SitePlace, impulses, pushed, rates

MOST = 400  # free steps in search of the impulses of one


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


class Moment(NamedTuple):
    """Where a run is: places, μ (N, m), and of each gap the noise of its rate (N, K)."""

    place: SitePlace
    mu: np.ndarray
    noise: np.ndarray


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

    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Any = None,
        mu0: Any = None,
        checkpoint: Any = None,
        progress: Callable[[int], None] | None = None,
    ) -> ContactLatticeTrajectory:
        """As of any lattice; raises `BadInput` for a checkpoint, and for a start inside."""
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        if checkpoint is not None:
            raise BadInput(f"{self.lattice.name}: a run with contact keeps no checkpoint; leave it "
                           "out.")  # fmt: skip
        x, mu = self._start(x0, mu0)
        if x0 is not None:
            self.gaps.check(x)
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
        self.flow, self.gaps, self.e = flow, flow.gaps, float(flow.lattice.restitution)
        self.steps, self.every, self.progress = steps, every, progress
        self.h, self.index, self.made = float(flow.step), 0, 0
        self.run = LatticeRun(flow, x.copy(), mu.copy())
        self.moment = Moment(
            self.gaps.at_start(x), mu * flow.lattice.free[:, None],
            np.zeros((len(x), self.gaps.count)),
        )  # fmt: skip
        shapes = (x.shape, mu.shape, mu.shape, *[(len(x), self.gaps.count)] * 2)
        #: x, u, μ, φ, impulses
        self.rows = [np.zeros((steps // every + 1, *shape)) for shape in shapes]
        #: (index, share of the step, site and gap, impulse, rates before and after) of impacts
        self.impacts: list[tuple[int, int, tuple[Any, ...], tuple[Any, ...]]] = []

    def taken(self) -> ContactLatticeTrajectory:
        """The trajectory; raises `StepFailure` with the rows so far."""
        try:
            while self.index < self.steps:
                before = self.moment
                self.moment, u, P = self._step()
                self._write(before, u, P)
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

    # -- a step ----------------------------------------------------------------------------------

    def _step(self) -> tuple[Moment, np.ndarray, np.ndarray]:
        """(the moment after one step, the u that left, impulses (N, K))."""
        gaps = self.gaps
        m = self.moment._replace(noise=self.moment.noise / 4)  # within a step it does not shrink
        m, xi, total = self._struck(m, 0)
        resting = m.place.closed & (rates(m.place, xi) <= self._slow(m.place, xi, m.noise))
        landing = np.zeros_like(resting)
        while True:
            there, mu, u, P, Q, noise = self._moved(m, xi, resting, landing)
            low = (there.phi < 0) & ~there.closed & gaps.free
            if not (low & ~resting & ~landing).any():
                break
            landing |= low & ~resting
        total = total + P + Q
        if (landed := landing & (P > 0)).any():
            mu, part = self._given_back(m, xi, there, mu, P, landed)
            total[landed] -= part * P[landed]
        if (gaps.free & (there.phi < -LEFT_OVER * EPS * there.size)).any():
            raise CannotMeasure("a contact was met that no impulse opens")
        m, _, struck = self._struck(Moment(there, mu, noise), 1)
        return m, u, total + struck

    def _slow(self, place: SitePlace, xi: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Rates of gaps that are round-off, (N, K)."""
        return NOISE * EPS * ((abs(place.normal) @ abs(xi)[:, :, None])[:, :, 0] + noise)

    def _struck(self, m: Moment, share: int) -> tuple[Moment, np.ndarray, np.ndarray]:
        """(the moment after impacts of closed gaps that are closing, its ξ, the impulses)."""
        place, total = m.place, np.zeros_like(m.noise)
        for _ in range(AGAIN):
            xi = self.gaps.velocity(place.x, m.mu)
            before = rates(place, xi)
            closing = place.closed & (before < -self._slow(place, xi, m.noise))
            if not closing.any():
                return m, xi, total
            at_once = place.closed & closing.any(axis=1, keepdims=True)
            W = self.gaps.flexibility(place)
            P = (1 + self.e) * impulses(W, before, at_once, total * 0)
            change = (W @ P[:, :, None])[:, :, 0]
            where = np.nonzero(P > 0)
            found = (P[where], before[where], (before + change)[where])
            self.impacts.append((self.index, share, where, found))
            noise = np.maximum(m.noise, (abs(W) @ P[:, :, None])[:, :, 0])
            m, total = Moment(place, m.mu + pushed(place, P), noise), total + P
        raise CannotMeasure(f"{AGAIN} impacts at one place do not open the gaps")

    def _moved(
        self, m: Moment, xi: np.ndarray, resting: np.ndarray, landing: np.ndarray
    ) -> tuple[SitePlace, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(the places after a step, μ, the u that left, impulses at its start and end, noise).

        Gaps that rest stay closed, or open; those that land are kept from being negative, by
        impulses at the start alone.
        """
        gaps, place, mask = self.gaps, m.place, resting | landing
        W = gaps.flexibility(place)
        weight = np.sqrt(abs(np.diagonal(W, axis1=1, axis2=2)))
        speed = np.sqrt(abs((m.mu * xi).sum(axis=1, keepdims=True)))
        # Newton ends at the round-off of all its solution, not of each site
        known = place.own + place.slope * abs(place.x).max()
        reach = known + self.h * (weight * speed + m.noise)

        def trial(P: np.ndarray) -> tuple[SitePlace, np.ndarray, np.ndarray]:
            y, mu, u = self._free_step(place.x, m.mu + pushed(place, P))
            changed = (abs(W) @ P[:, :, None])[:, :, 0]
            return gaps.at(y, reach + self.h * changed), mu, u

        P = np.zeros_like(m.noise)
        there, mu, u = trial(P)
        if mask.any():
            P, there, mu, u = self._in_contact(trial, W, mask, (P, there, mu, u))
        noise = np.maximum(m.noise, (abs(W) @ P[:, :, None])[:, :, 0])
        Q, kept = np.zeros_like(P), resting & there.closed
        if kept.any():
            W = gaps.flexibility(there)
            Q = impulses(W, rates(there, gaps.velocity(there.x, mu)), kept, Q)
            mu = mu + pushed(there, Q)
            noise = np.maximum(noise, (abs(W) @ Q[:, :, None])[:, :, 0])
        return there, mu, u, P, Q, noise

    def _in_contact(self, trial: Any, W: np.ndarray, mask: np.ndarray, found: Any) -> Any:
        """(P, what the trial gives) with φ ≥ 0 at the end of the step, P ≥ 0, and P φ = 0."""
        P, there, mu, u = found
        r = np.where(mask, 1 / np.where(mask, np.diagonal(W, axis1=1, axis2=2), 1), 0)
        before = np.inf
        for _ in range(MOST):
            U0 = there.phi / self.h - (W @ P[:, :, None])[:, :, 0]
            change = impulses(W, U0, mask, P) - P
            units = EPS * (P + r * there.size / self.h)
            size = abs(change).max() / (units.max() + EPS**4)
            if size <= 4 or (before / 2 <= size < STAGNANT):
                return P, there, mu, u
            if not size < np.inf:
                break
            P, before = P + change, size
            there, mu, u = trial(P)
        raise CannotMeasure(NOT_FOUND)

    def _given_back(
        self, m: Moment, xi: np.ndarray, there: SitePlace, mu: np.ndarray, P: np.ndarray,
        landed: np.ndarray,
    ) -> tuple[np.ndarray, float]:  # fmt: skip
        """(μ − s·along, s), so that H is what it was at the start of the step and the gaps close.

        along: what landing gaps gave; s = 1 undoes it. Where H is more at any s, the s with least.
        """
        gaps = self.gaps
        after = m.mu + pushed(m.place, np.where(landed, 0, P))
        wanted = min(gaps.energy(m.place.x, xi, m.mu),
                     gaps.energy(m.place.x, gaps.velocity(m.place.x, after), after))  # fmt: skip
        along = pushed(there, np.where(landed, P, 0))
        now = gaps.velocity(there.x, mu)
        curve = (along * gaps.change(there.x, along)).sum()
        rate = (along * now).sum()
        under = rate**2 - 2 * curve * (gaps.energy(there.x, now, mu) - wanted)
        s = float((rate + np.sqrt(max(under, 0.0))) / curve)
        return mu - s * along, s

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
        each = [(np.full(len(site), (k + share) * self.h), site, gap, *found)
                for k, share, (site, gap), found in self.impacts]  # fmt: skip
        empty = [(np.zeros(0), *[np.zeros(0, dtype=np.int64)] * 2, *[np.zeros(0)] * 3)]
        return SiteImpacts(*map(np.concatenate, zip(*(each or empty), strict=True)))
