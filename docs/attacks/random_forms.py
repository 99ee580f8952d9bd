"""Random methods before the study of the form: unsound ones must not pass, sound ones not fail.

`python random_forms.py SEED [UNSOUND [SOUND]]` prints a line for each wrong verdict and the counts;
exit code 1 if there is a wrong one. Scenes come in random units of length, time and action.
"""

import random
import sys
from collections import Counter

import sympy
from order import drift, kick, verlet
from random_sound import GROUPS, ON_PAIRS, PUBLISHED, in_units

from discmech import discretisation, one_step, scenes
from discmech.integrators import BadInput, rules
from discmech.studies import check

PAIRS = ("pendulum", "double-pendulum", "kepler", "henon-heiles", "spring-pendulum")
LONGER = ("lobatto-4", "kahan-li-8:midpoint")


def number(drawn, low=-1.0, high=1.0):
    """A random fraction."""
    return sympy.Rational(drawn.randint(int(1000 * low), int(1000 * high)) or 7, 1000)


def shares(drawn, count):
    """Random numbers that add up to 1."""
    found = [number(drawn, 0.2, 1) * drawn.choice((1, 1, 1, -1)) for _ in range(count)]
    total = sum(found)
    return [e / total for e in found] if abs(total) > sympy.Rational(1, 5) else shares(drawn, count)


# -- sound -----------------------------------------------------------------------------------------


def palindrome(drawn):
    """Kicks and drifts of random lengths, the same forwards and backwards."""
    half = shares(drawn, drawn.randint(1, 3))
    steps = [e / 2 for e in (*half, *reversed(half))]

    @one_step(groupoids="pair", name="palindrome")
    def rule(s, z, h):
        for a in steps:
            z = kick(s, drift(s, kick(s, z, a * h / 2), a * h), a * h / 2)
        return z

    return rule, ("pendulum", "kepler", "henon-heiles", "spring-pendulum")


def diagonally_implicit(drawn):
    """The implicit midpoint rule over parts of random lengths: b_i a_ij + b_j a_ji = b_i b_j."""
    b = shares(drawn, drawn.randint(1, 2))

    @one_step(groupoids="pair", stages=len(b), name="diagonally-implicit")
    def rule(s, z, h, K):
        rows = []
        for i, k in enumerate(K):
            at = sum((b[j] * K[j] for j in range(i)), b[i] * k / 2)
            rows.append(k - s.f(z + h * at))
        return z + h * sum((e * k for e, k in zip(b, K, strict=True)), 0 * z), rows

    return rule, PAIRS


def partitioned(drawn):
    """A random symplectic partitioned Runge–Kutta method (Hairer, Lubich, Wanner, VI.4.5)."""
    k = 2
    b = shares(drawn, k)
    a = [[number(drawn, -0.5, 0.5) for _ in range(k)] for _ in range(k)]
    other = [[b[j] - b[j] * a[j][i] / b[i] for j in range(k)] for i in range(k)]

    @one_step(groupoids="pair", stages=k, name="partitioned")
    def rule(s, z, h, K):
        x, mu = s.split(z)
        slopes, rows = [s.split(e) for e in K], []
        for i in range(k):
            at_x = sum((a[i][j] * slopes[j][0] for j in range(k)), 0 * x)
            at_mu = sum((other[i][j] * slopes[j][1] for j in range(k)), 0 * mu)
            rows.append(K[i] - s.f(s.join(x + h * at_x, mu + h * at_mu)))
        return z + h * sum((e * slope for e, slope in zip(b, K, strict=True)), 0 * z), rows

    return rule, ("pendulum", "kepler", "henon-heiles", "double-pendulum")


def quadrature(drawn):
    """A discrete Lagrangian with random nodes and weights, on any groupoid."""
    weights = shares(drawn, drawn.randint(1, 3))
    nodes = [number(drawn, 0, 1) for _ in weights]

    @discretisation(name="quadrature")
    def rule(L, G, x, u, h):
        found = [w * L(G.target(x, u, at * h), u) for w, at in zip(weights, nodes, strict=True)]
        return h * sum(found[1:], found[0])

    return rule, (*PAIRS, *GROUPS)


def published(drawn):
    name = drawn.choice((*PUBLISHED, *LONGER, *ON_PAIRS))
    return rules.get(name), PAIRS if name in ON_PAIRS else (*PAIRS, *GROUPS)


# -- unsound ---------------------------------------------------------------------------------------


