"""Methods drawn at random: unsound maps that the study of orders may not pass, and sound methods.

`python -m tests.studies.negative_controls.order_trials SEED [UNSOUND [SOUND]]` prints a line for
each that is judged wrongly, and the counts of all verdicts.
"""

import random
import sys
from collections import Counter

import sympy

from discmech.integrators import Scene, one_step, pair, scenes
from discmech.studies.core.case import Case
from discmech.studies.core.study import every_study
from discmech.tests.bench.power.valid import random_rule
from tests.studies.as_json import run_case

DRIVEN = Scene(
    "driven", pair(1),
    lambda x, v, p, t: v[0] ** 2 / 2 + sympy.cos(x[0]) + x[0] * sympy.cos(2 * t) / 3,
    x0=[1], v0=["0.3"], duration=10, step="0.05",
)  # fmt: skip
PLANAR = Scene(
    "kepler-in-space", pair(3), lambda x, v, p: v.dot(v) / 2 + 1 / sympy.sqrt(x.dot(x)),
    x0=["0.4", 0, 0], v0=[0, 2, 0], duration=5, step="0.01",
)  # fmt: skip
SCENES = [
    *map(scenes.get, ("pendulum", "henon-heiles", "spring-pendulum", "rigid-body", "kirchhoff")),
    DRIVEN, PLANAR,
]  # fmt: skip


def heun(s, z, h):
    first = s.f(z)
    return z + h / 2 * (first + s.f(z + h * first))


def kutta(s, z, h):
    """Of order 3."""
    first = s.f(z)
    second = s.f(z + h / 2 * first)
    return z + h / 6 * (first + 4 * second + s.f(z + h * (2 * second - first)))


def classical(s, z, h):
    """Of order 4."""
    a = s.f(z)
    b = s.f(z + h / 2 * a)
    c = s.f(z + h / 2 * b)
    return z + h / 6 * (a + 2 * b + 2 * c + s.f(z + h * c))


BASES = {2: heun, 3: kutta, 4: classical}


def unsound(seed):
    """(scene, map, what is wrong): a sound map and c h^q g(z) in one component, q up to its order.

    g vanishes on a plane, at a time or at steps 2ᵏ; c is from 10⁻² to 10⁻¹⁰.
    """
    drawn = random.Random(f"unsound {seed}")
    scene = drawn.choice(SCENES)
    order = drawn.choice(sorted(BASES))
    power, digits = drawn.randint(1, order), drawn.randint(2, 10)
    size = scene.groupoid.dim_x + scene.groupoid.dim_u
    where, of, also = (drawn.randrange(size) for _ in range(3))
    kind = drawn.choice(["plain", "square", "product", "sine", "log of the step"])

    @one_step(order=order, name=f"unsound-{seed}")
    def wrong(s, z, h):
        letters = list(z)[: scene.groupoid.dim_x] + list(z)[-scene.groupoid.dim_u :]
        g = {
            "plain": letters[of], "square": letters[of] ** 2,
            "product": letters[of] * letters[also], "sine": sympy.sin(letters[of]),
            "log of the step": letters[of] * sympy.sin(sympy.pi * sympy.log(h, 2)) ** 2,
        }[kind]  # fmt: skip
        new = sympy.Matrix(list(BASES[order](s, z, h)))
        place = where if where < scene.groupoid.dim_x else len(z) - size + where
        new[place] += h**power * g / sympy.Integer(10) ** digits
        return new

    return scene, wrong, f"h^{power} 10^-{digits} {kind} in component {where}, order {order}"


def sound(seed):
    """(scene, method): a random rule, or a Runge–Kutta method with a free coefficient."""
    drawn = random.Random(f"sound {seed}")
    scene = drawn.choice(SCENES)
    if drawn.random() < 0.5:
        return scene, random_rule(seed)
    c = sympy.Rational(drawn.randint(4, 20), 20)

    @one_step(order=2, name=f"two-stages-{seed}")
    def two_stages(s, z, h):
        first = s.f(z)
        second = s.f(z + c * h * first)
        return z + h * ((1 - 1 / (2 * c)) * first + second / (2 * c))

    @one_step(order=2, implicit=True, name=f"theta-mean-{seed}")
    def of_two(s, z, Z, h):
        return Z - z - h * (c * s.f((z + Z) / 2) + (1 - c) * (s.f(z) + s.f(Z)) / 2)

    return scene, drawn.choice([two_stages, of_two])


def told(seed, scene, rule, what, wanted, counts, lines):
    """Count the verdict, and add a line if another one is wanted."""
    digits = random.Random(seed).choice([16, 50])
    found = run_case(every_study()["order"], Case("order", scene, rule, digits))
    counts[found["verdict"]] += 1
    if found["verdict"] != wanted:
        lines.append(f"{found['verdict']}: {what} on {scene.name}, {digits} digits ({seed}): "
                     f"{found['reason']}")  # fmt: skip


def trials(seed, of_unsound, of_sound):
    """(counts of verdicts of unsound and of sound methods, lines of those judged wrongly)."""
    counts, lines = [Counter(), Counter()], []
    for k in range(of_unsound):
        scene, rule, what = unsound(seed + k)
        told(seed + k, scene, rule, what, "fail", counts[0], lines)
    for k in range(of_sound):
        scene, rule = sound(seed + k)
        scene = scene if rule.applies(scene) else SCENES[0]
        told(seed + k, scene, rule, f"{rule.name} ({rule.source})", "pass", counts[1], lines)
    return counts, lines


if __name__ == "__main__":
    given = [*map(int, sys.argv[1:]), *(20261126, 20, 60)[len(sys.argv) - 1 :]]
    counts, lines = trials(*given)
    print("\n".join(lines))
    print(f"unsound: {dict(counts[0])}; sound: {dict(counts[1])}")
