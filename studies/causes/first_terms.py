"""How a one-step map begins at h = 0: the first terms of its error at places of the evidence.

D(h) = Φ_h(z) − φ_h(z) = e₁h + e₂h² + …, by steps in doubles beside the motion itself, extrapolated.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import State, scene_in_numbers
from discmech.integrators.numbers import Vector, arithmetic, mpmath
from discmech.reference import surroundings

from ..evidence import Place, evidence_of

#: steps at a place, relative to the time for which the motion is a short polynomial
PARTS = [Fraction(1, 2**k) for k in range(4, 10)]
SEEN = 1e-6  # largest error of an extrapolated entry, relative to the rate of the motion
NOISE = SEEN / 10  # usual error of an extrapolated entry
Told = tuple[str, str]  # cause, sentence
SAME = 1e-4  # largest relative difference of factors at all places that count as one factor


@dataclass(frozen=True)
class Beginning:
    """The first terms of the error at one place.

    The vector field f and its parts, z̈, z⃛, ∂f/∂t, and e₁, e₂, e₃ of the step's error; e₂ and e₃
    hold if those before them are 0. Of a program in velocities z̈, ∂f/∂t and e₂ are in these.
    later: e₁ of three steps together. parts: by name, terms of f in all entries. others: the fields
    of known mistakes, no numbers where there is none. misread: what a program takes z for that
    reads states otherwise, and what it takes for z. grown: D(h)/h of the shortest step over that of
    the longest. shortest: its D(h). moved: Φ_h(z) − z of the longest and the shortest step. square:
    the limit of (Φ_h(z) − z)/h², of entries that the limit field leaves as they are.
    """

    z: Vector
    time: float
    f: Vector
    second: Vector
    third: Vector
    of_time: Vector
    first_error: Vector
    second_error: Vector
    third_error: Vector
    later: Vector
    parts: dict[str, Vector]
    others: dict[str, Vector]
    misread: dict[str, list[Vector]]
    span: Vector
    moved: tuple[Vector, Vector]
    square: Vector
    grown: float = 1.0
    shortest: Vector | None = None


@lru_cache(maxsize=64)
def beginnings(scheme: Any, order: bool) -> list[Beginning]:
    """Return the first terms at all places of the evidence, and where it decided on the order.

    They are kept, for all studies of a scheme that seek a cause.
    """
    system = scene_in_numbers(scheme.s, scheme.scene, arithmetic(16))
    evidence = evidence_of(scheme)
    decided = evidence.order.place if order else None  # a fault may show nowhere else
    more = [] if decided is None or decided in evidence.places else [decided]
    return [_beginning(scheme, system, place) for place in (*evidence.places, *more)]


def _beginning(scheme: Any, system: Any, place: Place) -> Beginning:
    n, time = system.n, float(place.t)
    z = np.array([float(e) for e in (*place.x, *place.mu)])
    steps = [place.length * part for part in PARTS]
    (one, images), (three, _) = (_errors(scheme, place, steps, count) for count in (1, 3))
    sizes = np.array([float(h) for h in steps])

    def f(at: Vector, t: float = time) -> Vector:
        try:
            return np.concatenate(system.f(at[:n], at[n:], t))
        except (ArithmeticError, ValueError):  # a state that is read wrongly may be a collision
            return np.full(len(at), np.nan)

    field = f(z)
    d = float(steps[-1]) / 8
    second = (f(z + d * field, time + d) - f(z - d * field, time - d)) / (2 * d)
    ends = [f(z + s * d * field + d**2 / 2 * second, time + s * d) for s in (1, -1)]
    third = (ends[0] - 2 * field + ends[1]) / d**2
    of_time = (f(z, time + d) - f(z, time - d)) / (2 * d)
    parts = parts_of(system, z, time)
    form = getattr(scheme.rule, "form", State())
    readings = other_readings(system, form, z, time)

    def field_of(meant: Any, inverse: Any) -> Vector:
        at = meant(z)
        along = d * f(at)
        return np.asarray((inverse(at + along, d) - inverse(at - along, -d)) / (2 * d))

    others = {name: field_of(*pair) for name, pair in readings.items()}
    misread = {name: [one(z) for one in pair] for name, pair in readings.items()}
    if len(z) == 2 * n:
        others["momentum for velocity"] = np.concatenate([z[n:], field[n:]])
        turned = {"degrees for radians": np.pi / 180, "radians for degrees": 180 / np.pi}
        others |= {name: np.concatenate([field[:n], f(np.concatenate([c * z[:n], z[n:]]))[n:]])
                   for name, c in turned.items()}  # fmt: skip
    if form.has_attitude:  # Ȧ = AΩ from the right
        A, rate = (e[:9].reshape(3, 3) for e in (z, field))
        others["velocity from the left"] = np.concatenate([(A.T @ rate @ A).ravel(), field[9:]])
    if scheme.s.clocked:
        others |= {"time frozen": f(z, 0.0), "time doubled": f(z, 2 * time)}
    span = np.concatenate([np.full(len(e), np.abs(e).max(initial=0.0) or 1.0)
                           for e in (field[:n], field[n:])])  # fmt: skip
    first, e2 = (_at_zero(sizes, one / sizes[:, None] ** k) for k in (1, 2))
    if form.second == "v":  # a term is stale, or comes twice, in the program's own numbers

        def v(at: Vector, t: float = 0) -> Vector:
            return system.velocity(at[:n], at[n:], time + t)

        curve = [z + s * d * field + d**2 / 2 * second + s * d**3 / 6 * third for s in (1, -1)]
        ends = [v(at, s * d) for at, s in zip(curve, (1, -1), strict=True)]
        second = np.concatenate([second[:n], (ends[0] - 2 * v(z) + ends[1]) / d**2])
        e2, of_time = (np.concatenate([e[:n], (v(z + d**2 * e) - v(z - d**2 * e)) / (2 * d**2)])
                       for e in (e2, of_time))  # fmt: skip
    return Beginning(z, time, field, second, third, of_time, first, e2,
                     _at_zero(sizes, one / sizes[:, None] ** 3),
                     _at_zero(sizes, three / sizes[:, None]),
                     parts, others, misread, span, (images[0] - z, images[-1] - z),
                     _at_zero(sizes, (images - z) / sizes[:, None] ** 2),
                     _grown(sizes, one / span), one[-1])  # fmt: skip


def parts_of(system: Any, z: Vector, time: float) -> dict[str, Vector]:
    """Return the terms of the field of a `SceneInNumbers` at a state by name, (n+m,) each."""
    n = system.n
    q, p = z[:n], z[n:]
    potential = -system.gradient(q, p, time)
    anchor, velocity = system.tensor(q, p), system.velocity(q, p, time)
    zero = np.zeros(n)
    return {
        "the motion of x": np.concatenate([system.f(q, p, time)[0], 0 * p]),
        "the gradient of the potential": np.concatenate([zero, anchor[:n, n:].T @ potential]),
        "the bracket of momenta": np.concatenate([zero, anchor[n:, n:] @ velocity]),
        "the force": np.concatenate([zero, system.force(q, p, time)]),
    }  # fmt: skip


def _grown(sizes: Vector, errors: np.ndarray) -> float:
    """Return how many times the error of a step over its size grows as steps get shorter."""
    rates = np.abs(errors).max(axis=1) / sizes
    return float(rates[-1] / rates[0]) if rates[0] else 0.0


def _errors(
    scheme: Any, place: Place, steps: list[Fraction], count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return (Φ_h^k(z) − φ_kh(z), Φ_h^k(z)) for each step, in doubles; (steps, n+m) each."""
    ends = surroundings(scheme.scene).after(
        place.x, place.u, place.t, [count * h for h in steps], 30
    )
    rows, images = [], []
    for h, end in zip(steps, ends, strict=True):
        run = scheme.flow(h).trajectory(count, every=count, **place.start)
        with mpmath.workdps(30):
            got = [*run.x[-1], *run.mu[-1]]
            rows.append([float(mpmath.mpf(a) - b)
                         for a, b in zip(got, [*end.x, *end.mu], strict=True)])  # fmt: skip
            images.append([float(a) for a in got])
    return np.array(rows), np.array(images)


