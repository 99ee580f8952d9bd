"""Many runs at once are the runs one after another, and each fails by itself."""

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, pair, rules
from tests.objects import SCENES, flow


def starts(scene, count):
    """Momenta around the scene's own."""
    own = flow(scene, "midpoint", SCENES[scene].step).trajectory(0).mu[0]
    return own * np.linspace(0.8, 1.2, count)[:, None]


@pytest.mark.parametrize("rule", ["midpoint", "gauss-3"])
@pytest.mark.parametrize("scene", ["kepler", "rigid-body"])
def test_members_are_runs(scene, rule):
    f = Scheme(SCENES[scene], rules.get(rule)).flow(SCENES[scene].step)
    mu0s = starts(scene, 9)
    many = f.ensemble(None, mu0s, 40, 8)
    assert not many.failures and many.mu.shape == (9, 6, mu0s.shape[1])
    for k, mu0 in enumerate(mu0s):
        run = f.trajectory(40, 8, mu0=mu0)
        for name in ("x", "u", "mu"):
            assert np.array_equal(getattr(many, name)[k], getattr(run, name))
    assert np.array_equal(many.t, run.t)


def test_a_failing_member_fails_alone():
    """One of three particles is thrown to where the potential ends."""

    def lagrangian(x, v, p):
        return v[0] ** 2 / 2 - sympy.sqrt(x[0]) ** 3

    scene = Scene("edge", pair(1), lagrangian, x0=[1], v0=[0])
    f = Scheme(scene, rules.get("midpoint")).flow("0.1")
    many = f.ensemble([[1.0], [1.0], [1.0]], [[0.0], [-9.0], [0.1]], 5, 1)
    assert list(many.failures) == [1]
    assert np.isnan(many.x[1][-1]).all() and np.isfinite(many.x[[0, 2]]).all()
    assert np.array_equal(many.x[2], f.trajectory(5, x0=[1.0], mu0=[0.1]).x)


def test_many_digits():
    f = Scheme(SCENES["kepler"], rules.get("gauss-2")).flow("0.1", digits=30)
    many = f.ensemble(None, starts("kepler", 2), 2)
    assert many.x.shape == (2, 3, 2) and many.x.dtype == object


@pytest.mark.parametrize("given", [{}, {"mu0s": []}, {"x0s": [[1, 0]], "mu0s": [[0, 1], [0, 1]]}])
def test_starts_that_do_not_fit_are_refused(given):
    with pytest.raises(BadInput, match="starts"):
        flow("kepler", "midpoint", SCENES["kepler"].step).ensemble(**given, steps=2)


def test_steps_have_to_be_given():
    with pytest.raises(BadInput, match="steps is None"):
        flow("kepler", "midpoint", SCENES["kepler"].step).ensemble(None, starts("kepler", 2))
