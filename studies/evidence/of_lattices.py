"""Single steps of a whole lattice, beside the exact ones, told site by site.

A run asks a rule for L_d of each site and of each bond, with the parameters that are theirs: a rule
may be wrong at one of them alone. So the step that is judged here is that of the lattice itself.
The exact step is an extrapolated one: the trapezoidal rule is self-adjoint, so k steps of h/k
are off by a series in (h/k)², of which each further k takes one power away.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import BadInput, Lattice, Scheme, StepFailure, rules
from discmech.integrators.numbers import mpmath
from discmech.reference import ReferenceFailure

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
from .places import SHARES, random_fraction
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
    """A state of a lattice, x (N, n) and μ (N, m), at a time."""

    x: Any
    mu: Any
    t: Fraction
    beside = False

    def __str__(self) -> str:
        return f"the state of the lattice at t = {float(self.t):.4g}"


def sample_of(lattice: Lattice, seed: int) -> tuple[Lattice, tuple[int, ...]]:
    """Return a lattice of some of its sites without contact, and their numbers there.

    They are all that there are, or those of each kind (fixed or not, degree, parameters), the
    first, the last and others at random, with the neighbours of each. Raises `ReferenceFailure`
    where arrays are parameters of sites and of bonds at once: a part has no such arrays.
    """
    if lattice.has_contact:
        lattice = replace(lattice, contact=None, bond_contact=None, restitution=0)
    most = MOST // lattice.groupoid.dim_x if lattice.groupoid.dim_x else MOST
    if lattice.sites <= most:
        return lattice, tuple(range(lattice.sites))
    drawn, pairs = np.random.default_rng(seed), lattice.pairs
    parts = lattice.split_parameters
    if parts["site"].keys() & parts["bond"].keys():
        raise ReferenceFailure(f"{lattice.name}: its arrays are those of sites and of bonds")
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
    """Return the lattice of some sites and of the bonds among them; sites with other bonds stay."""
    number = {site: k for k, site in enumerate(sites)}
    of_sites = np.isin(lattice.pairs, sites)
    taken: np.ndarray = np.all(of_sites, axis=1)
    leaving = of_sites & ~taken[:, None]
    rim = {*lattice.pairs[leaving].tolist()}
    parts, (x0, v0) = lattice.split_parameters, lattice.start
    given = {**parts["shared"], **{k: a[[*sites]] for k, a in parts["site"].items()},
             **{k: a[taken] for k, a in parts["bond"].items()}}  # fmt: skip
    bonds = [(number[i], number[j]) for i, j in lattice.pairs[taken].tolist()]
    fixed = [number[i] for i in sites if i in rim or not lattice.free[i]]
    return replace(
        lattice, sites=len(sites), bonds=bonds, parameters=given, x0=x0[[*sites]], v0=v0[[*sites]],
        fixed=fixed, fixed_ends=False,
    )  # fmt: skip


def order_of_sites(scheme: Any, seed: int) -> LocalOrder:
    """Return the lowest order that a small step of a lattice shows, with its component and site.

    scheme: that of the lattice. It is `order.local_order`, with the extrapolated step as the exact
    one. Raises `ReferenceFailure` where none is known, or a part is no lattice of its own.
    """
    try:
        lattice, sites = sample_of(scheme.lattice, seed)
        judged = scheme if lattice is scheme.lattice else Scheme(lattice, scheme.rule)
    except BadInput as error:  # such as rods that are straight between sites that stay
        raise ReferenceFailure(str(error)) from None
    steps = _Steps(judged, scheme.order or 2, sites, random.Random(seed))
    missed: StepFailure | None = None
    found: list[ComponentOrder] = []
    shown: tuple[Fraction, ...] = ()
    for place in steps.places():
        try:
            if len(found) >= PLACES * steps.count:
                found += steps.orders_at(place, shown) if steps.unlike(place, shown, found) else []
                continue
            for longest in steps.longest:
                pair = steps.drawn_steps(longest)
                here = steps.orders_at(place, pair)
                if any(c.order is not None for c in here):
                    break
            found, shown = found + here, shown or pair
        except StepFailure as failure:
            missed = failure
    if not found:
        return unknown(" ".join(str(missed).split()), refused=True)
    seen = [c for c in found if c.order is not None]
    if not seen:
        return LocalOrder(None, "", float(shown[0]), components=tuple(found))
    lowest = min(seen, key=lambda c: c.order or 0.0)
    return LocalOrder(lowest.order, lowest.name, float(shown[0]), lowest.place, tuple(found))


def _symmetric(lattice: Lattice) -> Any:
    """Return the scheme of a self-adjoint rule of one step that runs on a lattice.

    Raises `ReferenceFailure` if there is none: then no exact step is known.
    """
    for name in ("trapezoidal", "midpoint"):
        scheme: Any = Scheme(lattice, rules.get(name))
        with suppress(StepFailure):
            scheme.flow(lattice.step).trajectory(1)
            if scheme.equations.self_adjoint:
                return scheme
    raise ReferenceFailure(f"{lattice.name}: no self-adjoint rule runs on it")


class _Steps:
    """Small steps of a rule on a lattice from states on its motion and beside it."""

    def __init__(
        self, judged: Any, expected: int, sites: tuple[int, ...], drawn: random.Random
    ) -> None:
        self.lattice = lattice = judged.lattice
        self.expected, self.drawn = expected, drawn
        self.judged, self.exact = judged, _symmetric(lattice)
        self.digits = digits_for(expected)
        self.moving = moving = np.flatnonzero(lattice.free).tolist()
        n, m = lattice.groupoid.dim_x, lattice.groupoid.dim_u
        self.names = [f"{word}[{i}] of site {sites[k]}" for word, size in (("x", n), ("mu", m))
                      for k in moving for i in range(size)]  # fmt: skip
        self.count, self.of_x = len(self.names), len(moving) * n

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

    def places(self) -> Iterator[SitesPlace]:
        """Yield states of a run through the motion.

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
        for place, k in enumerate(drawn):
            x, mu = run.x[k], run.mu[k]
            if place < PLACES - 1 and not tied:
                share = self.drawn.uniform(*SHARES)
                if self.lattice.groupoid.canonical:
                    x = self._beside(x, of_x, share)
                mu = self._beside(mu, of_mu, share)
            yield SitesPlace(x, mu, Fraction(run.step) * k)

    def _smooth(self) -> Any:
        """Return a run of many short steps, of the rule that is judged where it makes them."""
        for scheme in (self.judged, self.exact):
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
        self, place: SitesPlace, steps: Sequence[Fraction], found: Sequence[ComponentOrder]
    ) -> bool:
        """Return True if a step from a place has an error far above those of its component."""
        known: dict[str, Any] = {}
        for c in found:
            known[c.name] = max(c.error, known.get(c.name, 0))
        return any(abs(error) > UNLIKE * max(known[name], CLEAR * bound)
                   for name, error, bound in self.errors(place, steps[0]))  # fmt: skip

    def errors(self, place: SitesPlace, step: Fraction) -> list[StepError]:
        """Return the errors of a step from a place, of all components of the sites that move.

        What more digits change of the step bounds its round-off, of all components of one kind.
        """
        with mpmath.workdps(self.digits + 2 * GUARD):
            end = self._ends(self.judged, step, 1, place, self.digits + GUARD)
            rough = self._ends(self.judged, step, 1, place, self.digits)
            gap = end - self._extrapolated(step, place)
            parts = slice(self.of_x), slice(self.of_x, None)
            unit = mpmath.mpf(10) ** -self.digits
            bounds = np.zeros_like(end)
            for part in parts:
                if len(end[part]):
                    bounds[part] = max(abs(end - rough)[part]) + unit * max(abs(end[part]))
            return [*zip(self.names, gap, bounds, strict=True)]

    def _extrapolated(self, step: Fraction, place: SitesPlace) -> np.ndarray:
        """Return the exact end of a step, to a power of it that is higher than its error's."""
        table: list[list[np.ndarray]] = []
        for k in range(1, self.expected // 2 + BEYOND + 1):
            row = [self._ends(self.exact, step / k, k, place, self.digits + GUARD)]
            for j, before in enumerate(table[-1] if table else ()):
                ratio = mpmath.mpf(k) ** 2 / mpmath.mpf(k - j - 1) ** 2
                row.append(row[-1] + (row[-1] - before) / (ratio - 1))
            table.append(row)
        return table[-1][-1]

    def _ends(
        self, scheme: Any, step: Fraction, count: int, place: SitesPlace, digits: int
    ) -> np.ndarray:
        flow = scheme.flow(step, digits)
        run = flow.trajectory(count, count, x0=place.x, mu0=place.mu, t0=place.t)
        ends = [part[-1][self.moving].ravel() for part in (run.x, run.mu)]
        return np.concatenate(ends)
