"""Random rules with steps that vary by random σ: sound ones and naive ones, from a seed.

`python -m tests.studies.negative_controls.steps_trials SEED COUNT` prints a line a trial and what
became of all: a sound rule must not fail, and a naive one must not pass.
"""

import random
import sys
from collections import Counter

import sympy

from discmech import scenes, vary
from discmech.integrators.rules import get
from discmech.studies.core.case import Case
from discmech.studies.core.study import every_study

SCENES = ("pendulum", "kepler", "henon-heiles", "heavy-top", "spherical-pendulum", "rotor-body",
          "harmonic", "charged-particle")  # fmt: skip
RULES = ("rectangle", "midpoint", "trapezoidal", "gauss-2", "gauss-3", "lobatto-3",
         "triple-jump:trapezoidal", "triple-jump:midpoint", "suzuki:rectangle")  # fmt: skip


def sigma_of(drawn, of_momentum):
    """Return a smooth positive σ with drawn coefficients, entry and power."""
    a, b, c = (sympy.Rational(drawn.randrange(20, 200), 100) for _ in range(3))
    k, power = drawn.randrange(5), sympy.Rational(drawn.choice((-2, -1, 1)), 2)

    def sigma(x, mu, p):
        value = a + b * x.dot(x) + c * sympy.sin(x[k % len(x)]) ** 2
        return (value + c * of_momentum * mu[k % len(mu)] ** 2) ** power

    return sigma


def trial(drawn):
    """Return (way, verdict, line) of one random rule on a random scene."""
    scene, rule = scenes.get(drawn.choice(SCENES)), get(drawn.choice(RULES))
    way = drawn.choice(("poincare", "reversible", "naive"))
    of_momentum = int(way != "poincare" and drawn.random() < 0.5)
    case = Case("steps", scene, vary(rule, sigma_of(drawn, of_momentum), way), 16, 2000)
    study = every_study()["steps"]
    found = study.measurement(case, lambda label, share: None)
    told = study.verdict(case, found)
    return way, told.verdict, f"{scene.name} {case.label}: {told.verdict} {told.reason}"


if __name__ == "__main__":
    drawn, became = random.Random(int(sys.argv[1])), Counter()
    for _ in range(int(sys.argv[2])):
        way, verdict, line = trial(drawn)
        became["naive" if way == "naive" else "sound", verdict] += 1
        print(line, flush=True)
    print(dict(became))
    sys.exit(became["sound", "fail"] > 0 or became["naive", "pass"] > 0)
