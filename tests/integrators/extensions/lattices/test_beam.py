"""The beam's flexural frequencies against those of Euler and Bernoulli, free at both ends."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy
from scipy import linalg

from discmech import Scheme, midpoint
from discmech.integrators.extensions.lattices import scenes as systems

#: roots of cos β cosh β = 1, ω = β² √(EI/m): Blevins, Formulas for Natural Frequency, 8-1
ROOTS = (4.730040744862704, 7.853204624095838, 10.99560783800167)


def slender(sites, stiffness):
    """A beam that hardly shears and whose sections hardly resist turning."""
    beam = systems.beam(sites, stiffness, 1)
    return replace(beam, parameters={**beam.parameters, "inertia": "1/10000000"})


def stiffness_and_masses(beam):
    """The stiffness matrix in the plane and the masses, in the letters (y, θ) of the sites in turn.

    Of the second derivatives of `on_bond` and `on_site` in two neighbours about the straight beam.
    """
    N, letters = beam.sites, sympy.symbols("y0 t0 y1 t1")
    shared = beam.split_parameters["shared"]
    p = SimpleNamespace(**{**shared, "length": sympy.Symbol("length")})

    def place(x, y, t):
        g = sympy.eye(4)
        g[0, 0], g[0, 1], g[1, 0], g[1, 1] = sympy.cos(t), -sympy.sin(t), sympy.sin(t), sympy.cos(t)
        g[0, 3], g[1, 3] = x, y
        return g

    y0, t0, y1, t1 = letters
    ends = place(0, y0, t0), place(sympy.Rational(1, N - 1), y1, t1)
    block = sympy.hessian(-beam.on_bond(*ends, p), letters).subs(dict.fromkeys(letters, 0))
    v = sympy.Matrix(sympy.symbols("v:6"))
    kinetic = beam.on_site(sympy.eye(4), v, p)
    of_y, of_t = (float(kinetic.diff(v[k], 2) / p.length) for k in (4, 2))
    K = np.zeros((2 * N, 2 * N))
    for i in range(N - 1):
        K[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += np.array(block, dtype=float)
    masses = np.outer(beam.parameters["length"], [of_y, of_t]).ravel()
    return K, masses


@pytest.mark.slow
def test_frequencies_tend_to_those_of_euler_and_bernoulli_to_second_order():
    errors = []
    for sites in (21, 41, 81):
        K, masses = stiffness_and_masses(slender(sites, 10**8))
        y, turned = slice(0, None, 2), slice(1, None, 2)  # sections turn without inertia
        of_y = K[y, y] - K[y, turned] @ np.linalg.solve(K[turned, turned], K[turned, y])
        found = np.sqrt(linalg.eigh(of_y, np.diag(masses[y]), eigvals_only=True)[2:5])
        errors.append(abs(found / np.square(ROOTS) - 1))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert abs(orders - 2).max() < 0.05
    assert max(errors[-1]) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("sites", [21, 41])
def test_a_run_swings_in_the_first_mode_as_its_stiffness_says(sites):
    beam, h, steps = slender(sites, 10**4), 0.002, 200
    K, masses = stiffness_and_masses(beam)
    squares, shapes = linalg.eigh(K, np.diag(masses))
    omega, shape = np.sqrt(squares[2]), shapes[:, 2]
    q = 1e-6 * shape / abs(shape).max()
    x0 = beam.start[0].reshape(sites, 4, 4).copy()
    x0[:, 1, 3], turned = q[0::2], q[1::2]
    x0[:, 0, 0] = x0[:, 1, 1] = np.cos(turned)
    x0[:, 1, 0], x0[:, 0, 1] = np.sin(turned), -np.sin(turned)
    still = replace(beam, x0=x0, v0=np.zeros((sites, 6)))
    rows = Scheme(still, midpoint).flow(h).trajectory(steps).x.reshape(steps + 1, sites, 4, 4)
    swung = np.stack([rows[:, :, 1, 3], np.arctan2(rows[:, :, 1, 0], rows[:, :, 0, 0])], axis=2)
    share = swung.reshape(steps + 1, -1) @ (masses * q) / (q @ (masses * q))
    phase = 2 * np.arctan(h * omega / 2) * np.arange(steps + 1)
    assert abs(share - np.cos(phase)).max() < 1e-6
