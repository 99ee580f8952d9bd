"""Places from which one step of a rule is judged: states that no method can know beforehand.

A run sees one trajectory, its symmetry planes, and steps h·2⁻ᵏ from t = 0. These places lie on the
motion and beside it, in every coordinate, at times drawn over the whole motion, with steps that are
no h·2ᵏ of each other. They are drawn from a seed that the content of scene and rule makes.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from discmech import reference
from discmech.integrators import Scheme
from discmech.integrators.equations import (
    SceneSymbols,
    constraint,
    constraint_matrix,
    constraint_shift,
    inverse_two_form,
    momentum,
)
from discmech.integrators.numbers import arithmetic, exact, mpmath, numeric, sympy, to_sympy
from discmech.integrators.scene import remembered
from discmech.reference import surroundings

if TYPE_CHECKING:
    from discmech.reference.answer.local_motion import Surroundings

DIGITS = 170  # digits of a place: more than any study uses
ON, BESIDE = 1, 3  # how many places lie on the motion, and how many beside it
SHARES = 0.1, 0.35  # of a coordinate's size by which a place lies beside the motion
NEAR_TO = 0.005, 0.02  # the same share for the places all along the motion
LEAST_ALONG, MOST_ALONG = 4, 24  # the least and the largest number of those
NEARER = 8, 12  # how many times nearer to the motion the next try is, and the number of tries
EXACT, OF_EXACT = 4, 80  # how many places lie on the motion to so many digits
OF_ROUGH = 50  # digits of a piece of motion from a state of a rough run
HASTE = 64  # a place with a motion so many times faster than the scene's anywhere is not used
#: an ordinary step, as a share of the time in which the motion is a polynomial
#: (`Surroundings.length`)
SMALLER, LARGER = 0.15, 0.3
ARROWS = 4  # iterations from one state of the motion to the next: each squares the remaining error

# a coordinate that moves by a smaller share of the others' motion has no size of its own
STILL = 1e-9


@dataclass(frozen=True)
class Place:
    """A state, a time and a step: x (n), u (m, the velocity ξ) and μ (m), mpf; t and step exact.

    Of a Hamiltonian, and of a degenerate Lagrangian, u is μ: its references know no velocity.

    length: the time in which the exact motion from there is that of a short polynomial. beside:
    True if it lies beside the motion.
    """

    x: tuple[Any, ...]
    mu: tuple[Any, ...]
    u: tuple[Any, ...]
    t: Fraction
    step: Fraction
    length: Fraction
    beside: bool

    @property
    def start(self) -> dict[str, Any]:
        """Return the place as arguments of `Flow.trajectory`."""
        arguments: dict[str, Any] = {"x0": self.x, "mu0": self.mu, "u0": self.u}
        if self.u == self.mu:
            del arguments["u0"]
        return {**arguments, "t0": self.t} if self.t else arguments

    def __str__(self) -> str:
        parts = [", ".join(f"{float(e):.4g}" for e in part) for part in (self.x, self.mu)]
        return f"x = ({parts[0]}), mu = ({parts[1]}), t = {float(self.t):.4g}"


def seed_of(scheme: Scheme) -> int:
    """Return the seed of a scene and a rule, from their contents."""
    return seed_from(surroundings(scheme.scene).key, scheme.rule)


def seed_from(content: str, whole: Any) -> int:
    """Return a seed from the text of what moves, and from a rule."""
    rule = whole.of_step
    words = [content, whole.name, rule.name, str(rule.order)]
    code = getattr(rule.formula, "__code__", None)
    if code is not None:
        numbers = [e for e in code.co_consts if not hasattr(e, "co_code")]  # no inner functions
        words += [code.co_code.hex(), repr(code.co_names), repr(numbers)]
    return int(hashlib.sha256("\0".join(words).encode()).hexdigest()[:8], 16)


def seed_in_numbers(scheme: Any) -> int:
    """Return a seed from the content of a rule and of its scene's start."""
    code, scene = getattr(scheme.rule.formula, "__code__", None), scheme.scene
    words = [scene.name, scheme.rule.name, str(code and code.co_code.hex()),
             repr((scene.x0, scene.mu0, scene.step))]  # fmt: skip
    return int(hashlib.sha256("\0".join(words).encode()).hexdigest()[:8], 16)


def places_of(scheme: Scheme, seed: int, beside: int = BESIDE) -> list[Place]:
    """Return `ON` places on the motion and so many beside it.

    Raises `ReferenceFailure` for a scene that has no continuous equations, and where no place
    around the motion can be found.
    """
    drawn, motion = random.Random(seed), _motion(scheme.scene)
    shares = [0.0 if k < ON else drawn.uniform(*SHARES) for k in range(ON + beside)]
    at = [drawn.randrange(len(motion.states)) for _ in shares]
    places = list(_drawn(scheme, drawn, at, shares))
    if not places:
        raise reference.ReferenceFailure(
            f"scene {scheme.scene.name}: no state around its motion has a series; its equations "
            "are singular there"
        )
    return places


