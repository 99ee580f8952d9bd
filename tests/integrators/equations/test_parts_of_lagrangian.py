"""L.potential, L.gradient and L.mass inside of a rule: force gradients in four lines."""

import numpy as np
import pytest
import sympy

from discmech import BadInput, Scene, Scheme, discretisation, pair, scenes

ON_PAIRS = [s.name for s in scenes.all_scenes()
            if s.groupoid.kind == "pair" and s.lagrangian is not None and s.force is None
            and not s.all_constraints and s.contact is None]  # fmt: skip


@discretisation(order=2, groupoids="pair")
def takahashi_imada(L, G, x, u, h):
    y = G.target(x, u, h)
    square = [(L.gradient(z).T * L.mass(z).inv() * L.gradient(z))[0] for z in (x, y)]
    return h * (L(x, u) + L(y, u)) / 2 + h**3 / 48 * sum(square)


@discretisation(order=2, groupoids="pair")
def by_hand(L, G, x, u, h):
    """The same with derivatives that the rule takes itself."""
    q = sympy.Matrix(sympy.symbols(f"q0:{len(x)}", real=True))
    v = sympy.Matrix(sympy.symbols(f"v0:{len(u)}", real=True))
    slope = sympy.Matrix([L(q, v)]).jacobian(q[: len(u), :]).T.subs(dict.fromkeys(v, 0))
    mass = sympy.hessian(L(q, v), list(v)).subs(dict.fromkeys(v, 0))
    square = (slope.T * mass.inv() * slope)[0]
    y = G.target(x, u, h)
    ends = [square.subs(dict(zip(q, z, strict=True)), simultaneous=True) for z in (x, y)]
    return h * (L(x, u) + L(y, u)) / 2 + h**3 / 48 * sum(ends)


@discretisation(order=2, groupoids="pair")
def from_parts(L, G, x, u, h):
    """The trapezoidal rule, from mass and potential."""
    y = G.target(x, u, h)
    return sum(h / 2 * ((u.T * L.mass(z) * u)[0] / 2 - L.potential(z)) for z in (x, y))


def ends(scene, rule, steps=20):
    run = Scheme(scene, rule).flow(scene.step).trajectory(steps)
    return np.concatenate([run.x[-1], run.mu[-1]])


@pytest.mark.dear("double-pendulum", "-pendulum", "henon", "kepler")
@pytest.mark.parametrize("name", [n for n in ON_PAIRS if n not in ("outer-solar-system", "fpu")])
def test_a_force_gradient_is_that_of_the_lagrangian(name):
    scene = scenes.get(name)
    assert ends(scene, takahashi_imada) == pytest.approx(ends(scene, by_hand), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("name", ["pendulum", "double-pendulum", "kepler", "kapitza-pendulum"])
def test_mass_and_potential_are_those_of_the_lagrangian(name):
    from discmech import trapezoidal

    scene = scenes.get(name)
    assert ends(scene, from_parts) == pytest.approx(ends(scene, trapezoidal), rel=1e-12, abs=1e-13)


def test_elsewhere_it_is_refused_with_a_sentence():
    @discretisation(order=2)
    def anywhere(L, G, x, u, h):
        return h * L(x, u) + h**3 * sum(L.gradient(x))

    with pytest.raises(
        BadInput, match=r"L\.gradient\(x\) is in the coordinates of a pair groupoid"
    ):
        Scheme(scenes.get("heavy-top"), anywhere)

    @discretisation(order=2)
    def of_two(L, G, x, u, h):
        return h * L(x, u) + L.potential(x.col_join(x))

    with pytest.raises(BadInput, match="takes the 1 entries of a point, not 2"):
        Scheme(scenes.get("pendulum"), of_two)


@pytest.mark.slow
def test_a_molecule_is_derived_and_explained_in_seconds():
    """Six coordinates, Morse bonds: written out, the equations have a hundred thousand letters."""
    from discmech import explain

    def morse(x, v, p):
        mass = (1, 16, 1)
        kinetic = sum(m * (v[2 * i] ** 2 + v[2 * i + 1] ** 2) for i, m in enumerate(mass)) / 2

        def bond(i, j):
            far = sympy.sqrt((x[2 * i] - x[2 * j]) ** 2 + (x[2 * i + 1] - x[2 * j + 1]) ** 2)
            return (1 - sympy.exp(-2 * (far - 1))) ** 2

        return kinetic - bond(0, 1) - bond(1, 2)

    molecule = Scene(
        "molecule", pair(6), morse, x0=["-0.8", "0.6", 0, 0, "0.9", "0.5"],
        v0=["0.1", 0, 0, 0, "-0.1", "0.05"], duration=20,
    )  # fmt: skip
    page = explain(molecule, takahashi_imada)
    assert "self-adjoint" in page and "letters; discmech report" in page
