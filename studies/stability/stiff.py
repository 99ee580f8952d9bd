"""Families of ever stiffer problems: a scene, its stiffness, and its fastest frequency."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from discmech.integrators import Scheme


@dataclass(frozen=True)
class Family:
    """Variants of a scene along one stiffness.

    `values(s)` are arguments of `Scheme.at`; `frequency(s)` is the fastest frequency ω there, so
    that steps are compared as hω. `adiabatic` names a declared quantity that a fast motion nearly
    keeps.

    title: the family's title, without the number that varies. region: ‖x‖ that the true motion does
    not exceed, None if it has no known bound. held(s): hω up to which an error of the energy of
    (hω)² of its terms leaves the motion bounded. least: time that a run covers if `most` steps
    suffice.
    """

    scene: str
    label: str
    stiffness: tuple[Fraction, ...]
    values: Callable[[Fraction], dict[str, Any]]
    frequency: Callable[[Fraction], float]
    title: str
    adiabatic: str | None = None
    region: Callable[[Fraction], float] | None = None
    held: Callable[[Fraction], float] | None = None
    least: float = 0.0
    most: int = 10**7

    def scheme(self, derived: Scheme, stiffness: Fraction) -> Scheme:
        """Return the scheme of that variant, from the one derived at the scene's own values."""
        return derived.at(**self.values(stiffness))


def _numbers(*values: Any) -> tuple[Fraction, ...]:
    return tuple(Fraction(v) for v in values)


def _kepler(eccentricity: Fraction) -> dict[str, Any]:
    """Return values for a start at the pericentre; its speed is rounded, so e is exact to 1e-16."""
    speed = Fraction(math.sqrt((1 + eccentricity) / (1 - eccentricity)))
    return {"x0": [1 - eccentricity, 0], "v0": [0, speed]}


def _body_frequency(ratio: Fraction) -> float:
    """Return √(ξ·Iξ/I₁) at the scene's spin ξ.

    The step's effective moment about the thin axis is I₁ + h²(ξ·Iξ)/4 by the Cayley map, so the
    energy of the other axes sets the pace there, though the motion itself is slow.
    """
    moments = (1.0, float(ratio), float(ratio) + 0.5)
    return math.sqrt(sum(i * v**2 for i, v in zip(moments, (0.7, 0.6, 0.5), strict=True)))


FAMILIES = {
    family.scene: family
    for family in (
        Family("fpu", "ω", _numbers(50, 100, 200, 500, 1000, 10**4),
               lambda w: {"parameters": {"omega": w}, "x0": [1, 0, 0, 1 / w, 0, 0]}, float,
               "Fermi–Pasta–Ulam chain", "oscillatory energy", region=lambda omega: 3.0,
               least=6e4, most=400_000),  # imex at hω = 9 blows up after T = 54 000
        Family("spring-pendulum", "k", _numbers(*(10**k for k in range(2, 9))),
               lambda k: {"parameters": {"stiffness": k}}, lambda k: math.sqrt(k),
               "Pendulum on a stiff spring", region=lambda k: 1.5),
        Family("kepler", "e", _numbers("0.6", "0.9", "0.97", "0.99", "0.997", "0.999"), _kepler,
               lambda e: math.sqrt((1 + e) / (1 - e) ** 3), "Kepler’s problem",
               region=lambda e: float(1 + e), least=6 * math.pi,  # three turns
               # the pericentre's energy −1/2 is a difference of (3 + e)/(1 − e)/2
               held=lambda e: math.sqrt((1 - e) / (3 + e))),
        Family("rigid-body", "I₂/I₁", _numbers(2, *(10**k for k in range(1, 9))),
               # a rod, with the spin as in the scene
               lambda r: {"parameters": {"inertia": [1, r, r + Fraction(1, 2)]}},
               _body_frequency, "Free rigid body"),
        Family("lagrange-top", "spin", _numbers(1, 3, 10, 30, 100, 300, 1000),
               lambda spin: {"v0": ["0.1", "0.2", spin]}, float, "Lagrange top"),
        Family("charged-particle", "B", _numbers(*(10**k for k in range(0, 7))),
               lambda field: {"parameters": {"field": field}}, float,
               "Charged particle in a uniform field"),
    )
}  # fmt: skip