def places_along(scheme: Scheme, seed: int) -> list[Place]:
    """Return places all along the motion and near to it, fewer for a scheme with costly steps.

    They show a fault of a rule in one part of the motion alone.
    """
    unknowns = (len(scheme.s.x) + len(scheme.s.u)) * (1 + len(scheme.s.stages))
    count = max(LEAST_ALONG, MOST_ALONG // max(1, unknowns // 2))
    drawn, states = random.Random(seed + 2), len(_motion(scheme.scene).states)
    at = [int((k + drawn.random()) / count * states) for k in range(count)]
    return list(_drawn(scheme, drawn, at, [drawn.uniform(*NEAR_TO) for _ in at]))


def places_on(scheme: Scheme, seed: int) -> list[Place]:
    """Return places all along the motion and exactly on it, to `OF_EXACT` digits.

    Those of `places_of` follow a rough run, and are beside the motion by its error. Raises
    `ReferenceFailure` where the motion cannot be followed so exactly.
    """
    drawn, around = random.Random(seed + 3), surroundings(scheme.scene)
    states = _motion(scheme.scene).states
    wanted = {int((k + drawn.random()) / EXACT * len(states)) for k in range(EXACT)}
    (t, x, v), places = states[0], list[Place]()
    for k, (after, *_) in enumerate(states[: max(wanted) + 1]):
        if after > t:
            (end,) = around.after(x, v, t, [after - t], OF_EXACT)
            t, x, v = after, end.x, end.v
        if k in wanted:
            mu = around.momentum(x, v, t, OF_EXACT)
            length = around.length(x, v, t) or Fraction(scheme.scene.step)
            places.append(Place(tuple(x), tuple(mu), tuple(v or mu), t, length, length, False))
    return places


def places_at(scheme: Scheme, times: Sequence[Fraction]) -> list[Place]:
    """Return places on the motion at those times, with steps that are no h·2ᵏ of each other.

    A time at which the motion has no series is left out.
    """
    around, states = surroundings(scheme.scene), _on_orbit(scheme.s, scheme.scene)
    drawn, places = random.Random(str(times)), list[Place]()
    for time in times:
        t, x, v = min(states, key=lambda state: abs(state[0] - time))
        if time != t:
            try:
                (end,) = around.after(x, v, t, [time - t], OF_ROUGH)
            except reference.ReferenceFailure:
                continue
            x, v = end.x, end.v
        place = _place(scheme, drawn, (time, x, v), 0.0, None, around)
        places += [] if place is None else [place]
    return places


def states_on_orbit(scheme: Scheme) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the motion's states in doubles: t (r,), x (r, n) and v (r, m)."""
    t, x, v = zip(*_on_orbit(scheme.s, scheme.scene), strict=True)
    return np.array(t, float), np.array(x, float), np.array(v, float)


def sizes_of_motion(scene: Any) -> np.ndarray:
    """Return how far each entry of (x, v) moves along the motion, (n+m,)."""
    return np.array([*_motion(scene).of_x, *_motion(scene).of_v], float)


def places_from(scheme: Scheme, cloud: Any, rows: Sequence[int]) -> list[Place]:
    """Return those states of a cloud as places; one whose motion has no series is left out."""
    around, drawn = surroundings(scheme.scene), random.Random(len(cloud.t))
    places = []
    for k in rows:
        x, v = ([mpmath.mpf(float(e)) for e in part[k]]
                for part in (cloud.z[:, : scheme.s.n], cloud.v))  # fmt: skip
        place = _place(scheme, drawn, (Fraction(cloud.t[k]), x, v), 0.0, None, around)
        places += [] if place is None else [replace(place, beside=True)]
    return places


def _drawn(
    scheme: Scheme, drawn: random.Random, at: Sequence[int], shares: Sequence[float]
) -> Iterator[Place]:
    """Yield places beside those states of the motion, by those shares of its size or nearer."""
    around, motion = surroundings(scheme.scene), _motion(scheme.scene)
    states = _on_orbit(scheme.s, scheme.scene)
    fastest = min((r for r in motion.lengths if r is not None), default=None)
    for k, share in zip(at, shares, strict=True):
        for _ in range(NEARER[1]):
            place = _place(scheme, drawn, states[k], share, motion, around)
            if place is not None and (fastest is None or HASTE * place.length >= fastest):
                yield place
                break
            share /= NEARER[0]


def random_fraction(drawn: random.Random, low: float, high: float) -> Fraction:
    """Return a fraction between the two whose ratio to another one is no power of 2."""
    return Fraction(drawn.randrange(int(low * 2**30), int(high * 2**30)) | 1, 2**30)


State = tuple[Fraction, list[Any], list[Any]]


@dataclass(frozen=True)
class Motion:
    """States (t, x, v) along a scene's motion, their `lengths`, and the size of each coordinate."""

    states: list[State]
    lengths: list[Fraction | None]
    of_x: list[Any]
    of_v: list[Any]


@remembered(maxsize=64)
def _motion(scene: Any) -> Motion:
    """Return the motion as far as a rough integration follows it within the scene's duration."""
    around = surroundings(scene)
    states = around.along(Fraction(scene.duration))
    lengths: list[Fraction | None] = [b[0] - a[0] for a, b in pairwise(states)]
    if len(states) <= 2:  # at rest, or ended at once
        lengths = [around.length(*states[0][1:], Fraction(0))] * len(states)
    columns = [list(zip(*part, strict=True)) for part in
               ([x for _, x, _ in states], [v for _, _, v in states])]  # fmt: skip
    time = Fraction(scene.step)
    of_v = _sizes_of(columns[1], [], time)
    return Motion(states, lengths, _sizes_of(columns[0], of_v, time), of_v)


@lru_cache(maxsize=64)
def _on_orbit(s: SceneSymbols, scene: Any) -> list[State]:
    """Return the motion's states, on the orbit of the start.

    Each is the nearest point that arrows from the start reach. A rough integration leaves the
    orbit, such as SO(3), by its own error, and a quantity kept only on the orbit would seem to be
    lost. On pairs every point is on the orbit.
    """
    states = _motion(scene).states
    if s.groupoid.canonical or not len(states[0][1]):
        return states
    numbers, points = arithmetic(DIGITS), []
    with numbers.working():
        target, anchor, _ = _functions(s)
        p = [numbers.number(e) for e in scene.parameter_values]
        at = np.array([numbers.number(e) for e in scene.x0], dtype=object)
        for t, x, v in states:
            wanted = np.array([numbers.number(e) for e in x], dtype=object)
            for _ in range(ARROWS):
                rho, left = (part.astype(float) for part in (anchor(at, p), wanted - at))
                w = np.linalg.lstsq(rho, left)[0]
                at = target(at, np.array([numbers.number(float(e)) for e in w], dtype=object), p)
            points.append((t, list(numbers.public(at)), v))
    return points


def _sizes_of(columns: Sequence[Sequence[Any]], rates: list[Any], time: Fraction) -> list[Any]:
    """Return how far each coordinate moves; for one at rest, the others' size, or a step's."""
    moved = [max(c) - min(c) for c in columns]
    most = max(moved, default=0)
    if not most:
        most = max((abs(e) for c in columns for e in c), default=0)
    if not most and rates:
        most = max(rates) * time.numerator / time.denominator
    return [m if m > STILL * most else (most or mpmath.mpf(1)) for m in moved]


def _place(
    scheme: Scheme, drawn: random.Random, state: tuple[Fraction, list[Any], list[Any]],
    share: float, motion: Motion | None, around: Surroundings,
) -> Place | None:  # fmt: skip
    """Return a place beside a state by that share of the sizes, or None if there is none.

    Without the motion it is at the state and its time.
    """
    t, x, v = state
    if scheme.s.clocked and motion is not None:  # its time lies between those of two states
        between = [e for e in motion.lengths if e is not None] or [Fraction(scheme.scene.duration)]
        t += random_fraction(drawn, 0, 1) * min(between)
    signs = [drawn.choice((-1, 1)) * drawn.uniform(0.5, 1) * share for _ in [*x, *v]]
    try:
        with mpmath.workdps(DIGITS):
            of_x, of_v = (motion.of_x, motion.of_v) if motion else ([0] * len(x), [0] * len(v))
            v = [e + s * size for e, s, size in zip(v, signs[len(x) :], of_v, strict=True)]
            x, v = _on_manifold(scheme.s, scheme.scene, x, v, t, signs, of_x)
            mu = around.momentum(x, v, t, DIGITS)
            length = around.length(x, v, t)
    except (reference.ReferenceFailure, ArithmeticError, ValueError, TypeError):
        return None
    length = Fraction(scheme.scene.step) if length is None else length
    step = length * random_fraction(drawn, SMALLER, LARGER)
    return Place(tuple(x), tuple(mu), tuple(v or mu), t, step, length, share > 0)


def _on_manifold(
    s: SceneSymbols,
    scene: Any,
    x: list[Any],
    v: list[Any],
    t: Fraction,
    signs: list[float],
    sizes: list[Any],
) -> tuple[list[Any], list[Any]]:
    """Return x moved along the groupoid by those shares of the sizes, and v, on the constraints at
    the time t.

    x moves to the target of an arrow, so it stays in its orbit, such as its sphere.
    """
    numbers = arithmetic(DIGITS)
    with numbers.working():
        target, anchor, rows = _functions(s)
        values = _values(s, scene)
        p = [numbers.number(e) for e in scene.parameter_values]
        at = np.array([numbers.number(e) for e in x], dtype=object)
        xi = np.array([numbers.number(e) for e in v], dtype=object)
        if len(at):
            rho = anchor(at, p)
            w = []
            for k in range(rho.shape[1]):
                reach = [sizes[i] / abs(rho[i, k]) for i in range(len(at)) if rho[i, k]]
                sign = signs[k % len(signs)]
                w.append(numbers.number(min(reach) * sign if reach else 0))
            at = target(at, np.array(w, dtype=object), p)
        if rows is not None:
            time = [numbers.number(t)] * s.clocked
            phi, A, _ = rows([*at, *time], p)
            k = len(phi)  # the rows of φ come first
            for _ in range(12 if k else 0):
                at = target(at, -A[:k].T @ numbers.solve(A[:k] @ A[:k].T, phi), p)
                phi, A, _ = rows([*at, *time], p)
            for _ in range(2):
                phi, A, a = rows([*at, *time], p)
                xi = xi - A.T @ numbers.solve(A @ A.T, A @ xi - a)
            if k and max(map(abs, phi)) > 10 ** -(DIGITS - 30) * max(map(abs, A.ravel())):
                raise ValueError
        for _ in range(12 if values is not None else 0):  # such as μ·x = 0
            off, slope = values(at, xi, p)
            xi = xi - slope.T @ numbers.solve(slope @ slope.T, off)
        return list(numbers.public(at)), list(numbers.public(xi))


@lru_cache(maxsize=64)
def _values(s: SceneSymbols, scene: Any) -> Any:
    """Return its quantities less their values, of (x, ξ, p), and their slope in ξ; None if none.

    Quantities of x alone are kept where x moves along the groupoid.
    """
    numbers = arithmetic(DIGITS)
    # references of a Hamiltonian have μ in the place of the velocity
    of_mu = scene.in_numbers or (s.hamiltonian is not None and not s.degenerate)
    mu = dict(zip(s.mu, s.u if of_mu else momentum(s), strict=True))
    off = [
        s.call(q.formula, q.name, s.position, s.mu, s.parameters).xreplace(mu)
        - to_sympy(exact(q.value, q.name))
        for q in scene.symmetries if q.value is not None
    ]  # fmt: skip
    off = [e for e in off if e.free_symbols & set(s.u)]
    if not off:
        return None
    slope = sympy.Matrix(off).jacobian(s.u)
    return numeric({"x": s.position, "u": s.u, "p": s.parameter_list}, [off, slope], numbers)


@lru_cache(maxsize=64)
def _functions(s: SceneSymbols) -> tuple[Any, Any, Any]:
    """Return b(x, w; 1), ρ̂(x), and (φ, A, a) at (x, t) or None, as functions of x, w, p."""
    numbers = arithmetic(DIGITS)
    letters = {"x": s.position, "p": s.parameter_list}
    groupoid = getattr(s.groupoid, "inner", s.groupoid) if s.clocked else s.groupoid
    one = 1

    def plain(e: Any) -> Any:
        return e.subs(s.h, one) if hasattr(e, "subs") else e

    target = numeric({"x": s.position, "w": s.u, "p": s.parameter_list},
                     [list(plain(groupoid.target(s.position, s.u, s.h)))], numbers)  # fmt: skip
    anchor = numeric(letters, [plain(groupoid.rho(s.position, s.h))], numbers)
    rows = None
    if s.constraints:
        parts = [f(s, s.x) for f in (constraint, constraint_matrix, constraint_shift)]
        entries = [list(parts[0]), plain(parts[1]), list(parts[2])]
        rows = numeric({**letters, "x": s.x}, entries, numbers)
    return target, anchor, rows


def is_linear(s: SceneSymbols) -> bool:
    """True if a scene's equations are linear: a quadratic Lagrangian on pairs, linear forces."""
    if not s.groupoid.canonical or s.constraints or s.clocked:
        return False
    if s.degenerate and inverse_two_form(s).free_symbols & {*s.x}:
        return False
    return is_quadratic(s)


def is_quadratic(s: SceneSymbols) -> bool:
    """True if L (or H) is a quadratic polynomial, and a force a linear one."""
    H = s.hamiltonian
    function, letters = (s.lagrangian, [*s.position, *s.u]) if H is None else (
        H, [*s.position, *s.mu])  # fmt: skip
    force = list(s.force) if s.forced else []
    try:
        degrees = [sympy.Poly(e, *letters).total_degree() for e in (function, *force)]
    except sympy.PolynomialError:
        return False
    return degrees[0] <= 2 and all(d <= 1 for d in degrees[1:])
