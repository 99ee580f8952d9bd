"""Starts: by the momentum, where there is a discrete Lagrangian only, and on constraints."""

import numpy as np
import pytest
import sympy

from discmech import BadInput, Conserved, Scene, Scheme, check, midpoint, pair
from tests.objects import SCENES

KICKED = Scene(
    "kicked-rotor", pair(1), x0=["0.3"], mu0=["0.8"], duration=100, step=1,
    parameters={"kick": "0.5"},
    discrete_lagrangian=lambda x, u, h, p: h * u[0] ** 2 / 2 + h * p.kick * sympy.cos(x[0]),
)  # fmt: skip


def test_the_run_begins_there():
    """The standard map: μ′ = μ − K sin x′ … in the order that this L_d has it."""
    flow = Scheme(KICKED, midpoint).flow(1)
    run = flow.trajectory(50)
    assert (run.x[0, 0], run.mu[0, 0]) == (0.3, 0.8) and run.u[0, 0] != 0
    given = flow.trajectory(50, x0=["0.3"], mu0=["0.8"])
    assert np.array_equal(run.x, given.x) and np.array_equal(run.mu, given.mu)
    x, mu = 0.3, 0.8
    for k in range(1, 51):
        mu -= 0.5 * np.sin(x)  # F⁻ = hu − (kick at the start): u = μ − K sin x
        x += mu
        assert run.x[k, 0] == pytest.approx(x, abs=1e-9) and run.mu[k, 0] == pytest.approx(mu)
    other = Scheme(KICKED, midpoint).at(mu0=["0.1"]).flow(1, digits=30).trajectory(1)
    assert float(other.mu[0, 0]) == 0.1


def test_studies_take_it():
    found = check("symplecticity", [KICKED], digits=[50], steps=8)
    assert found["verdict"] == "pass"
    with pytest.raises(BadInput, match="needs a Lagrangian"):
        check("energy", [KICKED])


def test_what_does_not_fit_is_refused():
    how = {"discrete_lagrangian": KICKED.discrete_lagrangian, "parameters": {"kick": 1}, "x0": [0]}
    with pytest.raises(BadInput, match="mu0 has 2 entries, but 1 are needed"):
        Scene("a", pair(1), mu0=[1, 2], **how)
    with pytest.raises(BadInput, match="mu0 follows from v0 by the Lagrangian"):
        Scene("a", pair(1), lambda x, v, p: v[0] ** 2, x0=[0], mu0=[1])
    kept = [Conserved("μ", lambda x, mu, p: mu[0], value=2)]
    with pytest.raises(BadInput, match="μ is 1 at x0, but must be 2"):
        Scheme(Scene("a", pair(1), mu0=[1], symmetries=kept, **how), midpoint)
    without = Scheme(Scene("a", pair(1), v0=[1], **how), midpoint).flow(1)
    with pytest.raises(BadInput, match=r"Scene\(..., mu0=...\), or trajectory"):
        without.trajectory(1)


# -- constraints: its own start is checked exactly, a run's to round-off ---------------------------


def test_a_row_of_a_run_satisfies_a_constraint_to_roundoff():
    """A run goes on from the doubles of a row, at any precision, and where all is tiny."""
    f = Scheme(SCENES["spherical-pendulum"], midpoint).flow("1/20", 30)
    run = f.trajectory(3)
    x, mu = run.x[-1].astype(float), run.mu[-1].astype(float)
    assert x @ mu != 0 or x @ x != 1
    assert f.trajectory(1, x0=x, mu0=mu).steps == 1
    assert f.trajectory(1, x0=x, mu0=mu * 1e-30).steps == 1
    with pytest.raises(BadInput, match="μ·x is"):
        f.trajectory(1, x0=x, mu0=1e-30 * (mu + x))


def test_a_constraint_is_checked_exactly():
    """|Γ|² = 1 to the last digit, also where it is irrational; other constants do not matter."""
    half, top = sympy.sqrt(2) / 2, SCENES["heavy-top"]
    assert Scheme(top.with_values(x0=[half, half, 0]), midpoint).scene.x0[0] == half
    with pytest.raises(BadInput, match="must be 1"):
        Scheme(top.with_values(x0=[half, "0.70710678118654752440", 0]), midpoint)
    fixed = Conserved("x²", lambda x, mu, p: x[0] ** 2, value="9/4")
    scene = SCENES["harmonic"].with_values(x0=[1], symmetries=[fixed])
    with pytest.raises(BadInput, match="x² is 1 at x0, but must be 9/4"):
        Scheme(scene, midpoint)
