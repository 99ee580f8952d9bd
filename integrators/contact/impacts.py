"""Impacts: the momentum jumps within the cones of the contacts, at a place where gaps are closed.

With U = G ξ the velocities of all contacts, U⁻ → U⁺, the mean (U⁺ + e U⁻)/(1 + e) meets the law
that without restitution U⁺ does (Moreau 1988). Where ξ is affine in μ, U⁺ = U⁻ + W P, so that
P = (1 + e) P_c, P_c the impulse for e = 0, and the kinetic energy changes by
(1 + e) [P_c·U_c − (1 − e)/2 P_c·W P_c]; P_c·U_c is what friction takes. It never grows, whatever e
in [0, 1], the number of contacts and the friction are. Of other Lagrangians the impulse of that law
is made shorter where it would raise the energy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import CannotMeasure
from ..numbers.types import Number, Vector
from .cones import NOT_FOUND, Cone, parts, scaling
from .gaps import Gaps, Place

NOISE = 2**10  # units of round-off of its terms below which a velocity is 0
MOST, STAGNANT = 60, 2**12
AGAIN = 100  # impacts at one place and time: each opens some gap that another one closes


class Active(NamedTuple):
    """Contacts that may push: velocities are along `rows`, impulses along `push`, both (k, m).

    owners: of each entry, its gap; made (k, K, 1 + D): what an impulse of 1 is of each gap, normal
    and along the coordinates of its plane.
    """

    rows: np.ndarray
    push: np.ndarray
    cones: list[Cone]
    owners: list[int]
    made: np.ndarray

    def total(self, P: Vector) -> np.ndarray:
        """The impulses of all gaps, (K, 1 + D)."""
        return np.tensordot(P, self.made, 1)


def width(gaps: Gaps) -> int:
    """1 + D: a gap's normal impulse, and those along its coordinates, if it has friction."""
    rough = (e for e, kappa in zip(gaps.coordinates, gaps.friction, strict=True) if kappa > 0)
    return 1 + max((gaps.n if e is None else len(e) for e in rough), default=0)


def active(
    gaps: Gaps,
    place: Place,
    rough: Sequence[int],
    smooth: Sequence[int] = (),
    sliding: Mapping[int, Vector] | None = None,
) -> Active:
    """The contacts of the gaps `rough`, with friction, and `smooth`, without.

    sliding: of gaps that are known to slip, the direction, in the basis of their plane: friction
    then has its full size against it.
    """
    rows: list[Vector] = []
    push: list[Vector] = []
    made: list[np.ndarray] = []
    cones, owners = list[Cone](), list[int]()
    for i in [*rough, *smooth]:
        normal, slip, basis = place.normal[i], place.slip[i], place.bases[i]
        bound = gaps.friction[i] * place.scale[i]
        forward = normal
        each = gaps.numbers.zeros(gaps.count, width(gaps))
        each[i, 0] += 1
        first = len(rows)
        along = (sliding or {}).get(i)
        if along is not None:
            bound = gaps.against * bound
            forward = normal - bound * (along @ slip)
            each[i, 1 : 1 + len(place.where[i])] -= bound * (
                along if basis is None else basis @ along
            )
        rows.append(normal)
        push.append(forward)
        made.append(each)
        if i in rough and along is None and gaps.friction[i] > 0:
            for k, row in enumerate(slip):
                rows.append(row)
                push.append(row)
                each = gaps.numbers.zeros(gaps.count, width(gaps))
                if basis is None:
                    each[i, 1 + k] += 1
                else:
                    each[i, 1 : 1 + len(basis)] += basis[:, k]
                made.append(each)
        cones.append(Cone(first, slice(first + 1, len(rows)), bound))
        owners += [i] * (len(rows) - first)
    shape = (len(rows), place.normal.shape[1])
    dtype: Any = place.normal.dtype
    return Active(
        np.array(rows, dtype=dtype).reshape(shape), np.array(push, dtype=dtype).reshape(shape),
        cones, owners, np.array(made, dtype=dtype).reshape(len(rows), gaps.count, width(gaps)),
    )  # fmt: skip


def in_cones(gaps: Gaps, trial: Any, W: np.ndarray, cones: list[Cone]) -> tuple[Vector, Any]:
    """(P, what the trial gives) with velocities F(P) in the cones.

    trial: P ↦ (F, unit of F's round-off, anything). W: nearly ∂F/∂P, improved on the way
    (Broyden). Raises `CannotMeasure` where none is found.
    """
    numbers = gaps.numbers
    P = numbers.zeros(len(W))
    F, unit, data = trial(P)
    r, before = scaling(W, cones), None
    for _ in range(MOST):
        change = gaps.impulses(W, F - W @ P, cones, P) - P
        units = numbers.eps * (abs(P) + r * unit)
        size = max(max(abs(change[k])) / (max(units[k]) + numbers.eps**4)
                   for k in parts(cones) if k.start < k.stop)  # fmt: skip
        if size <= 4 or (before is not None and before / 2 <= size < STAGNANT):
            return P, data
        if not size < np.inf:
            break
        P = P + change
        new, unit, data = trial(P)
        if size > STAGNANT:
            W = W + np.outer(new - F - W @ change, change) / (change @ change)
        F, before = new, size
    raise CannotMeasure(NOT_FOUND)


def velocity_law(
    gaps: Gaps, place: Place, mu: Vector, near: Vector, contacts: Active, e: Number
) -> tuple[Vector, Vector, Vector]:
    """(impulses P, μ + pushᵀP, noise (k,)) of an impact with the restitution e; 0: no rebound.

    noise: by how much the impulses change each velocity.
    """
    xi = gaps.velocity(place.x, mu, near)
    W = gaps.flexibility(place.x, xi, contacts.rows, contacts.push)
    if gaps.quadratic:
        P = (1 + e) * gaps.impulses(W, contacts.rows @ xi, contacts.cones, 0 * W[0])
    else:
        # a velocity may be far below what its round-off is a part of: μ, and where Newton began
        known, began = abs(gaps.inverse_mass(place.x, xi)), abs(near)

        def trial(P: Vector) -> tuple[Vector, Vector, Any]:
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
    """s P with the largest s ≤ 1 by which the energy does not rise; ξ before and after P.

    H is convex along P and falls at first, so Newton's method comes down to that s from s = 1.
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


def given_back(
    gaps: Gaps, place: Place, mu: Vector, near: Vector, along: Vector, wanted: Number
) -> Vector:
    """μ − s·along, so that the energy is `wanted` and the gaps close; s = 1 undoes an impulse.

    Where the place has more energy at any s, the s with the least.
    """
    xi = gaps.velocity(place.x, mu, near)
    curve = gaps.flexibility(place.x, xi, along[None], along[None])[0, 0]
    rate, excess = along @ xi, gaps.energy(place.x, xi, mu) - wanted
    under = rate * rate - 2 * curve * excess
    if under <= 0:
        least: Vector = mu - (rate / curve) * along
        return least
    s = (rate + under**0.5) / curve
    for _ in range(6):  # nothing is left to do where the energy is quadratic in μ
        at = mu - s * along
        xi = gaps.velocity(place.x, at, near)
        if not along @ xi < 0:
            break
        step = (gaps.energy(place.x, xi, at) - wanted) / (along @ xi)
        s = s + step
        if abs(step) <= 4 * gaps.numbers.eps * abs(s):
            break
    found: Vector = mu - s * along
    return found
