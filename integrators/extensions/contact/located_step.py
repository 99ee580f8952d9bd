"""Steps under contact with impacts, and ends of slips, located inside a step.

A part of the step ends where the gap is 0, the impact happens there, and the rest of the step
follows (Fetecau, Marsden, Ortiz, West 2003): times of impacts have the order of the rule. Impacts
of one gap may accumulate in a step; after `ZENO` of them it closes without a rebound. Gaps that
close and open again within the step are found by bounds along its path (`bounds`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from ...errors import CannotMeasure, StepFailure
from ...numbers.types import Number, Vector
from .bounds import cubic
from .contact_step import ContactSteps, FreePart, Impact, Moment, StepPart, carried
from .gaps import TOUCHING, Gaps, Place

EVENTS = 2**14  # largest number in one step
HALVINGS = 200  # largest number of iterations in the search for an event
SOON = 4  # a shorter part of a step, in units of its round-off, counts as none


class Event(NamedTuple):
    """The end of a part of a step: the share of the step up to it, and that part.

    stopped: the gap that stopped slipping there; rests: the gap that did not open after all.
    """

    share: Number
    part: StepPart
    stopped: int | None = None
    rests: int | None = None


class LocatedSteps(ContactSteps):
    """Steps of a scene under contact, with impacts inside a step.

    stepped: True if impacts are located only when impacts at the end of the step have no solution,
    or when a gap closes and opens again before.
    """

    def __init__(
        self, gaps: Gaps, h: Number, part: FreePart, restitution: Number, stepped: bool
    ) -> None:
        super().__init__(gaps, h, part, restitution)
        self.stepped = stepped
        #: gaps that were negative within a step by less than the round-off of their terms
        self.unsure = set[int]()

    def free_steps(self, x: np.ndarray) -> tuple[int, np.ndarray]:
        """Return (number of rows of x (r, n) certainly reached without contact; φ)."""
        phi = self.gaps.phi(x)
        if len(x) < 3:
            return 0, phi
        surely = self.gaps.bounds.open(x[:, : self.gaps.n].astype(float))
        where = np.flatnonzero(~surely | ~(phi[1:] >= 0).all(axis=1))  # it may have no value
        return (int(where[0]) if len(where) else len(x) - 1), phi

    def _take_step(
        self, m: Moment, counts: np.ndarray, impacts: list[Impact]
    ) -> tuple[Moment, Vector, np.ndarray]:
        passed, left_with = 0 * self.one, None
        total, stuck, closed_anyway = self.gaps.no_impulses, set[int](), set[int]()
        for k in range(EVENTS):
            m = self._after_impacts(m, passed, counts, impacts)
            resting, left = self._at_rest(m, closed_anyway), self.one - passed
            if self.stepped and k == 0 and (stepped := self._stepped(m, resting)) is not None:
                return stepped
            slips = self._slips(m, resting, stuck)
            taken = self._move(m, left, resting, slips)
            left_with = taken.end.u if left_with is None else left_with
            event = self._first_event(m, taken, left, resting, slips) or Event(left, taken)
            if event.stopped is not None:
                stuck.add(event.stopped)
            if event.rests is not None:
                closed_anyway.add(event.rests)
            if event.share > 0:
                total, m = total + event.part.impulses, event.part.end
                passed = passed + event.share
            if self.one - passed <= SOON * self.eps:
                return m, left_with, total
        raise CannotMeasure(f"there are more than {EVENTS} impacts in one step")

    def _stepped(self, m: Moment, resting: np.ndarray) -> tuple[Moment, Vector, np.ndarray] | None:
        """Take a step with impacts at its end.

        Returns None if that fails, or if a gap closes and opens again on the way.
        """
        try:
            taken, landing = self._land(m, resting)
        except (CannotMeasure, StepFailure):
            return None
        if self._closing(m, taken, self.one, {*resting, *landing}):
            return None
        return self._return_impulse(m, taken, resting, landing)

    def _at_rest(self, m: Moment, closed_anyway: set[int]) -> np.ndarray:
        """Return the closed gaps that do not open or that are in `closed_anyway`."""
        resting = self.resting(m)
        if not closed_anyway:
            return resting
        return np.array(
            sorted({*resting} | {i for i in closed_anyway if m.place.closed[i]}), dtype=int
        )

    def _first_event(
        self, m: Moment, taken: StepPart, share: Number, resting: np.ndarray,
        slips: Mapping[int, Vector],
    ) -> Event | None:  # fmt: skip
        """Return the first gap that closes or slip that ends in that part, or None."""
        event: Event | None = None
        done, place = set[int](), m.place

        def gap_after(i: int, share: Number) -> tuple[Number, Number, StepPart]:
            """Return (φ_i after a share, its round-off, the part of the step).

            If the gap is closed at the start, the first two are divided by the share, after the
            remainder of φ_i at the start is subtracted.
            """
            taken = self._move(m, share, resting, slips)
            there, over, begun = taken.end.place, self.one, 0 * self.one
            if place.closed[i]:
                over, begun = share, (1 - share) * place.phi[i]
            unit = 4 * self.eps * there.size[i] / over
            return (there.phi[i] - begun) / over, unit, taken

        def slip_after(i: int, share: Number) -> tuple[Number, Number, StepPart]:
            """Return (slip i after a share of the step, its round-off, the part of the step)."""
            taken = self._move(m, share, resting, slips, held=True)
            return self._slip(place, taken.end, i, slips[i]), self.eps * taken.end.noise[i], taken

        while True:
            if gap := self._closing(m, taken, share, {*resting, *done}):
                i, first, upto = gap
                root = self._root(partial(gap_after, i), first, upto)
                if root is not None and place.closed[i] and self._is_round_off(m, i, first, root):
                    return Event(0 * share, taken, rests=i)
                if root is not None:
                    closed = root[1].end.place.closed.copy()
                    closed[i] = True  # by construction, whatever its round-off
                    end = root[1].end
                    end = end._replace(place=end.place._replace(closed=closed))
                    root = root[0], root[1]._replace(end=end)
                stopped = None
            else:
                ended = [i for i in slips if i not in done
                         and self._has_ended(place, taken.end, i, slips[i])]  # fmt: skip
                if not ended:
                    return event
                i = stopped = ended[0]
                done.add(i)
                first = slips[i] @ (place.slip[i] @ m.u)
                root = self._root(partial(slip_after, i), first, share)
                if root is not None and root[0] <= SOON * self.eps:
                    return Event(0 * share, taken, stopped=i)
            if root is None or not root[0] < share:
                done.add(i)
            if root is not None:
                share, taken = root
                event = Event(share, taken, stopped)

    def _is_round_off(
        self, m: Moment, i: int, first: Number, root: tuple[Number, StepPart]
    ) -> bool:
        """Return True if a closed gap that opens closes again before it exceeds its round-off.

        Its parabola is as high as a quarter of its initial rate times its duration.
        """
        size = max(m.place.size[i], root[1].end.place.size[i])
        return bool(root[0] <= SOON * self.eps
                    or first * root[0] / 4 <= TOUCHING * self.eps * size)  # fmt: skip

    def _has_ended(self, place: Place, end: Moment, i: int, along: Vector) -> bool:
        """Return True if the slip of gap i has ended or turned, up to round-off."""
        row = end.place.slip[i]
        slow = self._slow(row, end.u, end.noise[i]).max()
        return bool(self._slip(place, end, i, along) <= slow)

    def _slip(self, place: Place, end: Moment, i: int, along: Vector) -> Number:
        """Return the slip of gap i at the end of a part, in the direction in which it began."""
        there = end.place
        if not there.closed[i]:
            return self.one
        xi = self.gaps.velocity(there.x, end.mu, end.u)
        return carried(place, there, i, along) @ (there.slip[i] @ xi)

    def _closing(
        self, m: Moment, taken: StepPart, share: Number, done: set[int]
    ) -> tuple[int, Number, Number] | None:
        """Return (gap, its value at the start, a share at which it is negative), or None."""
        place, there, h = m.place, taken.end.place, self.h * share
        rates = place.normal @ m.u
        watched = [i for i in range(self.gaps.count) if i not in done]
        first = {i: self.h * rates[i] if place.closed[i] else place.phi[i] for i in watched}
        for i in watched:
            if there.phi[i] < 0 and not there.closed[i]:
                return i, first[i], share
        if watched and (dip := self._dip(m, taken, h, watched)):
            return dip[0], first[dip[0]], share * dip[1]
        return None

    def _dip(
        self, m: Moment, taken: StepPart, h: Number, watched: list[int]
    ) -> tuple[int, Number] | None:
        """Return (gap, share of the part at which it is negative on the way), or None.

        The path is the cubic with the velocities at both ends, which has their order.
        """
        gaps, n, place, there = self.gaps, self.gaps.n, m.place, taken.end.place
        bounds, begin = gaps.bounds, m.u
        if len(taken.at_start):
            pushed = m.mu + taken.start.push.T @ taken.at_start
            begin = gaps.velocity(place.x, pushed, m.u)
        ending = gaps.velocity(there.x, taken.arriving, taken.end.u)
        points = cubic(*(np.array([float(e) for e in part]) for part in (
            place.x[:n], h * (place.rho @ begin), there.x[:n], h * (there.rho @ ending))
        ))  # fmt: skip
        low = bounds.lowest(points[None])[0]
        for i in watched:
            if low[i] > 0:
                continue
            if place.closed[i] or there.closed[i]:
                below = TOUCHING * self.eps * max(place.size[i], there.size[i])
                at = bounds.dip(points, i, -float(below))
            else:
                at = self._thin_dip(m, points, i, abs(h * begin))
            if at:
                return i, at
        return None

    def _thin_dip(self, m: Moment, points: np.ndarray, i: int, way: Vector) -> float | None:
        """Return where on a path gap i, open at both ends, is negative beyond the round-off there.

        At a thin post this round-off is far less than at the ends of a step. A gap that is negative
        by less is noted in `unsure`.
        """
        number, below = self.gaps.numbers.number, 0.0
        for _ in range(2):  # the second time beyond the round-off at the place where it is negative
            at = self.gaps.bounds.dip(points, i, below)
            if at is None:
                break
            x = m.place.x.copy()
            back = 1 - at
            x[: self.gaps.n] = [
                number(float(e)) for e in
                np.array([back**3, 3 * at * back**2, 3 * at**2 * back, at**3]) @ points
            ]  # fmt: skip
            place = self.gaps.at(x)
            closed = TOUCHING * self.eps * (place.own[i] + abs(place.normal[i]) @ way)
            if place.phi[i] < -closed:
                return at
            below = -float(closed)
        if below < 0:
            self.unsure.add(i)
        return None

    def _root(
        self,
        value: Callable[[Number], tuple[Number, Number, StepPart]],
        first: Number,
        upto: Number,
    ) -> tuple[Number, StepPart] | None:
        """Return (share, part of the step) at which a value that begins with `first` > 0 is 0, or
        None.

        It uses the secant between shares with opposite signs, and halves the weight of an end that
        stays (Anderson, Björck 1973).
        """
        low, above, high, latest = 0 * upto, first, upto, -1
        below, _, at = value(high)
        if not (above > 0 > below):
            return None
        newest = below
        for _ in range(HALVINGS):
            part = high - below * (high - low) / (below - above)
            if not low < part < high:
                part = (low + high) / 2
            new, unit, at = value(part)
            if abs(new) <= unit or high - low <= SOON * self.eps:
                break
            side = 1 if new > 0 else -1
            weight = 1 - new / newest if side == latest else self.one
            weight = weight if weight > 0 else self.one / 2
            if side > 0:
                low, above, below = part, new, below * weight
            else:
                high, below, above = part, new, above * weight
            latest, newest = side, new
        return part, at
