"""The flow of a lattice with contact (`lattice_gaps`): rows, impulses, impacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...compiler import text_key
from ...errors import StepFailure
from ...numbers import Matrix, Number
from ...numbers.types import Given, Rows
from ...runs import Trajectory
from ..contact import ContactRun, ContactSteps, Impact, Moment, Place, gap_expressions
from .lattice_flow import LatticeFlow
from .lattice_gaps import LatticeGaps
from .lattice_run import LatticeRun, LatticeScheme


class GapImpact(NamedTuple):
    """The impact of one gap: its time as a share of the step, the rest as of `LatticeImpacts`."""

    share: Number
    site: int
    bond: int
    gap: int
    impulse: Number
    approach: Number
    rebound: Number


@dataclass(frozen=True)
class LatticeImpacts:
    """The impacts of a run, (i,) each: t, the site or the bond, the number of its gap, the impulse.

    site is −1 for a gap of a bond, bond is −1 for one of a site. approach, rebound: the rates of
    the gap before and after; rebound = −e · approach unless another gap takes part.
    """

    t: np.ndarray
    site: np.ndarray
    bond: np.ndarray
    gap: np.ndarray
    impulse: np.ndarray
    approach: np.ndarray
    rebound: np.ndarray


class ContactLatticeFlow(LatticeFlow):
    """The flow of a lattice with contact. It has no forms.

    Raises `BadInput` for a negative step and for a start inside the obstacle.
    """

    def __init__(self, scheme: LatticeScheme, step: Given, digits: int = 16) -> None:
        super().__init__(scheme, step, digits)
        if self.step < 0:
            self.lattice.check_features("a step back")
        self._check(self.lattice.start[0])

    def _check(self, x: np.ndarray) -> None:
        """Raise `BadInput` unless x (N, n) is outside the obstacle, as seen by doubles."""
        if self.numbers.digits == 16:
            self.gaps.check(x)
        else:
            ContactLatticeFlow(self.scheme, self.step)._check(x.astype(float))

    @cached_property
    def gaps(self) -> LatticeGaps:
        """The gaps of all sites and bonds."""
        return LatticeGaps(self)

    def _start(
        self, x0: Rows | None, mu0: Rows | None, t0: Number = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        x, mu = super()._start(x0, mu0, t0)
        if x0 is not None:
            self._check(x)
        return x, mu

    def stepper(self, x: Matrix, mu: Matrix, t0: Number) -> _Run:
        return _Run(self, x, mu, t0)

    def _refused(self, *arguments: Any, **named: Any) -> Any:
        """Raise `CannotMeasure`: no form is defined if a step has impulses, no block is kept."""
        self.lattice.refuse("forms of a lattice")

    poisson_defect = blocks = _refused


class _Run(ContactRun):
    """One run of a lattice with contact; made: the number of free steps."""

    kind = GapImpact
    counters = ("index", "ended", "made")

    def __init__(self, flow: ContactLatticeFlow, x: Matrix, mu: Matrix, t0: Number) -> None:
        self.flow, self.made, gaps, number = flow, 0, flow.gaps, flow.numbers.number
        self.name, self.h = flow.lattice.name, number(flow.step)
        self.run = LatticeRun(flow, x.copy(), mu.copy(), t0)
        contact = ContactSteps(gaps, self.h, self._free_step, number(flow.lattice.restitution))
        mu = (mu * flow.lattice.free[:, None]).ravel()
        moment = Moment(gaps.at_start(self._with_time(x)), mu, 0 * mu, contact.no_noise())
        super().__init__(contact, moment)

    @property
    def key(self) -> str:
        """The key of the lattice's equations, of the gaps and of the start."""
        scheme, lattice = self.flow.scheme, self.flow.lattice
        gaps = [gap_expressions(s, contact) for (s, *_), contact in
                zip(scheme.terms, scheme.equations.contacts, strict=True) if contact]  # fmt: skip
        values = gaps, lattice.restitution, lattice.split_parameters["shared"]
        words = self.run.digest.hexdigest(), lattice.shape, *map(str, values)
        return text_key(scheme.system, *words)

    @property
    def state(self) -> dict[str, np.ndarray]:
        # a free step begins its search for the unknowns from those of the step before
        inner = {f"free {word}": array for word, array in self.run.state.items()}
        return {**super().state, **inner}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        super().restore(state)
        self.run.restore({word.removeprefix("free "): array for word, array in state.items()
                          if word.startswith("free ")})  # fmt: skip

    def _free_step(
        self, share: Number, x: np.ndarray, mu: np.ndarray, near: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (y, μ′, u) after a step without contact; u leaves x."""
        run, gaps = self.run, self.flow.gaps
        run.x[:], run.mu[:], run.index = gaps.of_sites(x), mu.reshape(run.mu.shape), self.index
        run.begin()
        run.checked(run.status)
        run.checked(run.show())
        u = run.u.ravel().copy()
        run.stepped()
        self.made += 1
        return self._with_time(run.x), run.mu.ravel().copy(), u

    def _with_time(self, x: np.ndarray) -> np.ndarray:
        """Return x of the present state as a vector of `LatticeGaps`."""
        if not self.flow.scheme.timed:
            return x.ravel().copy()
        return np.append(x.ravel(), self.run.t).astype(x.dtype, copy=False)

    def component(self, name: str, k: int) -> str:
        """Return the name of entry k of x or mu, with its site."""
        width = (self.run.x if name == "x" else self.run.mu).shape[1]
        return f"{name}[{k % width}] at site {k // width}"

    def recorded(self, impact: Impact, place: Place) -> list[GapImpact]:
        """Split an impact by sites."""
        e, gaps, P = impact, self.flow.gaps, impact.impulses[:, 0]
        where = np.flatnonzero(P > 0)
        rates = (place.normal[where] @ gaps.velocity(e.x, mu) for mu in (e.before, e.after))
        each = *(e[where] for e in gaps.owners), P[where], *rates
        return [GapImpact(e.share, *parts) for parts in zip(*each, strict=True)]

    def failed(self, failure: Exception, rows: Trajectory) -> StepFailure:
        """Return the failure of the coming step, at the site that is nearest to its obstacle."""
        flow, cause = self.flow, getattr(failure, "cause", str(failure))
        place, mu = self.moment.place, self.moment.mu
        word, i, _ = flow.gaps.where(int(place.phi.argmin()))
        i = i if word == "site" else int(flow.lattice.pairs[i, 0])
        here = {"x": flow.gaps.of_sites(place.x)[i], "mu": mu.reshape(self.run.mu.shape)[i]}
        return StepFailure(flow.lattice.name, flow.scheme.rule.name, self.index,
                           float(self.run.t0) + self.h * self.index,
                           getattr(failure, "state", here), cause, rows)  # fmt: skip

    def rows_of(self, count: int) -> Trajectory:
        flow, gaps, rows, public = self.flow, self.flow.gaps, self.rows, self.numbers.public
        x = rows["x"][:count, : gaps.N * gaps.n].reshape(count, gaps.N, gaps.n)
        mu, u = (rows[word][:count].reshape(count, gaps.N, gaps.m) for word in ("mu", "u"))
        numbers = np.arange(count, dtype=np.int64)
        phi = {term.word: public(term.phi(x)) for term in gaps.terms}
        P = {word: public(e) for word, e in gaps.by_terms(rows["impulses"][:count, :, 0]).items()}
        t = flow.numbers.multiples(flow.step, numbers * self.every) + self.run.t0
        return Trajectory.of_rows(
            *map(public, (t, x, u, mu)), steps=self.index, step=flow.step, scheme=flow.scheme,
            impacts=self._impacts(),
            newton_mean=self.made / max(1, self.index), solver="Newton, contacts in cones",
            multipliers=np.zeros((count, len(flow.lattice.pairs), 0)),
            gaps=phi.get("site"), bond_gaps=phi.get("bond"),
            impulses=P.get("site"), bond_impulses=P.get("bond"),
        )  # fmt: skip

    def _impacts(self) -> LatticeImpacts:
        e = list(zip(*(e for _, e in self.impacts), strict=True)) or [()] * len(GapImpact._fields)
        t = (np.array([k for k, _ in self.impacts]) + np.array(e[0])) * self.h + self.run.t0
        return LatticeImpacts(self.numbers.public(t), *(np.array(k, np.int64) for k in e[1:4]),
                              *map(self.numbers.public, e[4:]))  # fmt: skip
