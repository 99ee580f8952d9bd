"""A step under contact: free steps between impulses of the contacts.

A closed gap that does not open is kept closed as by a constraint, with an impulse at each end of
the step (`equations.constrained_equations`; RATTLE if the rule is trapezoidal), here in Coulomb's
cone: λ_i ≥ 0 at the start with φ(b(x, u)) ≥ 0 and λ_i φ_i = 0, and at the end the same for the
velocity. At the start friction acts on the displacement of the step, not on the velocity, so that a
sticking contact does not creep.

A gap that would become negative is an impact. In this file an impulse at the start makes the step
end on φ = 0; at the end this impulse is returned as far as the energy at the start of the step
allows, and the impact happens there: its time is late by less than a step (Kane, Repetto, Ortiz,
Marsden 1999; Pandolfi, Kane, Marsden, Ortiz 2002). `located_step` finds its time inside the step.

Everything is made of free steps of the scheme, with the size of the step or a part of it, so
nothing is compiled for contact, and it works with every rule on every groupoid. Unknowns are few:
one impulse for each closed gap, and one for each direction of its plane.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ...errors import CannotMeasure
from ...numbers.types import Number, Vector
from .cones import Jammed, NotFound, length
from .gaps import Gaps, Place
from .impacts import AGAIN, NOISE, Active, active, in_cones, returned_share, velocity_law

LEFT_OVER = 2**12  # a gap may be negative by so many units of round-off
ZENO = 64  # after so many impacts in one step a gap closes without a rebound


#: (share of the step, x, μ, a velocity nearby) ↦ (y, μ′, u), the state after that part of a step
#: without contact, and the u that leaves x; it may raise `StepFailure`
FreePart: TypeAlias = Callable[[Number, Vector, Vector, Vector], tuple[Vector, Vector, Vector]]


class Moment(NamedTuple):
    """The state of a run: place, μ, a velocity nearby, and the velocity noise of each gap."""

    place: Place
    mu: Vector
    u: Vector
    noise: Vector


class Impact(NamedTuple):
    """An impact: time as a share of the step, x, μ before and after, and impulses (K, 1 + D)."""

    share: Number
    x: Vector
    before: Vector
    after: Vector
    impulses: np.ndarray


class StepPart(NamedTuple):
    """A part of a step: the moment at its end, whose u leaves its start, and the impulses.

    start, at_start: the contacts that pushed at the start, and their impulses; arriving: μ at the
    end, before the impulses there.
    """

    end: Moment
    impulses: np.ndarray
    start: Active
    at_start: Vector
    arriving: Vector


class ContactSteps:
    """Steps of a scene under contact, with impacts at the end of a step.

    h: the step size; part: takes parts of it without contact; restitution: a number of the
    arithmetic.
    """

    def __init__(self, gaps: Gaps, h: Number, part: FreePart, restitution: Number) -> None:
        self.gaps, self.h, self.part, self.e = gaps, h, part, restitution
        self.eps, self.one = gaps.numbers.eps, gaps.numbers.number(1)

    def no_noise(self) -> Vector:
        """Return zero velocity noise for every gap, (K,)."""
        return self.gaps.numbers.zeros(self.gaps.count)

    def step(self, m: Moment) -> tuple[Moment, Vector, np.ndarray, list[Impact]]:
        """Take one step: return (the next moment, the u that left, impulses (K, 1 + D), impacts).

        Raises `CannotMeasure` if no impulses are found, or if impacts do not end.
        """
        m = m._replace(noise=m.noise / 4)  # within a step the noise does not shrink
        counts, impacts = np.zeros(self.gaps.count, dtype=np.int64), list[Impact]()
        m, u, total = self._take_step(m, counts, impacts)
        if (m.place.phi < -LEFT_OVER * self.eps * m.place.size).any():
            raise CannotMeasure("no impulse and no shorter step opens a contact that was met")
        m = self._after_impacts(m, self.one, counts, impacts)
        return m, u, sum((e.impulses for e in impacts), total), impacts

    def resting(self, m: Moment) -> np.ndarray:
        """Return the gaps that are closed and do not open; u of the moment is its ξ."""
        place = m.place
        slow = self._slow(place.normal, m.u, m.noise)
        return np.flatnonzero(place.closed & (place.normal @ m.u <= slow))

    def _slow(self, rows: np.ndarray, xi: Vector, noise: Vector) -> Vector:
        """Return the size below which velocities along the rows are round-off."""
        slow: Vector = NOISE * self.eps * (abs(rows) @ abs(xi) + noise)
        return slow

    def _after_impacts(
        self, m: Moment, share: Number, counts: np.ndarray, impacts: list[Impact]
    ) -> Moment:
        """Return the moment after the impacts of closed gaps that still close; its u is its ξ."""
        place = m.place
        for _ in range(AGAIN):
            m = m._replace(u=self.gaps.velocity(place.x, m.mu, m.u))
            slow = self._slow(place.normal, m.u, m.noise)
            closing = place.closed & (place.normal @ m.u < -slow)
            if not closing.any():
                return m
            counts += closing
            tired = self.e < 1 and counts[closing].max() > ZENO
            e = 0 * self.one if tired else self.e
            struck = self.gaps.struck_with(place.closed, closing)
            contacts = active(self.gaps, place, np.flatnonzero(struck))
            P, after, changed = velocity_law(self.gaps, place, m.mu, m.u, contacts, e)
            impacts.append(Impact(share, place.x, m.mu, after, contacts.total(P)))
            m = Moment(place, after, m.u, np.maximum(m.noise, contacts.noise(changed)))
        raise CannotMeasure(f"{AGAIN} impacts at one place do not open the gaps")

    def _slips(self, m: Moment, resting: np.ndarray, stuck: set[int]) -> dict[int, Vector]:
        """Return the directions in which resting gaps with friction slip.

        If friction of full size would close the gap at once (Painlevé's paradox), the slip has no
        known direction, and the gap is left to the cone as a whole.
        """
        slips, place = dict[int, Vector](), m.place
        for i in resting if self.gaps.rough else ():
            if i in stuck or not self.gaps.friction[i] > 0:
                continue
            slip = place.slip[i] @ m.u
            if (abs(slip) > self._slow(place.slip[i], m.u, m.noise[i])).any():
                along = {i: slip / length(slip)}
                alone = active(self.gaps, place, [i], (), along)
                if self.gaps.flexibility(place.x, m.u, alone.rows, alone.push)[0, 0] > 0:
                    slips |= along
        return slips

    def _move(
        self,
        m: Moment,
        share: Number,
        resting: np.ndarray,
        slips: Mapping[int, Vector],
        landing: Sequence[int] | np.ndarray = (),
        held: bool = False,
    ) -> StepPart:
        """Take a part of a step in which the resting gaps stay closed, or open.

        slips: the directions of slips; friction at the start acts against them unless the path
        along the plane turns back. landing: gaps that an impulse without friction, only at the
        start, keeps from being negative. held: True if friction acts against the slips throughout.
        """
        gaps, h, place = self.gaps, self.h * share, m.place
        start = active(gaps, place, resting, landing, slips)
        W = gaps.flexibility(place.x, m.u, start.rows, start.push)
        # Newton ends at the round-off of its whole solution, not of each component
        reach = place.own + self.h * (gaps.fastest(place, m.u) + m.noise)
        # A resting gap is closed only to round-off. A whole step removes the remainder: a short
        # part that did so would need an impulse larger by the factor 1/share.
        left_over = 0 * place.phi
        left_over[resting] = (1 - share) * place.phi[resting]

        def trial(P: Vector) -> tuple[Vector, Vector, tuple[Place, Vector, Vector]]:
            pushed = m.mu + start.push.T @ P
            near = gaps.velocity(place.x, pushed, m.u) if len(P) else m.u
            y, mu, u = self.part(share, place.x, pushed, near)
            pushing = start.noise(abs(W) @ abs(P))
            there = gaps.at(y, reach + self.h * pushing)
            F = (there.phi - left_over)[start.owners] / h
            unit = there.size[start.owners] / h
            for n, (plane, _) in start.cones.planes.items():
                i = start.owners[n]
                F[plane] = place.moved(i, there) / h
                fast = max(abs(place.slip[i]) @ abs(near)) + m.noise[i] + pushing[i]
                unit[plane] = (there.breadth[i] + self.h * fast) / h
            return F, unit, (there, mu, u)

        P = gaps.numbers.zeros(len(start.owners))
        if not len(P):
            _, _, (there, mu, u) = trial(P)
            return StepPart(Moment(there, mu, u, m.noise), start.total(P), start, P, mu)
        try:
            P, (there, mu, u) = in_cones(gaps, trial, W, start.cones)
        except (Jammed, NotFound):
            if not slips:
                raise
            return self._move(m, share, resting, {}, landing)  # treat the cone as a whole
        onward = {i: e for i, e in slips.items() if held or e @ place.moved(i, there) > 0}
        if len(onward) < len(slips):
            return self._move(m, share, resting, onward, landing)
        kept = resting[there.closed[resting]]
        turned = {i: carried(place, there, i, e) for i, e in slips.items()} if held else {}
        arriving = mu
        end = active(gaps, there, kept, (), turned)
        total, noise = start.total(P), np.maximum(m.noise, start.noise(abs(W) @ abs(P)))
        if len(kept):
            try:
                Q, mu, changed = velocity_law(gaps, there, mu, u, end, 0)
            except Jammed:
                end = active(gaps, there, kept)
                Q, mu, changed = velocity_law(gaps, there, mu, u, end, 0)
            total, noise = total + end.total(Q), np.maximum(noise, end.noise(changed))
        return StepPart(Moment(there, mu, u, noise), total, start, P, arriving)

    def _take_step(
        self, m: Moment, counts: np.ndarray, impacts: list[Impact]
    ) -> tuple[Moment, Vector, np.ndarray]:
        """Return (the moment at the end of the step, the u that left, the impulses outside
        impacts).

        The counts (K,) and the impacts are updated on the way.
        """
        m = self._after_impacts(m, 0 * self.one, counts, impacts)
        resting = self.resting(m)
        taken, landing = self._land(m, resting)
        return self._return_impulse(m, taken, resting, landing)

    def _land(self, m: Moment, resting: np.ndarray) -> tuple[StepPart, np.ndarray]:
        """Return (a step that ends on the gaps that it would make negative, these gaps)."""
        landing, slips = resting[:0], self._slips(m, resting, set())
        while True:
            taken = self._move(m, self.one, resting, slips, landing)
            there = taken.end.place
            low = (there.phi < 0) & ~there.closed
            low[resting] = low[landing] = False
            if not low.any():
                return taken, landing
            landing = np.append(landing, np.flatnonzero(low))

    def _return_impulse(
        self, m: Moment, taken: StepPart, resting: np.ndarray, landing: np.ndarray
    ) -> tuple[Moment, Vector, np.ndarray]:
        """Return results of `_take_step` for a step that landed, with its impulse returned."""
        gaps, end, start, P = self.gaps, taken.end, taken.start, taken.at_start
        pushed = slice(len(resting), len(resting) + len(landing))
        landed = np.flatnonzero(P[pushed] > 0) + len(resting)
        if len(landed):
            others = P.copy()
            others[pushed] = 0
            after = m.mu + start.push.T @ others
            pushed_off = gaps.velocity(m.place.x, after, m.u)
            wanted = min(gaps.energy(m.place.x, m.u, m.mu),
                         gaps.energy(m.place.x, pushed_off, after))  # fmt: skip
            there = end.place
            along = P[landed] @ there.normal[start.owners[landed]]
            s = returned_share(gaps, there, end.mu, end.u, along, wanted)
            # more than the whole impulse would pull; an elastic impact has to keep the energy
            if self.e < 1:
                s = min(s, self.one)
            taken.impulses[start.owners[landed], 0] -= s * P[landed]
            end = end._replace(mu=end.mu - s * along)
        return end, end.u, taken.impulses


def carried(place: Place, there: Place, i: int, along: Vector) -> Vector:
    """Return a direction of gap i's plane in the basis of its plane at another place."""
    direction: Vector = there.bases[i].T @ (place.bases[i] @ along)
    return direction / length(direction)
