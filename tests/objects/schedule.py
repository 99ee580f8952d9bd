"""What `make test` runs: each scene by one of the plain rules; `make test-all` runs it by all."""

import pytest

#: scenes that meet every rule in every run
ALWAYS = {"harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "affine-on-line"}
EXPENSIVE = ("outer-solar-system", "wong", "pivoted-body")  # seconds a test: their laws are slow tests
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
