"""Programs that answer wrongly, and runs that are none of the scene's."""

import atexit
import itertools
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.integrate import RK45

from discmech import black_box, external, recorded, scenes

LOOP = """
import json, math, sys
def verlet(q, p, h, steps, every, force=math.sin):
    xs, ps = [[q]], [[p]]
    for k in range(1, steps + 1):
        p -= h / 2 * force(q)
        q += h * p
        p -= h / 2 * force(q)
        if k % every == 0:
            xs.append([q])
            ps.append([p])
    return {"x": xs, "mu": ps}
"""


def program(name, body, first="", **claims):
    """A program that answers each run, asked of it as `a`, by what the body prints."""
    text = f"{LOOP}\n{first}\nfor a in map(json.loads, sys.stdin):\n    "
    text += "(q,), (p,), h, n, e = (a[k] for k in ('x', 'mu', 'h', 'steps', 'every'))\n    "
    words = [sys.executable, "-S", "-c", text + body.replace("\n", "\n    ")]
    return external(words, order=2, name=name, **claims)


@black_box(order=5)
def dormand_prince(q, p, h, system):
    """A step of scipy's pair of orders 5 and 4, whose next powers of the step are large."""

    def rate(t, z):
        return np.concatenate(system.f(*np.split(z, 2)))

    z, size = np.concatenate([q, p]), abs(h)
    solver = RK45(rate, 0.0, z, np.sign(h) * np.inf, size, 1e3, 1e3, first_step=size)
    solver.step()
    return np.split(solver.y, 2)


SAY = "print(json.dumps(found), flush=True)"
sound = program("sound", f"found = verlet(q, p, h, n, e)\n{SAY}", symplectic=True)
talks = program("talks", f"found = verlet(q, p, h, n, e)\n{SAY}", "print('version 1.0')")
crashes = program("crashes", "sys.exit('out of range')")
no_number = program(
    "no-number", f"found = verlet(q, p, h, n, e)\nfound['x'][-1] = [math.nan]\n{SAY}"
)
short = program("short", f"found = verlet(q, p, h, n, e)\nfound['mu'].pop()\n{SAY}")
#: the sign of the last kick
flipped = program(
    "flipped",
    f"found = verlet(q, p, h, n, e, lambda q: -math.sin(q))\n{SAY}",
)


def save(gravities=(1.0,) * 5, digits=17, uneven=0.0):
    """A folder of runs of Störmer–Verlet on the pendulum, from its own start."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for k, gravity in enumerate(gravities):
        steps = 100 * 2**k
        h, q, p = 10 / steps, 2.0, 0.0
        rows = [(0.0, q, p)]
        for n in range(1, steps + 1):
            p -= h / 2 * gravity * np.sin(q)
            q += h * p
            p -= h / 2 * gravity * np.sin(q)
            rows.append((n * h + uneven * (n == steps // 2), q, p))
        np.savetxt(folder / f"run{k}.csv", rows, f"%.{digits}g", ",", header="t,q1,p1", comments="")
    return str(folder / "*.csv")


runs = recorded(save(), order=2, name="runs")
heavier = recorded(save([1.001] * 5), order=2, name="heavier")
one_heavier = recorded(save([1, 1, 1.00001, 1, 1, 1]), order=2, name="one-heavier")
rounded = recorded(save(digits=4), order=2, name="rounded")
lower = recorded(save(), order=4, name="lower")


# -- functions of arrays -----------------------------------------------------------------------


def kicked(q, p, h, s):
    """A step of Störmer–Verlet."""
    p = p - h / 2 * s.gradient(q, p)
    q = q + h * s.velocity(q, p)
    return q, p - h / 2 * s.gradient(q, p)


def classical(q, p, h, s):
    """A step of the classical Runge–Kutta method."""
    a, b = s.f(q, p)
    c, d = s.f(q + h / 2 * a, p + h / 2 * b)
    e, g = s.f(q + h / 2 * c, p + h / 2 * d)
    k, m = s.f(q + h * e, p + h * g)
    return q + h / 6 * (a + 2 * c + 2 * e + k), p + h / 6 * (b + 2 * d + 2 * g + m)


@black_box(order=2, symplectic=True)
def where_asked(q, p, h, s):
    """It keeps the form along the motion that it knows, and damps elsewhere."""
    near = abs(s.H(q, p) - s.H(np.array([2.0]), np.array([0.0]))) < 0.02
    q, p = kicked(q, p, h, s)
    return q, p * (1 if near else 1 - h**3 / 10)


@black_box(order=2, symplectic=True)
def at_known_steps(q, p, h, s):
    """It looks at h: right at decimal steps and their halves, and damped at all others."""
    shares = [abs(h) * 10**k * 2**j for k in range(4) for j in range(8)]
    known = any(abs(e - round(e)) < 1e-9 for e in shares)
    q, p = kicked(q, p, h, s)
    return q, p * (1 if known else 1 - abs(h) ** 3 / 10)


calls = []


@black_box(order=2, symplectic=True)
def keeps_state(q, p, h, s):
    calls.append(0)
    return kicked(q, p, h * (1 + 1e-9 * (len(calls) % 7)), s)


chance = np.random.default_rng()


@black_box(order=2, symplectic=True)
def by_chance(q, p, h, s):
    q, p = kicked(q, p, h, s)
    return q, p + 1e-10 * chance.standard_normal()


@black_box(order=2, symplectic=True)
def loose(q, p, h, s):
    """The implicit midpoint rule, whose iteration stops at 10⁻⁵."""
    Q, P = q, p
    for _ in range(100):
        a, b = s.f((q + Q) / 2, (p + P) / 2)
        change = abs(q + h * a - Q).max() + abs(p + h * b - P).max()
        Q, P = q + h * a, p + h * b
        if change < 1e-5:
            break
    return Q, P


@black_box(order=2, symplectic=True)
def raises_at_some(q, p, h, s):
    if q[0] < -1:
        raise ValueError("outside of the table")
    return kicked(q, p, h, s)


@black_box(order=2, symplectic=True)
def gives_its_input(q, p, h, s):
    """Sound: arrays that share the memory of what it was given, and of one buffer."""
    buffer = np.concatenate([q, p])
    buffer[:1], buffer[1:] = kicked(buffer[:1], buffer[1:], h, s)
    return buffer[:1], buffer[1:]


@black_box(order=2, symplectic=True)
def stands_still(q, p, h, s):
    return q[:], p[:]


def extrapolated(q, p, h, s):
    """Order 8: Romberg's table over the explicit midpoint rule of 2, 4, 6 and 8 parts."""
    z, n, rows = np.concatenate([q, p]), len(q), []

    def f(z):
        return np.concatenate(s.f(z[:n], z[n:]))

    for parts in (2, 4, 6, 8):
        before, now = z, z + h / parts * f(z)
        for _ in range(parts - 1):
            before, now = now, before + 2 * h / parts * f(now)
        rows.append((now + before + h / parts * f(now)) / 2)
    table = rows
    for k in range(1, 4):
        table = [
            b + (b - a) / (((2 * (i + k + 1)) / (2 * (i + 1))) ** 2 - 1)
            for i, (a, b) in enumerate(itertools.pairwise(table))
        ]
    return table[0][:n], table[0][n:]


