"""A step of a lattice with contact at its sites: all impulses at once, as arrays.

It is that of a scene with contact, stepped and without friction (`contact.contact_step`): free
steps of the whole lattice between impulses. A site's impulse opens its own gaps as its own mass has
it, W, and other sites' through the bonds. With P ← (P ≥ 0 at which U₀ + W P ≥ 0, U₀ = φ/h − W P)
an error shrinks by (hω)²/(4 + (hω)²) (midpoint, ω the fastest motion), or is gone at once
where forces are of the ends of the step. So a step takes a number of free steps that does not grow
with the sites.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..contact import AGAIN, LEFT_OVER, NOISE, NOT_FOUND, STAGNANT
from ..errors import CannotMeasure
from .site_gaps import (
    EPS,
    SiteGaps,
    SitePlace,
    applied,
    flexibility,
    impulses,
    pushed,
    rates,
    scaling,
)

MOST = 400  # free steps in search of the impulses of one
#: (y, μ′, u) of a step without contact from (x, μ), u what left x
FreeStep = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


class Moment(NamedTuple):
    """Where a run is: places, μ (N, m), and of each gap the noise of its rate (N, K)."""

    place: SitePlace
    mu: np.ndarray
    noise: np.ndarray


class SiteImpact(NamedTuple):
    """Impacts at one time: after which share of the step, 0 or 1; where (sites, gaps) they are;
    their impulses, and the rates of the gaps before and after."""

    share: int
    where: tuple[np.ndarray, ...]
    impulses: np.ndarray
    approach: np.ndarray
    rebound: np.ndarray


class SiteContactSteps:
    """Steps of a lattice under contact, of the size h; restitution: e."""

    def __init__(self, gaps: SiteGaps, free: FreeStep, h: float, restitution: float) -> None:
        self.gaps, self.free, self.h, self.e = gaps, free, h, restitution
        self.impacts: list[SiteImpact] = []

    def step(self, m: Moment) -> tuple[Moment, np.ndarray, np.ndarray, list[SiteImpact]]:
        """(the moment after one step, the u that left, impulses (N, K), impacts).

        Raises `CannotMeasure` where no impulses are found.
        """
        self.impacts = []
        m, u, total = self._taken(m)
        return m, u, total, self.impacts

    def _taken(self, m: Moment) -> tuple[Moment, np.ndarray, np.ndarray]:
        gaps = self.gaps
        m = m._replace(noise=m.noise / 4)  # within a step it does not shrink
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
        return NOISE * EPS * (applied(abs(place.normal), abs(xi)) + noise)

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
            W = flexibility(place)
            P = (1 + self.e) * impulses(W, before, at_once, total * 0)
            change = applied(W, P)
            where = np.nonzero(P > 0)
            found = (P[where], before[where], (before + change)[where])
            self.impacts.append(SiteImpact(share, where, *found))
            noise = np.maximum(m.noise, applied(abs(W), P))
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
        W = flexibility(place)
        weight = np.sqrt(abs(np.diagonal(W, axis1=1, axis2=2)))
        speed = np.sqrt(abs((m.mu * xi).sum(axis=1, keepdims=True)))
        # Newton ends at the round-off of all its solution, not of each site
        known = place.own + place.slope * abs(place.x).max()
        reach = known + self.h * (weight * speed + m.noise)

        def trial(P: np.ndarray) -> tuple[SitePlace, np.ndarray, np.ndarray]:
            y, mu, u = self.free(place.x, m.mu + pushed(place, P))
            changed = applied(abs(W), P)
            return gaps.at(y, reach + self.h * changed), mu, u

        P = np.zeros_like(m.noise)
        there, mu, u = trial(P)
        if mask.any():
            P, there, mu, u = self._in_contact(trial, W, mask, (P, there, mu, u))
        noise = np.maximum(m.noise, applied(abs(W), P))
        Q, kept = np.zeros_like(P), resting & there.closed
        if kept.any():
            W = flexibility(there)
            Q = impulses(W, rates(there, gaps.velocity(there.x, mu)), kept, Q)
            mu = mu + pushed(there, Q)
            noise = np.maximum(noise, applied(abs(W), Q))
        return there, mu, u, P, Q, noise

    def _in_contact(self, trial: Any, W: np.ndarray, mask: np.ndarray, found: Any) -> Any:
        """(P, what the trial gives) with φ ≥ 0 at the end of the step, P ≥ 0, and P φ = 0."""
        P, there, mu, u = found
        r = scaling(W, mask)
        before = np.inf
        for _ in range(MOST):
            U0 = there.phi / self.h - applied(W, P)
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
        changed = np.linalg.solve(there.mass, along[:, :, None])[:, :, 0]
        curve = (along * changed).sum()
        rate = (along * now).sum()
        under = rate**2 - 2 * curve * (gaps.energy(there.x, now, mu) - wanted)
        s = float((rate + np.sqrt(max(under, 0.0))) / curve)
        return mu - s * along, s
