"""Two-link arms that Newton's method alone does not solve, held to a direct optimisation."""

import numpy as np
import pytest
import sympy
from scipy import optimize

from discmech import Control, Scene, midpoint, pair
from discmech.integrators.errors import NotDecided
from tests.integrators.extensions.control.test_control import effort

END, STEPS = np.array([1.2, 2.0]), 16
#: duration and gravity: lifted from hanging on the earth, with a tenth of the weight, in half of
#: the time
ARMS = [(2, "9.81"), (2, "1"), (1, "9.81")]


def arm(duration, g):
    """Absolute angles from below; masses and lengths 1, the elbow's torque acts on both links."""

    def lagrangian(x, v, p):
        a, b = x
        kinetic = sympy.Rational(4, 3) * v[0] ** 2 + v[1] ** 2 / 3 + sympy.cos(a - b) * v[0] * v[1]
        return kinetic / 2 + p.g * (sympy.Rational(3, 2) * sympy.cos(a) + sympy.cos(b) / 2)

    scene = Scene("arm", pair(2), lagrangian, parameters={"g": g}, x0=[0, 0], v0=[0, 0],
                  duration=duration)  # fmt: skip
    return Control(scene, effort, (["1.2", "2.0"], [0, 0]),
                   lambda x, v, f, p: [f[0] - f[1], f[1]], 2)  # fmt: skip


def directly(duration, g):
    """The least h/2 Σ|f|² of points and torques whose momenta agree at every node, by SLSQP.

    The discrete equations are written by hand; it begins at a cubic path without torques.
    """
    N, h, g = STEPS, duration / STEPS, float(g)
    share = np.linspace(0, 1, N + 1)[:, None]

    def misses(y):
        points, f = np.split(y.reshape(-1, 2), [N - 1])
        q = np.vstack([0 * END, points, END])
        (a, b), (va, vb) = ((q[1:] + q[:-1]) / 2).T, (np.diff(q, axis=0) / h).T
        cos, sin = np.cos(a - b), np.sin(a - b)
        momentum = np.stack([4 / 3 * va + cos / 2 * vb, vb / 3 + cos / 2 * va], 1)
        force = np.stack([-sin / 2 * va * vb - 3 / 2 * g * np.sin(a) + f[:, 0] - f[:, 1],
                          sin / 2 * va * vb - g / 2 * np.sin(b) + f[:, 1]], 1)  # fmt: skip
        before, after = momentum - h / 2 * force, momentum + h / 2 * force
        return np.vstack([before[:1], before[1:] - after[:-1], after[-1:]]).ravel()

    def slopes(y):
        steps = 1e-30j * np.eye(len(y))  # complex steps have no round-off
        return np.transpose([misses(y + e).imag / 1e-30 for e in steps])

    path = (3 * share**2 - 2 * share**3)[1:-1] * END
    cut = path.size
    found = optimize.minimize(
        lambda y: h / 2 * (y[cut:] ** 2).sum(), np.append(path, np.zeros(2 * N)), method="SLSQP",
        jac=lambda y: np.append(np.zeros(cut), h * y[cut:]),
        constraints={"type": "eq", "fun": misses, "jac": slopes},
        options={"maxiter": 500, "ftol": 1e-13},
    )  # fmt: skip
    assert found.success
    return found.fun


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "g"), ARMS)
def test_an_arm_has_the_cost_of_a_direct_optimisation(duration, g):
    """Of the same steps, which another solver meets from another start to its own tolerance."""
    best = arm(duration, g).solve(STEPS, midpoint)
    assert abs(best.cost / directly(duration, g) - 1) < 1e-8
    assert np.abs(best.x[-1] - END).max() < 1e-12 and np.abs(best.mu[-1]).max() < 1e-12


@pytest.mark.slow
def test_costs_of_an_arm_converge():
    """With the order 2 of the rule, from starts for each number of steps of their own."""
    costs = [arm(1, "9.81").solve(N, midpoint).cost for N in (25, 50, 100)]
    assert 3.8 < (costs[0] - costs[1]) / (costs[1] - costs[2]) < 4.2


def test_an_end_that_none_reaches_is_not_said_to_be_out_of_reach():
    """A second, free pendulum stays at rest whatever moves the first. Steps that are not affine
    prove nothing, so the sentence says what was tried and how far off that ended."""

    def lagrangian(x, v, p):
        return v.dot(v) / 2 + sympy.cos(x[0]) + sympy.cos(x[1])

    scene = Scene("two", pair(2), lagrangian, x0=[0, 0], v0=[0, 0], duration=2)
    problem = Control(scene, effort, ([1, 1], [0, 0]), lambda x, v, f, p: [f[0], 0], 1)
    with pytest.raises(NotDecided, match=r"does not show that there is none: .* cubic") as raised:
        problem.solve(10)
    assert "reached" not in str(raised.value)
