"""The two-point boundary problem of optimal control: Newton with a banded matrix over all steps.

The unknowns are the states z_1 … z_N, the costates p_1 … p_N, and in every step v = (w, f, κ). v is
eliminated; the remaining Hessian of ℒ (`stages`) is symmetric, and one linear step of z, p is

    δz′ = A δz + G δp′ + …,    δp = Q δz + Aᵀ δp′ + …

so the matrix is block-tridiagonal over the steps, and the work is linear in their number. At the
end z_N = z1 along the orbit of x1 if it is given, and the other components of p_N vanish.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from ...errors import BadInput, NotDecided
from ...numbers import LazyModule, over
from ...numbers.types import Matrix, Vector
from .descent import descended, violation
from .first_guess import End, Path, first_guess
from .second_order import OtherMotion, check_bound, check_minimum, check_steered, unbound
from .stages import ControlStages

lapack = LazyModule("scipy.linalg.lapack")

# largest number of corrections: from a start in the basin of convergence about ten are enough
MOST = 60
HALVINGS = 12  # largest number of halvings of a correction before the search stops
# unknowns below this share of the largest one (in units of the problem) are compared with it
TINY = 1e-6
NEAR = 1e-8  # a relative correction of an unknown below this is as good as the last one
ROUNDED = 1e-13  # a correction of an unknown, relative to the size of its kind, that is round-off
#: the share of the effort ½|f|² in the cost falls by this factor, by less if that is too fast, and
#: becomes 0 once it is below LAST
FALL, SLOWEST, LAST = 1 / 8, 0.9, 1e-4

#: states, costates and v of all steps
Parts = tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Optimum:
    """A stationary motion of a discrete control problem with N steps that is a minimum.

    t (N+1,), x (N+1, n), mu (N+1, m), u (N, m) as in a `Trajectory`; controls (N, r, k): the
    controls in each step, at the times control_times (N, r); node_controls (N+1, k): the controls
    at the times t, by Pontryagin's condition; costates (N+1, n+m): the derivative of the remaining
    cost by (x, μ); cost; iterations: number of Newton corrections; correction: the last one
    relative to the size of its kind of unknown, at the level of round-off. scene, rule: what was
    solved.
    """

    t: np.ndarray
    x: np.ndarray
    mu: np.ndarray
    u: np.ndarray
    controls: np.ndarray
    control_times: np.ndarray
    node_controls: np.ndarray
    costates: np.ndarray
    cost: float
    iterations: int
    correction: float
    scene: Any = field(kw_only=True, default=None, repr=False)
    rule: Any = field(kw_only=True, default=None, repr=False)


class BoundaryProblem:
    """The equations of an optimum with steps of size h that begin at `times`, and Newton's method.

    z0 and z1: the states at the ends; fixed: the projection onto the conditions of the end, (n+m)².
    All numbers inside are in `units` (one for each letter) and `cost_unit` (`units_of`): pivots and
    eigenvalues of a matrix that mixes lengths and momenta would mean nothing. effort: the cost is
    (1 − effort) C + effort·½|f|², whose second part bounds all controls.
    """

    def __init__(
        self, stages: ControlStages, z0: Vector, z1: Vector, fixed: Matrix, h: float,
        times: Vector, units: Vector, cost_unit: float,
    ) -> None:  # fmt: skip
        self.stages, self.h, self.times = stages, h, times
        self.units, self.cost_unit, self.effort = units, cost_unit, 0.0
        self.N, self.d = len(times), len(z0)
        at = stages.slices
        self.z = np.r_[at["x"], at["mu"]]
        self.v = np.r_[at["w"], at["f"], at["kappa"]]
        self.p = np.r_[at["p"]]
        self.z0, self.z1, self.fixed = z0 / units[self.z], z1 / units[self.z], fixed
        self.equations = at["kappa"].stop - at["kappa"].start
        #: of the last correction: the Hessians of ℒ, and (A, G, Q) of the linear steps
        self.hessian: np.ndarray | None = None
        self.steps: tuple[np.ndarray, ...] | None = None

    def rows(self, y: Parts) -> Matrix:
        """Return the inputs of ℒ for all steps, from (z, p, v)."""
        z, p, v = y
        a = np.empty((self.N, len(self.z) + len(self.v) + len(self.p)))
        a[:, self.z] = np.vstack([self.z0, z[:-1]])
        a[:, self.v], a[:, self.p] = v, p
        return a * self.units

    def derivatives(self, y: Parts) -> tuple[Matrix, np.ndarray]:
        """Return the gradients and Hessians of ℒ in all steps, in units of the problem."""
        a, f, weight = self.rows(y), self.stages.slices["f"], self.effort
        g, H = self.stages(a, self.times, self.h, 1 - weight)
        per = self.units / self.cost_unit
        g, H = g * per, H * self.units[:, None] * per
        g[:, f] += weight * a[:, f] / self.units[f]
        H[:, range(f.start, f.stop), range(f.start, f.stop)] += weight
        return g, H

    def residual(self, y: Parts) -> tuple[Matrix, Matrix, Matrix, np.ndarray]:
        """Return the equations that vanish at an optimum, by v, p and z, and the Hessians of ℒ."""
        z, p, _ = y
        g, H = self.derivatives(y)
        of_end = self.fixed @ (z[-1] - self.z1) + p[-1] - self.fixed @ p[-1]
        by_z = np.vstack([g[1:, self.z] - p[:-1], of_end])
        return g[:, self.v], g[:, self.p] - z, by_z, H

    def linearised(self, H: np.ndarray) -> Callable[..., Parts]:
        """Return the map residuals ↦ Newton's (δz, δp, δv); raises `LinAlgError` if singular."""
        d, N, (z, v, p) = self.d, self.N, (self.z, self.v, self.p)
        outer, inner = np.r_[z, p], H[:, v][:, :, v]
        self.hessian = H
        back = np.linalg.inv(inner)
        solved = back @ H[:, v][:, :, outer]
        left = solved.transpose(0, 2, 1)
        S = H[:, outer][:, :, outer] - left @ H[:, v][:, :, outer]
        Q, A, G = S[:, :d, :d], S[:, d:, :d], S[:, d:, d:]
        self.steps = A, G, Q
        width = 2 * d - 1
        band = np.zeros((3 * width + 1, 2 * d * N))

        def put(row: int, column: int, blocks: np.ndarray, first: int = 0) -> None:
            """Write blocks (k, d, d) at rows 2d·j + row and columns 2d·j + column, j = first, …"""
            j = 2 * d * np.arange(first, first + len(blocks))[:, None, None]
            i, c = j + row + np.arange(d)[:, None], j + column + np.arange(d)
            band[2 * width + i - c, c + 0 * i] = blocks

        one = np.eye(d)
        put(0, -d, A[1:], 1)
        put(0, 0, G)
        put(0, d, np.broadcast_to(-one, (N, d, d)))
        put(d, 0, np.broadcast_to(-one, (N - 1, d, d)))
        put(d, d, Q[1:])
        put(d, 2 * d, A[1:].transpose(0, 2, 1))
        put(d, 0, (one - self.fixed)[None], N - 1)
        put(d, d, self.fixed[None], N - 1)
        factors, pivots, failed = lapack.dgbtrf(band, width, width, overwrite_ab=True)
        if failed:
            raise np.linalg.LinAlgError

        def corrections(r_v: Matrix, r_z: Matrix, r_p: Matrix) -> Parts:
            shift = (left @ r_v[:, :, None])[:, :, 0]
            r_p = r_p - np.vstack([shift[1:, :d], np.zeros(d)])
            rhs = np.concatenate([shift[:, d:] - r_z, -r_p], axis=1).ravel()
            solution = lapack.dgbtrs(factors, width, width, rhs, pivots)[0].reshape(N, 2, d)
            dp, dz = solution[:, 0], solution[:, 1]
            along = np.concatenate([np.vstack([np.zeros(d), dz[:-1]]), dp], axis=1)
            dv = -(back @ r_v[:, :, None] + solved @ along[:, :, None])[:, :, 0]
            return dz, dp, dv

        return corrections

    def size(self, change: Parts, y: Parts) -> float:
        """Return the largest change of an unknown, relative to the size of its kind."""
        at, n = self.stages.slices, self.stages.n
        cuts = np.cumsum([at[k].stop - at[k].start for k in ("w", "f")])

        def kinds(parts: Parts) -> list[Matrix]:
            z, p, v = parts
            return [z[:, :n], z[:, n:], p[:, :n], p[:, n:], *np.split(v, cuts, axis=1)]

        sizes = [np.abs(part).max(initial=0) for part in kinds(y)]
        least = TINY * max(sizes) or 1.0
        changes = [np.abs(part).max(initial=0) for part in kinds(change)]
        return max(a / max(s, least) for a, s in zip(changes, sizes, strict=True))

    def newton(self, y: Parts) -> tuple[Parts, int, float] | None:
        """Return (z, p, v), the number of corrections and the size of the last one, or None.

        A correction is halved until the next one, computed with the same matrix, is smaller: this
        test is independent of units (Deuflhard 2004, 3.3).
        """
        (*residual, H), before = self.residual(y), np.inf
        for iteration in range(1, MOST + 1):
            try:
                corrections = self.linearised(H)
            except np.linalg.LinAlgError:
                return None
            change = corrections(*residual)
            size, share = self.size(change, y), 1.0
            for _ in range(HALVINGS):
                tried = tuple(a + share * b for a, b in zip(y, change, strict=True))
                *residual, H = self.residual(tried)
                if size < NEAR or self.size(corrections(*residual), y) <= (1 - share / 4) * size:
                    break
                share /= 2
            else:
                return None
            y = tried
            if over(size, before, ROUNDED, size, size < NEAR):
                return y, iteration, size
            before = size
        return None

    def by_effort(self, y: Parts) -> tuple[Parts, int, float] | None:
        """Return the result of `newton` by continuation from the motion of least effort ½|f|².

        The share of the effort in the cost falls to 0. A cost that is nearly flat for large
        controls, such as smoothed fuel, drives Newton's method away from a guess without controls
        (Bertrand, Epenoy, Optimal Control Appl. Methods 23 (2002), 171). `effort` keeps the last
        share that was solved for.
        """
        self.effort, corrections = 1.0, 0
        result = self.newton(y)
        solved, fall = 1.0, FALL
        while result is not None:
            y, corrections = result[0], corrections + result[1]
            if solved == 0:
                return y, corrections, result[2]
            while True:
                self.effort = 0.0 if solved * fall < LAST else solved * fall
                result = self.newton(y)
                if result is not None:
                    solved, fall = self.effort, fall**1.5
                    break
                fall = fall**0.5
                if fall > SLOWEST:
                    break
        self.effort = solved
        return None


