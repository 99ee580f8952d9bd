"""Constraints that move: φ(x, t) = 0 and A(x, t) ξ = a(x, t), against closed forms."""

import mpmath
import numpy as np
import pytest
import sympy

from discmech import (
    Conserved,
    Scene,
    Scheme,
    action,
    exponential,
    lie_group,
    pair,
    se,
    so,
    solution,
)
from discmech.integrators import BadInput, rules, scenes
from discmech.reference import ReferenceFailure
from tests.objects import SCENES, flow


def on_turntable(t):
    """The centre's velocity turns at 2/7 of the table's rate; the spin rolls on the table."""
    rate, turn = mpmath.mpf(2), mpmath.mpf(4) / 7
    v0, turned = mpmath.mpc("0.2", "0.3"), mpmath.expj(turn * t)
    place, v = 1 + v0 * (turned - 1) / (1j * turn), v0 * turned
    slip = v - 1j * rate * place  # radius · (ω₂ − iω₁)
    spin = [-slip.imag / 5, slip.real / 5, mpmath.mpf("0.07")]  # inertia / radius = 1/5
    return [place.real, place.imag], [v.real, v.imag, *spin]


def in_cylinder(t):
    """It goes up and down with √(2/7) of the frequency with which it goes round."""
    nu, share = mpmath.mpf("1.2"), mpmath.mpf(2) / 7
    beat = nu * mpmath.sqrt(share)
    middle = -(share * mpmath.mpf("0.18") + (1 - share)) / beat**2
    z = middle * (1 - mpmath.cos(beat * t)) + mpmath.mpf("0.2") / beat * mpmath.sin(beat * t)
    rise = middle * beat * mpmath.sin(beat * t) + mpmath.mpf("0.2") * mpmath.cos(beat * t)
    normal, around = mpmath.mpf("0.3") + 2 * nu * z, 2 * rise
    turned = mpmath.expj(nu * t) * mpmath.mpc(normal, around) / 10
    return [nu * t, z], [nu, rise, turned.real, turned.imag, mpmath.mpf("0.06")]


def on_hoop(t):
    """The same motion by the bead's angle alone."""
    hoop = Scene(
        "hoop-by-angle", pair(1), x0=[sympy.asin("3/5")], v0=[0], duration=10, step="1/20",
        parameters={"rate": "1.5"},
        lagrangian=lambda x, v, p: (v[0] ** 2 + p.rate**2 * sympy.sin(x[0]) ** 2) / 2
        + sympy.cos(x[0]),
    )  # fmt: skip
    found = solution(hoop, t, 30)
    (angle,), (turn,), around = found.x, found.mu, mpmath.mpf("1.5") * t
    sine, cosine = mpmath.sin(angle), mpmath.cos(angle)
    plane = mpmath.expj(around)
    v = plane * mpmath.mpc(turn * cosine, mpmath.mpf("1.5") * sine)
    x = plane * sine
    return [x.real, x.imag, -cosine], [v.real, v.imag, turn * sine]