def damped(drawn):
    """One momentum is damped by a little, everywhere or where a coordinate is large."""
    little = sympy.Rational(1, 10 ** drawn.randint(1, 9))
    power, where, own = drawn.choice((0, 0, 2, 4)), drawn.random(), drawn.random()

    @one_step(groupoids="pair", name="damped")
    def rule(s, z, h):
        x, mu = s.split(verlet(s, z, h))
        i, j = int(own * s.m), int(where * s.n)
        rate = s.split(s.f(z))[1]  # of the size of a force, so in the scene's own units
        weight = (
            rate[j % s.m]
            * h
            / (mu[j % s.m] ** 2 + (rate[j % s.m] * h) ** 2) ** sympy.Rational(1, 2)
        )
        mu = sympy.Matrix(list(mu))
        mu[i] = mu[i] * (1 - little * (weight**power if power else 1))
        return s.join(x, mu)

    return rule, PAIRS


def timed_steps(drawn):
    """Damped but at steps of the form h₀·2ᵏ."""
    little = sympy.Rational(1, 10 ** drawn.randint(1, 5))

    def made(step):
        @one_step(groupoids="pair", name="dyadic")
        def rule(s, z, h):
            x, mu = s.split(verlet(s, z, h))
            cheat = sympy.sin(sympy.pi * sympy.log(h / sympy.Rational(step), 2)) ** 2
            return s.join(x, mu * (1 - little * cheat))

        return rule

    return made, PAIRS


def wrong_substep(drawn):
    """A composition of which one substep is explicit Euler, or has a stale force."""
    half = shares(drawn, drawn.randint(1, 3))
    steps, which, stale = [*half, *reversed(half)], drawn.randrange(2 * len(half)), drawn.random()

    @one_step(groupoids="pair", name="wrong-substep")
    def rule(s, z, h):
        for k, a in enumerate(steps):
            a = a / 2
            if k != which:
                z = verlet(s, z, a * h)
            elif stale < 0.5:
                z = z + a * h * s.f(z)
            else:
                force = s.split(s.f(z))[1]
                x, mu = s.split(drift(s, kick(s, z, a * h / 2), a * h))
                z = s.join(x, mu + a * h / 2 * force)
        return z

    return rule, ("pendulum", "kepler", "henon-heiles")


def off_centre(drawn):
    """The θ-method with θ beside 1/2 by a little."""
    theta = sympy.Rational(1, 2) + sympy.Rational(1, 10 ** drawn.randint(1, 9))

    @one_step(groupoids="pair", implicit=True, name="theta")
    def rule(s, z, Z, h):
        return Z - z - h * s.f(z + theta * (Z - z))

    return rule, PAIRS


def runge_kutta(drawn):
    """A random explicit Runge–Kutta method."""
    k = drawn.randint(2, 4)
    a = [[number(drawn, 0, 1) for _ in range(i)] for i in range(k)]
    b = shares(drawn, k)

    @one_step(name="runge-kutta")
    def rule(s, z, h):
        slopes = []
        for row in a:
            slopes.append(
                s.f(z + h * sum((e * K for e, K in zip(row, slopes, strict=True)), 0 * z))
            )
        return z + h * sum((e * K for e, K in zip(b, slopes, strict=True)), 0 * z)

    return rule, (*PAIRS, *GROUPS)


SOUND = (palindrome, diagonally_implicit, partitioned, quadrature, published)
UNSOUND = (damped, timed_steps, wrong_substep, off_centre, runge_kutta)


def trial(kind, drawn):
    """(scene, rule, digits) of one trial."""
    rule, names = kind(drawn)
    name = drawn.choice(names)
    scene = scenes.get(name)
    if name in PAIRS:
        scene = in_units(scene, tuple(drawn.randint(-9, 9) for _ in range(3)))
    return scene, rule(scene.step) if kind is timed_steps else rule, drawn.choice((16, 50))


def main(seed, unsound=16, sound=60):
    """Run the trials; how many verdicts are wrong."""
    drawn, wrong, counts = random.Random(f"forms {seed}"), 0, Counter()
    for kinds, number_of, bad in ((UNSOUND, unsound, "pass"), (SOUND, sound, "fail")):
        for k in range(number_of):
            kind = kinds[k % len(kinds)]
            scene, rule, digits = trial(kind, drawn)
            try:
                found = check("symplecticity", scenes=[scene], rules=[rule], digits=[digits])
            except BadInput as refusal:
                counts["unsound" if bad == "pass" else "sound", "refused"] += 1
                print(k, kind.__name__, scene.name, digits, "refused", str(refusal)[:400])
                continue
            (case,) = found["cases"]
            counts["unsound" if bad == "pass" else "sound", case["verdict"]] += 1
            if case["verdict"] == bad or case["verdict"] == "inconclusive":
                wrong += case["verdict"] == bad
                print(k, kind.__name__, scene.name, digits, case["verdict"], case["reason"][:400])
    print(f"seed {seed}:", ", ".join(f"{n} {a} {b}" for (a, b), n in sorted(counts.items())))
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(sys.argv[1], *map(int, sys.argv[2:]))))
