"""Rules with internal stages that are none: a sentence each."""

import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, StepFailure, discretisation, pair
from discmech.integrators.rules import gauss, get, lobatto
from tests.objects import SCENES


def built(stages, formula):
    made = discretisation(name="mine", stages=stages)(formula)
    return Scheme(SCENES["kepler"], made)


def one_of_two(L, G, x, u, h, s):
    w, dw = u / 2 + s[0], u + s[0]
    return h * L(G.target(x, w, h), G.velocity(x, w, dw, h))


def linear(L, G, x, u, h, s):
    return h * L(x, u) + s[0][0] + s[0][1]


@pytest.mark.parametrize(("make", "words"), [
    (lambda: discretisation(stages=-1), "whole number from 0, not -1"),
    (lambda: discretisation(stages=1.5), "whole number from 0, not 1.5"),
    (lambda: discretisation(stages=1)(lambda L, G, x, u, h: 0), r"takes six: \(L, G, x, u, h, s\)"),
    (lambda: discretisation()(lambda L, G, x, u, h, s: 0), r"takes five: \(L, G, x, u, h\)"),
    (lambda: built(1, lambda L, G, x, u, h, s: h * L(x, u)),
     r"does not depend on all of s\[0\]; use every stage"),
    (lambda: built(2, one_of_two), r"does not depend on all of s\[1\]"),
    (lambda: built(1, linear), "singular everywhere.*every stage"),
    (lambda: built(1, lambda L, G, x, u, h, s: s[3][0]), "could not be evaluated.*IndexError"),
    (lambda: gauss(0), "gauss with 0 nodes: give a whole number from 1 to 20"),
    (lambda: (gauss(2), gauss(2.0)), "gauss with 2.0 nodes"),
    (lambda: lobatto(1), "lobatto with 1 nodes: give a whole number from 2"),
    (lambda: get("gauss-99"), "gauss with 99 nodes"),
    (lambda: get("gaus-2"), "did you mean gauss-2"),
])  # fmt: skip
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(BadInput, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_stages_that_are_not_found_are_a_step_failure():
    """∂L_d/∂s = 0 has no real solution far out: eˢ grows without end."""

    @discretisation(name="no-stage", stages=1)
    def formula(L, G, x, u, h, s):
        return h * (L(x, u) + sympy.exp(s[0][0]) + s[0][0])

    scene = Scene("a", pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[1])
    f = Scheme(scene, formula).flow("0.1")
    with pytest.raises(StepFailure, match="the internal stages were not found"):
        f.evolve([1], [1])
    with pytest.raises(StepFailure, match=r"Newton did not converge|singular"):
        f.trajectory(3)
