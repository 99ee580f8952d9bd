"""Impacts: the momentum jumps within the cones of the contacts, at a place where gaps are closed.

U = G ξ are the velocities of all contacts, U⁻ before and U⁺ after. The mean (U⁺ + e U⁻)/(1 + e)
satisfies the law that U⁺ satisfies without restitution (Moreau 1988). If ξ is affine in μ, U⁺ = U⁻
+ W P, so that P = (1 + e) P_c, where P_c is the impulse for e = 0, and the kinetic energy changes
by (1 + e) [P_c·U_c − (1 − e)/2 P_c·W P_c]; P_c·U_c is the loss by friction. It never grows, for any
e in [0, 1], any number of contacts and any friction. For other Lagrangians the impulse of that law
is shortened if it would raise the energy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from ...numbers import over
from ...numbers.types import MatrixLike, Number, Vector
from .cones import Cones, NotFound, missed, of_parts, scaling
from .gaps import Gaps, Place

Data = TypeVar("Data")

NOISE = 2**10  # a velocity below so many units of round-off of its terms is 0
MOST, STAGNANT = 400, 2**12
NEAR = 4  # largest residual of a solution, in units of the round-off of the motion's velocities
AGAIN = 100  # number of impacts at one place and time: each opens some gap that another one closes


class Active(NamedTuple):
    """Contacts that may push: velocities are along `rows`, impulses along `push`, both (k, m).

    owners (k,): the gap of each entry; none: zero impulses, (K, 1 + D); made: for entries with
    friction, (entry, the impulse 1 in the coordinates of its gap's plane).
    """

    rows: MatrixLike
    push: MatrixLike
    cones: Cones
    owners: np.ndarray
    none: np.ndarray
    made: list[tuple[int, Vector]]

    def total(self, P: Vector) -> np.ndarray:
        """Return the impulses of all gaps, (K, 1 + D)."""
        impulses, normals = self.none.copy(), self.cones.normals
        impulses[self.owners[:normals], 0] += P[:normals]
        for k, along in self.made:
            impulses[self.owners[k], 1 : 1 + len(along)] += P[k] * along
        return impulses

    def noise(self, changed: Vector) -> Vector:
        """Return the largest change of each gap's velocities by impulses, (K,)."""
        changes = self.none[:, 0].copy()
        np.maximum.at(changes, self.owners, changed)
        return changes


def active(
    gaps: Gaps,
    place: Place,
    rough: Sequence[int] | Vector,
    smooth: Sequence[int] | Vector = (),
    sliding: Mapping[int, Vector] = {},
) -> Active:
    """Return the contacts of the gaps `rough`, with friction, and `smooth`, without.

    sliding: for gaps that are known to slip, the direction in the basis of their plane; friction
    then has its full size against it.
    """
    owners = np.append(rough, smooth).astype(np.int64)
    rows = push = place.normal[owners]
    planes = dict[int, tuple[slice, Number]]()
    made, slips, last = list[tuple[int, Vector]](), list[Vector](), len(owners)
    rubbing = list[int]()
    for n, i in enumerate(rough) if gaps.rough else ():
        slip, basis, bound = place.slip[i], place.bases[i], gaps.friction[i] * place.scale[i]
        if i in sliding:
            along, bound = sliding[i], gaps.against * bound
            push = push.copy() if push is rows else push
            push[n] -= bound * (along @ slip)
            made.append((n, -bound * (basis @ along)))
        elif bound > 0:
            made += [(last + k, along) for k, along in enumerate(basis.T)]
            planes[n] = slice(last, last + len(slip)), bound
            slips.append(slip)
            rubbing += [i] * len(slip)
            last += len(slip)
    if slips:
        rows, push = (np.vstack([e, *slips]) for e in (rows, push))
    cones, owners = Cones(len(owners), planes), np.append(owners, rubbing) if slips else owners
    return Active(rows, push, cones, owners, gaps.no_impulses, made)


def in_cones(
    gaps: Gaps, trial: Callable[[Vector], tuple[Vector, Vector, Data]], W: MatrixLike,
    cones: Cones,
) -> tuple[Vector, Data]:  # fmt: skip
    """Return (P, the trial's data) with velocities F(P) in the cones.

    trial: P ↦ (F, unit of F's round-off, any data). W: approximately ∂F/∂P; unless it is a sparse
    matrix of many sites, it is improved on the way (Broyden). Raises `CannotMeasure` if no P is
    found.
    """
    numbers = gaps.numbers
    P = numbers.zeros(W.shape[0])
    F, unit, data = trial(P)
    r, before = scaling(W, cones), np.inf
    for _ in range(MOST):
        units = of_parts(numbers.eps * (abs(P) + r * unit), cones)
        left = _largest(missed(P, F, r, cones), units)
        # redundant contacts might exchange impulses for ever
        if before < np.inf and left <= NEAR:
            return P, data
        try:
            change = gaps.impulses(W, F - W @ P, cones, P) - P
            size = _largest(of_parts(change, cones), units)
        except NotFound as failure:  # once frozen, redundant contacts may contradict each other
            change = failure.near - P
            size = left
        if over(size, before, NEAR, size, size < STAGNANT):
            return P, data
        if not size < np.inf:
            break
        P = P + change
        new, unit, data = trial(P)
        if size > STAGNANT and isinstance(W, np.ndarray):
            W = W + np.outer(new - F - W @ change, change) / (change @ change)
        F, before = new, size
    raise NotFound(P)


def _largest(parts: Vector, units: Vector) -> Number:
    """Return the largest of the parts in their units; a part that is 0 needs no unit."""
    some = parts != 0
    if not some.any():
        return 0
    if not (units[some] > 0).all():
        return np.inf
    size: Number = (parts[some] / units[some]).max()
    return size


def velocity_law(
    gaps: Gaps, place: Place, mu: Vector, near: Vector, contacts: Active, e: Number
) -> tuple[Vector, Vector, Vector]:
    """Return (impulses P, μ + pushᵀP, noise (k,)) of an impact with the restitution e.

    noise: the size of the velocity changes by the impulses.
    """
    xi = gaps.velocity(place.x, mu, near)
    W = gaps.flexibility(place.x, xi, contacts.rows, contacts.push)
    if gaps.quadratic:
        U = contacts.rows @ xi
        try:
            P = gaps.impulses(W, U, contacts.cones, 0 * U)
        except NotFound as failure:  # redundant contacts agree to their velocities' noise
            P, r = failure.near, scaling(W, contacts.cones)
            unit = abs(P) + r * (abs(contacts.rows) @ abs(xi))
            left = missed(P, U + W @ P, r, contacts.cones)
            if not (left <= NOISE * gaps.numbers.eps * of_parts(unit, contacts.cones)).all():
                raise
        P = (1 + e) * P
    else:
        # a velocity may be far smaller than the sizes that determine its round-off: μ, and the
        # start of Newton's method
        known, began = abs(gaps.inverse_mass(place.x, xi)), abs(near)

        def trial(P: Vector) -> tuple[Vector, Vector, Vector]:
            pushed = mu + contacts.push.T @ P
            after = gaps.velocity(place.x, pushed, near)
            size = abs(contacts.rows) @ (abs(after) + began + known @ abs(pushed))
            return contacts.rows @ (after + e * xi), size, after

        P, after = in_cones(gaps, trial, W, contacts.cones)
        P = _without_gain(gaps, place, mu, contacts.push, P, xi, after)
    return P, mu + contacts.push.T @ P, abs(W) @ abs(P)


def _without_gain(
    gaps: Gaps, place: Place, mu: Vector, push: np.ndarray, P: Vector, xi: Vector, after: Vector
) -> Vector:
    """Return s P with the largest s ≤ 1 for which the energy does not rise.

    xi and after are ξ before and after P. H is convex along P and falls at first, so Newton's
    method descends to that s from s = 1.
    """
    wanted = gaps.energy(place.x, xi, mu)
    for _ in range(MOST):
        moved = mu + push.T @ P
        excess, rate = gaps.energy(place.x, after, moved) - wanted, (push.T @ P) @ after
        if not excess > 4 * gaps.numbers.eps * (abs(wanted) + rate):
            break
        P = (1 - excess / rate) * P
        after = gaps.velocity(place.x, mu + push.T @ P, after)
    return P


def returned_share(
    gaps: Gaps, place: Place, mu: Vector, near: Vector, along: Vector, wanted: Number
) -> Number:
    """Return s for which μ − s·along has the energy `wanted` and the gaps close; 1 undoes an
    impulse.

    If the energy is larger for every s, return the s with the least energy.
    """
    xi = gaps.velocity(place.x, mu, near)
    curve = gaps.flexibility(place.x, xi, along[None], along[None])[0, 0]
    rate, excess = (along * xi).sum(), gaps.energy(place.x, xi, mu) - wanted
    least = rate / curve  # the mean of the two solutions s: no square of an energy is formed
    under = max(least * least - 2 * excess / curve, 0 * rate)
    s = least + under**0.5
    for _ in range(6 if under > 0 else 0):  # nothing remains to do if the energy is quadratic in μ
        at = mu - s * along
        xi = gaps.velocity(place.x, at, near)
        rate = (along * xi).sum()
        if not rate < 0:
            break
        step = (gaps.energy(place.x, xi, at) - wanted) / rate
        s = s + step
        if abs(step) <= 4 * gaps.numbers.eps * abs(s):
            break
    return s
