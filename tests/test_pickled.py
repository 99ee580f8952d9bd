"""Rules, scenes, schemes and flows in other people's programs: pools, threads, copies."""

import multiprocessing
import pickle
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from fractions import Fraction

import numpy as np
import pytest

from discmech import (
    Conserved,
    Scene,
    Scheme,
    discretisation,
    exponential,
    midpoint,
    one_step,
    pair,
    rectangle,
    scenes,
    trapezoidal,
)
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.rules import MAPS, compose, gauss, imex, lobatto, own, splitting

J = Conserved("E", lambda x, mu, p: mu[0] ** 2 + x[0] ** 2, "first integral")
SCENE = Scene("mine", pair(1), lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2 / 2, {"k": 1},
              x0=[1], v0=[0], symmetries=[J])  # fmt: skip


@discretisation(order=2)
def mine(L, G, x, u, h):
    return h * (L(x, u) + L(G.target(x, u, h), u)) / 2


@one_step(order=1)
def explicit(s, z, h):
    return z + h * s.f(z)


BY_H = Scene("by-h", pair(1), hamiltonian=lambda x, mu, p: p.k * mu[0] ** 2 + x[0] ** 2,
             parameters={"k": 1}, x0=[1], mu0=[0])  # fmt: skip


def part(x, mu, p):
    return mu.dot(mu) / 2


def other_part(x, mu, p):
    return x.dot(x) / 2


parted = splitting([1, 1], parts=[part, other_part], name="parted")
RULES = (midpoint, trapezoidal, rectangle, imex, own, gauss(3), lobatto(4), mine, explicit,
         compose(midpoint, "suzuki"), compose(mine, "triple-jump"),
         compose(mine, [0.25, 0.5, 0.25]), splitting([1, 1]), parted, *MAPS.values())  # fmt: skip


def again(thing):
    return pickle.loads(pickle.dumps(thing))


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_rules(rule):
    assert again(rule) == rule and deepcopy(rule) == rule


@pytest.mark.parametrize("name", [*scenes.every_name(), "mine", "by-h"])
def test_scenes(name):
    own = {"mine": SCENE, "by-h": BY_H}
    scene = own[name] if name in own else scenes.get(name)
    assert again(scene) is scene and deepcopy(scene) is scene
    other = scene.with_values(duration=Fraction(7, 3), title="another")
    back = again(other)
    assert (back.duration, back.title, back.laws) == (other.duration, other.title, other.laws)
    assert back.groupoid is scene.groupoid


def test_a_scene_in_another_chart_and_a_lattice():
    body = scenes.get("rigid-body").with_retraction(exponential)
    assert again(body).groupoid.retraction == "exponential"
    assert again(systems.get("fput")) is systems.get("fput")
    flow = Scheme(systems.get("toda"), trapezoidal).flow("1/20")
    one, other = (f.trajectory(4).x for f in (again(flow), deepcopy(flow)))
    assert np.array_equal(one, flow.trajectory(4).x) and np.array_equal(one, other)


def flows():
    for digits in (16, 30):
        yield Scheme(SCENE.with_values(x0=[2]), mine).flow("1/10", digits)
    yield Scheme(scenes.get("heavy-top"), compose(midpoint, "suzuki")).flow("1/20")
    yield Scheme(scenes.get("kepler"), explicit).flow("1/50", on_edge="refuse")


@pytest.mark.slow
def test_flows():
    for flow in flows():
        for other in (again(flow), deepcopy(flow)):
            assert other is not flow and (other.step, other.digits) == (flow.step, flow.digits)
            assert (other.trajectory(5).x == flow.trajectory(5).x).all()


def test_a_chosen_step_stays_chosen():
    flow = Scheme(scenes.get("harmonic"), midpoint).flow(tolerance="1e-3")
    assert again(flow).step == flow.step and again(flow).choice == flow.choice


def test_what_cannot_go_is_told():
    scene = Scene("local", pair(1), lambda x, v, p: v[0] ** 2, x0=[1], v0=[0])
    with pytest.raises(pickle.PicklingError, match="at the top level of a module"):
        pickle.dumps(Scheme(scene, midpoint))
    flow = Scheme(scene, midpoint).flow("1/10")
    assert (deepcopy(flow).trajectory(3).x == flow.trajectory(3).x).all()


def ends(flow):
    return flow.trajectory(10).x[-1]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["spawn", "fork"])
@pytest.mark.filterwarnings("ignore")  # of a fork beside threads
def test_a_pool_of_processes(method):
    asked = [*flows()]
    with multiprocessing.get_context(method).Pool(2) as pool:
        found = pool.map(ends, asked)
    for one, flow in zip(found, asked, strict=True):
        assert (one == ends(flow)).all()


@pytest.mark.slow
def test_eight_threads():
    asked = [*flows()] * 4
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(ends, asked))
    for one, flow in zip(found, asked, strict=True):
        assert (one == ends(flow)).all()