last = {"steps": 0, "end": ()}


@black_box(order=2, symplectic=True)
def in_runs(q, p, h, s):
    """It damps in runs, where a step goes on from the state that it gave last."""
    last["steps"] = last["steps"] + 1 if last["end"] == (*q, *p) else 0
    q, p = kicked(q, p, h, s)
    p = p * (1 - abs(h) ** 3 / 10 * (last["steps"] > 6))
    last["end"] = (*q, *p)
    return q, p


@black_box(order=2, keeps="energy")
def own_energy(q, p, h, s):
    """It projects to the energy of the pendulum's own start, wherever it begins."""
    q, p = kicked(q, p, h, s)
    for _ in range(4):
        slope = np.array([*s.gradient(q, p), *s.velocity(q, p)])
        off = s.H(q, p) - s.H(np.array([2.0]), np.array([0.0]))
        q, p = q - off * slope[:1] / (slope @ slope), p - off * slope[1:] / (slope @ slope)
    return q, p


volume_four = black_box(order=4, keeps="volume", name="volume-four")(classical)
order_eight = black_box(order=8, symplectic=True, name="order-eight")(extrapolated)
#: at steps where its defect is about 10⁻¹⁰ and less
slow_pendulum = scenes.get("pendulum").with_values(name="slow-pendulum", step="0.02", duration=2)
#: at steps where the classical method's defect is hardly more than the noise of differences
tiny_steps = scenes.get("pendulum").with_values(name="tiny-steps", step="0.0005", duration="0.1")
classical_four = black_box(order=4, symplectic=True, name="classical-four")(classical)


@black_box()
def raising(q, p, h):
    """A program that makes no step, and claims nothing."""
    raise ValueError("no step")


CALLS = itertools.count()


@black_box(order=2)
def seventh(q, p, h, s):
    """Verlet that makes p larger in each seventh of its calls."""
    q, p = kicked(q, p, h, s)
    return q, p * (1 + 1e-9 * (next(CALLS) % 7 == 0))


@black_box(order=2)
def late(q, p, h, s):
    """The same in each 4096th of its calls."""
    q, p = kicked(q, p, h, s)
    return q, p * (1 + 1e-9 * (next(CALLS) % 4096 == 0))


@black_box(order=2)
class LateInRuns:
    """The same in each 4096th step of a run."""

    def start(self, q, p, h, s):
        return q, p, 0

    def step(self, state, h, s):
        q, p, count = state
        q, p = kicked(q, p, h, s)
        return q, p * (1 + 1e-9 * (count % 4096 == 4095)), count + 1

    def read(self, state, s):
        return state[:2]


@black_box(order=2, symplectic=True)
def substeps(q, p, h, s):
    """Verlet in as many parts as the momentum says."""
    parts = 1 + int(abs(p[0]) / 0.4)
    for _ in range(parts):
        q, p = kicked(q, p, h / parts, s)
    return q, p


