"""Derivatives by terms are those of sympy."""

import pytest
import sympy
from sympy import cos, exp, sin, sqrt, symbols

from discmech.integrators import scenes
from discmech.integrators.equations import SceneSymbols
from discmech.integrators.numbers import as_one_number, first_violation, jacobian

x, y, z, a = symbols("x y z a", real=True, positive=True)
EXPRESSIONS = [
    a * 3,
    x,
    x * y * z + a * x**2 - y / x,
    (x**2 + y**2 + a) ** sympy.Rational(-3, 2) * (x - y) * z,
    sin(x * y) * exp(z) + sqrt(cos(x) ** 2 + y),
    x**y + y**a,
    as_one_number(x + y) * as_one_number(x * z),
    abs(x - y) ** 3,
]


def test_jacobian_is_that_of_sympy():
    column = sympy.Matrix(EXPRESSIONS)
    difference = jacobian(column, (x, y, z)) - column.jacobian([x, y, z])
    assert difference.shape == (len(EXPRESSIONS), 3)
    assert first_violation(difference) is None


@pytest.mark.dear("outer-solar-system")
@pytest.mark.parametrize(
    "scene", [s for s in scenes.all_scenes() if s.lagrangian is not None], ids=lambda s: s.name
)
def test_gradient_of_every_lagrangian(scene):
    s = SceneSymbols(scene, 0)
    letters = [*s.x, *s.u]
    found = jacobian([s.lagrangian], letters)
    differences = [f - s.lagrangian.diff(v) for f, v in zip(found, letters, strict=True)]
    assert first_violation(differences) is None
