"""Scenes at their edge: variants of extreme scale, stiffness and start, each with its frequency."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ..stability.stiff import FAMILIES


@dataclass(frozen=True)
class Extreme:
    """A variant of a scene at its edge: a name, arguments of `Scheme.at`, the fastest frequency."""

    name: str
    values: dict[str, Any]
    frequency: float


def _upright(tilt: str) -> list[Fraction]:
    """Return a point of the unit sphere, exactly, about `tilt` from the pole."""
    t = Fraction(tilt) / 2
    return [2 * t / (1 + t * t), Fraction(0), (1 - t * t) / (1 + t * t)]


def _kepler_scale(power: int) -> dict[str, Any]:
    """Return all lengths times 10^power at the same times: the strength goes with the cube."""
    size = Fraction(10) ** power
    return {"x0": [Fraction(2, 5) * size, 0], "v0": [0, 2 * size],
            "parameters": {"strength": size**3}}  # fmt: skip


def _stiffest(scene: str, words: str) -> Extreme:
    family = FAMILIES[scene]
    value = family.stiffness[-1]
    return Extreme(f"{words} {float(value):g}", family.values(value), family.frequency(value))


PERICENTRE = FAMILIES["kepler"]
EXTREMES: dict[str, tuple[Extreme, ...]] = {
    "pendulum": (
        *(Extreme(f"mass 1e{p}", {"parameters": {"mass": Fraction(10) ** p}}, 1.0)
          for p in (100, -100)),
        *(Extreme(f"length 1e{p}", {"parameters": {"length": Fraction(10) ** p,
                                                   "gravity": Fraction(10) ** p}}, 1.0)
          for p in (100, -100)),
        Extreme("upright at rest, 1e-12 away", {"x0": ["3.141592653588793"]}, 1.0),
    ),
    "kepler": (
        *(Extreme(f"e = {e}", PERICENTRE.values(Fraction(e)), PERICENTRE.frequency(Fraction(e)))
          for e in ("0.9", "0.99", "0.999")),
        Extreme("lengths 1e100", _kepler_scale(100), 5.0),
        Extreme("lengths 1e-100", _kepler_scale(-100), 5.0),
        Extreme("fall into the centre", {"v0": [0, 0]}, 5.0),
    ),
    "charged-particle": (_stiffest("charged-particle", "field"),),
    "fpu": (_stiffest("fpu", "ω ="),),
    "spring-pendulum": (_stiffest("spring-pendulum", "k ="),),
    "rigid-body": (
        *(Extreme(f"{d} beside the separatrix", {"v0": [d, 1, 0]}, 1.0) for d in ("1e-8", "1e-12")),
        _stiffest("rigid-body", "I₂/I₁ ="),
        *(Extreme(f"inertia 1e{p}", {"parameters": {
            "inertia": [Fraction(k) * Fraction(10) ** p for k in (1, 2, 3)]}}, 1.0)
          for p in (100, -100)),
    ),
    "lagrange-top": (
        Extreme("sleeping", {"x0": _upright("1e-6"), "v0": [0, 0, 10]}, 10.0),
        Extreme("falling", {"x0": _upright("1e-6"), "v0": [0, 0, 1]}, 2.0),
        _stiffest("lagrange-top", "spin"),
    ),
}  # fmt: skip
