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


@pytest.mark.parametrize(
    ("parameters", "two"),
    [
        ({"a": [1], "a_0": 3}, lambda p: (p.a[0], p.a_0)),
        ({"a_0": 3, "a": [1]}, lambda p: (p.a[0], p.a_0)),
        ({"a": [[1]], "a_0": [3]}, lambda p: (p.a[0, 0], p.a_0[0])),
        ({"x": [1], "x_0": 3}, lambda p: (p.x[0], p.x_0)),
    ],
)
def test_an_entry_of_a_parameter_is_no_other_parameter(parameters, two):
    """a[0] beside a_0 had its value: V = x² + 3x⁴ was 3x² + 3x⁴."""

    def lagrangian(x, v, p):
        one, other = two(p)
        return v[0] ** 2 / 2 - one * x[0] ** 2 - other * x[0] ** 4

    def plainly(x, v, p):
        return v[0] ** 2 / 2 - x[0] ** 2 - 3 * x[0] ** 4

    pairs = [("entries", lagrangian, parameters), ("plain", plainly, {})]
    one, other = (
        Scheme(Scene(*given, x0=[1], v0=[0]), midpoint).flow("0.1", 20).trajectory(10).x
        for given in ((name, pair(1), function, named) for name, function, named in pairs)
    )
    assert np.abs(one - other).max() < 1e-19
