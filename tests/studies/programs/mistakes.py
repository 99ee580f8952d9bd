"""Mistakes that people make in integrators, each with the cause that has to be named."""

from __future__ import annotations

import itertools

import numpy as np

from discmech import black_box

from .methods import INNER, OUTER, LateLeapfrog, composed, kick_drift_kick, loose

#: cause → functions (q, p, h, system) that have it
MISTAKES: list[tuple[str, object]] = []


def mistake(cause, order=2, **more):
    def add(function):
        MISTAKES.append((cause, black_box(order=order, **more)(function)))
        return function

    return add


def split(kick=(0.5, 0.5), drift=1.0):
    def step(q, p, h, s):
        p = p - kick[0] * h * s.gradient(q, p)
        q = q + drift * h * s.velocity(q, p)
        return q, p - kick[1] * h * s.gradient(q, p)

    return step


for number, (cause, step) in enumerate((
    ("flipped sign", split((0.5, -0.5))),
    ("flipped sign", split((-0.5, -0.5))),
    ("flipped sign", split(drift=-1.0)),
    ("factor", split((1 / 3, 1 / 3))),
    ("factor", split((1.0, 1.0))),
    ("factor", split((0.5, 0.25))),
    ("factor", split(drift=0.5)),
    ("factor", split(drift=2.0)),
    ("missing motion of x", split(drift=0.0)),
    ("missing gradient of the potential", split((0.0, 0.0))),
    ("factor of time", split((0.25, 0.25), 0.5)),
    ("factor of time", split((1.0, 1.0), 2.0)),
    ("few digits", split((0.49999, 0.5))),
    ("few digits", split(drift=1.0001)),
    ("few digits", split((0.500000005, 0.500000005))),
)):  # fmt: skip
    MISTAKES.append((cause, black_box(order=2, name=f"split-{number}")(step)))

for number, (cause, weights) in enumerate((
    ("factor of time", (OUTER, -INNER, OUTER)),
    ("factor of time", (OUTER, INNER)),
    ("few digits", (1.35121, -1.70241, 1.35121)),
    ("order conditions", (INNER, OUTER, OUTER)),
    ("few digits", (1.3512, -1.7024, 1.3512)),  # which add up to 1
)):  # fmt: skip
    made = black_box(order=4, name=f"composed-{number}")(composed(weights))
    MISTAKES.append((cause, made))


@mistake("no step")
def ignores_h(q, p, h, s):
    return kick_drift_kick(q, p, 0.05, s)


