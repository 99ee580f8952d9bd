"""A Lagrangian whose derivatives cancel as they are taken: the mass cos² + sin² is 1.

Its runs are those of the Lagrangian without it.
"""

import pytest
from sympy import cos, cosh, sin, sinh

from discmech.integrators import Scene, Scheme, lie_group, pair, product, rules, so

#: Lagrangians of x, v and a number 1, which is written as `ONES` have it
CASES = {
    "cart": (pair(2), {"x0": [0, 1], "v0": ["0.3", "0.2"]}, lambda x, v, one:
             v[0] ** 2 + v[0] * v[1] * cos(x[1]) + one * v[1] ** 2 / 2 + cos(x[1]) / 3),
    "carried": (product(pair(1), lie_group(so(3))),
                {"x0": [1], "v0": ["0.3", "0.5", "-0.4", "0.8"]},
                lambda x, v, one: one * v[0] ** 2 / 2 + v[1] ** 2 + v[2] ** 2 + 2 * v[3] ** 2
                + v[0] * v[1] * cos(x[0]) / 2 - sin(x[0]) * v[3]),
}  # fmt: skip
ONES = {
    "circle": lambda x: cos(x[-1]) ** 2 + sin(x[-1]) ** 2,
    "hyperbola": lambda x: cosh(x[0]) ** 2 - sinh(x[0]) ** 2,
}
RULES = ("gauss-2", "gauss-3", "lobatto-3", "lobatto-4")


def scene(name, one=lambda x: 1):
    groupoid, start, formula = CASES[name]
    return Scene(name, groupoid, lambda x, v, p: formula(x, v, one(x)), **start)


def both_runs(name, one, rule, digits, steps):
    """The runs of a scene with a 1 that is written out, and without it."""
    for of in (scene(name, ONES[one]), scene(name)):
        yield Scheme(of, rules.get(rule)).flow(f"1/{2 * steps}", digits).trajectory(steps)


@pytest.mark.dear("carried")
@pytest.mark.sampled
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("one", ONES)
@pytest.mark.parametrize("name", CASES)
def test_its_runs_are_those_of_the_plain_form(name, one, rule, digits):
    run, wanted = both_runs(name, one, rule, digits, steps := 8)
    size = 2.0**-53 if digits == 16 else 10.0**-digits
    for found, plain in ((run.x, wanted.x), (run.mu, wanted.mu)):
        assert abs(found - plain).max() < 64 * steps * size
