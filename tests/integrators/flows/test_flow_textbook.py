"""Flows against textbook implementations written here, with no symbolic step in between."""

import math

import mpmath
import numpy as np
import pytest

from tests.objects import flow

STEPS = 1000


def pendulum_force(x):
    return -math.sin(x) if isinstance(x, float) else -mpmath.sin(x)


def kepler_force(x):
    r = (x[0] * x[0] + x[1] * x[1]) ** 0.5 if isinstance(x[0], float) else mpmath.hypot(*x)
    return np.array([-c / r**3 for c in x], dtype=x.dtype)


FORCES = {"harmonic": lambda x: -x, "pendulum": pendulum_force, "kepler": kepler_force}


def tableaus(rule, one):
    """a, b and â of partitioned Runge–Kutta methods: symplectic Euler, Störmer–Verlet, Gauss,
    Lobatto IIIA–IIIB (Hairer, Lubich, Wanner, II.1)."""
    half, sixth, root = one / 2, one / 6, (3 * one) ** (one / 2) / 6
    gauss, b = [[one / 4, one / 4 - root], [one / 4 + root, one / 4]], [sixth, 4 * sixth, sixth]
    return {
        "rectangle": ([[0]], [1], [[1]]),
        "trapezoidal": ([[0, 0], [half, half]], [half, half], [[half, 0], [half, 0]]),
        "midpoint": ([[half]], [1], [[half]]),
        "gauss-2": (gauss, [half, half], gauss),
        "lobatto-3": ([[0, 0, 0], [5 * one / 24, one / 3, -one / 24], b], b,
                      [[sixth, -sixth, 0], [sixth, one / 3, 0], [sixth, 5 * sixth, 0]]),
    }[rule]  # fmt: skip


TEXTBOOK = ("rectangle", "trapezoidal", "midpoint", "gauss-2", "lobatto-3")


def runge_kutta(rule, force, x, mu, h, steps):
    """Steps on ẋ = μ, μ̇ = force(x), by a fixed-point iteration until nothing moves any more."""
    a, b, a_hat = tableaus(rule, h / h)

    def sums(rows, values):
        return [sum(e * value for e, value in zip(row, values, strict=True)) for row in rows]

    for _ in range(steps):
        forces, gap = [force(x)] * len(b), None
        while True:
            momenta = [mu + h * e for e in sums(a_hat, forces)]
            new = [force(x + h * e) for e in sums(a, momenta)]
            moved = max(np.max(np.abs(p - q)) for p, q in zip(new, forces, strict=True))
            forces = new
            if moved == 0 or (gap is not None and moved >= gap and moved < 1e-10):
                break
            gap = moved
        (drift,), (kick,) = sums([b], momenta), sums([b], forces)
        x, mu = x + h * drift, mu + h * kick
    return x, mu


@pytest.mark.dear("1e-47-kepler-lobatto", "1e-47-kepler-gauss")
@pytest.mark.sampled
@pytest.mark.parametrize("rule", TEXTBOOK)
@pytest.mark.parametrize("scene", FORCES)
@pytest.mark.parametrize(("digits", "steps", "limit"), [(16, STEPS, 3e-12), (50, 100, 1e-47)])
def test_pair_groupoid(scene, rule, digits, steps, limit):
    run = flow(scene, rule, "1/64", digits).trajectory(steps, every=steps)
    with mpmath.workdps(digits + 12):
        x, mu, h = run.x[0], run.mu[0], 1 / 64 if digits == 16 else mpmath.mpf(1) / 64
        if scene != "kepler":
            x, mu = x[0], mu[0]
            x, mu = (float(x), float(mu)) if digits == 16 else (x, mu)
        x, mu = runge_kutta(rule, FORCES[scene], x, mu, h, steps)
        gap = np.max(np.abs(np.append(x, mu) - np.append(run.x[-1], run.mu[-1])))
    # round-off of one step is amplified along the orbit, most near Kepler's pericentre
    assert gap < limit * (10 if scene == "kepler" and digits == 16 else 1)


@pytest.mark.parametrize("rule", ["gauss-2", "lobatto-3"])
def test_stages_have_all_digits(rule):
    """Of a nonlinear motion, which fixed points solve: in every run, of the cases above some."""
    test_pair_groupoid("pendulum", rule, 50, 5, 1e-47)


def test_textbooks_tell_each_other_apart():
    """What is compared to round-off above differs by far more between the methods."""
    ends = [runge_kutta(rule, pendulum_force, 2.0, 0.0, 1 / 64, STEPS) for rule in TEXTBOOK[:3]]
    for i in range(3):
        for j in range(i):
            assert abs(ends[i][0] - ends[j][0]) > 1e-5