@mistake("q and p exchanged")
def gives_p_first(q, p, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return p, q


@mistake("q and p exchanged")
def takes_p_first(p, q, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return p, q


CALLS = itertools.count()


@mistake("no map")
def changes_each_seventh(q, p, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return q, p * (1 + 1e-9 * (next(CALLS) % 7 == 0))


@mistake("momentum for velocity")
def momentum_for_velocity(q, p, h, s):
    p = p - h / 2 * s.gradient(q, p)
    q = q + h * p
    return q, p - h / 2 * s.gradient(q, p)


@mistake("degrees for radians")
def of_degrees(q, p, h, s):
    p = p - h / 2 * s.gradient(np.deg2rad(q), p)
    q = q + h * s.velocity(q, p)
    return q, p - h / 2 * s.gradient(np.deg2rad(q), p)


@mistake("velocities for momenta")
def velocities_for_momenta(q, v, h, s):
    q, p = kick_drift_kick(q, s.momentum(q, v), h, s)
    return q, s.velocity(q, p)


@mistake("stale force")
def stale(q, p, h, s):
    force = s.gradient(q, p)
    q = q + h * s.velocity(q, p - h / 2 * force)
    return q, p - h * force


@mistake("first order")
def euler(q, p, h, s):
    a, b = s.f(q, p)
    return q + h * a, p + h * b


@mistake("first order")
def late(q, p, h, s):
    p = p - h * s.gradient(q, p)
    return q + h * s.velocity(q, p), p


mistake("stored half step")(LateLeapfrog.formula)


@mistake("single precision")
def single(q, p, h, s):
    p = p - h / 2 * s.gradient(q, p).astype(np.float32)
    q = q + h * s.velocity(q, p)
    return q, p - h / 2 * s.gradient(q, p).astype(np.float32)


@mistake("single precision")
def single_result(q, p, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return q.astype(np.float32).astype(float), p.astype(np.float32).astype(float)


@mistake("single precision")
def single_throughout(q, p, h, s):
    """Of which differences leave fewer bits than a number of single precision may have."""
    q, p, h = q.astype(np.float32), p.astype(np.float32), np.float32(h)
    p = p - h / 2 * s.gradient(q, p).astype(np.float32)
    q = q + h * s.velocity(q, p).astype(np.float32)
    return q.astype(float), (p - h / 2 * s.gradient(q, p).astype(np.float32)).astype(float)


@mistake("another field")
def turned(q, p, h, s):
    """Each step ends with a turn of 10⁻⁶ h in (q, p), as smooth as no rounding is."""
    q, p = kick_drift_kick(q, p, h, s)
    return q + 1e-6 * h * p, p - 1e-6 * h * q


@mistake("unlike steps")
class StaleTenth:
    """Verlet with a force that is not computed anew in each tenth step."""

    def start(self, q, p, h, s):
        return q, p, s.gradient(q, p), 0

    def step(self, state, h, s):
        q, p, force, k = state
        p = p - h / 2 * force
        q = q + h * s.velocity(q, p)
        force = force if k % 10 == 9 else s.gradient(q, p)
        return q, p - h / 2 * force, force, k + 1

    def read(self, state, s):
        return state[:2]


@mistake("drag")
def dragged(q, p, h, s):
    q, p = kick_drift_kick(q, p * (1 - h / 200), h, s)
    return q, p * (1 - h / 200)


@mistake("step of its own")
def own_step(q, p, h, s):
    return kick_drift_kick(q, p, h * (1 + 0.1 * np.cos(q[0])), s)


def taylor(of_x=1.0, of_mu=1.0):
    """Velocity Verlet, whose terms with h² come so many times."""

    def step(q, p, h, s):
        g = s.gradient(q, p)
        Q = q + h * s.velocity(q, p - of_x * h / 2 * g)
        return Q, p - h * ((1 - of_mu / 2) * g + of_mu / 2 * s.gradient(Q, p))

    return step


def to_power(of_drift=1, of_x=2, of_mu=1):
    """Velocity Verlet, whose terms come with such powers of h."""

    def step(q, p, h, s):
        g = s.gradient(q, p)
        Q = q + h**of_drift * s.velocity(q, p) - h**of_x / 2 * s.velocity(q, g)
        return Q, p - h**of_mu / 2 * (g + s.gradient(Q, p))

    return step


for number, (cause, made) in enumerate((
    ("power of h", to_power(of_x=1)), ("power of h", to_power(of_mu=2)),
    ("power of h", to_power(of_drift=2, of_x=3)),
    ("factor", taylor(of_x=2.0)), ("factor", taylor(of_x=2 / 3)), ("factor", taylor(of_mu=1.2)),
)):  # fmt: skip
    MISTAKES.append((cause, black_box(order=2, name=f"taylor-{number}")(made)))


@mistake("first order", numbers="float32")
def late_in_single_precision(q, p, h, s):
    p = p - h * s.gradient(q, p)
    return q + h * s.velocity(q, p), p


@mistake("rounded")
def rounded(q, p, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return np.round(q, 6), np.round(p, 6)  # an order shows down to eight decimals


@mistake("another field")
def pole(q, p, h, s):
    """A force 1/q, which is steep beside 0, and does not jump."""
    p = p - h / 2 / q
    q = q + h * s.velocity(q, p)
    return q, p - h / 2 / q


@mistake("few digits", order=4)
def weights_of_five_digits(q, p, h, s):
    a, b = s.f(q, p)
    c, d = s.f(q + h / 2 * a, p + h / 2 * b)
    e, g = s.f(q + h / 2 * c, p + h / 2 * d)
    k, m = s.f(q + h * e, p + h * g)
    u, v = 0.16667, 0.33333
    return q + h * (u * (a + k) + v * (c + e)), p + h * (u * (b + m) + v * (d + g))


@mistake("order conditions", order=4)
def swapped_weights(q, p, h, s):
    f = s.f
    a, b = f(q, p)
    c, d = f(q + h / 2 * a, p + h / 2 * b)
    e, g = f(q + h / 2 * c, p + h / 2 * d)
    k, m = f(q + h * e, p + h * g)
    return q + h / 6 * (a + 2 * c + e + 2 * k), p + h / 6 * (b + 2 * d + g + 2 * m)


GENERATOR = np.random.default_rng(0)


@mistake("no map")
def noisy(q, p, h, s):
    q, p = kick_drift_kick(q, p, h, s)
    return q + 1e-6 * GENERATOR.standard_normal(len(q)), p


mistake("loose iteration")(loose(2.6e-5))
