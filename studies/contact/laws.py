"""The laws of contact as numbers, of the rows and impacts of a run: each is 0 but for round-off.

Gaps, slopes and velocities are evaluated anew, to twice the digits; no step has a part in them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.contact import ZENO, Gaps, length
from discmech.integrators.flows import ContactTrajectory
from discmech.integrators.numbers import arithmetic

#: of the largest coordinate of its plane, the way of a step below which a contact sticks, and of
#: its fastest slip, the slip: round-off moves it too
SLOW = 1e-10


def defects(scheme: Any, run: ContactTrajectory, digits: int) -> dict[str, float]:
    """Of a run: how far it is from each law, relative to the largest number of its kind.

    penetration: −φ, of the largest sum of its terms and of the way of a step. pull: −P_n.
    complementarity: P_n φ, at impacts, and of gaps that are open at both ends of a step. cone:
    ‖P_t‖ − κ P_n. slip: the part of the full friction κ P_n that is against the way of a step, less
    than it would be against the slips at both ends, over steps that slip from end to end (0; 1
    without friction, 2 along the slip). impact_energy: what an impact adds. jump: μ⁺ − μ⁻ less the
    impulses. restitution: P_n |U⁺ + e U⁻| of the normal velocities.
    """
    numbers = arithmetic(2 * digits)
    with numbers.working():
        found = _Run(scheme, run, numbers).defects()
    return {name: float(value) for name, value in found.items()}


def energies(scheme: Any, run: ContactTrajectory, digits: int) -> tuple[np.ndarray, float]:
    """H of the rows, and the largest sum of its terms' sizes, |H| + |μ·ξ|."""
    numbers = arithmetic(2 * digits)
    with numbers.working():
        made = _Run(scheme, run, numbers)
        H = [made.gaps.energy(*state) for state in made.states]
        size = max(abs(e) + abs(mu @ xi) for e, (_, xi, mu) in zip(H, made.states, strict=True))
        return np.array([float(e - H[0]) for e in H]), float(size)


class _Run:
    """A run in numbers of more digits."""

    def __init__(self, scheme: Any, run: ContactTrajectory, numbers: Any) -> None:
        self.gaps = Gaps(scheme.equations.s, scheme.scene, numbers)
        self.run, self.numbers = run, numbers
        self.e = numbers.number(scheme.scene.restitution)
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
        """As `laws.defects`."""
        places = [self.gaps.at(x) for x, _, _ in self.states]
        phi = np.array([place.phi for place in places])
        P = self._array(self.run.impulses)
        h = self.numbers.number(float(self.run.step))
        ways = [place.own + h * self.gaps.fastest(place, xi)
                for place, (_, xi, _) in zip(places, self.states, strict=True)]  # fmt: skip
        widest = [max(way[i] for way in ways) or 1 for i in range(self.gaps.count)]
        hardest = abs(P).max(initial=0) or 1
        self.breadth = [max((abs(e) for place in places for e in place.where[i]), default=0)
                        for i in range(self.gaps.count)]  # fmt: skip
        moving = [(place, xi) for place, (_, xi, _) in zip(places, self.states, strict=True)]
        self.fastest = [max(length(place.slip[i] @ xi) if self.gaps.friction[i] > 0 else 0
                            for place, xi in moving) for i in range(self.gaps.count)]  # fmt: skip
        found = dict.fromkeys(("complementarity", "cone", "slip", "impact_energy", "jump",
                               "restitution"), 0 * hardest)  # fmt: skip
        found["penetration"] = max(0, *(-phi / widest).ravel())
        found["pull"] = max(-P[:, :, 0].min(), 0) / hardest
        struck = {k for step in self.steps for k in (step - 1, step, step + 1)}
        for k in range(len(P) - 1):
            for i in range(self.gaps.count):
                if k in struck:
                    continue
                open_by = min(phi[k, i], phi[k + 1, i]) / widest[i]
                self._most(found, "complementarity", P[k, i, 0] * open_by / hardest)
                self._friction(found, k, i, places[k], places[k + 1], P[k, i], hardest)
        self._at_impacts(found, widest, hardest)
        return found

    @staticmethod
    def _most(found: dict[str, Any], name: str, value: Any) -> None:
        """The larger; what is no number stays, so that it is not taken for 0."""
        if found[name] == found[name] and not value <= found[name]:
            found[name] = value

    def _friction(
        self, found: dict[str, Any], k: int, i: int, here: Any, there: Any, P: Any, hardest: Any
    ) -> None:
        kappa = self.gaps.friction[i] * max(here.scale[i], there.scale[i])  # at both ends
        if not kappa > 0:
            return
        self._most(found, "cone", (length(P[1:]) - kappa * P[0]) / hardest)
        slips = [place.slip[i] @ self.states[j][1] for j, place in ((k, here), (k + 1, there))]
        moved, push = here.moved(i, there), P[1 : 1 + len(here.where[i])] @ here.bases[i]
        way, full = length(moved), kappa * P[0]
        slow = SLOW * self.fastest[i] * way  # a slip that ended in the step has a last one of noise
        slipping = way > SLOW * self.breadth[i] and all(slip @ moved > slow for slip in slips)
        if slipping and full > 1e-9 * hardest:
            turn = min(slip @ moved / length(slip) for slip in slips)  # friction is against these
            self._most(found, "slip", (turn + push @ moved / full) / way)

    def _at_impacts(self, found: dict[str, Any], widest: Any, hardest: Any) -> None:
        gaps = self.gaps
        pushed = [(step, i) for step, (_, _, P) in zip(self.steps, self.impacts, strict=True)
                  for i in range(gaps.count) if P[i, 0] > 0]  # fmt: skip
        many = {at[0] for at in pushed if pushed.count(at) >= ZENO}  # a rebound may be left out
        for step, ((x, before_xi, before), (_, after_xi, after), P) in zip(
            self.steps, self.impacts, strict=True
        ):
            place, strong = gaps.at(x), abs(P).max()
            made = P[:, 0] @ place.normal
            for i, (normal, *along) in enumerate(P):
                open_by = abs(place.phi[i]) / widest[i]
                self._most(found, "complementarity", normal * open_by / strong)
                if gaps.friction[i] > 0:
                    push = np.array(along[: len(place.where[i])]) @ place.bases[i]
                    made = made + push @ place.slip[i]
                    bound = gaps.friction[i] * place.scale[i] * normal
                    self._most(found, "cone", (length(push) - bound) / strong)
            size = max(abs(before).max(), abs(after).max())
            self._most(found, "jump", abs(after - before - made).max() / size)
            gained = gaps.energy(x, after_xi, after) - gaps.energy(x, before_xi, before)
            energy = abs(gaps.energy(x, before_xi, before)) + abs(before @ before_xi)
            self._most(found, "impact_energy", gained / energy)
            if step in many:
                continue
            rates = place.normal @ before_xi, place.normal @ after_xi
            fastest = max(abs(e).max() for e in rates) or 1
            for i in map(int, np.flatnonzero(P[:, 0] > 1e-9 * strong)):
                gap = (rates[1][i] + self.e * rates[0][i]) / fastest
                if gap < 0 and not gaps.quadratic and gained > -SLOW * energy:
                    continue  # more of a rebound would have added energy (`impacts`)
                self._most(found, "restitution", abs(gap) * P[i, 0] / strong)
