"""Parameters of any name: none is taken for a coordinate or a name of the generated text."""

import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, Scheme, midpoint, pair


def plain(name, lagrangian):
    return Scene("named", pair(1), lagrangian, {name: 4}, x0=[1], v0=[0])


@pytest.mark.parametrize("name", ["x_0", "u_0", "mu_0"])
def test_a_parameter_is_never_taken_for_a_coordinate(name):
    """A silent wrong answer is worse than an exception: m ẍ = −x whatever the mass is called."""

    def end(name):
        def lagrangian(x, v, p):
            return getattr(p, name) * v[0] ** 2 / 2 - x[0] ** 2 / 2

        return Scheme(plain(name, lagrangian), midpoint).flow("0.1", 20).trajectory(10).x[-1, 0]

    assert end(name) == end("mass")


@pytest.mark.parametrize(
    "name", ["h", "R", "EPS", "PI", "sin", "q0", "c0", "k0", "t0", "w", "lambda"]
)
def test_names_of_the_generated_text_are_free(name):
    def lagrangian(x, v, p):
        return getattr(p, name) * v[0] ** 2 / 2 + sympy.cos(x[0])

    scene = plain(name, lagrangian)
    wanted = plain("mass", lambda x, v, p: 2 * v[0] ** 2 + sympy.cos(x[0]))
    digits = 16 if name in ("h", "R") else 20
    one, other = (Scheme(s, midpoint).flow("0.1", digits).trajectory(10).x for s in (scene, wanted))
    assert np.abs(one - other).max() < 1e-15
