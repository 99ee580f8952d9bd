"""Control problems told in other units, and costs that are nearly flat where controls are large."""

import numpy as np
import pytest
import sympy
from scipy import optimize

from discmech import BadInput, Control, Scene, midpoint, pair
from discmech.integrators.rules import gauss
from tests.integrators.extensions.control.test_control import mass, plane

I, Q = sympy.Integer, sympy.Rational


def ten(power):
    return I(10) ** power


def swing(length, time, of_mass):
    """A pendulum steered by one radian, in units of which the old ones are so many."""
    scene = Scene(
        "swing", pair(1), parameters={"m": of_mass, "l": length, "g": 1 / time**2},
        lagrangian=lambda x, v, p: p.m * (v[0] ** 2 / 2 + p.g * p.l**2 * sympy.cos(x[0] / p.l)),
        x0=[0], v0=[0], duration=3 * time,
    )  # fmt: skip
    return Control(scene, lambda x, v, f, p: f.dot(f) / 2, ([length], [0]))


@pytest.mark.dear(but=("(1/1000000000000, 1/1000000000000, 1)",))
@pytest.mark.parametrize("units", [
    (ten(-12), ten(-12), 1), (ten(12), ten(12), 1), (1, 1, ten(-12)), (1, ten(12), 1),
    (ten(-50), 1, 1), (1, 1, ten(150)), (1, 1, ten(-150)),
], ids=str)  # fmt: skip
def test_an_optimum_is_the_same_in_every_unit(units):
    length, time, of_mass = units
    own, told = (swing(*of).solve(20, gauss(2)) for of in ((1, 1, 1), units))
    cost = told.cost / float(of_mass**2 * length**2 / Q(time) ** 3)
    assert abs(cost / own.cost - 1) < 1e-13
    assert np.allclose(told.x / float(length), own.x, rtol=0, atol=1e-13)
    assert np.allclose(told.node_controls / float(of_mass * length / Q(time) ** 2),
                       own.node_controls, rtol=0, atol=1e-11)  # fmt: skip


@pytest.mark.parametrize("units", [
    (ten(12), ten(-10), 1, 1), (1, 1, ten(20), ten(-20)), (ten(10), 1, 1, ten(10)),
], ids=str)  # fmt: skip
def test_each_coordinate_and_control_may_have_a_unit_of_its_own(units):
    def of(a, b, c, d):
        def lagrangian(x, v, p):
            springs = (x[0] / a) ** 2 + (x[1] / b) ** 2 + x[0] * x[1] / (a * b)
            return (v[0] / a) ** 2 / 2 + 3 * (v[1] / b) ** 2 / 2 - springs / 2

        return Control(plane(lagrangian=lagrangian, duration=2),
                       lambda x, v, f, p: (c * f[0]) ** 2 + (d * f[1]) ** 2, ([a, 2 * b], [0, 0]),
                       lambda x, v, f, p: [c * f[0] / a, d * f[1] / b], 2).solve(10)  # fmt: skip

    assert abs(of(*units).cost / of(1, 1, 1, 1).cost - 1) < 1e-13


@pytest.mark.parametrize("eps", [Q(1, 2), Q(1, 4), Q(1, 10)])
def test_smoothed_fuel_has_the_minimum_of_another_solver(eps):
    """min ∫ √(f² + ε²) dt from rest to rest (Bertrand, Epenoy 2002); the same steps by SLSQP."""
    N, h, e = 20, 0.1, float(eps)
    M, B = np.array([[1, h], [0, 1]]), np.array([h * h / 2, h])
    A = np.stack([np.linalg.matrix_power(M, N - 1 - k) @ B for k in range(N)], 1)
    other = optimize.minimize(
        lambda f: h * np.sqrt(f * f + e * e).sum(), A.T @ np.linalg.solve(A @ A.T, [1, 0]),
        jac=lambda f: h * f / np.sqrt(f * f + e * e), method="SLSQP",
        constraints={"type": "eq", "fun": lambda f: A @ f - [1, 0], "jac": lambda f: A},
        options={"maxiter": 1000, "ftol": 1e-14},
    )  # fmt: skip
    cost = lambda x, v, f, p: sympy.sqrt(f[0] ** 2 + eps**2)  # noqa: E731
    best = Control(mass(duration=2), cost, ([1], [0])).solve(N)
    assert abs(best.cost - other.fun) < 1e-8
    assert np.isfinite(best.node_controls).all()


def quartic(x, v, f, p):
    return f[0] ** 4 / 10**30


@pytest.mark.parametrize("cost", [
    quartic, lambda x, v, f, p: sympy.cosh(3 * f[0]), lambda x, v, f, p: sympy.exp(f[0] ** 2),
    lambda x, v, f, p: sympy.sqrt(f[0] ** 2 + Q(1, 10**4)),
    lambda x, v, f, p: f[0] ** 2 / 2 + sympy.log(1 + sympy.exp(5 * f[0])),
])  # fmt: skip
def test_a_strictly_convex_cost_has_a_minimum(cost):
    best = Control(mass(duration=2), cost, ([1], [0])).solve(20)
    assert best.x[-1, 0] == pytest.approx(1) and np.isfinite(best.cost)


def test_a_cost_that_is_flat_at_the_control_that_was_found_is_named():
    with pytest.raises(BadInput, match="vanishes in step 20 of the motion that was found"):
        Control(mass(duration=2), quartic, ([1], [0])).solve(41, midpoint)
