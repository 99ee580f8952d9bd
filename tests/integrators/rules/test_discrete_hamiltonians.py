"""Discrete Hamiltonians of type II and III: known methods, symplectic whatever the formula is."""

import numpy as np
import pytest
import sympy

from discmech import BadInput, Scene, Scheme, midpoint, pair, scenes, solution
from discmech.integrators.rules import discrete_hamiltonian, get


@discrete_hamiltonian(order=1)
def euler(H, x, mu, h):
    return mu.dot(x) + h * H(x, mu)


@discrete_hamiltonian(order=1, kind="III")
def other_euler(H, x, mu, h):
    return -mu.dot(x) + h * H(x, mu)


@discrete_hamiltonian(order=2, stages=1)
def verlet(H, x, mu, h, s):
    ((end, half),) = s
    return mu.dot(end) - half.dot(end - x) + h * (H(x, half) + H(end, half)) / 2


@discrete_hamiltonian(order=2, stages=1)
def middle(H, x, mu, h, s):
    ((end, half),) = s
    return mu.dot(end) - half.dot(end - x) + h * H((x + end) / 2, half)


@discrete_hamiltonian(order=2)
def arbitrary(H, x, mu, h):
    """Of no order at all, and not linear in H: symplectic all the same."""
    return mu.dot(x) + sympy.sin(h * H(x + h * mu / 3, mu)) + h**2 * x[0] * mu[0] ** 3


@discrete_hamiltonian(order=1)
def weighted(H, x, mu, h):
    """The weights of H depend on the state."""
    return mu.dot(x) + h * (1 + x[0]) * H(x, mu) - h * x[0] * H(x + h * mu, mu)


def swift(x, mu, p):
    return sympy.sqrt(1 + mu.dot(mu)) + x.dot(x) / 2


KEPLER, SWIFT = scenes.get("kepler"), Scene(
    "swift", pair(1), hamiltonian=swift, x0=[1], mu0=["1/2"], duration=5, step="1/50")  # fmt: skip


@pytest.mark.dear(but=("midpoint-kepler",))
@pytest.mark.parametrize(
    ("rule", "known", "scene"),
    [(verlet, get("stoermer-verlet"), KEPLER), (verlet, get("stoermer-verlet"), SWIFT),
     (middle, midpoint, KEPLER), (middle, midpoint, scenes.get("double-pendulum"))],
    ids=lambda e: e.name,
)  # fmt: skip
def test_they_are_the_known_methods(rule, known, scene):
    a, b = (Scheme(scene, r).flow("1/50").trajectory(20) for r in (rule, known))
    assert np.abs(a.x - b.x).max() < 1e-14 and np.abs(a.mu - b.mu).max() < 1e-14


def test_both_types_of_euler_s_method_are_each_other_s_adjoints():
    one, other = Scheme(KEPLER, euler).flow("-1/50"), Scheme(KEPLER, other_euler).flow("1/50")
    run = other.trajectory(4)
    x, mu = one.dual_step(run.x[-1], run.mu[-1])
    assert np.abs(x - run.x[-2]).max() < 1e-14 and np.abs(mu - run.mu[-2]).max() < 1e-14


@pytest.mark.parametrize("rule", [euler, other_euler, verlet, middle, arbitrary, weighted],
                         ids=lambda rule: rule.name)  # fmt: skip
def test_each_step_is_symplectic(rule):
    flow = Scheme(KEPLER, rule).flow("1/50")
    run = flow.trajectory(5)
    assert flow.poisson_defect(run.x[-1], run.mu[-1]) < 1e-25


@pytest.mark.parametrize(("rule", "order"), [(euler, 1), (other_euler, 1), (verlet, 2)],
                         ids=lambda e: getattr(e, "name", e))  # fmt: skip
def test_their_order(rule, order):
    exact = float(solution(SWIFT, 1, digits=30).x[0])
    errors = [Scheme(SWIFT, rule).flow(1 / n).trajectory(n).x[-1, 0] - exact for n in (64, 128)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.05)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: discrete_hamiltonian(kind="I"), 'say "II" or "III"'),
    (lambda: discrete_hamiltonian()(lambda H, x: x), r"takes four: \(H, x, mu, h\)"),
    (lambda: Scheme(KEPLER, discrete_hamiltonian(name="short")(lambda H, x, mu, h: H(x[0], mu))),
     "H is asked at 3 numbers: give x and mu, 2 numbers each"),
    (lambda: Scheme(scenes.get("damped-pendulum"), euler), "knows no time and no force"),
    (lambda: Scheme(scenes.get("rigid-body"), euler), "euler exists on pair groupoids only"),
    (lambda: Scheme(KEPLER, discrete_hamiltonian(name="no")(lambda H, x, mu, h: x)),
     "gives a matrix: return one expr"),
    (lambda: Scheme(KEPLER, discrete_hamiltonian(name="no")(lambda H, x, mu, h: h * H(x, mu))),
     'of kind "II" is mu·x at h = 0, where nothing moves; this one is 0'),
    (lambda: Scheme(KEPLER, discrete_hamiltonian(kind="III", name="no")(lambda H, x, mu, h: 0 * h)),
     'of kind "III" is −mu·x at h = 0'),
])  # fmt: skip
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(BadInput, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
