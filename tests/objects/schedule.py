"""What `make test` runs: each scene by one of the plain rules; `make test-all` runs it by all."""

from collections import Counter
from itertools import combinations

import pytest

#: scenes that meet every rule in every run, one of each kind of groupoid
ALWAYS = {"pendulum", "rigid-body", "heavy-top"}
#: seconds a test, and others of their kind run in every run: their laws are slow tests
EXPENSIVE = (
    "outer-solar-system", "wong", "pivoted-body", "rigid-body-so4", "kovalevskaya-top",
    "double-spherical-pendulum",
)  # fmt: skip
#: the rule that a scene meets in every run, so that each rule meets every kind of groupoid; a scene
#: that is not here meets them all
TURN = {
    "harmonic": "rectangle",
    "pendulum": "midpoint",
    "double-pendulum": "trapezoidal",
    "kepler": "rectangle",
    "henon-heiles": "midpoint",
    "charged-particle": "trapezoidal",
    "fpu": "rectangle",
    "spring-pendulum": "midpoint",
    "outer-solar-system": "trapezoidal",
    "rigid-body": "rectangle",
    "rigid-body-so4": "midpoint",
    "kirchhoff": "trapezoidal",
    "sl2": "rectangle",
    "moser-veselov": "own",
    "heavy-top": "trapezoidal",
    "lagrange-top": "rectangle",
    "kovalevskaya-top": "midpoint",
    "spherical-pendulum": "trapezoidal",
    "reduced-kepler": "rectangle",
    "rotor-body": "midpoint",
    "wong": "trapezoidal",
    "damped-pendulum": "trapezoidal",
    "duffing": "rectangle",
    "driven-heavy-top": "midpoint",
    "kapitza-pendulum": "trapezoidal",
    "cartesian-pendulum": "trapezoidal",
    "double-spherical-pendulum": "midpoint",
    "pivoted-body": "trapezoidal",
    "suslov": "rectangle",
    "chaplygin-sleigh": "midpoint",
    "rolling-disc": "trapezoidal",
    "knife-edge": "midpoint",
    "contact-oscillator": "midpoint",
    "bead-on-hoop": "trapezoidal",
    "ball-on-turntable": "midpoint",
    "ball-in-cylinder": "trapezoidal",
    "moving-mass": "rectangle",
    "rigid-body-by-hand": "midpoint",
    "heavy-top-by-hand": "trapezoidal",
    "affine-group": "rectangle",
    "affine-on-line": "midpoint",
    "framed-plane": "trapezoidal",
    "moebius": "midpoint",
    "stereographic": "rectangle",
    "carried-along": "trapezoidal",
}


def named(schemes):
    """Parameters (scene, rule, …) of a test; what is not in every run is marked slow."""

    def marks(scene, rule):
        turn = scene not in EXPENSIVE and TURN.get(scene, rule) == rule
        often = scene in ALWAYS or rule not in TURN.values() or turn
        return () if often else pytest.mark.slow

    return [pytest.param(*s, id="-".join(map(str, s)), marks=marks(*s[:2])) for s in schemes]


def sample(cases):
    """Places of cases (dicts of arguments) that hold every value of every argument at least once.

    Each next one brings the most values that are new; among those the pairs met least so
    far, so that no stratum or rule is the partner of all. Always the same ones.
    """
    cases = [[(name, _key(value)) for name, value in case.items()] for case in cases]
    met = Counter()
    taken, left = set(), {value for case in cases for value in case}

    def worth(k):
        alone, pairs = cases[k], combinations(cases[k], 2)
        new = sum(value in left for value in alone)
        return -new, sum(map(met.__getitem__, pairs)), sum(map(met.__getitem__, alone)), k

    while left:
        best = min(set(range(len(cases))) - taken, key=worth)
        met.update([*cases[best], *combinations(cases[best], 2)])
        taken.add(best)
        left.difference_update(cases[best])
    return taken


def _key(value):
    try:
        hash(value)
    except TypeError:
        return id(value)
    return value