CLOSED = {
    "ball-on-turntable": (on_turntable, {}),
    "bead-on-hoop": (on_hoop, {}),
    "ball-in-cylinder": (in_cylinder, {"swing": 0}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CLOSED)
def test_references_and_steps_are_those_of_the_closed_form(name):
    closed_form, values = CLOSED[name]
    scene = scenes.get(name).with_values(parameters=values)
    time = sympy.Rational(3)
    run = Scheme(scene, rules.get("midpoint")).flow(time / 3000).trajectory(3000, every=3000)
    found = solution(scene, 3, 30, proof=False)
    with mpmath.workdps(40):
        exact = [e for part in closed_form(3) for e in part]
        assert max(abs(a - b) for a, b in zip([*found.x, *found.mu], exact, strict=True)) < 1e-29
    assert np.abs([*run.x[-1], *run.mu[-1]] - np.array(exact, dtype=float)).max() < 1e-5


L = {"lagrangian": lambda x, v, p: (v[0] ** 2 + 2 * v[1] ** 2 + 3 * v[2] ** 2 + v[0] * v[1]) / 2,
     "duration": 2, "step": "1/10"}  # fmt: skip
ANYWHERE = [
    Scene("on-action", action(so(3)), x0=["0.6", 0, "0.8"], v0=[1, 1, "-3/14"], **L,
          nonholonomic=lambda x, p, t: ([[x[0], x[1], x[2] + 2]], [sympy.sin(t) + x[1]])),
    Scene("on-sphere", action(so(3), exponential), x0=["0.6", 0, "0.8"], v0=[1, 0, 2], **L,
          holonomic=lambda x, p, t: [x[2] - sympy.cos(t) * sympy.Rational(4, 5)]),
    Scene("on-group", lie_group(so(3)), v0=[1, "0.5", 0], **L,
          nonholonomic=lambda x, p, t: ([[0, t, 1]], [sympy.sin(t)])),
    Scene("by-constants", lie_group(se(2)), v0=[1, "0.5", 2], **L,
          nonholonomic=lambda x, p: ([[1, 2, 0]], [2])),
    Scene("of-both-kinds", pair(3), x0=[0, 0, 0], v0=[1, 1, 1], **L,
          holonomic=lambda x, p, t: [x[2] - x[0] ** 2 / 2 - sympy.sin(t)],
          nonholonomic=lambda x, p: ([[-x[1], 1, 0]], [1 + x[0]])),
    Scene("pushed", pair(3), x0=[0, 0, 0], v0=[1, 2, 0], **L,
          holonomic=lambda x, p, t: [x[1] - sympy.sin(x[0] + t)],
          force=lambda x, v, p, t: [-v[0] / 3, 0, sympy.cos(t)]),
]  # fmt: skip


@pytest.mark.dear("by-constants", "pushed", "on-sphere", "2-")
@pytest.mark.parametrize("scene", ANYWHERE, ids=lambda s: s.name)
@pytest.mark.parametrize(("rule", "power"), [("midpoint", 2), ("trapezoidal", 2), ("rectangle", 1)])
@pytest.mark.sampled
def test_they_have_their_order_on_every_groupoid(scene, rule, power):
    """Midpoint needs a at the middle's time: at the start's it would be of order 1."""
    exact, errors = solution(scene, 1, 20, proof=False), []
    scheme = Scheme(scene, rules.get(rule))
    power = 2 if scene.name in ("by-constants", "on-sphere") else power  # the same at both ends
    assert scheme.order == power
    for steps in (100, 200):
        run = scheme.flow(sympy.Rational(1, steps)).trajectory(steps, every=steps)
        ends = zip([*run.x[-1], *run.mu[-1]], [*exact.x, *exact.mu], strict=True)
        errors.append(max(abs(a - float(b)) for a, b in ends))
    assert abs(np.log2(errors[0] / errors[1]) - power) < 0.05


@pytest.mark.parametrize("name", ["bead-on-hoop", "ball-in-cylinder"])
def test_a_run_goes_on_from_its_rows_at_their_times(name):
    made = flow(name, "midpoint", SCENES[name].step)
    run = made.trajectory(20)
    again = made.trajectory(10, x0=run.x[10], mu0=run.mu[10], t0=made.step * 10)
    assert np.abs(again.x[-1] - run.x[-1]).max() < 1e-14
    back = flow(name, "midpoint", f"-{SCENES[name].step}")
    home = back.trajectory(20, x0=run.base[-1], mu0=run.mu[-1])
    assert np.abs(home.mu[-1] - run.mu[0]).max() < 1e-13
    with pytest.raises(BadInput, match="is off by"):
        made.trajectory(10, x0=run.x[10], mu0=run.mu[10])  # at the time 0
    with pytest.raises(BadInput, match="is off by"):
        made.trajectory(10, t0=1)  # the scene's own start, at another time
    with pytest.raises(BadInput, match="is off by"):
        made.trajectory(10, x0=run.x[10], mu0=run.mu[10] * 1.001, t0=made.step * 10)


@pytest.mark.slow
def test_a_declared_moving_energy_is_kept_and_the_energy_is_not():
    """Of the bead Jacobi's integral, in a band; a wrong rate is no integral."""
    scene = scenes.get("bead-on-hoop")
    run = flow("bead-on-hoop", "trapezoidal", scene.step).trajectory(2000)
    x, v = run.x.T, run.mu.T
    around, energy = x[0] * v[1] - x[1] * v[0], (v**2).sum(axis=0) / 2 + x[2]
    assert np.ptp(energy) > 0.5 > 1000 * np.ptp(energy - 1.5 * around)
    kept = solution(scene, 1, 20, proof=False).evidence
    assert "moving energy kept" in kept
    wrong = Conserved("moving energy", lambda x, mu, p: mu.dot(mu) / 2 + x[2], "first integral")
    said = solution(scene.with_values(symmetries=[wrong]), 2, 20, proof=False).evidence
    assert "moving energy, which the scene declares, not conserved" in said


def test_rows_that_vanish_on_the_way_end_a_reference():
    stops = Scene("stops", pair(2), lambda x, v, p: v.dot(v) / 2, x0=[0, 0], v0=[1, 0], duration=2,
                  nonholonomic=lambda x, p, t: ([[1 - t, 0]], [1 - t]))  # fmt: skip
    with pytest.raises(ReferenceFailure, match="dependent at t = 1"):
        solution(stops, 2, 20)


def test_a_black_box_is_refused_where_constraints_move():
    from discmech import black_box

    @black_box(order=1)
    def euler(q, p, h, system):
        return q + h * p, p

    with pytest.raises(Exception, match="bead-on-hoop has moving constraints"):
        Scheme(scenes.get("bead-on-hoop"), euler)
