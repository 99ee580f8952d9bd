"""Many states around a motion, along it or in a map's box, and a step in doubles from each.

A fault in a part of the states, or of the sizes of steps, lies between a few places. So each law is
looked at from many states, by steps whose sizes are drawn over all octaves below the scene's own.
Such steps judge nothing: where one departs from a law by more than round-off, or by more than the
others, the law itself is asked there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.errors import CannotMeasure, DiscmechError, Displaced
from discmech.integrators.extensions.foreign import guarded, images
from discmech.integrators.extensions.foreign.box import no_motion
from discmech.integrators.numbers import Matrix, Vector, mpmath
from discmech.reference import ReferenceFailure, many_motions

from ..systems.runs import Rows
from .places import Place, seed_in_numbers, sizes_of_motion, states_on_orbit

#: drawn states: a part that is a 150th of those around the motion is met but once in a thousand
COUNT = 2**10
#: fewer where a step takes long: a formula's, that of a program of whole runs, and a part of the
#: steps of a long run
OF_FORMULA, OF_RUNS, OF_LONG_RUN = 4, 16, 64
IN_BOX = 2**12  # states of a box, which is all that its map is judged by: four in a thousandth
WIDE = 0.5  # share of the motion's size by which the farthest of the states lie beside it
#: sizes of steps, from `LONGEST` of the scene's own on over so many octaves, more of the longer
#: ones: two in a part of a hundredth everywhere, and four in ten among those of the scene's own.
#: A formula is one for all sizes, and its flow takes as long as ten steps
SIZES, OF_FORMULAS_SIZES = 2**10, 2**5
OCTAVES, LONGEST = 10, 1.7
#: the same in a sentence
STEPS_ASKED = f"steps of {LONGEST * 2.0**-OCTAVES:.2g} to {LONGEST:g} of the scene's"
#: share of the largest entry of x, or of μ, below which an entry may be round-off all along a run
ROUND_OFF = 2.0**-40
LOOKED_AT = 3  # states from which the law itself is asked

Map: TypeAlias = Callable[[Vector], Vector]
#: a `BoxScheme` or another one
AnyScheme: TypeAlias = Any


@dataclass(frozen=True, eq=False)
class Cloud:
    """Many states, and a step from each.

    z: (x, μ), (r, n+m). v: velocities there, (r, m), μ of a Hamiltonian. t: times, and steps: (r,).
    beside: (r,), False for those on a run.
    """

    scheme: AnyScheme
    z: Matrix
    v: Matrix
    t: Vector
    steps: Vector
    beside: Vector

    @cached_property
    def scale(self) -> Vector:
        """The size of each entry of (x, μ), (n+m,)."""
        scale, n = np.abs(self.z).max(axis=0), self.scheme.s.n
        for part in (slice(n), slice(n, None)):
            most = scale[part].max(initial=0.0) or scale.max() or 1.0
            scale[part] = np.where(scale[part] > ROUND_OFF * most, scale[part], most)
        return scale

    @cached_property
    def ends(self) -> Matrix:
        """The states after the steps, (r, n+m), not numbers where a step fails."""
        return ends_of(self.scheme, self.z, self.t, self.steps)

    def back(self) -> Matrix:
        """Return the states after a step back from each end."""
        return ends_of(self.scheme, self.ends, self.t + self.steps, self.steps, _one_back)

    def changes(self, of: Rows) -> Vector:
        """Return the change of a quantity by each step, over its terms, (r,)."""
        (before, terms), (after, _) = of(self.rows(self.z)), of(self.rows(self.ends))
        size = terms.max(axis=1)
        return np.asarray(np.abs(after - before).max(axis=1) / np.where(size > 0, size, 1))

    def rows(self, states: Matrix) -> Any:
        """Return states (r, n+m) as the rows of a run from which quantities are computed."""
        x, mu = np.hsplit(states, [self.scheme.s.n])
        base = np.hstack([x, self.t[:, None]]) if self.scheme.s.clocked else x
        return SimpleNamespace(x=x, base=base, mu=mu, u=self.v)

    def places(self, gaps: Vector, limit: float) -> list[Place]:
        """Return the starts of the steps with the largest gaps (r,) beyond the limit, as places."""
        gaps = np.nan_to_num(gaps)
        return [self.place(k) for k in map(int, np.argsort(-gaps)[:LOOKED_AT]) if gaps[k] > limit]

    def place(self, k: int) -> Place:
        """Return a state as a place."""
        parts = (*np.split(self.z[k], [self.scheme.s.n]), self.v[k])
        x, mu, near = (tuple(map(mpmath.mpf, part.tolist())) for part in parts)
        step = Fraction(self.steps[k])
        return Place(x, mu, near, Fraction(self.t[k]), step, abs(step), bool(self.beside[k]))


def in_box(case: Any) -> bool:
    """True if the map of a case or scheme runs on its own box of states, not on a scene."""
    return case.scene.lagrangian is no_motion


@lru_cache(maxsize=8)
def around(scheme: AnyScheme) -> Cloud:
    """Return states up to `WIDE` of the motion's size beside it in every entry, and steps.

    They are free states where there are no constraints; on a group x is that of the motion. Of a
    map's box they are states in it. States outside the scene's domain are left out. Raises
    `ReferenceFailure` for a scene without continuous equations, and where no state is left.
    """
    rule, seed = scheme.rule, seed_in_numbers(scheme)
    if in_box(scheme):
        low, high = np.array(rule.states, dtype=float)
        z = np.random.default_rng(seed).uniform(low, high, (IN_BOX, len(low)))
        t, steps = np.zeros(IN_BOX), np.full(IN_BOX, float(scheme.scene.step))
        return Cloud(scheme, z, z[:, scheme.s.n :], t, steps, t > 0)
    count = min(COUNT // costs_of_call(rule), rule.long_run // OF_LONG_RUN)
    drawn, (t, x, v) = np.random.default_rng(seed), states_on_orbit(scheme)
    at, by = drawn.integers(len(t), size=count), sizes_of_motion(scheme.scene)
    moved = by * drawn.uniform(0, WIDE, (count, 1)) * drawn.uniform(-1, 1, (count, len(by)))
    of_x, of_v = np.hsplit(moved, [x.shape[1]])
    t, x, v = t[at], x[at] + of_x * scheme.s.groupoid.canonical, v[at] + of_v
    z = np.hstack([x, many_motions(scheme.scene).after(x, v, t, 0 * t, by).mu])
    steps, inside = np.resize(sizes_of(scheme, seed), count), np.isfinite(z).all(axis=1)
    if not inside.any():
        raise ReferenceFailure(f"{scheme.scene.name}: no state around its motion has a momentum.")
    return Cloud(
        scheme, z[inside], v[inside], t[inside], steps[inside], np.full(inside.sum(), True)
    )


def costs_of_call(rule: Any) -> int:
    """Return how dear a step of a rule is by itself: made by many calls, or by a whole run."""
    return OF_FORMULA if rule.is_formula else OF_RUNS if rule.runs else 1


def sizes_of(scheme: AnyScheme, seed: int) -> Vector:
    """Return the sizes of steps by which every law is asked, in no order."""
    count = SIZES // (OF_FORMULAS_SIZES if scheme.rule.is_formula else 1)
    drawn = np.random.default_rng(seed)
    shares = (drawn.permutation(count) + drawn.uniform(size=count)) / count
    sizes = float(scheme.scene.step) * LONGEST * 2.0 ** (-OCTAVES * shares**2)
    return np.array([float(scheme.rule.step_for(h)) for h in sizes])


def ends_of(
    scheme: AnyScheme, states: Matrix, times: Vector, steps: Vector, made_by: Any = None
) -> Matrix:
    """Return the ends of steps (r,) from states (r, n+m) at times (r,), nan where one fails.

    made_by: what gives the map of a step (`one_step`). Raises `Displaced`.
    """
    ends, timed = np.full(states.shape, np.nan), scheme.scene.timed
    known = np.isfinite(states).all(axis=1)
    for size in np.unique(steps):
        rows = np.flatnonzero(known & (steps == size))
        step = scheme.rule.step_for(Fraction(size))
        for part in rows[:, None] if timed else [rows] * bool(len(rows)):
            time = Fraction(times[part[0]]) if timed else 0
            try:
                f = (made_by or one_step)(scheme, step, time, states[part[0]])
                ends[part] = images(guarded(f, states.shape[1]), states[part])
            except Displaced:
                raise
            except DiscmechError:
                continue
    return ends


def one_step(
    scheme: AnyScheme, step: Fraction, time: Fraction | int, state: Vector | None = None
) -> Map:
    """Return the map of a step in doubles on states (x, μ)."""
    flow, n = scheme.flow(step, 16), scheme.s.n
    if hasattr(flow, "map_of"):
        return flow.map_of(1, t0=time)

    def image(z: Vector) -> Vector:
        run = flow.trajectory(1, x0=z[:n], mu0=z[n:], t0=time)
        return np.concatenate([run.x[-1], run.mu[-1]])

    return image


def _one_back(scheme: AnyScheme, step: Fraction, time: Fraction | int, state: Vector) -> Map:
    return way_back(scheme, step, 1, time, state)


def way_back(
    scheme: AnyScheme, step: Fraction, count: int, time: Fraction | int, state: Vector
) -> Map:
    """Return the map of so many steps back from a time on.

    If a program makes no negative step from the state, and H is even in the momentum, it is that of
    steps forth with reversed momenta. Raises `StepFailure` or `CannotMeasure` if it is not even.
    """
    if scheme.rule.is_formula:
        return one_step(scheme, -step, time)
    try:
        back = scheme.flow(-step).map_of(count, t0=time)
        back(state)
    except (StepFailure, CannotMeasure):
        flow, n = scheme.flow(step), scheme.s.n
        if not _even(scheme, flow.system, state):
            raise
        turned = np.concatenate([np.ones(n), -np.ones(len(state) - n)])
        again = flow.map_of(count)

        def back(z: Vector) -> Vector:
            return turned * again(turned * z)

    return back


def _even(scheme: AnyScheme, system: Any, z: Vector) -> bool:
    """True if reversed momenta reverse the motion: H(q, −p) = H(q, p), and no force."""
    if not scheme.scene.groupoid.canonical or scheme.scene.clocked:
        return False
    n = scheme.s.n
    values = [system.H(z[:n], sign * z[n:]) for sign in (1, -1)]
    return bool(abs(values[0] - values[1]) <= 2.0**-40 * (1 + abs(values[0])))
