"""Starts under constraints: what round-off hides is projected, what is off by more is refused."""

import math
import re

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, pair, rules
from discmech.reference import ReferenceFailure, solution
from tests.objects import SCENES, flow

GIVEN = ("0.6", "-0.8"), ("0.8", "0.6")
OFF = [((0.6, -0.7), (0.8, 0.6), "x0", 0.15), ((0.6, -0.8), (0.8, 0.7), "v0", 0.16)]


def pendulum(x0, v0):
    return Scene("circle", pair(2), lambda x, v, p: v.dot(v) / 2 - x[1],
                 holonomic=lambda x, p: [x.dot(x) - 1], x0=x0, v0=v0)  # fmt: skip


def blade(v0):
    """A row of the velocity, at an angle of one half."""
    return Scene("blade", pair(3), lambda x, v, p: v.dot(v) / 2 - x[0],
                 nonholonomic=lambda x, p: [[sympy.sin(x[2]), -sympy.cos(x[2]), 0]],
                 x0=[0, 0, 0.5], v0=v0)  # fmt: skip


def offered(refusal):
    """The start that a refusal offers, as it is pasted."""
    return eval(f"dict({re.search('such as (.*?)[.]?$', str(refusal.value))[1]})")


STARTS = [
    pendulum((0.6, -0.8), (0.8, 0.6)),
    pendulum(np.array([math.sin(1), -math.cos(1)]), np.array([math.cos(1), math.sin(1)])),
    pendulum((math.cos(math.pi / 2), 1), (1, math.cos(math.pi / 2))),  # entries of round-off alone
    blade((math.cos(0.5), math.sin(0.5), 1)),
]


@pytest.mark.dear("blade")
@pytest.mark.parametrize("scene", STARTS, ids=lambda s: f"{s.name}-{float(s.v0[0]):.2f}")
def test_floats_start_on_the_constraint_in_runs_and_references_alike(scene):
    given = scene
    scene = Scheme(given, rules.get("midpoint")).scene
    assert scene is not given and Scheme(scene, rules.get("midpoint")).scene is scene
    x, v = (sympy.Matrix([sympy.Rational(e) for e in z]) for z in (scene.x0, scene.v0))
    if scene.holonomic:
        rows = [x.dot(x) - 1, x.dot(v)]
    else:
        rows = [sympy.sin(x[2]) * v[0] - sympy.cos(x[2]) * v[1]]
    assert all(abs(sympy.N(row, 20, maxn=200)) < 1e-99 for row in rows)
    moved = [abs(float(a - b)) for a, b in zip([*scene.x0, *scene.v0], [*given.x0, *given.v0],
                                               strict=True)]  # fmt: skip
    assert 0 < max(moved) < 2.0**-52
    held, own = solution(given, 0, digits=90), solution(scene, 0, digits=90)
    with mpmath.workdps(95):
        gaps = (a - b for a, b in zip([*held.x, *held.v], [*own.x, *own.v], strict=True))
        assert max(map(abs, gaps)) < mpmath.mpf(10) ** -90


def test_exact_starts_stay_what_they_are():
    one = sympy.Integer(1)
    for start in (GIVEN, ((sympy.sin(one), -sympy.cos(one)), (sympy.cos(one), sympy.sin(one)))):
        scene = pendulum(*start)
        assert Scheme(scene, rules.get("midpoint")).scene is scene
        solution(scene, 0)


@pytest.mark.parametrize(("x0", "v0", "what", "far"), OFF)
def test_a_start_off_its_constraints_is_refused_with_one_that_is_not(x0, v0, what, far):
    said = rf"{what}\)? ?.*= 0.* is off by {far}"
    with pytest.raises(BadInput, match=said) as refused:
        Scheme(pendulum(x0, v0), rules.get("midpoint"))
    Scheme(pendulum(**offered(refused)), rules.get("midpoint"))
    with pytest.raises(ReferenceFailure, match=said) as refused:
        solution(pendulum(x0, v0), 1)
    solution(pendulum(**offered(refused)), 0)
    made = Scheme(pendulum(*GIVEN), rules.get("midpoint")).flow("0.1")
    with pytest.raises(BadInput, match=said) as refused:
        made.trajectory(1, x0=x0, mu0=v0)
    made.trajectory(1, **offered(refused))
    with pytest.raises(BadInput, match=said):
        made.ensemble([[0.6, -0.8], x0], [[0.8, 0.6], v0], 1)


def test_what_is_off_by_more_than_round_off_is_not_projected():
    near = pendulum(("0.600000000000002", "-0.8"), ("0.8", "0.6"))
    with pytest.raises(BadInput, match=r"off by 2\.4e-15"):
        Scheme(near, rules.get("midpoint"))
    with pytest.raises(ReferenceFailure, match=r"off by 2\.4e-15"):
        solution(near, 1)
    with pytest.raises(ReferenceFailure, match=r"A\(x0\) v0 = 0 of scene blade is off by"):
        solution(blade((0.5, 0.3, 1)), 1)


@pytest.mark.parametrize("name", ["cartesian-pendulum", "chaplygin-sleigh", "knife-edge"])
def test_rows_of_a_run_are_starts(name):
    made = flow(name, "midpoint", SCENES[name].step)
    run = made.trajectory(300, every=10)
    made.ensemble(run.base, run.mu, 0)
    with pytest.raises(BadInput, match=r"A\(x0\) v0 = 0 is off by"):
        made.trajectory(0, x0=run.base[1], mu0=run.mu[1] + 0.01)