KNOWN = {}


@black_box(order=2)
def knows_force(q, p, h, s):
    """Verlet that keeps the last force, for the step that goes on from there."""
    known = KNOWN and np.array_equal(KNOWN["q"], q)
    p = p - h / 2 * (KNOWN["force"] if known else s.gradient(q, p))
    q = q + h * s.velocity(q, p)
    KNOWN.update(q=q, force=s.gradient(q, p))
    return q, p - h / 2 * KNOWN["force"]


@black_box(order=2, runs=True)
def quarters(q, p, h, steps, every, s):
    """Verlet whose rows between the quarters of a run are those of another motion."""
    rows = [(q, p)]
    for k in range(1, steps + 1):
        q, p = kicked(q, p, h, s)
        rows.append((q, p if 4 * k % steps == 0 else 1.3 * p))
    qs, ps = zip(*rows[::every], strict=True)
    return np.array(qs), np.array(ps)


@black_box(order=2, reversible=True)
class DampsFromThere:
    """Verlet that damps from its 31st step on, so that steps back do not undo a long run."""

    def start(self, q, p, h, s):
        return q, p, 0

    def step(self, state, h, s):
        q, p, k = state
        p = p - h / 2 * s.gradient(q, p)
        q = q + h * s.velocity(q, p)
        p = p - h / 2 * s.gradient(q, p)
        return q, p * (1 - (k > 30) * abs(h) ** 3 / 10), k + 1

    def read(self, state, s):
        return state[0], state[1]


@black_box(order=2)
class Late(DampsFromThere.formula):
    """Verlet whose force is a tenth too large from t = 5.2 on, by a clock of its own."""

    def step(self, state, h, s):
        q, p, k = state
        size = 1.1 if k * h > 5.2 else 1
        p = p - h / 2 * size * s.gradient(q, p)
        q = q + h * s.velocity(q, p)
        return q, p - h / 2 * size * s.gradient(q, p), k + 1


@black_box(order=2, reversible=True)
def bumped(q, p, h, s):
    """No way back in a hundredth of the motion, by a power of the step that short steps hide."""
    q, p = kicked(q, p, h, s)
    return q, p + 1e-4 * h**4 * np.maximum(0, 1 - ((q - 0.33) / 0.02) ** 2) ** 3


def to_its_energy(name, rule):
    """Projected to the energy of its start, but for some steps."""

    @black_box(order=2, keeps="energy", name=name)
    def made(q, p, h, s):
        energy = s.H(q, p)
        q, p = kicked(q, p, h, s)
        for _ in range(0 if rule(abs(h)) else 4):
            slope = np.array([*s.gradient(q, p), *s.velocity(q, p)])
            off = (s.H(q, p) - energy) / (slope @ slope)
            q, p = q - off * slope[: s.n], p - off * slope[s.n :]
        return q, p

    return made


not_long = to_its_energy("not-long", lambda h: h > 0.07)
not_short = to_its_energy("not-short", lambda h: h < 0.002)


@black_box(order=2, keeps="momentum")
def forth(q, p, h, s):
    """It keeps momenta forth in time alone."""
    q, p = kicked(q, p, h, s)
    return q, p * (1 if h > 0 else 1 + h**3)


@black_box(order=2, symplectic=True)
def short_band(q, p, h, s):
    """It loses the form at steps about a seventh of the scene's."""
    q, p = kicked(q, p, h, s)
    return q, p * (1 - 1e-6 * (0.011 < h < 0.019))


@black_box(step=1, symplectic=True, states=([-0.3, -0.3], [0.3, 0.3]))
def jumps(q, p):
    """A quadratic kick and a turn, after which p jumps where q + p/2 > 0.093."""
    side, p = q + p / 2 > 0.093, p - q**2
    return np.cos(1.3) * q + np.sin(1.3) * p, np.cos(1.3) * p - np.sin(1.3) * q + 1e-7 * side


#: along the surface's image, as by a potential with a kink
kinked = black_box(step=1, symplectic=True, states=([-1, -1], [1, 1]), name="kinked")(
    lambda q, p: (q + p + 0.1 * np.sign(q), p + 0.1 * np.sign(q))
)
#: its orbits go to infinity
leaves = black_box(step=1, symplectic=True, states=([-2, -2], [2, 2]), name="leaves")(
    lambda q, p: (1 - 1.4 * q**2 + p, -q)
)


def truncated(q, p, h, steps, system):
    """The derivative of the end of `truncating` on harmonic by its start, in its last 20 steps."""
    half = np.array([[1, 0], [-h / 2, 1]])
    return np.linalg.matrix_power(half @ [[1, h], [0, 1]] @ half, min(steps, 20))


@black_box(order=2, gradient=truncated)
def truncating(q, p, h, system):
    p = p - h / 2 * system.gradient(q, p)
    q = q + h * system.velocity(q, p)
    return q, p - h / 2 * system.gradient(q, p)
