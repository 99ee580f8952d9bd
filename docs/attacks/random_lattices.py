"""Random lattices and control problems, sound and not: what `discmech` says of them.

`python random_lattices.py SEED [UNSOUND SOUND [lattices|control]]` prints a line a trial, and
counts; without the last word every fourth trial is of control. Every
trial is drawn from its number and the seed, in units of length, time and mass of its own.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy
from sympy import Rational

from discmech import (
    BadInput,
    Control,
    Lattice,
    Scene,
    check,
    discretisation,
    midpoint,
    pair,
    trapezoidal,
)
from discmech.integrators.rules import gauss
from discmech.integrators.rules import get as rule_of

STEPS = 1_000


def power(drawn: random.Random, most: int = 6) -> sympy.Rational:
    return sympy.Integer(10) ** drawn.randint(-most, most)


def quotient(drawn: random.Random, low: float, high: float) -> sympy.Rational:
    return Rational(round(drawn.uniform(low, high) * 1000), 1000)


def lattice(drawn: random.Random, name: str) -> Lattice:
    """Masses on nonlinear springs, on a chain, a ring or a list of bonds, some above a table."""
    X, T, M = (power(drawn) for _ in range(3))
    N, dim = drawn.randint(4, 9), drawn.choice((1, 1, 2))
    a, b, g = (quotient(drawn, 0.3, 1.5) for _ in range(3))
    bonds: Any = drawn.choice(("chain", "ring", [(i, i + 1) for i in range(N - 1)] + [(0, 2)]))
    contact = dim == 1 and drawn.random() < 0.3
    rng = np.random.default_rng(drawn.randrange(2**32))
    masses = rng.uniform(0.5, 2, N)
    energy = M * X**2 / T**2

    def on_site(x: Any, v: Any, p: Any) -> Any:
        height = x[0] / X
        pull = g * height if contact else b * (1 - sympy.cos(height)) / 3
        return energy * (p.mass * v.dot(v) * (T / X) ** 2 / 2 - pull)

    def on_bond(x: Any, y: Any, p: Any) -> Any:
        r = (y - x).dot(y - x) / X**2
        return -energy * (a * r / 2 + b * r**2 / 8)

    x0 = rng.uniform(0.2, 0.6, (N, dim)) * float(X)
    v0 = rng.uniform(-0.3, 0.3, (N, dim)) * float(X / T)
    return Lattice(
        name, pair(dim), N, {"mass": masses}, on_site, on_bond, bonds, x0, v0, duration=20 * T,
        step=T / 40, restitution=Rational(1, 2) if contact else 0,
        contact=(lambda x, p: [x[0] / X]) if contact else None,
    )  # fmt: skip


def problem(drawn: random.Random, name: str) -> Control:
    """A mass on a nonlinear spring that is steered to a place, of a convex cost."""
    X, T, M, C = (power(drawn) for _ in range(4))
    a, b, end = (quotient(drawn, 0.2, 1.2) for _ in range(3))
    energy, force = M * X**2 / T**2, M * X / T**2

    def lagrangian(x: Any, v: Any, p: Any) -> Any:
        y = x[0] / X
        return energy * ((v[0] * T / X) ** 2 / 2 - a * y**2 / 2 - b * (1 - sympy.cos(y)))

    def cost(x: Any, v: Any, f: Any, p: Any) -> Any:
        return C * ((f[0] / force) ** 2 / 2 + b * (x[0] / X) ** 2 / 10)

    scene = Scene(name, pair(1), lagrangian, x0=[0], v0=[0], duration=2 * T, step=T / 20)
    return Control(scene, cost, end=([end * X], [0]))


def sound_rule(drawn: random.Random, number: int, of_lattice: bool) -> Any:
    """A published rule, or a symmetric one with random weights."""
    known = [trapezoidal, midpoint, gauss(2), gauss(3)]
    if of_lattice:
        known.append(rule_of("triple-jump:midpoint"))
    if drawn.random() < 0.6:
        return drawn.choice(known)
    # a cost whose control has a negative weight somewhere has no minimum
    w = quotient(drawn, -0.5, 1.5) if of_lattice else quotient(drawn, 0.1, 0.9)

    def mixed(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        ends = L(x, u) + L(G.target(x, u, h), u)
        return h * (w * L(G.target(x, u, h / 2), u) + (1 - w) * ends / 2)

    mixed.__name__ = f"mixed_{number}"
    return discretisation(order=2)(mixed)


def unsound_rule(drawn: random.Random, number: int) -> Any:
    """A rule of a lower order than declared, or of another motion, by little."""
    eps = Rational(1, 10 ** drawn.randint(3, 11))
    theta, kind = Rational(1, 2), drawn.randrange(5)

    def wrong(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        m = G.target(x, u, theta * h)
        if kind == 0:
            return h * L(G.target(x, u, (theta + eps) * h), u)
        if kind == 1:
            return h * L(m, u) + eps * h * (L(m, 0 * u) - L(x, 0 * u))
        if kind == 2:
            return h * L(m, u * (1 + eps))
        if kind == 3:
            return h * ((1 + eps) * L(x, u) + (1 - eps) * L(G.target(x, u, h), u)) / 2
        return h * L(m, u)  # midpoint, said to be of order 4

    wrong.__name__ = f"wrong_{kind}_{number}"
    return discretisation(order=4 if kind == 4 else 2)(wrong)


def trial(seed: str, number: int, rule: Callable[..., Any], kind: str) -> tuple[str, str, str]:
    """(what, verdict, reason) of a lattice, or of a control problem."""
    drawn = random.Random(f"{seed} {number}")
    if kind == "control" or (not kind and number % 4 == 3):
        asked = problem(drawn, f"steered-{number}")
        # the problem is found by its scene
        from discmech.studies.core import lookup

        told = lookup.problem_of
        lookup.problem_of = lambda scene: asked if scene is asked.scene else told(scene)
        try:
            made = rule(drawn, number, False)
            (case,) = check("optimality", [asked.scene], [made])["cases"]
        finally:
            lookup.problem_of = told
    else:
        system = lattice(drawn, f"lattice-{number}")
        made = rule(drawn, number, True)
        (case,) = check("lattices", [system], [made], steps=STEPS)["cases"]
    return f"{case['scene']} by {made.name}", case["verdict"], case["reason"]


def main(seed: str, unsound: int = 20, sound: int = 40, kind: str = "") -> int:
    """Print all trials; how many verdicts were wrong."""
    wrong = 0
    for word, count, rule, bad in (
        ("unsound", unsound, lambda drawn, k, _: unsound_rule(drawn, k), "pass"),
        ("sound", sound, sound_rule, "fail"),
    ):
        counts = Counter[str]()
        for number in range(count):
            try:
                what, verdict, reason = trial(f"{seed} {word}", number, rule, kind)
            except BadInput as refusal:
                what, verdict, reason = f"number {number}", "refused", str(refusal)
            counts[verdict] += 1
            wrong += verdict == bad
            print(f"{word:8} {verdict:13} {what}: {reason}", flush=True)
        print(f"{word}: {dict(counts)}", flush=True)
    return wrong


if __name__ == "__main__":
    seed, *given = sys.argv[1:]
    sys.exit(min(main(seed, *map(int, given[:2]), *given[2:]), 1))
