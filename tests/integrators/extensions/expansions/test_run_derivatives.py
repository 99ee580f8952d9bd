"""Derivatives of runs, tangent and adjoint, against differences at 50 digits."""

import mpmath
import numpy as np
import pytest

from discmech.integrators import BadInput, Scheme, retractions, rules, scenes
from discmech.integrators.errors import CannotMeasure

slow = pytest.mark.slow
STEPS = 12
TINY = mpmath.mpf(10) ** -18  # of differences at 50 digits, whose error is its square

#: scene, rule, retraction: pairs, a group, an action, a product, stages, compositions, maps
CASES = [
    ("pendulum", "midpoint", None),
    ("rigid-body", "rectangle", "cayley"),
    ("kepler", "implicit-midpoint", None),
    pytest.param("kepler", "gauss-3", None, marks=slow),
    pytest.param("kapitza-pendulum", "trapezoidal", None, marks=slow),
    pytest.param("damped-pendulum", "midpoint", None, marks=slow),
    pytest.param("heavy-top", "midpoint", "exponential", marks=slow),
    pytest.param("heavy-top", "gauss-2", "cayley", marks=slow),
    pytest.param("rotor-body", "triple-jump:trapezoidal", "cayley", marks=slow),
    pytest.param("double-pendulum", "kahan-li-6:trapezoidal", None, marks=slow),
    pytest.param("spherical-pendulum", "runge-kutta-4", "cayley", marks=slow),
    pytest.param("henon-heiles", "stoermer-verlet", None, marks=slow),
]


def made(scene, rule, retraction):
    given = scenes.get(scene)
    if retraction:
        given = given.with_retraction(retractions.get(retraction))
    return Scheme(given, rules.get(rule))


def end(scheme, x0, mu0, **parameters):
    """z at the end of a run at 50 digits."""
    flow = (scheme.at(parameters=parameters) if parameters else scheme).flow(scheme.scene.step, 50)
    run = flow.trajectory(STEPS, STEPS, x0=x0 if len(x0) else None, mu0=mu0)
    return np.concatenate([run.base[-1], run.mu[-1]])


@pytest.mark.parametrize(("scene", "rule", "retraction"), CASES)
def test_derivatives_are_those_of_differences(scene, rule, retraction):
    scheme = made(scene, rule, retraction)
    flow = scheme.flow(scheme.scene.step)
    run = flow.trajectory(STEPS)
    apart = flow.trajectory(STEPS, STEPS)
    found, again = flow.derivatives(run), flow.derivatives(apart)
    n, size = run.base.shape[1], run.base.shape[1] + run.mu.shape[1]
    assert found.start.shape == (STEPS + 1, size, size)
    np.testing.assert_allclose(found.start[-1], again.start[-1], rtol=1e-9, atol=1e-11)
    with mpmath.workdps(60):
        z0 = [mpmath.mpf(float(e)) for e in (*run.base[0], *run.mu[0])]
        wanted = []
        for i in range(size):
            ends = []
            for sign in (1, -1):
                z = list(z0)
                z[i] += sign * TINY
                ends.append(end(scheme, z[:n], z[n:]))
            wanted.append((ends[0] - ends[1]) / (2 * TINY))
        wanted = np.array(wanted).T.astype(float)
        scale = abs(wanted).max()
        np.testing.assert_allclose(found.start[-1], wanted, rtol=0, atol=2e-12 * scale)
        for name, value in scheme.scene.parameters.items():
            if isinstance(value, tuple):
                continue
            ends = [end(scheme, z0[:n], z0[n:], **{name: mpmath.mpf(value.numerator)
                    / value.denominator + sign * TINY}) for sign in (1, -1)]  # fmt: skip
            of = ((ends[0] - ends[1]) / (2 * TINY)).astype(float)
            got = found.parameters[name][-1]
            np.testing.assert_allclose(got, of, rtol=0, atol=1e-11 * max(1, abs(of).max()))
    slope = np.linspace(1, 2, size)
    back = flow.gradient(run, slope)
    joined = np.concatenate([back.x0, back.mu0])
    np.testing.assert_allclose(joined, slope @ found.start[-1], atol=1e-11 * scale)
    for name, part in back.parameters.items():
        forth = np.tensordot(slope, found.parameters[name][-1], 1)
        np.testing.assert_allclose(part, forth, atol=1e-11 * max(1, np.abs(forth).max(initial=0)))


def test_at_50_digits_derivatives_have_them():
    scheme = made("pendulum", "midpoint", None)
    flow = scheme.flow(scheme.scene.step, 50)
    run = flow.trajectory(3)
    found = flow.derivatives(run)
    M = found.start[-1]
    with mpmath.workdps(60):
        det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        assert abs(det - 1) < mpmath.mpf(10) ** -48  # the step keeps the area
        run16 = scheme.flow(scheme.scene.step).trajectory(3)
    of = scheme.flow(scheme.scene.step).derivatives(run16)
    np.testing.assert_allclose(M.astype(float), of.start[-1], rtol=1e-13)


def test_a_sum_over_rows_and_a_velocity_that_is_held():
    """Σ of the squares of all angles, by the length, at the same v₀."""
    scheme = made("pendulum", "gauss-2", None)

    def total(length):
        own = scheme.at(parameters={"length": length})
        return float((own.flow("0.1").trajectory(20).x ** 2).sum())

    flow = scheme.at(v0=["0.7"]).flow("0.1")
    scheme = flow.scheme
    run = flow.trajectory(20)
    slope = np.hstack([2 * run.x, 0 * run.mu])
    back = flow.gradient(run, slope, held="v0")
    length, d = float(scheme.scene.parameters["length"]), 1e-5
    wanted = (total(length + d) - total(length - d)) / (2 * d)
    assert back.parameters["length"] == pytest.approx(wanted, rel=1e-7)
    forth = flow.derivatives(run, held="v0")
    of = np.einsum("rz,rz->", slope, forth.parameters["length"])
    assert back.parameters["length"] == pytest.approx(of, rel=1e-12)


def test_what_has_no_derivative_is_said_in_a_sentence():
    flow = made("cartesian-pendulum", "midpoint", None).flow("0.1")
    with pytest.raises(CannotMeasure, match="has constraints"):
        flow.derivatives(flow.trajectory(2))
    other = made("pendulum", "midpoint", None)
    with pytest.raises(BadInput, match="is of another flow"):
        other.flow("0.1").derivatives(other.flow("0.2").trajectory(2))
    pendulum = scenes.get("pendulum")
    run = Scheme(pendulum, rules.get("midpoint")).flow("0.1").trajectory(3)
    for scene, rule in (
        (pendulum, "gauss-2"),
        (pendulum.with_values(parameters={"length": 2}), "midpoint"),
    ):
        with pytest.raises(BadInput, match="is of another flow"):
            Scheme(scene, rules.get(rule)).flow("0.1").derivatives(run)
    own = other.flow("0.1")
    run = own.trajectory(3)
    with pytest.raises(BadInput, match=r"give \(2,\) for the last row, or \(4, 2\) for all"):
        own.gradient(run, [1.0, 2.0, 3.0])
    with pytest.raises(BadInput, match="the slope is 'x': give numbers"):
        own.gradient(run, "x")
    with pytest.raises(BadInput, match='give "mu0" or "v0"'):
        own.derivatives(run, held="v")


@slow
def test_a_discrete_lagrangian_on_the_group_has_no_series():
    flow = made("moser-veselov", "midpoint", None).flow("0.1")
    with pytest.raises(CannotMeasure, match="on the group itself"):
        flow.derivatives(flow.trajectory(1))