def best_of(problem: BoundaryProblem, starts: dict[str, Parts]) -> tuple[Parts, int, float]:
    """Return the first result of `newton` that is a minimum; starts: guesses by their names.

    The first start is tried as it is and by continuation in the effort, then each after a descent.
    Raises `NotDecided` with the reason why the first stationary motion is no minimum, or with what
    was tried and how far off the last motion is.
    """
    name, refusal = problem.stages.scene.name, None
    first = next(iter(starts.values()))
    tried_from = [first]

    def after_descent(y: Parts) -> tuple[Parts, int, float] | None:
        problem.effort = 0.0
        tried_from.append(descended(problem, y))
        return problem.newton(tried_from[-1])

    tries = [(problem.newton, first), (problem.by_effort, first)]
    for tried, start in [*tries, *((after_descent, y) for y in starts.values())]:
        result = None
        with suppress(np.linalg.LinAlgError):
            result = tried(start)
        if result is not None:
            try:
                check_bound(name, problem)
                check_steered(name, problem, result[0])
                check_minimum(name, problem)
            except OtherMotion as error:
                refusal = refusal or error
            else:
                return result
    if refusal is not None:
        raise refusal
    problem.effort = 0.0

    def off(y: Parts) -> float:
        *residual, _ = problem.residual(y)
        largest = np.abs(violation(problem, tuple(residual), y[0])).max()
        return float(largest) if np.isfinite(largest) else np.inf

    nearest, change = min(tried_from, key=off), np.inf
    *residual, H = problem.residual(nearest)
    with suppress(np.linalg.LinAlgError):
        change = problem.size(problem.linearised(H)(*residual), nearest)
    check_bound(name, problem)
    check_steered(name, problem, nearest, found=False)
    raise NotDecided(
        f"{name}: no minimum was found, which does not show that there is none: Newton's method "
        f"was begun at {' and at '.join(starts)}, by continuation in the effort and after a "
        f"descent. The nearest motion misses its equations by {off(nearest):.2g} of its size, "
        f"and the next correction is {change:.2g} of it; give a path= near a motion to the end, "
        "another duration or a nearer end."
    )


