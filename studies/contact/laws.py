"""The laws of contact as numbers, for the rows and impacts of a run: each is 0 except for
round-off.

Gaps, slopes and velocities are evaluated anew, to twice the digits, without any step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.extensions.contact import ZENO, Gaps, length
from discmech.integrators.flows import Trajectory
from discmech.integrators.numbers import arithmetic

from ..systems.impulses import change_by

#: share of the size that determines its round-off: a shorter way of a step sticks; and share of the
#: mean slip of the step for the slip at an end, which round-off changes too
SLOW = 1e-10


def defects(scheme: Any, run: Trajectory, digits: int) -> dict[str, float]:
    """Return the defect of a run in each law, relative to numbers of its kind in the same step.

    No scale comes from another step, such as the hardest impulse of the run: it would hide a fault
    of one step behind another. Impulses are compared with those of the same step, and with those
    that would move a gap by its own size in a step, whose round-off they have.

    penetration: −φ, of the sum of its terms and of the way of a step. pull: −P_n. complementarity:
    P_n φ, at impacts, and of gaps that are open at both ends of a step. cone: ‖P_t‖ − κ P_n. slip:
    the part of the full friction κ P_n that is against the way of a step, less than it would be
    against the slips at both ends, over steps that slip from end to end (0; 1 without friction, 2
    along the slip). friction: the same for planes of one direction, in which no slip turns: the
    missing part of κ P_n. impact_energy: the energy that an impact adds. jump: μ⁺ − μ⁻ less the
    impulses. restitution: P_n |U⁺ + e U⁻| of the normal velocities. impact_friction: |P_t |Ū| + κ
    P_n Ū| with the slip Ū = (U⁺ + e U⁻)/(1 + e) of Moreau's law: 0 for a sticking contact, and for
    friction of its full size against Ū.
    """
    numbers = arithmetic(2 * digits)
    with numbers.working():
        worst = _Run(scheme, run, numbers, float(arithmetic(digits).eps)).defects()
    return {name: float(value) for name, value in worst.items()}


def energies(scheme: Any, run: Trajectory, digits: int) -> tuple[np.ndarray, np.ndarray]:
    """Return H of the rows less the first, and the sizes of their terms, |H| + |μ·ξ|, each (r,)."""
    numbers = arithmetic(2 * digits)
    with numbers.working():
        made = _Run(scheme, run, numbers, float(arithmetic(digits).eps))
        H = [made.gaps.energy(*state) for state in made.states]
        sizes = [abs(e) + abs(mu @ xi) for e, (_, xi, mu) in zip(H, made.states, strict=True)]
        return np.array([float(e - H[0]) for e in H]), np.array([float(e) for e in sizes])


class _Run:
    """A run in numbers of more digits; unit: ε of the run's own numbers."""

    def __init__(self, scheme: Any, run: Trajectory, numbers: Any, unit: float) -> None:
        self.unit = unit
        self.gaps = Gaps(scheme.equations.s, scheme.scene, numbers)
        self.run, self.numbers = run, numbers
        self.e = numbers.number(scheme.scene.restitution)
        self.h = numbers.number(float(run.step))
        clock = run.base.shape[1] - run.x.shape[1]
        self.states = [self._state(*row) for row in zip(run.base, run.mu, run.u, strict=True)]
        jumps = run.impacts
        at = [[*x, *([t] if clock else [])] for x, t in zip(jumps.x, jumps.t, strict=True)]
        self.steps = [int((t - run.t[0]) // float(run.step)) for t in jumps.t]
        near = [(run.u[k], run.u[min(k + 1, len(run.u) - 1)]) for k in self.steps]
        self.impacts = [
            (self._state(x, before, u), self._state(x, after, v), self._array(P))
            for x, before, after, P, (u, v) in zip(
                at, jumps.before, jumps.after, jumps.impulses, near, strict=True)
        ]  # fmt: skip

    def _array(self, values: Any) -> np.ndarray:
        entries = np.asarray(values, dtype=object)
        return self.numbers.array([self.numbers.number(e) for e in entries.ravel()], *entries.shape)

    def _state(self, x: Any, mu: Any, near: Any) -> tuple[Any, Any, Any]:
        x, mu = self._array(x), self._array(mu)
        return x, self.gaps.velocity(x, mu, self._array(near)), mu

    def defects(self) -> dict[str, Any]:
        """Return the result of `laws.defects`."""
        places = [self.gaps.at(x) for x, _, _ in self.states]
        phi = np.array([place.phi for place in places])
        P = self._array(self.run.impulses)
        h = self.h
        weights = [self.gaps.weights(place, xi)
                   for place, (_, xi, _) in zip(places, self.states, strict=True)]  # fmt: skip
        ways = [place.own + h * fastest
                for place, (_, fastest) in zip(places, weights, strict=True)]  # fmt: skip
        past = np.maximum.accumulate(ways)  # a closed gap keeps the round-off of its past
        widest = [[e or 1 for e in way] for way in past]
        self.breadths = np.maximum.accumulate([place.breadth for place in places])
        hardest = [self._hardest(*row, h) for row in zip(places, past, weights, P, strict=True)]
        worst = dict.fromkeys(
            ("complementarity", "cone", "slip", "friction", "impact_energy", "jump", "restitution",
             "impact_friction"), 0 * h)  # fmt: skip
        worst["penetration"] = max(0, *(-phi / np.array(widest)).ravel())
        worst["pull"] = max(0, *(-P[:, :, 0] / np.array(hardest)).ravel())
        struck = {k for step in self.steps for k in (step - 1, step, step + 1)}
        for k in range(len(P) - 1):
            for i in range(self.gaps.count):
                if k in struck:
                    continue
                open_by = min(phi[k, i] / widest[k][i], phi[k + 1, i] / widest[k + 1][i])
                self._most(worst, "complementarity", P[k, i, 0] * open_by / hardest[k][i])
                self._friction(worst, k, i, places[k], places[k + 1], P[k, i], hardest[k][i])
        self._at_impacts(worst, widest)
        return worst

    def _hardest(self, place: Any, way: Any, weights: Any, P: Any, h: Any) -> list[Any]:
        """Return for each gap the scale of its impulses in a step."""
        return [abs(P).max(initial=0) + ((way[i] + place.breadth[i]) / h / weight if weight else 0)
                or 1 for i, weight in enumerate(weights[0])]  # fmt: skip

    @staticmethod
    def _most(worst: dict[str, Any], name: str, value: Any) -> None:
        """Keep the larger value; one that is not a number stays, so that it is not taken for 0."""
        if worst[name] == worst[name] and not value <= worst[name]:
            worst[name] = value

    def _friction(
        self, worst: dict[str, Any], k: int, i: int, here: Any, there: Any, P: Any, hardest: Any
    ) -> None:
        kappa = self.gaps.friction[i] * max(here.scale[i], there.scale[i])  # at both ends
        if not kappa > 0:
            return
        self._most(worst, "cone", (length(P[1:]) - kappa * P[0]) / hardest)
        slips = [place.slip[i] @ self.states[j][1] for j, place in ((k, here), (k + 1, there))]
        moved, push = here.moved(i, there), P[1 : 1 + len(here.where[i])] @ here.bases[i]
        way, full = length(moved), kappa * P[0]
        # after a slip that ended in the step the last one is noise
        slow = SLOW * way / self.h * way
        slipping = way > SLOW * self.breadths[k + 1][i] and all(
            slip @ moved > slow for slip in slips
        )
        if not (slipping and full > 1e-9 * hardest):
            return
        if len(moved) == 1:  # friction of each end has the size of its own |φ′|
            change = abs(here.scale[i] - there.scale[i]) / max(here.scale[i], there.scale[i])
            missing = abs(full + push @ moved / way) - change * full
            self._most(worst, "friction", missing / hardest)
            return
        turn = min(slip @ moved / length(slip) for slip in slips)  # friction is against these
        self._most(worst, "slip", (turn + push @ moved / full) / way)

    def _at_impacts(self, worst: dict[str, Any], widest: Any) -> None:
        gaps = self.gaps
        pushed = [(step, i) for step, (_, _, P) in zip(self.steps, self.impacts, strict=True)
                  for i in range(gaps.count) if P[i, 0] > 0]  # fmt: skip
        many = {at[0] for at in pushed if pushed.count(at) >= ZENO}  # a rebound may be left out
        for step, ((x, before_xi, before), (_, after_xi, after), P) in zip(
            self.steps, self.impacts, strict=True
        ):
            place, strong = gaps.at(x), abs(P).max()
            made = change_by(gaps, place, P)
            for i, (normal, *along) in enumerate(P):
                open_by = abs(place.phi[i]) / widest[min(step, len(widest) - 1)][i]
                self._most(worst, "complementarity", normal * open_by / strong)
                if gaps.friction[i] > 0:
                    push = np.array(along[: len(place.where[i])]) @ place.bases[i]
                    bound = gaps.friction[i] * place.scale[i] * normal
                    self._most(worst, "cone", (length(push) - bound) / strong)
            size = max(abs(before).max(), abs(after).max())
            off = abs(after - before - made).max() / size
            if off > self.unit:
                turned = self._turned(x, place)
                off = max(0, off - (abs(P[:, 0]) @ turned).max() / size)
            self._most(worst, "jump", off)
            gained = gaps.energy(x, after_xi, after) - gaps.energy(x, before_xi, before)
            energy = abs(gaps.energy(x, before_xi, before)) + abs(before @ before_xi)
            self._most(worst, "impact_energy", gained / energy)
            if step in many:
                continue
            self._impact_friction(worst, place, before_xi, after_xi, P)
            rates = place.normal @ before_xi, place.normal @ after_xi
            # a rate has the round-off of its terms, which a grazing impact is far below
            terms = (abs(place.normal) @ abs(xi) for xi in (before_xi, after_xi))
            fastest = max(e.max() for e in terms) or 1
            for i in map(int, np.flatnonzero(P[:, 0] > 1e-9 * strong)):
                gap = (rates[1][i] + self.e * rates[0][i]) / fastest
                if abs(gap) > self.unit:
                    unsure = self._turned(x, place)[i] @ (abs(after_xi) + self.e * abs(before_xi))
                    gap = gap * max(0, 1 - unsure / fastest / abs(gap))
                if gap < 0 and not gaps.quadratic and gained > -SLOW * energy:
                    continue  # a larger rebound would have added energy (`impacts`)
                self._most(worst, "restitution", abs(gap) * P[i, 0] / strong)

    def _turned(self, x: Any, place: Any) -> Any:
        """Return how far normals, (K, m), may turn by round-off.

        x and the point that it is compared with, such as the centre of a post, are each rounded,
        which turns the normals of a thin post by ε|x|/r.
        """
        turned = 0 * abs(place.normal)
        for j, size in enumerate(abs(x)):
            moved = x.copy()
            moved[j] += 2 * self.unit * size
            turned = turned + abs(self.gaps.at(moved).normal - place.normal)
        return turned

    def _impact_friction(
        self, worst: dict[str, Any], place: Any, before: Any, after: Any, P: Any
    ) -> None:
        gaps, strong = self.gaps, abs(P).max()
        mean = (after + self.e * before) / (1 + self.e)
        for i in range(gaps.count) if gaps.quadratic else ():
            if not gaps.friction[i] > 0 or not P[i, 0] > 0:
                continue
            rows = np.vstack([place.normal[i][None], place.slip[i]])
            fastest = max((abs(rows) @ abs(xi)).max() for xi in (before, after)) or 1
            slip = place.slip[i] @ mean
            push = P[i, 1 : 1 + len(place.where[i])] @ place.bases[i]
            bound = gaps.friction[i] * place.scale[i] * P[i, 0]
            off = length(length(slip) * push + gaps.against * bound * slip)
            self._most(worst, "impact_friction", off / (strong * fastest))
