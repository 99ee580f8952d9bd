"""Integrators as people write them: functions of arrays, right ones and ones with a mistake."""

import numpy as np

from discmech import black_box


def kick_drift_kick(q, p, h, s):
    p = p - h / 2 * s.gradient(q, p)
    q = q + h * s.velocity(q, p)
    return q, p - h / 2 * s.gradient(q, p)


@black_box(order=2, symplectic=True, reversible=True)
def verlet(q, p, h, system):
    return kick_drift_kick(q, p, h, system)


@black_box(order=1, symplectic=True)
def symplectic_euler(q, p, h, system):
    p = p - h * system.gradient(q, p)
    return q + h * system.velocity(q, p), p


def rk4_step(f, q, p, h):
    a, b = f(q, p)
    c, d = f(q + h / 2 * a, p + h / 2 * b)
    e, g = f(q + h / 2 * c, p + h / 2 * d)
    k, m = f(q + h * e, p + h * g)
    return q + h / 6 * (a + 2 * c + 2 * e + k), p + h / 6 * (b + 2 * d + 2 * g + m)


@black_box(order=4)
def rk4(q, p, h, system):
    return rk4_step(system.f, q, p, h)


@black_box(order=2, symplectic=True)
class LateLeapfrog:
    """Its momentum is that of half a step later."""

    def start(self, q, p, h, system):
        return q, p - h / 2 * system.gradient(q, p)

    def step(self, state, h, system):
        q, p = state
        q = q + h * system.velocity(q, p)
        return q, p - h * system.gradient(q, p)

    def read(self, state, system):
        return state


def loose(stop):
    """The implicit midpoint rule by an iteration that stops where it changes less than that."""

    def loose(q, p, h, s):
        Q, P = q, p
        for _ in range(100):
            a, b = s.f((q + Q) / 2, (p + P) / 2)
            change = abs(q + h * a - Q).max() + abs(p + h * b - P).max()
            Q, P = q + h * a, p + h * b
            if change < stop:
                break
        return Q, P

    return loose


@black_box(order=2, symplectic=True)
def dragged(q, p, h, system):
    p = p - h / 2 * (system.gradient(q, p) + p / 100)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * (system.gradient(q, p) + p / 100)


@black_box(order=3, symplectic=True)
def ruth(q, p, h, system):
    for c, d in ((7 / 24, 2 / 3), (3 / 4, -2 / 3), (-1 / 24, 1)):
        p = p - c * h * system.gradient(q, p)
        q = q + d * h * system.velocity(q, p)
    return q, p


ROOT = 2 ** (1 / 3)
OUTER, INNER = 1 / (2 - ROOT), -ROOT / (2 - ROOT)


def composed(weights):
    def step(q, p, h, system):
        for w in weights:
            q, p = kick_drift_kick(q, p, w * h, system)
        return q, p

    return step


yoshida = black_box(order=4, symplectic=True, reversible=True, name="yoshida")(
    composed((OUTER, INNER, OUTER))
)
wrong_sign = black_box(order=4, symplectic=True, name="wrong-sign")(
    composed((OUTER, -INNER, OUTER))
)


@black_box(order=2, state="qv")
class Beeman:
    """Positions of Verlet, velocities from three accelerations."""

    def start(self, q, v, h, s):
        def a(q, v):
            p = s.momentum(q, v)
            return -s.gradient(q, p) / (s.momentum(q, v + 1) - p)  # constant diagonal masses

        now = a(q, v)
        return q, v, now, a(q - h * v + h**2 / 2 * now, v), a

    def step(self, state, h, s):
        q, v, now, before, a = state
        q = q + h * v + h**2 / 6 * (4 * now - before)
        after = a(q, v)
        return q, v + h / 6 * (2 * after + 5 * now - before), after, now, a

    def read(self, state, s):
        return state[:2]


def solved(residual, z):
    """Newton's method with a Jacobian by differences, until a change is round-off alone."""
    before = np.inf
    for _ in range(50):
        r = residual(z)
        J = np.array([(residual(z + e) - residual(z - e)) / 2e-6 for e in 1e-6 * np.eye(len(z))]).T
        change = np.linalg.solve(J, r)
        z = z - change
        size = abs(change).max()
        if size < 1e-15 * (1 + abs(z).max()) or (before < 1e-9 and not size < before / 2):
            break
        before = size
    return z