def solve(
    stages: ControlStages, end: End, duration: Fraction, steps: int, path: Path | None = None,
    near: Optimum | None = None,
) -> Optimum:  # fmt: skip
    """Return the optimum of a control problem (`Control.solve`)."""
    name, at, n, m = stages.scene.name, stages.slices, stages.n, stages.m
    t = np.array([float(duration * k / steps) for k in range(steps + 1)])
    h = float(duration / steps)
    with np.errstate(all="ignore"):
        z0, z1, fixed, guess = first_guess(stages, end, t, path)
        units, cost_unit = units_of(stages, z0, z1, guess, t)
        problem = BoundaryProblem(stages, z0, z1, fixed, h, t[:-1], units, cost_unit)
        guesses = {} if near is None else {"the motion near=": _along_motion(stages, end, t, near)}
        guesses["the path=" if path else "the straight arrow"] = guess
        if end[0] is not None and n:
            with suppress(BadInput):  # a path may lead where no straight arrow does
                guesses["a cubic to the end"] = first_guess(stages, end, t, None, cubic=True)[-1]
        (z, p, v), iterations, correction = best_of(problem, {
            word: tuple(a / units[of] for a, of in zip(guess, (problem.z, problem.p, problem.v),
                                                       strict=True))
            for word, guess in guesses.items()
        })  # fmt: skip
        asked = np.repeat([e is not None for e in end], (n, m))
        off = np.abs((z[-1] - problem.z1)[asked])
        if off.max(initial=0) > 1e-8 * (1 + np.abs(problem.z1).max()):
            missed = (off * units[problem.z][asked]).max()
            raise NotDecided(
                f"{name}: the motion that was found ends {missed:.3g} off the end, in a direction "
                "in which no velocity moves it there: the end may be on another orbit of "
                f"{stages.scene.groupoid.name}; give one that a motion from x0 meets, or a path=."
            )
        rows = problem.rows((z, p, v))
        first = stages(rows[:1], t[:1], h)[0][0, problem.z]
        cost = stages.cost(rows, t[:-1], h)[0].sum()
    if not np.isfinite(cost):
        raise NotDecided(
            f"{name}: the cost is not finite at the motion that was found; give more time, a "
            "nearer end or a path= along which it is finite."
        )
    states = np.vstack([z0, z * units[problem.z]])
    controls = rows[:, at["f"]].reshape(steps, len(stages.places), stages.controls)
    u, costates = rows[:, at["w"]][:, :m], np.vstack([first, p * units[problem.p]])
    control_times = t[:-1, None] + h * np.array(stages.places)
    each = controls.reshape(-1, stages.controls).T
    nodes = np.transpose([_along(t, control_times.ravel(), values) for values in each])
    beside = np.hstack([u[[*range(steps), -1]], nodes])
    try:
        with np.errstate(all="ignore"):
            at_nodes = stages.at_nodes(states[:, :n], states[:, n:], costates[:, n:], t, beside)
    except np.linalg.LinAlgError:
        raise unbound(name) from None
    return Optimum(
        t=t, x=states[:, :n], mu=states[:, n:], u=u, controls=controls, node_controls=at_nodes,
        control_times=control_times, costates=costates,
        cost=float(cost), iterations=iterations, correction=correction,
        scene=stages.scene, rule=stages.rule,
    )  # fmt: skip


