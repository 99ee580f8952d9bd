"""Many ordinary steps in doubles, all along the motion, which show where a law is to be asked.

A fault in a thousandth of the motion lies between a few places, and one of a high power of the step
does not show in a run of short steps (`scan`). So steps of all sizes up to the scene's own, forth
and back in time, are made from rows of such a run. They judge nothing: where one of them departs
from a law by more than round-off, the law itself is asked. So it is where steps are unlike those
beside them (`unlike_steps`), whatever the law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.errors import CannotMeasure, DiscmechError
from discmech.integrators.extensions.foreign import guarded, images
from discmech.integrators.numbers import Matrix, Vector, mpmath

from ..systems.runs import Rows
from .places import SHARES, Place, seed_in_numbers
from .scan import costs_of, highest, peaks_of, run_of, steps_of

#: rows of a run from which one step is made: four in a thousandth of the motion. A formula's step
#: takes as long as ten of a function, and a program of whole runs answers each by itself
ROWS, OF_FORMULA, OF_RUNS = 2**12, 4, 16
#: different sizes of steps, from the scene's own on over so many octaves, more of the longer ones
SIZES, OCTAVES = 32, 10
BESIDE = 5  # one row of so many begins beside the motion
APART = 19  # sizes of neighbouring rows are so many apart: a narrow part has several of them
#: share of the largest entry of x, or of μ, below which an entry may be round-off all along a run
ROUND_OFF = 2.0**-40
LOOKED_AT = 3  # steps from which the law itself is asked
#: steps of one size all along the motion, and of sizes over `OCTAVES` and more from one state: four
#: in a thousandth of the motion, and three in a hundredth of a size
ALONG, OF_SIZES = 2**12, 2**11
LONGEST = 1.7  # of these sizes, over the scene's own step, as from drawn places

Map: TypeAlias = Callable[[Vector], Vector]
#: a `BoxScheme` or another one
AnyScheme: TypeAlias = Any


@dataclass(frozen=True, eq=False)
class ManySteps:
    """Steps of a scheme from rows of a run.

    starts: states (x, μ), (r, n+m). velocities: u of these. times: those of the starts. sizes: the
    steps, and which: of each row. scale: the size of each entry along the motion.
    """

    scheme: AnyScheme
    starts: Matrix
    velocities: Matrix
    times: list[Fraction]
    sizes: list[Fraction]
    which: Vector
    scale: Vector

    @cached_property
    def ends(self) -> Matrix:
        """The states after the steps, (r, n+m), not numbers where a step fails."""
        return self._made(self.starts, 0)

    def back(self) -> Matrix:
        """Return the states after a step back from each end."""
        return self._made(self.ends, 1)

    def _made(self, states: Matrix, back: int) -> Matrix:
        """Return the ends of steps from the states; of a size that the first refuses, nan."""
        scheme, ends = self.scheme, np.full(states.shape, np.nan)

        def of_row(i: int, size: Fraction) -> Map:
            time = self.times[i] + back * size if scheme.scene.timed else 0
            if back:
                return way_back(scheme, size, 1, time, states[i])
            return one_step(scheme, size, time)

        for k, size in enumerate(self.sizes):
            rows = np.flatnonzero((self.which == k) & np.isfinite(states).all(axis=1))
            if not len(rows):
                continue
            try:
                of_row(rows[0], size)(states[rows[0]])
                for part in rows[:, None] if scheme.scene.timed else [rows]:
                    f = guarded(of_row(part[0], size), states.shape[1])
                    ends[part] = images(f, states[part])
            except DiscmechError:
                continue
        return ends

    def changes(self, of: Rows) -> Vector:
        """Return the change of a quantity by each step, over its terms, (r,)."""
        (before, terms), (after, _) = of(self._rows(self.starts)), of(self._rows(self.ends))
        size = terms.max(axis=1)
        return np.asarray(np.abs(after - before).max(axis=1) / np.where(size > 0, size, 1))

    def _rows(self, states: Matrix) -> Any:
        x, mu = np.hsplit(states, [self.scheme.s.n])
        times = np.array([float(t) for t in self.times])[:, None]
        base = np.hstack([x, times]) if self.scheme.s.clocked else x
        return SimpleNamespace(x=x, base=base, mu=mu, u=self.velocities)

    def places(self, gaps: Vector, limit: float) -> list[Place]:
        """Return the starts of the steps with the largest gaps (r,) beyond the limit, as places."""
        gaps = np.nan_to_num(gaps)
        return [_place(self.scheme, self.starts[k], self.velocities[k], self.times[k],
                       self.sizes[self.which[k]], k % BESIDE == 0)
                for k in map(int, np.argsort(-gaps)[:LOOKED_AT]) if gaps[k] > limit]  # fmt: skip


def _place(
    scheme: AnyScheme, z: Vector, u: Vector, time: Fraction, step: Fraction, beside: bool = False
) -> Place:
    x, mu, near = (tuple(map(mpmath.mpf, part)) for part in (*np.split(z, [scheme.s.n]), u))
    return Place(x, mu, near, time, step, abs(step), beside)


@lru_cache(maxsize=8)
def unlike_steps(scheme: AnyScheme) -> list[Place]:
    """Return the starts of steps that are least like those beside them: none of a derived rule.

    The ends of steps of one size from rows along the motion are a smooth curve, and so are those of
    steps of all sizes from one row, but where the method does something else (`scan.peaks`). A
    derived rule has one formula everywhere, and a program is looked at in its own numbers.
    """
    rule, own = scheme.rule, Fraction(scheme.scene.step)
    if not rule.is_formula or rule.asks_lagrangian:
        return []
    try:
        run = run_of(scheme, steps_of(scheme))
    except DiscmechError:
        return []
    z, drawn = np.hstack([run.x, run.mu]).astype(float), np.random.default_rng(len(run.t))
    at = np.arange(0, len(run.t), max(1, len(run.t) * costs_of(scheme) // ALONG))  # evenly
    shares = np.geomspace(2.0**-OCTAVES, LONGEST, OF_SIZES // costs_of(scheme))
    one, part = int(drawn.choice(at)), Fraction(drawn.uniform(0.9, 1))
    map_of = lru_cache(maxsize=1)(partial(one_step, scheme))
    places = []
    for looks in ([(int(k), own * part) for k in at],
                  [(one, own * Fraction(share)) for share in shares]):  # fmt: skip
        maps = (map_of(step, k * run.step if scheme.scene.timed else 0) for k, step in looks)
        ends = np.array([guarded(f, z.shape[1])(z[k])
                         for f, (k, _) in zip(maps, looks, strict=True)])  # fmt: skip
        known = np.flatnonzero(np.isfinite(ends).all(axis=1))
        for peak in highest(peaks_of(ends[known], Fraction(1), rule.unit(16)), LOOKED_AT):
            k, step = looks[known[int(peak.time)]]
            places.append(_place(scheme, z[k], np.asarray(run.u[k], float), k * run.step, step))
    return places


@lru_cache(maxsize=8)
def many_steps(scheme: AnyScheme) -> ManySteps | None:
    """Return many steps of a scheme all along its motion; None where no run can be made."""
    rule = scheme.rule
    rows = ROWS // costs_of(scheme) // (OF_FORMULA if rule.is_formula else 1)
    rows //= OF_RUNS if getattr(rule, "runs", False) else 1
    try:
        run = run_of(scheme, steps_of(scheme))
    except DiscmechError:
        return None
    at = np.linspace(0, len(run.t) - 2, min(rows, len(run.t) - 1)).astype(int)
    starts = np.hstack([run.x, run.mu])[at].astype(float)
    reach, scale = np.ptp(starts, axis=0), np.abs(starts).max(axis=0)
    if scheme.scene.all_constraints or scheme.s.degenerate:
        reach[:] = 0
    elif not scheme.scene.groupoid.canonical:  # x may lie on an orbit, such as a sphere
        reach[: scheme.s.n] = 0
    drawn = np.random.default_rng(seed_in_numbers(scheme))
    starts[::BESIDE] += (reach * drawn.uniform(-SHARES[1], SHARES[1], starts.shape))[::BESIDE]
    own = Fraction(scheme.scene.step) * Fraction(drawn.uniform(0.99, 1))
    sizes = [own * Fraction(2.0 ** (-OCTAVES * (k / SIZES) ** 2)) * (-1) ** k for k in range(SIZES)]
    for part in (slice(scheme.s.n), slice(scheme.s.n, None)):
        most = scale[part].max(initial=0.0) or scale.max() or 1.0
        scale[part] = np.where(scale[part] > ROUND_OFF * most, scale[part], most)
    times = [int(k) * run.step for k in at]
    if not rule.is_formula and rule.own_coordinates:  # a run of many steps may leave a group
        flow = scheme.flow(scheme.scene.step)
        starts = np.array([flow.settled(z, t) for z, t in zip(starts, times, strict=True)])
    which = np.arange(len(at)) * APART % SIZES
    return ManySteps(scheme, starts, np.asarray(run.u, float)[at], times, sizes, which, scale)


def one_step(scheme: AnyScheme, step: Fraction, time: Fraction | int) -> Map:
    """Return the map of a step in doubles on states (x, μ)."""
    flow, n = scheme.flow(step, 16), scheme.s.n
    if hasattr(flow, "map_of"):
        return flow.map_of(1, t0=time)

    def image(z: Vector) -> Vector:
        run = flow.trajectory(1, x0=z[:n], mu0=z[n:], t0=time)
        return np.concatenate([run.x[-1], run.mu[-1]])

    return image


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
