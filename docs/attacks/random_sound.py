"""Sound methods on scenes in seven systems of units, before four studies: none may fail.

`python random_sound.py SEED COUNT [STUDY …]` prints a line for each trial that did not pass and the
counts of each study; exit code 1 if one failed. Trial number k takes the study, the system of units
and the method by k, and draws the scene and the method's numbers from SEED and k.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from typing import Any

import sympy

from discmech import Scene, check, scenes
from discmech.integrators import BadInput, rules
from discmech.tests.bench.power.valid import random_rule

#: units of length, time and mass, as powers of ten
UNITS = [(0, 0, 0), (6, 0, 0), (-9, 0, 0), (0, 4, 0), (0, -6, 0), (0, 0, 12), (-6, 3, -10)]
PAIRS = ("harmonic", "pendulum", "kepler", "henon-heiles", "spring-pendulum")
GROUPS = ("rigid-body", "heavy-top", "kirchhoff")
PUBLISHED = ("rectangle", "midpoint", "trapezoidal", "gauss-2", "gauss-3", "lobatto-3",
             "triple-jump:trapezoidal", "suzuki:midpoint", "kahan-li-6:trapezoidal")  # fmt: skip
ON_PAIRS = ("stoermer-verlet", "implicit-midpoint", "dual-gauss-2", "newmark-0.5-0")
STUDIES = ("order", "symplecticity", "momentum", "energy")
#: shorter than usual, for the clock's sake
STEPS = {"momentum": 2000, "energy": 20_000}


def in_units(plain: Scene, powers: tuple[int, int, int]) -> Scene:
    """A scene in other units of length (on pairs alone), time and mass, with its symmetries."""
    length, time, mass = (sympy.Integer(10) ** k for k in powers)
    length = length if plain.groupoid.kind == "pair" else sympy.Integer(1)
    action = mass * length**2 / time
    given = plain.lagrangian

    def lagrangian(x: Any, v: Any, p: Any) -> Any:
        return action / time * given(x / length, v * time / length, p)

    def told(quantity: Any) -> Any:
        def formula(x: Any, mu: Any, p: Any) -> Any:
            return quantity.formula(x / length, mu * length / action, p)

        return replace(quantity, formula=formula)

    def scaled(values: Any, unit: Any) -> list[Any]:
        return [sympy.Rational(sympy.sympify(e) * unit) for e in values]

    return Scene(
        f"{plain.name}-{'-'.join(map(str, powers))}".replace("--", "-m"), plain.groupoid,
        lagrangian, plain.parameters, scaled(plain.x0, length), scaled(plain.v0, length / time),
        plain.duration * Fraction(int(time.p), int(time.q)),
        plain.step * Fraction(int(time.p), int(time.q)),
        symmetries=[*map(told, plain.symmetries)],
    )  # fmt: skip


def asked_of_rules(scene: Scene) -> bool:
    """Return True if the scene has quantities that a rule has to keep."""
    return any(e.kind != "first integral" for e in scene.symmetries)


def trial(seed: str, k: int, studies: tuple[str, ...]) -> tuple[str, str, str, str]:
    """(study, what, verdict, reason) of trial number k."""
    drawn = random.Random(f"sound {seed} {k}")
    study, powers = studies[k % len(studies)], UNITS[k % len(UNITS)]
    own = drawn.random() < 0.5
    rule: Any = random_rule(drawn.randrange(10**9)) if own else None
    while rule is not None and rule.name.startswith("gauge") and any(powers):
        # its total difference is in the scene's own unit of action: in another it may be 10²² of L
        rule = random_rule(drawn.randrange(10**9))
    name = drawn.choice((*PAIRS, *GROUPS))
    while study == "momentum" and not asked_of_rules(scenes.get(name)):
        name = drawn.choice((*PAIRS, *GROUPS))
    of_rule = (*PUBLISHED, *(ON_PAIRS if name in PAIRS else ()))
    rule = rule or rules.get(drawn.choice(of_rule))
    digits = drawn.choice((16, 50)) if study in ("order", "symplecticity") else 16
    scene = in_units(scenes.get(name), powers)
    what = f"{k} {scene.name} by {rule.name}, {digits} digits"
    more = {"steps": STEPS[study]} if study in STEPS else {}
    try:
        (case,) = check(study, [scene], [rule], digits=[digits], **more)["cases"]
    except BadInput as refusal:
        return study, what, "refused", str(refusal)
    return study, what, case["verdict"], case["reason"]


def main(seed: str, count: int = 50, *studies: str) -> int:
    """Run the trials; how many failed."""
    counts = Counter[tuple[str, str]]()
    for k in range(count):
        study, what, verdict, reason = trial(seed, k, studies or STUDIES)
        counts[study, verdict] += 1
        if verdict != "pass":
            print(f"{verdict:12} {study} {what}: {reason}", flush=True)
    print(", ".join(f"{study}: {n} {v}" for (study, v), n in sorted(counts.items())), flush=True)
    return sum(n for (_, v), n in counts.items() if v == "fail")


if __name__ == "__main__":
    seed, count, *studies = sys.argv[1:]
    sys.exit(bool(main(seed, int(count), *studies)))
