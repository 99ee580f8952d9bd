"""Single steps of a whole lattice, beside the exact ones, told site by site.

A run asks a rule for L_d of each site and of each bond, with the parameters that are theirs: a rule
may be wrong at one of them alone. So the step that is judged here is that of the lattice itself.
The exact step is an extrapolated one: the trapezoidal rule is self-adjoint, so k steps of h/k
are off by a series in (h/k)², of which each further k takes one power away. The form is measured in
states of a run (`symplecticity`): L_d of any rule gives it.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from discmech.integrators import BadInput, Lattice, Scheme, StepFailure
from discmech.integrators.extensions.lattices import scene_of
from discmech.integrators.numbers import mpmath
from discmech.reference import ReferenceFailure

from ..core.single_steps import Departure, EffectiveOrder
from . import Evidence, evidence_of, own_rules
from .floats import end_of
from .laws import ARROW, SHORT, Law, short_arrow
from .order import (
    CLEAR,
    FALLEN,
    FIRST,
    GUARD,
    RATIO,
    SMALL,
    UNLIKE,
    ComponentOrder,
    LocalOrder,
    StepError,
    digits_for,
    orders,
    unknown,
)
from .places import SHARES, is_quadratic, random_fraction, seed_from
from .scan import highest, peaks_of

#: numbers of the state, up to which all sites are taken; of more some, with their neighbours
MOST = 96
#: states from which orders are told, and those along the motion from which one step is made
PLACES, ALONG = 2, 6
#: states where the run is least smooth, at most
ROUGH = 6
#: steps of the run to them, at most; with constraints, where they need all digits
MANY, FEW = 4096, 12
#: powers of the step that are known exactly beyond that of the error
BEYOND = 2


@dataclass(frozen=True)
class SitesPlace:
    """A state of a lattice, x (N, n) and μ (N, m), at a time; length: as of a `Place`."""

    x: Any
    mu: Any
    t: Fraction
    length: Fraction
    beside = False

    @property
    def start(self) -> dict[str, Any]:
        """Return the place as arguments of `LatticeFlow.trajectory`."""
        return {"x0": self.x, "mu0": self.mu, "t0": self.t}

    def __str__(self) -> str:
        return f"the state of the lattice at t = {float(self.t):.4g}"


def sample_of(lattice: Lattice, seed: int) -> tuple[Lattice, tuple[int, ...]]:
    """Return a lattice of some of its sites without contact, and their numbers there.

    They are all that there are, or those of each kind (fixed or not, degree, parameters), the
    first, the last and others at random, with the neighbours of each.
    """
    if lattice.has_contact:
        lattice = replace(lattice, contact=None, bond_contact=None, restitution=0)
    most = MOST // lattice.groupoid.dim_x if lattice.groupoid.dim_x else MOST
    if lattice.sites <= most:
        return lattice, tuple(range(lattice.sites))
    drawn, pairs = np.random.default_rng(seed), lattice.pairs
    parts = lattice.split_parameters
    kinds = [lattice.free[:, None], np.bincount(pairs.ravel(), minlength=lattice.sites)[:, None]]
    kinds += [a.reshape(lattice.sites, -1) for a in parts["site"].values()]
    _, of_each = np.unique(np.hstack(kinds), axis=0, return_index=True)
    of_bonds = [a.reshape(len(pairs), -1) for a in parts["bond"].values()]
    if of_bonds:
        _, bonds = np.unique(np.hstack(of_bonds), axis=0, return_index=True)
        of_each = np.concatenate([of_each, pairs[bonds, 0]])
    others = drawn.permutation(lattice.sites)[:most]
    chosen: set[int] = set()
    for i in [0, lattice.sites - 1, *drawn.permutation(of_each)[:most], *others]:
        near = pairs[(pairs == i).any(axis=1)].ravel().tolist()
        if len(more := chosen | {int(i), *near}) <= most:  # one with many neighbours stays out
            chosen = more
    return part_of(lattice, sorted(chosen)), tuple(sorted(chosen))


def part_of(lattice: Lattice, sites: Sequence[int]) -> Lattice:
    """Return the lattice of some sites and of the bonds among them; sites with other bonds stay.

    With constraints these move, too: a row between two sites that stay may be redundant. An array
    that is one of sites and of bonds holds the i-th of both: so the part has both, beside its own
    sites such as stay, and beside its bonds such as join two that stay. Raises `ReferenceFailure`
    if there are no two.
    """
    number = {site: k for k, site in enumerate(sites)}
    of_sites = np.isin(lattice.pairs, sites)
    taken: np.ndarray = np.all(of_sites, axis=1)
    leaving = of_sites & ~taken[:, None]
    rim = {*lattice.pairs[leaving].tolist()} if lattice.constraint is None else set[int]()
    parts, (x0, v0) = lattice.split_parameters, lattice.start
    own, links = [*sites], np.flatnonzero(taken).tolist()
    if both := parts["site"].keys() & parts["bond"].keys():
        links = own = own + [b for b in links if b not in number]
    elif len(own) == len(links):  # arrays of sites are none of bonds
        own.append(own[0])
    fixed = [k for k, i in enumerate(own) if k >= len(sites) or i in rim or not lattice.free[i]]
    if both and len(fixed) < 2:
        raise ReferenceFailure(f"{lattice.name}: its arrays are those of sites and of bonds.")
    bonds = np.array([[number[i] for i in lattice.pairs[b].tolist()] if taken[b]
                      else [fixed[0], fixed[-1]] for b in links])  # fmt: skip
    parameters = {**parts["shared"], **{k: a[own] for k, a in parts["site"].items()},
                  **{k: a[links] for k, a in parts["bond"].items()}}  # fmt: skip
    return replace(
        lattice, sites=len(own), bonds=bonds, parameters=parameters, x0=x0[own], v0=v0[own],
        fixed=fixed, fixed_ends=False,
    )  # fmt: skip


def _symmetric(lattice: Lattice) -> Any:
    """Return the scheme of a self-adjoint rule of one step that runs on a lattice.

    Raises `ReferenceFailure` if there is none: then no exact step is known.
    """
    for rule in (own_rules.trapezoidal, own_rules.midpoint):
        scheme: Any = Scheme(lattice, rule)
        with suppress(StepFailure):
            scheme.flow(lattice.step).trajectory(1)
            if scheme.equations.self_adjoint:
                return scheme
    raise ReferenceFailure(f"{lattice.name}: no self-adjoint rule runs on it")


class LatticeEvidence(Evidence):
    """The evidence of a lattice: small steps from states on its motion and beside it.

    scheme: that of the lattice; whole: that of the sites whose steps are made, all or a sample.
    Raises `ReferenceFailure` where no exact step is known, or a part is no lattice of its own.
    """

    scheme: Any
    whole: Any = None
    unscanned, around = "", (0, ())

    def __init__(self, scheme: Any) -> None:
        of = scheme.lattice
        words = of.name, of.step, of.start, of.pairs, of.parameters
        self.scheme, self.seed = scheme, seed_from(repr(words), scheme.rule)
        self._departures = {}
        try:
            self.lattice, sites = sample_of(scheme.lattice, self.seed)
            self.whole = self.with_rule(scheme.rule)
        except BadInput as error:  # such as a part of constraints that are a ring
            raise ReferenceFailure(str(error)) from None
        lattice, self.exact = self.lattice, _symmetric(self.lattice)
        self.expected, self.drawn = scheme.order or 2, random.Random(self.seed)
        self.digits = digits_for(self.expected)
        self.moving = np.flatnonzero(lattice.free).tolist()
        n, m = lattice.groupoid.dim_x, lattice.groupoid.dim_u
        #: of sites that a sample has beside those of the lattice, which stay, there is no number
        self.sites = [*sites, *[-1] * (lattice.sites - len(sites))]
        self.names = [f"{word}[{i}] of site {site}" for word, size in (("x", n), ("mu", m))
                      for site in self.sites for i in range(size)]  # fmt: skip
        self.count, self.of_x = len(self.names), lattice.sites * n

    def with_rule(self, rule: Any) -> Any:
        """Return the scheme of the sites by a rule."""
        return Scheme(self.lattice, rule)

    @property
    def effective(self) -> EffectiveOrder:
        """The judgement of the effective order, on the lattice as a scene."""
        return evidence_of(Scheme(scene_of(self.scheme.lattice), self.scheme.rule)).effective

    @property
    def linear(self) -> bool:
        """True if the equations are linear: quadratic terms on pairs, linear forces."""
        lattice, equations = self.lattice, self.scheme.equations
        plain = lattice.groupoid.canonical and lattice.constraint is None and not lattice.timed
        return plain and all(map(is_quadratic, (equations.site.s, equations.bond_symbols)))

    @cached_property
    def order(self) -> LocalOrder:
        """The lowest order that a small step shows, with its component and site.

        It is `order.local_order`, with the extrapolated step as the exact one.
        """
        missed: StepFailure | None = None
        components: list[ComponentOrder] = []
        shown: tuple[Fraction, ...] = ()
        for place in self.places:
            try:
                if len(components) >= PLACES * self.count:
                    if self.unlike(place, shown, components):
                        components += self.orders_at(place, shown)
                    continue
                for longest in self.longest:
                    pair = self.drawn_steps(longest)
                    here = self.orders_at(place, pair)
                    if any(c.order is not None for c in here):
                        break
                components, shown = components + here, shown or pair
            except StepFailure as failure:
                missed = failure
        if not components:
            return unknown(" ".join(str(missed).split()), refused=True)
        seen = [c for c in components if c.order is not None]
        if not seen:
            return LocalOrder(None, "", float(shown[0]), components=tuple(components))
        lowest = min(seen, key=lambda c: c.order or 0.0)
        return LocalOrder(
            lowest.order, lowest.name, float(shown[0]), lowest.place, tuple(components)
        )

    def departure(self, law: Law) -> Departure:
        """Return the largest departure from a law; a run is asked for all but the arrow."""
        if law is not ARROW:
            return Departure(unknown="it is asked of a lattice's run.")
        departures = map(self.arrow, self.places[:PLACES])
        return max(departures, key=lambda one: np.nan_to_num(one.size or 0, nan=np.inf))

    def arrow(self, place: SitesPlace) -> Departure:
        """Return how far u of a step to 0 is from that of the exact one (`laws.ArrowVelocity`)."""
        short = SHORT * self.longest[0]
        ours, exact = (short_arrow(scheme, place, short, self.digits)
                       for scheme in (self.whole, self.exact))  # fmt: skip
        with mpmath.workdps(self.digits):
            gaps = abs(ours - exact).max(axis=1)
            size = float(max(gaps) / (abs(exact).max() or 1))
        where = f"site {self.sites[int(np.argmax(gaps))]}, in {place}"
        return Departure(size, float(2**20 * SHORT**2), step=float(short), place=where)

    @property
    def longest(self) -> list[Fraction]:
        """The longest steps that are tried, as shares of the lattice's own (`order.SMALL`)."""
        powers = (float((self.digits - 14) * part) / (self.expected + 1) for part in SMALL)
        return [Fraction(self.lattice.step) * Fraction(10.0**-power) for power in powers]

    def drawn_steps(self, longest: Fraction) -> tuple[Fraction, Fraction]:
        """Return two steps whose ratio is drawn."""
        first = longest * random_fraction(self.drawn, *FIRST)
        ratio = Fraction(10.0 ** (-FALLEN / (self.expected + 1)))
        return first, first * ratio * random_fraction(self.drawn, *RATIO)

    @cached_property
    def places(self) -> list[SitesPlace]:  # type: ignore[override]
        """States of a run through the motion.

        First are PLACES, all but one of them beside it, then those where the run is least smooth
        (`scan`), then others.
        With constraints they are the first of the run, to all digits: others leave them by theirs.
        """
        tied = self.lattice.constraint is not None
        run = self._run(self.exact, FEW, self.digits + GUARD) if tied else self._smooth()
        count = len(run.t)
        of_x = np.ptp(run.x, axis=0).max() or abs(run.x).max() or 1.0
        # at rest that of a motion through a tenth of the largest x in a step
        slow = np.full(run.mu[0].shape, float(of_x) / (10 * float(self.lattice.step)))
        momenta = self.exact.flow(self.lattice.step).momenta
        of_mu = abs(run.mu).max() or abs(momenta(run.x[0], slow)).max()
        drawn = self.drawn.sample(range(count), min(count, PLACES + ALONG))
        rows = np.hstack([np.array(e, dtype=float).reshape(count, -1) for e in (run.x, run.mu)])
        rough = highest([] if tied else peaks_of(rows, Fraction(run.step), 2.0**-53), ROUGH)
        drawn[PLACES:PLACES] = [int(peak.time / run.step) for peak in rough]
        places, length = list[SitesPlace](), 8 * Fraction(self.lattice.step)
        for place, k in enumerate(drawn):
            x, mu = run.x[k], run.mu[k]
            if place < PLACES - 1 and not tied:
                share = self.drawn.uniform(*SHARES)
                if self.lattice.groupoid.canonical:
                    x = self._beside(x, of_x, share)
                mu = self._beside(mu, of_mu, share)
            places.append(SitesPlace(x, mu, Fraction(run.step) * k, length))
        return places

    def _smooth(self) -> Any:
        """Return a run of many short steps, of the rule that is judged where it makes them."""
        for scheme in (self.whole, self.exact):
            with suppress(StepFailure):
                return self._run(scheme, MANY, 16)
        return self._run(self.exact, 1, 16)

    def _run(self, scheme: Any, most: int, digits: int) -> Any:
        """Return a run through the duration, or of so many steps of the lattice's own size."""
        duration, step = Fraction(self.lattice.duration), Fraction(self.lattice.step)
        whole = duration / step <= most
        size = duration / most if whole and digits == 16 else step
        return scheme.flow(size, digits).trajectory(min(most, max(1, int(duration / size))))

    def _beside(self, values: np.ndarray, size: float, share: float) -> np.ndarray:
        """Return values of the sites that move, changed by a share of that size."""
        moved = values.copy()
        for k in self.moving:
            moved[k] += [self.drawn.uniform(-share, share) * size for _ in values[k]]
        return moved

    def orders_at(self, place: SitesPlace, steps: Sequence[Fraction]) -> list[ComponentOrder]:
        """Return the order of each component from a place (`order.orders`)."""

        def errors(steps: Sequence[Fraction]) -> list[list[StepError]]:
            return [self.errors(place, step) for step in steps]

        return orders(self.expected, place, steps, errors, self.digits)

    def unlike(
        self, place: SitesPlace, steps: Sequence[Fraction], components: Sequence[ComponentOrder]
    ) -> bool:
        """Return True if a step from a place has an error far above those of its component."""
        known: dict[str, Any] = {}
        for c in components:
            known[c.name] = max(c.error, known.get(c.name, 0))
        return any(abs(error) > UNLIKE * max(known[name], CLEAR * bound)
                   for name, error, bound in self.errors(place, steps[0]))  # fmt: skip

    def errors(self, place: SitesPlace, step: Fraction) -> list[StepError]:
        """Return the errors of a step from a place, of all components of the sites that move.

        What more digits change of the step bounds its round-off, of all components of one kind.
        """
        with mpmath.workdps(self.digits + 2 * GUARD):
            end = end_of(self.whole, place, step, self.digits + GUARD)
            rough = end_of(self.whole, place, step, self.digits)
            gap = end - self._extrapolated(place, step)
            parts = slice(self.of_x), slice(self.of_x, None)
            unit = mpmath.mpf(10) ** -self.digits
            bounds = np.zeros_like(end)
            for part in parts:
                if len(end[part]):
                    bounds[part] = max(abs(end - rough)[part]) + unit * max(abs(end[part]))
            return [*zip(self.names, gap, bounds, strict=True)]

    def _extrapolated(self, place: SitesPlace, step: Fraction) -> np.ndarray:
        """Return the exact end of a step, to a power of it that is higher than its error's."""
        table: list[list[np.ndarray]] = []
        for k in range(1, self.expected // 2 + BEYOND + 1):
            row = [end_of(self.exact, place, step / k, self.digits + GUARD, k)]
            for j, before in enumerate(table[-1] if table else ()):
                ratio = mpmath.mpf(k) ** 2 / mpmath.mpf(k - j - 1) ** 2
                row.append(row[-1] + (row[-1] - before) / (ratio - 1))
            table.append(row)
        return table[-1][-1]