def _at_zero(sizes: Vector, values: np.ndarray) -> Vector:
    """Return the limit at h = 0 of values at ever smaller steps, by polynomials in h (Neville)."""
    table = list(values)
    for k in range(1, len(sizes)):
        table = [b + (b - a) / (sizes[i] / sizes[i + k] - 1)
                 for i, (a, b) in enumerate(itertools.pairwise(table))]  # fmt: skip
    return np.asarray(table[0])


def other_readings(system: Any, form: State, z: Vector, time: float) -> dict[str, tuple[Any, Any]]:
    """Return the ways to read a state wrongly: (what is meant, its inverse) by the cause's name.

    A program that takes z for M(z) moves as M⁻¹ ∘ φ_h ∘ M. M⁻¹ is a function of a state and of the
    time since that of z, M of the state z alone.
    """
    n, of_v = system.n, form.second == "v"

    def momenta(w: Vector, t: float = 0.0) -> Vector:
        return np.concatenate([w[:n], system.momentum(w[:n], w[n:], time + t)])

    def velocities(w: Vector, t: float = 0.0) -> Vector:
        return np.concatenate([w[:n], system.velocity(w[:n], w[n:], time + t)])

    def exchanged(w: Vector, t: float = 0.0) -> Vector:
        return np.roll(w, n)

    readings: dict[str, tuple[Any, Any]] = {}
    if len(z) == 2 * n or form.has_attitude:
        names = ("velocities for momenta", "momenta for velocities")
        readings[names[of_v]] = (velocities, momenta) if of_v else (momenta, velocities)
    if len(z) == 2 * n:
        readings["q and p exchanged"] = exchanged, exchanged
    if not form.has_attitude:
        return readings

    def transposed(w: Vector, t: float = 0.0) -> Vector:
        return np.concatenate([w[:9].reshape(3, 3).T.ravel(), w[9:]])

    def turned(w: Vector, t: float, back: bool) -> Vector:
        """Return the state with its momentum, or velocity, turned to space or back."""
        A, own = w[:9].reshape(3, 3), velocities(w, t) if of_v else w
        own = np.concatenate([w[:9], (A.T if back else A) @ own[9:]])
        return momenta(own, t) if of_v else own

    def rolled(w: Vector, t: float, by: int) -> Vector:
        return np.concatenate([form.read(np.roll(form.written(w[:9]), by)), w[9:]])

    def both(of: Any, a: Any, b: Any) -> tuple[Any, Any]:
        return (lambda w: of(w, 0.0, a)), (lambda w, t=0.0: of(w, t, b))

    readings["attitude transposed"] = transposed, transposed
    readings["velocity in space" if of_v else "momentum in space"] = both(turned, True, False)
    if form.first == "quaternion":
        readings["quaternion with w last"] = both(rolled, 1, -1)
    return readings


def factor(
    starts: list[Beginning], got: Any, of: Any, same: float = SAME, noise: float = NOISE
) -> float | None:
    """Return the one c with got = c·of at all places and in all entries, or None."""
    a = np.concatenate([got(b) / b.span for b in starts])
    return factor_of(a, np.concatenate([of(b) / b.span for b in starts]), same, noise)


def factor_of(a: Vector, e: Vector, same: float, noise: float) -> float | None:
    """Return the one c with a = c·e in all entries, or None."""
    if not e @ e > 1e-12:
        return None
    c = float(a @ e / (e @ e))
    off = np.abs(a - c * e)
    return c if bool((off <= max(same * np.abs(a).max(), noise)).all()) else None


def only(values: Vector, part: slice) -> Vector:
    """Return the entries of a part of the state, with zeros elsewhere."""
    kept = np.zeros_like(values)
    kept[part] = values[part]
    return kept