def _along_motion(stages: ControlStages, end: End, t: np.ndarray, near: Optimum) -> Parts:
    """Return a start (z, p, v) along an optimum with other steps, by any rule."""

    def at(values: np.ndarray, times: np.ndarray = t[1:]) -> np.ndarray:
        columns = [np.interp(times, near.t, column) for column in values.T]
        return np.reshape(columns, (len(columns), len(times))).T

    path = at(near.x, t)
    *_, (_, _, v) = first_guess(stages, end, t, dict(zip(t, path, strict=True)).__getitem__)
    acted = stages.slices["w"].stop - stages.slices["w"].start
    places = t[:-1, None] + np.diff(t)[:, None] * np.array(stages.places)
    controls = at(near.node_controls, places.ravel()).reshape(len(v), -1)
    v[:, acted : acted + controls.shape[1]] = controls
    return at(np.hstack([near.x, near.mu])), at(near.costates), v


def _along(t: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values at the times t by linear interpolation and extrapolation from given times."""
    if len(times) == 1:
        return np.full(len(t), values[0])
    k = np.clip(np.searchsorted(times, t) - 1, 0, len(times) - 2)
    slopes = np.diff(values)[k] / np.diff(times)[k]
    return np.asarray(values[k] + slopes * (t - times[k]))


# Units of a control problem in which its unknowns, multipliers and cost are near 1.


#: relative to the largest of its kind: if a groupoid mixes components, a smaller number may be the
#: round-off of others (of rates, times the number of steps), so it has no unit of its own
NOISE = 2.0**-20


def units_of(
    stages: ControlStages, z0: np.ndarray, z1: np.ndarray, guess: tuple[Matrix, ...], t: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return (a unit for each letter of ℒ, the unit of the cost): powers of two, for exact scaling.

    Each component of x, μ and the velocity has the size that it has in the first guess. These and
    the duration T determine a unit of force, μ/T divided by the effect of a control of 1, and the
    cost of that; κ·E and p·z are costs. If nothing moves in the guess, velocities are x/T.
    """
    at, n, m = stages.slices, stages.n, stages.m
    z, _, v = guess
    states, T, steps = np.vstack([z0, z, z1]), t[-1], len(t) - 1
    x, u = sizes(states[:, :n]), sizes(v[:, :m])
    if not u.any():
        u = x / T if n == m and x.any() else np.full(m, (x.max(initial=0) or 1.0) / T)
    if not x.any():
        x = u * T if n == m else np.full(n, u.max() * T)
    noise = 0.0 if stages.s.groupoid.canonical else NOISE
    x, u = shared(x, noise), shared(u, noise)
    mu = sizes(states[:, n:])
    if not mu.any():
        moved = stages.along(np.repeat(states[:1, :n], 2, axis=0), np.stack([0 * u, u]), t[[0, 0]])
        mu = sizes(np.diff(moved[0], axis=0))
    mu = shared(mu, noise)
    a = np.zeros((steps, at["p"].stop))
    a[:, at["x"]], a[:, at["mu"]] = states[:-2, :n], states[:-2, n:]
    a[:, at["w"]] = v[:, : at["w"].stop - at["w"].start]
    count = (at["w"].stop - at["w"].start) // m  # u, then each stage
    effects = np.abs(stages.gains(a, t[:-1], T / steps)).max(axis=0, initial=0)
    gains = effects * steps / np.tile(mu, count + 1)[:, None]
    f = np.array([1 / e if 0 < e < np.inf else 1.0 for e in gains.max(axis=0)])
    still = stages.cost(a, t[:-1], T / steps)[0]
    a[:, at["f"]] = f
    whole = stages.cost(a, t[:-1], T / steps)[0]
    cost = shared(sizes((whole - still)[:, None]) or sizes(whole[:, None]), 0)[0]
    x, mu, u, f, cost = map(powers, (x, mu, u, f, cost))
    units = np.ones(at["p"].stop)
    for name, values in {"x": x, "mu": mu, "w": np.tile(u, count), "f": f,
                         "kappa": cost / np.tile(mu, count),
                         "p": cost / np.append(x, mu)}.items():  # fmt: skip
        units[at[name]] = values
    return units, float(cost)


def sizes(columns: np.ndarray) -> np.ndarray:
    """Return the largest finite absolute value of each column, or 0 if there is none."""
    return np.where(np.isfinite(columns), abs(columns), 0).max(axis=0, initial=0)


def shared(values: np.ndarray, noise: float) -> np.ndarray:
    """Return sizes of one kind; those that are 0 or may be noise become the largest."""
    most = values.max(initial=0) or 1.0
    return np.where(values > noise * most, values, most)


def powers(values: Vector) -> Vector:
    """Return the powers of two nearest to positive numbers."""
    return 2.0 ** np.round(np.log2(values))