@black_box(order=2, reversible=True)
def newmark(q, p, h, s):
    """β = 1/4, γ = 1/2: the trapezoidal rule of Newmark's family."""
    g = s.gradient(q, p)

    def residual(Q):
        return Q - q - h * s.velocity(q, p - h / 4 * (g + s.gradient(Q, p)))

    Q = solved(residual, q + h * s.velocity(q, p))
    return Q, p - h / 2 * (g + s.gradient(Q, p))


@black_box(order=2)
class GeneralisedAlpha:
    """Chung and Hulbert's, ρ∞ = 0.8: the acceleration is remembered."""

    rho = 0.8
    am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma = 1 / 2 - am + af
    beta = (1 - am + af) ** 2 / 4

    def start(self, q, p, h, s):
        return q, p, -s.gradient(q, p)

    def step(self, state, h, s):
        q, p, a = state
        am, af, gamma, beta = self.am, self.af, self.gamma, self.beta

        def after(A):
            return q + h * s.velocity(q, p + h * ((1 / 2 - beta) * a + beta * A))

        def residual(A):
            return (1 - am) * A + am * a + s.gradient((1 - af) * after(A) + af * q, p)

        A = solved(residual, a)
        return after(A), p + h * ((1 - gamma) * a + gamma * A), A

    def read(self, state, s):
        return state[:2]


@black_box(order=2, symplectic=True)
def rattle(q, p, h, s):
    """Constraints by hand, for a constant mass."""
    Q, p = unprojected(q, p, h, s)
    slope = s.constraint_jacobian(Q)

    def projected(k):
        return p - slope.T @ k

    k = solved(lambda k: slope @ s.velocity(Q, projected(k)), np.zeros(len(slope)))
    return Q, projected(k)


def unprojected(q, p, h, s):
    """SHAKE, whose momentum does not keep the velocity on the constraint."""
    slope = s.constraint_jacobian(q)
    half = p - h / 2 * s.gradient(q, p)

    def moved(k):
        return q + h * s.velocity(q, half - slope.T @ k)

    k = solved(lambda k: s.constraint(moved(k)), np.zeros(len(slope)))
    half, Q = half - slope.T @ k, moved(k)
    return Q, half - h / 2 * s.gradient(Q, half)


@black_box(order=2, reversible=True)
class QuaternionMidpoint:
    """A free or heavy body by its quaternion and momentum: the midpoint rule in both."""

    def start(self, q, p, h, s):
        return np.array([1.0, 0, 0, 0]), q, p

    def step(self, state, h, s):
        turn, q, p = state

        def residual(z):
            a, b = s.f((q + z[: len(q)]) / 2, (p + z[len(q) :]) / 2)
            return z - np.concatenate([q + h * a, p + h * b])

        z = solved(residual, np.concatenate([q, p]))
        Q, P = z[: len(q)], z[len(q) :]
        w = h / 2 * s.velocity((q + Q) / 2, (p + P) / 2)
        r = np.array([1.0, *w / 2])
        a, b = turn[0], turn[1:]
        turn = np.concatenate([[a * r[0] - b @ r[1:]], a * r[1:] + r[0] * b + np.cross(b, r[1:])])
        return turn / np.linalg.norm(turn), Q, P

    def read(self, state, s):
        return state[1:]


@black_box(order=2)
class ReversibleHeun:
    """Its second state is wrong by ±h³ in turn, so that errors know whether steps are even."""

    def start(self, q, p, h, s):
        return q, p, q, p

    def step(self, state, h, s):
        q, p, a, b = state
        u, v = s.f(a, b)
        a, b = 2 * q - a + h * u, 2 * p - b + h * v
        w, z = s.f(a, b)
        return q + h / 2 * (u + w), p + h / 2 * (v + z), a, b

    def read(self, state, s):
        return state[:2]


def whole_runs(changed):
    """Return Verlet as a program of whole runs, whose momentum in row k of so many is changed."""

    @black_box(order=2, runs=True)
    def run(q, p, h, steps, every, s):
        qs, ps = [q], [p]
        for k in range(1, steps + 1):
            q, p = kick_drift_kick(q, p, h, s)
            if k % every == 0:
                qs.append(q)
                ps.append(p * changed(k, steps))
        return np.array(qs), np.array(ps)

    return run
