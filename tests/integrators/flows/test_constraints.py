"""Constraints of a scene: its own start is checked exactly, a run's to round-off."""

import pytest
import sympy

from discmech.integrators import BadInput, Conserved, Scheme, midpoint
from tests.objects import SCENES


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
