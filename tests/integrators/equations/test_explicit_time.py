"""Explicit time: each point of a rule has its own, and a start may be at any time."""

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, lie_group, pair, rules, scenes, so
from discmech.integrators.rules import compose, discretisation
from tests.integrators.equations.forced_scenes import errors, order
from tests.objects import flow, scheme
from tests.studies.cached_results import measured


def swung(x, v, p, t):
    """A mass and a spring that both change with the time."""
    return (2 + sympy.sin(t)) * v[0] ** 2 / 2 - (1 + t / 3) * x[0] ** 2 / 2


def swelling(x, v, p, t):
    """A body whose moments of inertia grow: no base, so the time alone tells points apart."""
    return sum((1 + i + t / 2) * v[i] ** 2 for i in range(3)) / 2


def held(**more):
    return Scene(**{"name": "swung", "groupoid": pair(1), "lagrangian": swung, "x0": [1],
                    "v0": ["0.3"], "step": "0.05", "duration": 2, **more})  # fmt: skip


SWUNG = held()
SWELLING = held(name="swelling", groupoid=lie_group(so(3)), lagrangian=swelling, x0=[],
                v0=["0.5", "-0.3", "0.7"])  # fmt: skip
ORDERS = {"rectangle": 1, "midpoint": 2, "trapezoidal": 2, "gauss-2": 4, "lobatto-3": 4}


@pytest.mark.sampled
@pytest.mark.parametrize("rule", ORDERS)
@pytest.mark.parametrize("scene", [SWUNG, SWELLING], ids=lambda s: s.name)
def test_every_point_of_a_rule_has_its_time(scene, rule):
    one = Scheme(scene, rules.get(rule))
    assert order(one, 1, (16, 32)) == pytest.approx(ORDERS[rule], abs=0.15)


@pytest.mark.parametrize("scene", [SWUNG, SWELLING], ids=lambda s: s.name)
def test_substeps_and_adjoints_have_theirs(scene):
    one = Scheme(scene, compose(rules.get("rectangle"), "triple-jump"))
    assert order(one, 1, (16, 32)) == pytest.approx(4, abs=0.2)


@discretisation(order=2, stages=1)
def two_halves(L, G, x, u, h, s):
    """Two trapezoidal steps of h/2, the velocity of the first a stage."""
    middle, then = G.target(x, s[0], h / 2), 2 * u - s[0]
    ends = L(x, s[0]) + L(G.target(x, u, h), then)
    return h * (ends + L(middle, s[0]) + L(middle, then)) / 4


@pytest.mark.parametrize("force", [None, lambda x, v, p, t: [sympy.cos(3 * t) - v[0] / 5]])
def test_a_point_that_a_stage_leads_to_has_its_time(force):
    scene = held(name="pushed", force=force)
    wanted, found = (
        errors(Scheme(scene, rule), 1, (32, 64)) for rule in (two_halves, rules.get("trapezoidal"))
    )
    assert np.log2(wanted[0] / wanted[1]) == pytest.approx(2, abs=0.05)
    assert 3 < found[0] / wanted[0] < 5  # steps half as long


def test_a_point_whose_time_is_unknown_is_refused():
    mixed = discretisation(stages=1, name="mixed")(
        lambda L, G, x, u, h, s: h * L(G.target(x, 2 * u - s[0], h / 2), u)
    )
    with pytest.raises(BadInput, match=r"the time of G.target\(x, w, h/2\) is unknown"):
        Scheme(SWUNG, mixed)


@discretisation(order=2)
def late(L, G, x, u, h):
    """The midpoint rule with everything at t_k."""
    middle = G.target(x, u, h / 2)
    middle[-1] = x[-1]
    return h * L(middle, u)


