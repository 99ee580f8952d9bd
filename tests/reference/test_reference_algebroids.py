"""The reference's own algebroids, against those that the integrators derive from b and p."""

import pytest
import sympy
from sympy import Matrix, Rational

from discmech.integrators import Scene, scenes
from discmech.reference import ReferenceFailure, solution
from discmech.reference.equations import Algebroid, algebroid_of, equations_of, parameter_values
from discmech.reference.equations.algebroid import in_frame
from tests.objects import GROUPOIDS, OWN_SCENES, frame


def scene_on(groupoid, **changes):
    """A scene whose Lagrangian does not matter."""
    given = {"lagrangian": lambda x, v, p: v.dot(v), "x0": [0] * groupoid.dim_x,
             "v0": [0] * groupoid.dim_u, **changes}  # fmt: skip
    return Scene("nameless", groupoid, **given)


@pytest.mark.dear("so(3) by hand", "action(so(3)) by hand")
@pytest.mark.parametrize("name", GROUPOIDS)
def test_anchor_and_structure_functions(name):
    """Two derivations, from matrices and maps here, from b and p or closed forms there."""
    g = GROUPOIDS[name]
    x = g.symbols["x"]
    at = {symbol: Rational(2 * i + 3, 7 + i) for i, symbol in enumerate(x)}
    found = algebroid_of(scene_on(g), x)
    h = Rational(3, 4)
    assert sympy.simplify((found.rho * h - g.rho(x, h)).xreplace(at)).is_zero_matrix
    for c, wanted in enumerate(g.structure_functions(x, h)):
        for i in range(g.dim_u):
            for j in range(g.dim_u):
                value = sympy.sympify(found.constants.get((c, i, j), 0))
                assert sympy.simplify((h * value - wanted[i, j]).xreplace(at)) == 0


def test_a_moving_frame_by_hand():
    """[∂₀, (1 + x₀²)∂₁] = 2x₀ ∂₁ in the framed plane."""
    x = Matrix(sympy.symbols("x0:2"))
    plane = in_frame(Algebroid(sympy.eye(2), {}, 2, 2), frame(x), x)
    rate = 2 * x[0] / (1 + x[0] ** 2)
    assert plane.constants == {(1, 1, 0): -rate, (1, 0, 1): rate}


def test_wongs_equations_by_hand():
    """m ẍ = −kx + q·F(ẋ, ·) and q̇ = q × (ξ), ξ = q/κ − A(x)ẋ; F from A as printed in books."""
    equations = equations_of(scenes.get("wong"))
    x, w, q = (Matrix(equations.states[i : i + 3]) for i in (0, 3, 6))
    A = Matrix(scenes.get("wong").groupoid.connection(x))

    def curvature(i, j):
        """F_ij = ∂_i A_j − ∂_j A_i − A_i × A_j: ξ = η − Aẋ is subtracted, hence the sign."""
        return A[:, j].diff(x[i]) - A[:, i].diff(x[j]) - A[:, i].cross(A[:, j])

    force = Matrix(3, 1, lambda i, _: sum(q.dot(curvature(i, j)) * w[j] for j in range(3)) - x[i])
    xi = q - A * w
    rates = Matrix(equations.rates)
    assert (rates[:3, 0] - w).expand().is_zero_matrix
    assert (rates[6:, 0] - q.cross(xi)).expand().is_zero_matrix
    assert (rates[3:6, 0] - force).expand().is_zero_matrix


@pytest.mark.parametrize("name", ["wong", "rotor-body", "reduced-kepler", "spherical-pendulum"])
def test_declared_quantities_are_constant_along_the_equations(name):
    """Momentum maps and Casimirs of the new scenes, by the reference's equations, at a point."""
    scene = scenes.get(name)
    equations = equations_of(scene)
    n = equations.dim_x
    x, mu = Matrix(equations.states[:n]), Matrix(equations.momentum)
    at = {s: Rational(3 * i + 2, 5 + i) for i, s in enumerate(equations.states)}
    for quantity in scene.symmetries:
        value = sympy.Matrix([quantity.formula(x, mu, parameter_values(scene))])
        rate = value.jacobian(equations.states) * Matrix(equations.rates)
        for symbol, assigned in reversed(equations.assignments):
            rate = rate.xreplace({symbol: assigned})
        assert sympy.simplify(rate.xreplace(at)).is_zero_matrix


def test_the_attitude_of_a_product_is_its_groups():
    """Ȧ = A Ω̂ of the body alone: a rotation, and AΠ is constant, whatever the rotor does."""
    import mpmath

    found = solution(scenes.get("rotor-body"), 1, digits=25, attitude=True)
    with mpmath.workdps(30):
        A = found.attitude
        assert A.rows == 3 and mpmath.norm(A * A.T - mpmath.eye(3)) < 1e-24
        spin = A * mpmath.matrix(found.mu[1:])
        start = equations_of(scenes.get("rotor-body"))
        at = dict(zip(start.states, start.start, strict=True))
        before = [mpmath.mpf(str(m.subs(at).evalf(30))) for m in start.momentum[1:]]
        assert mpmath.norm(spin - mpmath.matrix(before)) < 1e-24


def test_complex_matrices_give_no_attitude():
    with pytest.raises(ReferenceFailure, match="which has no attitude"):
        solution(scenes.get("wong"), 1, attitude=True)


def test_a_connection_of_another_shape_is_refused():
    scene = OWN_SCENES["carried-along"]
    groupoid = type(scene.groupoid)(*scene.groupoid.parts, lambda x: [[1, 2]])
    with pytest.raises(ReferenceFailure, match="connection of scene carried-along"):
        solution(scene.with_values(groupoid=groupoid), 1)
