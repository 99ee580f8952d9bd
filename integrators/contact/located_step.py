"""Steps under contact with impacts, and ends of slips, located inside a step.

A part of the step ends where the gap is 0, the impact is there, and the rest of the step follows
(Fetecau, Marsden, Ortiz, West 2003): times of impacts have the order of the rule. Impacts of one
gap may accumulate in a step; after `ZENO` of them it closes without a rebound.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from ..errors import CannotMeasure
from ..numbers.types import Number, Vector
from .contact_step import ContactSteps, Impact, Moment, Taken, carried
from .gaps import Place

EVENTS = 2**14  # in one step
HALVINGS = 200  # of the search for an event


class LocatedSteps(ContactSteps):
    """Steps of a scene under contact, with impacts inside a step."""

    def _met(self, phi: np.ndarray) -> np.ndarray:
        met = super()._met(phi)
        if len(phi) < 3:
            return met | True
        # between two rows φ is lower than at both by less than its second difference
        bend = abs(phi[2:] - 2 * phi[1:-1] + phi[:-2])
        bend = np.concatenate([bend[:1], np.maximum(bend[1:], bend[:-1]), bend[-1:]])
        found: np.ndarray = met | (np.minimum(phi[1:], phi[:-1]) < bend) & (phi[:-1] > 0)
        return found

    def _taken(
        self, m: Moment, counts: np.ndarray, impacts: list[Impact]
    ) -> tuple[Moment, Vector, np.ndarray]:
        passed, left_with = 0 * self.one, None
        total, stuck = self.gaps.still, set[int]()
        for _ in range(EVENTS):
            m = self._struck(m, passed, counts, impacts)
            resting, left = self.resting(m), self.one - passed
            slips = self._slips(m, resting, stuck)
            taken = self._moved(m, left, resting, slips)
            left_with = taken.end.u if left_with is None else left_with
            event = self._first_event(m, taken, left, resting, slips)
            share, taken, stopped = event or (left, taken, None)
            total, m, passed = total + taken.impulses, taken.end, passed + share
            if stopped is not None:
                stuck.add(stopped)
            if event is None or passed >= self.one:
                return m, left_with, total
        raise CannotMeasure(f"there are more than {EVENTS} impacts in one step")

    def _first_event(
        self, m: Moment, taken: Taken, share: Number, resting: np.ndarray,
        slips: Mapping[int, Vector],
    ) -> tuple[Number, Taken, int | None] | None:  # fmt: skip
        """(share of the step, what was taken up to it, the gap that stopped slipping there).

        Of the first gap that closes, or slip that ends; None where nothing happens in that part.
        """
        found: tuple[Number, Taken, int | None] | None = None
        stopped: int | None
        done, place = set[int](), m.place

        def gap_after(i: int, share: Number) -> tuple[Number, Number, Taken]:
            """(φ_i after a share, its round-off, what was taken), the first two divided by the
            share if the gap is closed at the start."""
            taken = self._moved(m, share, resting, slips)
            over, there = share if place.closed[i] else self.one, taken.end.place
            return there.phi[i] / over, 4 * self.eps * there.size[i] / over, taken

        def slip_after(i: int, share: Number) -> tuple[Number, Number, Taken]:
            """(slip i after a share of the step, its round-off, what was taken)."""
            taken = self._moved(m, share, resting, slips, held=True)
            return self._slip(place, taken.end, i, slips[i]), self.eps * taken.end.noise[i], taken

        while True:
            if gap := self._closing(m, taken.end, share, {*resting, *done}):
                i, first, upto = gap
                stopped, value = None, partial(gap_after, i)
            else:
                ended = [i for i in slips if i not in done
                         and self._slip(place, taken.end, i, slips[i]) <= 0]  # fmt: skip
                if not ended:
                    return found
                i = stopped = ended[0]
                done.add(i)
                first, upto = slips[i] @ (place.slip[i] @ m.u), share
                value = partial(slip_after, i)
            root = self._root(value, first, upto)
            if root is None or not root[0] < share:
                done.add(i)
            if root is not None:
                share, taken = root
                found = share, taken, stopped

    def _slip(self, place: Place, end: Moment, i: int, along: Vector) -> Number:
        """The slip of gap i at the end of a part, in the direction that it began with."""
        there = end.place
        if not there.closed[i]:
            return self.one
        xi = self.gaps.velocity(there.x, end.mu, end.u)
        return carried(place, there, i, along) @ (there.slip[i] @ xi)

    def _closing(
        self, m: Moment, end: Moment, share: Number, done: set[int]
    ) -> tuple[int, Number, Number] | None:
        """(gap, its value at the start, a share at which it is negative) of one that closes."""
        place, there, h = m.place, end.place, self.free.h * share
        rates = place.normal @ m.u
        for i in range(self.gaps.count):
            if i in done:
                continue
            first = self.free.h * rates[i] if place.closed[i] else place.phi[i]
            if there.phi[i] < 0 and not there.closed[i]:
                return i, first, share
            if place.closed[i] or not rates[i] < 0:
                continue
            ending = there.normal[i] @ self.gaps.velocity(there.x, end.mu, end.u)
            if ending > 0 and (low := _dip(place.phi[i], h * rates[i], there.phi[i], h * ending)):
                return i, first, share * low
        return None

    def _root(
        self, value: Callable[[Number], Any], first: Number, upto: Number
    ) -> tuple[Number, Taken] | None:
        """(share, what was taken) where a value that begins with `first` > 0 is 0; None if nowhere.

        Between shares with both signs by the secant, the side that stays weighed less (Anderson,
        Björck 1973).
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
            if abs(new) <= unit or high - low <= 4 * self.eps * high:
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


def _dip(first: Number, rate: Number, last: Number, ending: Number) -> Number | None:
    """Where in (0, 1) a cubic with these values and slopes at 0 and 1 has a negative minimum."""
    a, b = 2 * (first - last) + rate + ending, 3 * (last - first) - 2 * rate - ending
    under = b * b - 3 * a * rate
    if under <= 0:
        return None
    root = under**0.5
    at = -rate / (b + root) if b > 0 else (root - b) / (3 * a)
    value = first + at * (rate + at * (b + at * a))
    return at if 0 < at < 1 and value < 0 else None