def test_everything_at_the_time_of_the_start_is_of_first_order():
    assert order(Scheme(SWUNG, late), 1, (64, 128)) == pytest.approx(1, abs=0.1)
    assert order(Scheme(SWUNG, rules.get("midpoint")), 1, (64, 128)) == pytest.approx(2, abs=0.1)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("rule", "digits"),
    [(rule, 16) for rule in ("rectangle", "midpoint", "gauss-2")]
    + [("rectangle", 50), ("midpoint", 50)],
)
@pytest.mark.parametrize("scene", [SWUNG, SWELLING], ids=lambda s: s.name)
def test_the_form_is_kept_at_each_step(scene, rule, digits):
    """Without a force L_d(t_k) is a generating function of the step, whatever the time."""
    made = Scheme(scene, rules.get(rule)).flow("0.1", digits)
    run = made.trajectory(12, t0="0.3")
    limit = 1e-13 if digits == 16 else 1e-45
    for k in (0, 5, 11):
        assert made.pullback_defect(run.base[k], run.u[k]) < limit
        assert made.poisson_defect(run.base[k], run.mu[k], u0=run.u[k]) < limit
        ahead = run.base[k + 1], run.mu[k + 1]
        assert made.step_defect(run.base[k], run.mu[k], *ahead, u0=run.u[k]) < limit


def test_a_run_may_start_at_any_time():
    """Two halves, the second from where and when the first ended, are the whole."""
    made = flow("kapitza-pendulum", "midpoint", "0.01")
    whole = made.trajectory(40, t0="0.25")
    first = made.trajectory(20, t0="0.25")
    then = made.trajectory(20, x0=first.x[-1], mu0=first.mu[-1], u0=first.u[-1], t0="0.45")
    assert whole.t[0] == 0.25 and whole.t[-1] == pytest.approx(0.65, abs=1e-15)
    assert whole.x.shape == (41, 1) and whole.base.shape == (41, 2)
    assert np.abs(whole.base[:, 1] - whole.t).max() < 1e-15
    assert np.abs(then.x[-1] - whole.x[-1]).max() < 1e-13
    same = made.trajectory(20, x0=first.base[-1], mu0=first.mu[-1], u0=first.u[-1])
    assert same.t[0] == first.t[-1] and np.abs(same.x[-1] - whole.x[-1]).max() < 1e-13
    with pytest.raises(BadInput, match=r"x0 has the time .*, but t0 is 1/3: leave one"):
        made.trajectory(1, x0=first.base[-1], t0="1/3")
    assert np.abs(made.trajectory(40).x - whole.x).max() > 1e-3  # another time, another motion
    with pytest.raises(BadInput, match="t0"):
        made.trajectory(1, t0=float("nan"))


def test_the_time_changes_nothing_where_nothing_depends_on_it():
    made = flow("pendulum", "midpoint", "0.1")
    assert np.array_equal(made.trajectory(5, t0=3).x, made.trajectory(5).x)
    assert made.trajectory(5, t0=3).t[0] == 3
    assert not scheme("pendulum", "midpoint").s.clocked
    rubbed = scenes.get("damped-pendulum")
    assert not rubbed.timed and not Scheme(rubbed, rules.get("midpoint")).s.clocked


def test_a_step_back_starts_at_the_time_of_the_run():
    """Φ₋ₕ from t + h is the inverse of a self-adjoint Φₕ from t, which is not 0."""
    made, back = (scheme("kapitza-pendulum", "trapezoidal").flow(h) for h in ("0.01", "-0.01"))
    run = made.trajectory(3, t0="0.2")
    again = back.trajectory(1, x0=run.base[3], mu0=run.mu[3], u0=run.u[2])
    assert np.abs(again.base[1] - run.base[2]).max() < 1e-14
    assert np.abs(again.mu[1] - run.mu[2]).max() < 1e-13


@pytest.mark.dear("kapitza-pendulum", "damped")
@pytest.mark.parametrize("name", ["kapitza-pendulum", "duffing", "damped-pendulum"])
def test_energy_is_compared_with_the_work_that_is_done(name):
    found = measured("energy", name, "midpoint", steps=100)  # duffing is chaotic: at 400 it is 2.27
    assert found["verdict"] == "pass"
    assert found["measured"]["balance_order"] == pytest.approx(2, abs=0.01)


def test_energy_of_a_wrong_time_is_not_balanced():
    found = measured("energy", SWUNG, late, steps=400)
    assert found["verdict"] == "fail" and "balance" in found["reason"]
