"""The algebroid's structure and the continuous equations, against equations written by hand."""

from types import SimpleNamespace

import mpmath
import pytest
import sympy

from discmech.integrators import Scene, pair, scenes
from discmech.reference import ReferenceFailure, solution
from discmech.reference.equations import T, balance_of, equations_of
from discmech.reference.equations.elimination import explicit_rates

ALL = ("harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "lagrange-top")


def along(equations, quantity):
    """The time derivative of a function of the states."""
    return sum(
        quantity.diff(state) * rate
        for state, rate in zip(equations.states, equations.rates, strict=True)
    )


def local(name, dim_x, dim_u, target, product, **parts):
    groupoid = SimpleNamespace(
        kind="local", dim_x=dim_x, dim_u=dim_u, target=target, product=product
    )
    return SimpleNamespace(name=name, groupoid=groupoid, **parts)


def test_free_body_is_eulers():
    equations = equations_of(scenes.get("rigid-body"))
    omega = sympy.Matrix(equations.states)
    momentum = sympy.diag(1, 2, 3) * omega
    expected = sympy.diag(1, 2, 3).inv() * momentum.cross(omega)
    assert (sympy.Matrix(equations.rates) - expected).expand().is_zero_matrix


def test_heavy_top_by_hand():
    """dGamma/dt = Gamma x Omega, dmu/dt = mu x Omega + mgd Gamma x e (l has -mgd Gamma.e)."""
    equations = equations_of(scenes.get("heavy-top"))
    gamma, omega = sympy.Matrix(equations.states[:3]), sympy.Matrix(equations.states[3:])
    center = sympy.Matrix([2, 1, 2]) / 3
    mu = sympy.diag(1, 2, 3) * omega
    torque = mu.cross(omega) - gamma.cross(center) * -1
    assert (sympy.Matrix(equations.rates[:3]) - gamma.cross(omega)).expand().is_zero_matrix
    expected = sympy.diag(1, 2, 3).inv() * torque
    assert (sympy.Matrix(equations.rates[3:]) - expected).expand().is_zero_matrix
    momentum = sympy.Matrix(equations.momentum)
    assert sympy.expand(along(equations, momentum.dot(gamma))) == 0


@pytest.mark.parametrize("name", [*ALL, "double-pendulum"])
def test_energy_is_conserved_identically(name):
    """At a point; the double pendulum's mass matrix moves, and is eliminated by assignments."""
    equations = equations_of(scenes.get(name))
    assert bool(equations.assignments) == (name == "double-pendulum")
    rate = along(equations, equations.energy)
    for symbol, assigned in reversed(equations.assignments):
        rate = rate.xreplace({symbol: assigned})
    at = {z: sympy.Rational(3 * i + 2, 5 + i) for i, z in enumerate(equations.states)}
    assert abs(rate.xreplace(at).evalf(30)) < 1e-25


def test_local_groupoid_is_the_heavy_top():
    """The action groupoid given by target and product alone (to the order that matters)."""
    top = scenes.get("heavy-top")

    def target(x, u, h):
        return x + h * x.cross(u) + h**2 * (x.cross(u)).cross(u) / 2

    def product(x, u, v, h):
        return u + v + h * u.cross(v) / 2

    same = local(
        "heavy-top-locally", 3, 3, target, product, lagrangian=top.lagrangian,
        parameters=top.parameters, x0=top.x0, v0=top.v0,
    )  # fmt: skip
    ours, theirs = equations_of(same), equations_of(top)
    assert all(sympy.expand(a - b) == 0 for a, b in zip(ours.rates, theirs.rates, strict=True))


@pytest.mark.dear("on-", "in-", "edge")
@pytest.mark.parametrize("name", ["knife-edge", "suslov", "rolling-disc", "cartesian-pendulum",
                                  "bead-on-hoop", "ball-in-cylinder"])  # fmt: skip
def test_constraints_stay_met_and_do_no_work(name):
    """A xi' + A' xi = a', and M xi' - f has no part along a velocity that A admits."""
    scene = scenes.get(name)
    of, balance = equations_of(scene), balance_of(scene)
    m, rows = of.dim_u, sympy.Matrix(of.constraints).reshape(len(of.constraints) // of.dim_u,
                                                             of.dim_u)  # fmt: skip
    x, v = (list(of.states[of.block(part)]) for part in "xv")
    base = {z: sympy.Rational(2 * i + 1, 7) for i, z in enumerate(x)}
    if name == "cartesian-pendulum":
        base = dict(zip(x, map(sympy.Rational, ("3/5", "-4/5")), strict=True))
    if name == "bead-on-hoop":
        base = dict(zip(x, of.start[:3], strict=True))
    base[T], moving = sympy.S.Zero, balance.mechanics.moving
    admitted = rows.subs(base).nullspace()
    xi = sum(((k + 2) * w / 3 for k, w in enumerate(admitted)), sympy.zeros(m, 1))
    xi += rows.subs(base).pinv() * moving.subs(base)
    at = base | dict(zip(v, xi, strict=True))
    values = dict(at)
    for symbol, expression in of.assignments:
        values[symbol] = expression.xreplace(values)
    rates = sympy.Matrix(of.rates).xreplace(values)
    change = (rows * sympy.Matrix(v) - moving).jacobian(of.states).xreplace(at) * rates
    left = balance.mass[:m, :m] * rates[of.block("v"), :] - balance.force[:m, :]
    work = [(w.T * left.xreplace(at))[0] for w in admitted]
    assert all(abs(e.evalf(30)) < 1e-25 for e in (*change, *work))


def test_the_velocity_of_a_hamiltonian_is_its_slope_at_the_time():
    grows = Scene(
        "grows", pair(1), hamiltonian=lambda x, mu, p, t: mu[0] ** 2 * (1 + t) / 2 + x[0] ** 2 / 2,
        x0=[1], mu0=["1/3"], duration=1, step="1/10",
    )  # fmt: skip
    found = solution(grows, "1/2", 20)
    with mpmath.workdps(30):
        assert abs(found.v[0] - found.mu[0] * 3 / 2) < 1e-20


def test_local_groupoid_that_does_not_scale_is_refused():
    scene = local(
        "odd", 1, 1, lambda x, u, h: x + u, lambda x, u, v, h: u + v,
        lagrangian=lambda x, v, p: v[0] ** 2, parameters={}, x0=(0,), v0=(1,),
    )  # fmt: skip
    with pytest.raises(ReferenceFailure, match="does not scale with the step"):
        solution(scene, 1)


def pair_scene(name, lagrangian, x0, v0, **parameters):
    groupoid = SimpleNamespace(kind="pair", dim_x=len(x0), dim_u=len(x0))
    return SimpleNamespace(
        name=name, groupoid=groupoid, lagrangian=lagrangian, parameters=parameters, x0=x0, v0=v0
    )


A, B, C = sympy.symbols("a b c", real=True)
MASS = sympy.Matrix([[A, 2, B, 1], [2, B, 5, C], [B, 5, A + C, 0], [1, C, 0, 0]])
FORCE = sympy.Matrix([A * B, 3, C, -A])


@pytest.mark.sampled
@pytest.mark.parametrize("velocities", [4, 3])
@pytest.mark.parametrize("start", [(0, 1, 0), (1, 9, -2), (9, 1, 2), (1, -3, 9), (5, 5, 5)])
def test_the_eliminated_rates_solve_the_system(start, velocities):
    """At the start, whatever the order of the pivots, and elsewhere; also numbers alone."""
    at = dict(zip((A, B, C), map(sympy.Integer, start), strict=True))
    assignments, rates = explicit_rates("s", MASS, FORCE, at, velocities)
    for point in (at, {A: sympy.Rational(7, 3), B: sympy.Rational(-2, 5), C: sympy.Rational(11)}):
        values = dict(point)
        for symbol, expression in assignments:
            values[symbol] = expression.xreplace(values)
        found = sympy.Matrix(rates).xreplace(values)
        assert MASS.xreplace(point) * found == FORCE.xreplace(point)
    plain = explicit_rates("s", MASS.xreplace(at), FORCE, at, velocities)
    assert plain[0] == [] and sympy.expand(MASS.xreplace(at) * sympy.Matrix(plain[1])) == FORCE


@pytest.mark.parametrize("constant", [True, False])
def test_what_is_singular_is_named(constant):
    """The mass of the velocities, or the rows of the constraints below."""
    at = {A: sympy.S.One, B: sympy.S.One}

    def rates(entries, velocities):
        mass = sympy.Matrix(entries).xreplace(at if constant else {})
        return explicit_rates("s", mass, sympy.ones(mass.rows, 1), at, velocities)[1]

    assert len(rates([[A, 0, 1], [0, B, 1], [1, 1, 0]], 2)) == 3
    assert len(rates([[A - 1 + sympy.Rational(1, 10**9), 0], [0, B]], 2)) == 2
    with pytest.raises(ReferenceFailure, match=r"mass matrix .* of scene s is singular"):
        rates([[A, B, 0], [A, B, 0], [0, 0, 1]], 2)
    with pytest.raises(ReferenceFailure, match="constraints of scene s are dependent"):
        rates([[A, 0, 0], [0, B, 0], [0, 0, 0]], 2)


def test_a_pivot_is_the_largest_of_the_velocities_alone():
    """A constraint's row is larger at the start, and may pass through zero later."""
    mass = sympy.Matrix([[A, B, 9], [B, A + 7, 1], [9, 1, 0]])
    at = {A: sympy.S.One, B: sympy.Integer(3)}
    assignments, _ = explicit_rates("s", mass, sympy.ones(3, 1), at, 2)
    held = dict(assignments)
    below = [expression.as_numer_denom()[1] for _, expression in assignments]
    pivots = {held.get(symbol, symbol) for symbol in below if symbol != 1}
    assert B in pivots and A not in pivots and 9 not in pivots


def test_a_float_in_the_lagrangian_is_exact():
    """0.1 is its binary value and does not round the exact 1/3 beside it."""
    half = pair_scene(
        "floaty", lambda x, v, p: v[0] ** 2 / 2 - 0.5 * p.k * x[0] ** 2, (1,), (0,), k="1/3"
    )
    exact = pair_scene(
        "exact", lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2 / 2, (1,), (0,), k="1/3"
    )
    assert abs(solution(half, 5).x[0] - solution(exact, 5).x[0]) < 1e-50


@pytest.mark.parametrize("lagrangian, message", [
    (lambda x, v, p: v[0] ** 2 / 2 + x[0] * v[1], "mass matrix .* singular"),
    (lambda x, v, p: __import__("math").cos(x[0]), "sympy functions"),
    (lambda x, v, p: v[0] ** 2 + sympy.Symbol("q"), "unknown symbols q"),
    (lambda x, v, p: [v.dot(v) / 2, x[0]], "has 2 values"),
    (None, "no continuous Lagrangian"),
    (lambda x, v, p: v.dot(v) / 2 + sympy.besselj(0, x[0]), "besselj.*cannot expand"),
    (lambda x, v, p: p.missing * v[0], "missing"),
])  # fmt: skip
def test_unusable_lagrangians_are_named(lagrangian, message):
    scene = pair_scene("mine", lagrangian, (3, 1), (1, 2))
    with pytest.raises(ReferenceFailure, match=message) as failure:
        solution(scene, 1)
    assert "mine" in str(failure.value) and "\n" not in str(failure.value)


def test_a_component_is_one_number_and_a_matrix_of_one_entry_is_too():
    def pushed(component):
        return Scene("pushed", pair(1), lagrangian=lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[0],
                     duration=1, step="1/10", force=lambda x, v, p: [component(x)])  # fmt: skip

    found = solution(pushed(lambda x: sympy.Matrix([[-x[0]]])), "1/2", 20)
    with mpmath.workdps(30):
        assert abs(found.x[0] - mpmath.cos(0.5)) < 1e-20
    for several in (lambda x: sympy.Matrix([[x[0], 2]]), lambda x: x[0] > 0):
        with pytest.raises(ReferenceFailure, match="component 0 of the force of scene pushed is"):
            solution(pushed(several), "1/2", 20)


def test_algebra_that_is_not_closed_is_refused():
    basis = (((0, 1, 0), (-1, 0, 0), (0, 0, 0)), ((0, 0, 0), (0, 0, 1), (0, -1, 0)))
    groupoid = SimpleNamespace(kind="group", dim_x=0, dim_u=2, algebra=SimpleNamespace(basis=basis))
    scene = SimpleNamespace(
        name="open", groupoid=groupoid, parameters={}, x0=(), v0=(1, 0),
        lagrangian=lambda x, v, p: v.dot(v),
    )  # fmt: skip
    with pytest.raises(ReferenceFailure, match="not closed"):
        solution(scene, 1)
