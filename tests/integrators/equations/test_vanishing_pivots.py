"""Steps where an entry of a matrix is exactly 0 are no worse than any other step."""

from types import SimpleNamespace

import pytest
import sympy

from discmech.integrators import Scene, Scheme, pair, rules, scenes
from discmech.integrators.compiler import KernelsAtStep
from discmech.integrators.errors import StepFailure

PLAIN = ("rectangle", "midpoint", "trapezoidal")
TURNS = {2: [["3/5", "-4/5"], ["4/5", "3/5"]],
         3: [["2/3", "-1/3", "2/3"], ["2/3", "2/3", "-1/3"], ["-1/3", "2/3", "2/3"]]}  # fmt: skip

LENGTHS = SimpleNamespace(length=1, lengths=[1, 1], arm=sympy.Matrix([0, 0, sympy.Rational("0.6")]))


def sphere(n):
    """A weight on a rod, hanging down."""
    start, push = [0] * n, [0] * n
    start[1], push[0] = -1, "0.5"
    return Scene(
        f"rod-in-{n}", pair(n), lambda x, v, p: v.dot(v) / 2 - x[1], x0=start, v0=push,
        holonomic=lambda x, p: [x.dot(x) - 1],
    )  # fmt: skip


def at(name, x0, v0):
    return scenes.get(name).with_values(x0=x0, v0=v0)


#: (scene, copies of space among its coordinates and among its velocities)
STARTS = [
    (sphere(2), 1, 1),
    pytest.param(sphere(3), 1, 1, marks=pytest.mark.slow),
    (at("cartesian-pendulum", [1, 0], [0, 0]), 1, 1),
    pytest.param(
        at("double-spherical-pendulum", [0, 0, -1, 0, 0, -2], ["0.5", 0, 0, 0, 1, 0]), 2, 2,
        marks=pytest.mark.slow),
    pytest.param(
        at("pivoted-body", [0, 0, "0.6", 1, 0, 0, 0, 1, 0, 0, 0, 1],
        ["0.18", "-0.12", 0, "0.2", "0.3", "1.5"]), 4, 1,
        marks=pytest.mark.slow),
]  # fmt: skip


def turned(scene, of_x, of_v):
    """The same problem in space turned by rational angles, and the turn of its coordinates."""
    d = 2 if len(scene.x0) in (2, 4) else 3
    turn, one = sympy.Matrix(TURNS[d]).applyfunc(sympy.Rational), sympy.eye
    if of_x == 4:  # the attitude is written row by row
        X = sympy.diag(turn, sympy.kronecker_product(turn, one(3)))
    else:
        X = sympy.kronecker_product(one(of_x), turn)
    V = sympy.diag(sympy.kronecker_product(one(of_v), turn), one(len(scene.v0) - d * of_v))
    moved = {name: [str(e) for e in M * sympy.Matrix([sympy.Rational(str(s)) for s in start])]
             for name, M, start in (("x0", X, scene.x0), ("v0", V, scene.v0))}  # fmt: skip
    L, phi = scene.lagrangian, scene.holonomic
    copy = Scene(
        f"turned-{scene.name}", scene.groupoid, lambda x, v, p: L(X.T * x, V.T * v, p),
        scene.parameters, holonomic=phi and (lambda x, p: phi(X.T * x, p)), **moved,
    )  # fmt: skip
    return copy, X


def ends(scene, copy, rule, digits):
    """The last rows of runs of both."""
    for s in (scene, copy):
        run = Scheme(s, rules.get(rule)).flow("0.05", digits).trajectory(20)
        yield sympy.Matrix([sympy.Float(e, digits + 5) for e in run.x[-1]])


@pytest.mark.dear(but=("pendulum",))
@pytest.mark.sampled
@pytest.mark.parametrize("rule", PLAIN)
@pytest.mark.parametrize(("scene", "of_x", "of_v"), STARTS, ids=lambda s: getattr(s, "name", ""))
def test_a_start_in_the_axes_moves_as_one_that_is_turned(scene, of_x, of_v, rule):
    copy, X = turned(scene, of_x, of_v)
    for digits, kept, same in ((16, 1e-13, 1e-12), (50, 1e-45, 1e-45)):
        end, other = ends(scene, copy, rule, digits)
        assert max(map(abs, X.T * other - end)) < same
        assert max(map(abs, scene.holonomic(end, LENGTHS))) < kept


@pytest.mark.parametrize("rule", [
    "midpoint", *(pytest.param(r, marks=pytest.mark.slow) for r in PLAIN if r != "midpoint")
])  # fmt: skip
def test_what_is_singular_is_still_named(rule):
    """No mass along the line to which the constraint leaves the motion."""
    scene = Scene("massless", pair(2), lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 * v[1] ** 2,
                  holonomic=lambda x, p: [x[0]], x0=[0, 1], v0=[0, 1])  # fmt: skip
    with pytest.raises(StepFailure, match="singular"):
        Scheme(scene, rules.get(rule)).flow("0.05").trajectory(20)


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["rectangle", pytest.param("trapezoidal", marks=pytest.mark.slow)])
def test_a_pivot_of_a_regular_mass_matrix_may_be_zero(rule, monkeypatch):
    """Without constraints: M₀₀ = 4x₀ is 0 at the start, det M is -1 there."""
    scene = Scene(
        "indefinite", pair(4), lambda x, v, p: 2 * x[0] * v[0] ** 2 + v[0] * v[1] + v[1] * v[2]
        + v[2] * v[3] + v[3] ** 2 / 2 - x.dot(x) / 2, x0=[0, 0, "1/100", 0], v0=[0, 0, 0, 0],
    )  # fmt: skip
    copy, X = turned(scene, 2, 2)
    for digits, same in ((16, 1e-12), (50, 1e-45)):
        end, other = ends(scene, copy, rule, digits)
        assert max(map(abs, X.T * other - end)) < same
    monkeypatch.setattr(KernelsAtStep, "_exchanged", lambda *_: False)
    with pytest.raises(StepFailure, match="singular"):
        Scheme(scene, rules.get(rule)).flow("0.05").trajectory(20)
