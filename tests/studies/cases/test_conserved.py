"""Random methods and scenes: no drift passes, whatever stands in V, and no sound method fails.

By itself, `python -m tests.studies.cases.test_conserved SEED COUNT`, it prints each verdict.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from fractions import Fraction
from typing import Any

import pytest
import sympy
from sympy import Rational

from discmech.integrators import Scene, one_step, pair
from discmech.integrators.rules import get as rule_of
from tests.studies.cached_results import measured

#: (length, time, mass) in powers of ten
UNITS = [(0, 0, 0), (6, 0, 0), (-9, 0, 0), (0, 4, 0), (0, -6, 0), (0, 0, 12), (-6, 3, -10)]
SOUND = (
    "midpoint", "trapezoidal", "rectangle", "gauss-2", "gauss-3", "lobatto-3", "stoermer-verlet",
    "triple-jump:trapezoidal", "kahan-li-8:midpoint", "implicit-midpoint",
)  # fmt: skip
STEPS = 20_000


def scene_of(drawn: random.Random, units: tuple[int, int, int] = (0, 0, 0)) -> Scene:
    """A bounded motion of one or two coordinates, with a constant in V, in some units."""
    n = drawn.choice((1, 2))
    length, time, mass = (Rational(10) ** k for k in units)
    energy = mass * length**2 / time**2
    kind = drawn.choice(("swing", "quartic", "coupled"))
    a, b, c = (Rational(drawn.randint(1, 9), 4) for _ in range(3))
    constant = drawn.choice((0, 0, 1, -3, 40, 10**4)) * Rational(drawn.randint(1, 9), 3)

    def potential(q: Any) -> Any:
        total = sum(a * e**2 / 2 for e in q)
        if kind == "swing":
            total = sum(-a * sympy.cos(e) for e in q)
        if kind == "quartic":
            total += sum(b * e**4 / 4 for e in q)
        if n == 2 and kind == "coupled":
            total += c * (q[0] - q[1]) ** 2 / 2 + q[0] ** 2 * q[1] ** 2 / 5
        return total

    def lagrangian(x: Any, v: Any, p: Any) -> Any:
        kinetic = mass * sum(e**2 for e in v) / 2
        return kinetic - energy * (constant + potential([e / length for e in x]))

    step = Fraction(drawn.randint(2, 9), 40)
    scale = [Fraction(int(e.p), int(e.q)) for e in (length, length / time, time)]
    x0 = [Fraction(drawn.randint(-20, 20) or 7, 20) * scale[0] for _ in range(n)]
    v0 = [Fraction(drawn.randint(-10, 10), 20) * scale[1] for _ in range(n)]
    return Scene(
        f"random-{kind}-{n}", pair(n), lagrangian, x0=x0, v0=v0, step=step * scale[2],
        duration=10 * scale[2],
    )  # fmt: skip


def drifting(drawn: random.Random) -> Any:
    """A method that gains or loses energy: an explicit one, or a sound one with a loss."""
    size = Rational(drawn.choice((-1, 1)) * drawn.randint(1, 9), 10 ** drawn.randint(2, 9))
    kind = drawn.choice(("theta", "loss", "euler", "heun", "rk3", "rk4", "slope"))

    def explicit(s: Any, z: Any, h: Any) -> Any:
        f = s.f
        k1 = f(z)
        if kind == "euler":
            return z + h * k1
        if kind == "heun":
            return z + h * (k1 + f(z + h * k1)) / 2
        if kind == "rk3":
            k2 = f(z + h * k1 / 2)
            return z + h * (k1 + 4 * k2 + f(z - h * k1 + 2 * h * k2)) / 6
        k2 = f(z + h * k1 / 2)
        k3 = f(z + h * k2 / 2)
        return z + h * (k1 + 2 * k2 + 2 * k3 + f(z + h * k3)) / 6

    def implicit(s: Any, z: Any, Z: Any, h: Any) -> Any:
        if kind == "theta":  # the θ method, off the middle by little
            return Z - z - h * s.f(z + (Z - z) * (Rational(1, 2) + size))
        middle = (z + Z) / 2
        slope = s.f(middle)
        _, mu = s.split(middle)
        if kind == "slope":  # an energy that decays by a part of h² of the rate
            _, mu = s.split(s.df(middle) * s.df(middle) * middle * h**2)
        return Z - z - h * slope + h * abs(size) * s.join([0] * s.n, mu)

    if kind in ("euler", "heun", "rk3", "rk4"):
        found = one_step(order=1, name=f"{kind}-{drawn.randint(0, 10**6)}")(explicit)
    else:
        name = f"{kind}-{drawn.randint(0, 10**6)}"
        found = one_step(order=1, implicit=True, name=name)(implicit)
    return found


def told(rule: Any, scene: Scene) -> str:
    found = measured("energy", scene, rule, 16, STEPS)
    return str(found["verdict"]) + ": " + found["reason"][:100]


def bad_ones(seed: int, count: int) -> list[str]:
    drawn = random.Random(seed)
    return [told(drifting(drawn), scene_of(drawn)) for _ in range(count)]


def sound_ones(seed: int, count: int) -> list[str]:
    drawn = random.Random(seed)
    return [told(rule_of(SOUND[k % len(SOUND)]), scene_of(drawn, UNITS[k % len(UNITS)]))
            for k in range(count)]  # fmt: skip


@pytest.mark.slow
def test_a_drift_and_a_sound_method_of_each_kind():
    assert not [e for e in bad_ones(1, 2) if e.startswith("pass")]
    assert not [e for e in sound_ones(1, 2) if e.startswith("fail")]


@pytest.mark.slow
def test_no_random_drift_passes_and_no_sound_method_fails():
    assert not [e for e in bad_ones(20261126, 20) if e.startswith("pass")]
    assert not [e for e in sound_ones(20261126, 60) if e.startswith("fail")]


if __name__ == "__main__":
    for made in (bad_ones, sound_ones):
        answers = made(int(sys.argv[1]), int(sys.argv[2]))
        print(*answers, Counter(e.partition(":")[0] for e in answers), sep="\n")
