"""Starts of a scene with contact: outside the obstacle, with room to move and planes to slip in."""

from __future__ import annotations

import math

import numpy as np

from ...equations import SceneSymbols
from ...errors import BadInput
from ...numbers import arithmetic
from ...numbers.types import Numbers, Vector
from ...scene import Scene
from .gaps import TOUCHING, Gaps, Place

# relative size of a negligible component, and relative difference of equal lengths
NEAR, SAME = 1e-9, 1e-6
DEEPEST = 100  # largest number of corrections in the search for a place outside the obstacle


def check_gaps(s: SceneSymbols, scene: Scene, x0: Numbers | None = None) -> None:
    """Raise `BadInput` unless the start is outside the obstacle and the closed gaps leave room.

    x0: a start other than the scene's, in exact numbers or any arithmetic, without its time.
    """
    numbers = arithmetic(16)
    with numbers.working():
        gaps = Gaps(s, scene, numbers)
        x = np.array([float(e) for e in s.with_time(scene.x0 if x0 is None else x0)])
        try:
            place = gaps.at_start(x)
        # raised by Python's own functions outside their domain
        except (ArithmeticError, ValueError):
            raise BadInput(
                f"{scene.name}: a gap has no real value at x0; begin elsewhere."
            ) from None
        inside = place.phi < -TOUCHING * numbers.eps * place.size
        if inside.any():
            raise BadInput(f"{scene.name}: {_depth(gaps, x, place)}.")
        for i in np.flatnonzero(place.closed):
            if not abs(place.normal[i]).max() > 0:
                why = "has no slope there, so no force keeps it open; write it with a slope (a "
                why += "distance has one)."
                if abs(gaps._place(x, gaps.p)[2][i]).max() > 0:
                    why = f"no motion on {s.groupoid.name} changes it there; leave it out."
                raise BadInput(f"{scene.name}: gap {i} is closed at x0 and {why}")
        for k, own in enumerate(gaps.coordinates):
            if gaps.friction[k] == 0 or len(place.normal[k]) == 1:
                continue  # with one velocity any slip is a multiple of the rate of the gap
            xi = np.array([float(e) for e in scene.v0])
            rows = np.vstack([place.normal[k][None], place.slip[k]])
            if not _independent(gaps.flexibility(x, xi, rows, rows)):
                why = f"the coordinates of gap {k} do not move apart from each other and from the "
                why += "gap; give those of the touching point along its plane."
                if own is None:
                    why = f"motions on {s.groupoid.name} do not span the plane of gap {k}, along "
                    why += "which friction acts; give coordinates of it, (φ, [t, …])."
                raise BadInput(f"{scene.name}: at x0 {why}")
        closed = place.normal[place.closed]
        if opposed(closed):
            listed = ", ".join(map(str, np.flatnonzero(place.closed)))
            raise BadInput(
                f"{scene.name}: the gaps {listed} contradict each other: closed at x0, they leave "
                "no direction to move in that opens them all; a constraint is holonomic=."
            )


def scaled_gaps(s: SceneSymbols, scene: Scene) -> list[str]:
    """Return a sentence for each gap with friction whose φ is not a distance in its coordinates.

    Friction is κ times the normal impulse, which is a force only if φ is a distance. For a point
    with mass, a coordinate of the scene that moves it along the normal alone and another that moves
    it along the plane alone do so by equal amounts, in lengths or in kinetic energy (φ_j²/M_jj =
    t_k²/M_kk). A gap is reported if no two such coordinates do either.
    """
    numbers = arithmetic(16)
    with numbers.working():
        gaps = Gaps(s, scene, numbers)
        x = np.array([float(e) for e in s.with_time(scene.x0)])
        place = gaps.at_start(x)
        xi = np.array([float(e) for e in scene.v0])
        back = gaps.inverse_mass(x, xi).diagonal()
    sentences = []
    for i, own in enumerate(gaps.coordinates):
        if own is None or not gaps.friction[i] > 0:
            continue
        across, along = abs(place.normal[i]), abs(place.slip[i]).max(axis=0)
        least = NEAR * max(across.max(), along.max())
        alone = (across > least) & (along <= least), (along > least) & (across <= least)
        if not (alone[0].any() and alone[1].any()):
            continue
        ratios = [
            np.divide.outer(a[alone[0]], b[alone[1]])
            for a, b in ((across, along), (across**2 * back, along**2 * back))
        ]
        if not any((abs(r - 1) < SAME).any() for r in ratios):
            ratio = min(ratios[0].ravel(), key=lambda r: abs(np.log(r)))
            few = max(3, 2 - math.floor(math.log10(abs(ratio - 1))))  # digits beyond those of 1
            sentences.append(
                f"gap {i} is no distance: it grows by {ratio:.{few}g} where its touching point "
                f"moves by 1 along its plane, so friction is {1 / ratio:.{few}g} of what "
                "friction= says; divide the gap by that, or give the coordinates of the plane in "
                "the same unit."
            )
    return sentences


def unsure_gaps(unsure: list[int]) -> str:
    """Return a sentence for gaps negative within a step, but not beyond round-off."""
    named = ", ".join(map(str, unsure))
    return (
        f"gap {named} was negative within a step by less than the round-off of its terms, so that "
        "nobody can say whether it was met; write it so that its terms do not cancel, as "
        "sqrt((x - a)**2 + (y - b)**2) - r, and no expanded squares."
    )


def _depth(gaps: Gaps, x: Vector, place: Place) -> str:
    """Return how deep a start is inside the obstacle, and a place outside if one is near."""
    i = int(np.argmin(place.phi))
    told = f"x0 is inside the obstacle: gap {i} is {place.phi[i]:.3g}"
    at = x.copy()
    for _ in range(DEEPEST):
        phi, _, slope, *_ = gaps._place(at, gaps.p)
        if (phi >= 0).all():
            return f"{told}; begin outside, such as at x0={[float(e) for e in at[: gaps.n]]}"
        low = phi < 0
        at[: gaps.n] -= np.linalg.pinv(slope[low]) @ (phi[low] * 1.125)
        if not np.isfinite(at).all():
            break
    return f"{told}, and the gaps contradict each other: no place near x0 has all of them open"


def _independent(flexibility: np.ndarray) -> bool:
    """Return True if rows R with the flexibility R M⁻¹Rᵀ are independent, to half the digits.

    The units do not matter. A row of zeros is not independent. If M is not positive, this tells
    nothing.
    """
    own = flexibility.diagonal()
    if not (own > 0).all():
        return bool((own < 0).any())
    scaled = flexibility / np.sqrt(np.outer(own, own))
    return bool(np.linalg.eigvalsh(scaled)[0] > np.finfo(float).eps ** 0.5)


def opposed(rows: np.ndarray) -> bool:
    """Return True if a sum of the rows with weights ≥ 0, not all 0, vanishes.

    Then no direction opens all gaps.
    """
    if len(rows) < 2:
        return False
    from scipy.optimize import nnls  # few starts have two closed gaps

    unit = rows / np.linalg.norm(rows, axis=1)[:, None]
    table = np.vstack([unit.T, np.ones(len(unit))])
    return bool(nnls(table, np.eye(len(table))[-1])[1] < 1e-9)
