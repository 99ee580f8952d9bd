"""The modified energy of a method, along a run: it stays when the energy's own error oscillates.

A symplectic step Φ_h is the flow of a modified energy H̃ = H + O(h^p) except for terms that are
exponentially small in 1/h (Hairer, Lubich, Wanner IX.3). Its vector field is f̃ = (1/h) log Φ_h,
which central differences of 2K + 1 successive states give to the order 2K. If f̃ = B dH̃, B the
Poisson tensor, the change of H̃ along *any* path z(s) of a symplectic leaf, z′ = B α, is

    H̃(z(1)) − H̃(z(0)) = −∫ α·f̃ ds = H(z(1)) − H(z(0)) − ∫ α·(f̃ − f) ds.

So it is measured between the start of a run and any of its later states z_n along the short way
between them, which the run did not take: it is 0 for a sound method, even if only a part of the
motion has come back, and the drift alone for one that loses energy, without the band that hides it.
No formula of the rule is used: only its steps, and B, f and H of the scene.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import factorial, sqrt
from typing import Any

import numpy as np

from discmech.integrators import Scene, Scheme, StepFailure
from discmech.integrators.equations import (
    SceneSymbols,
    energy,
    energy_gradient,
    energy_terms,
    legendre_inverse,
    poisson_tensor,
    rates,
)
from discmech.integrators.errors import DiscmechError
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import arithmetic, numeric, sympy
from discmech.integrators.scene import remembered

from .modified_change import Change

NUMBERS = arithmetic(16)
EPS = 2.0**-53
K = 9  # f̃ from the states z₋₉ … z₉, of order 18
NODES = 16, 32  # intervals of a path; the second if the first is not fine enough
STATES = 16  # states of a run that are compared with its start
# fastest states of a run from which a single step is measured, and as many spread evenly
FASTEST = 12
SHORT = 8  # intervals of the way from there to the next state
SAME = 1e-9  # share of a coordinate's motion by which a run from its own state may differ
#: motions along which means are taken: factor of the scene's duration, and the most steps
TIMES, MOST_STEPS = 16, 50_000
#: share of a step's change of the form by which the step back may miss, and in round-offs
ONE_WAY, ROUNDED = 1e-3, 1024
#: standard deviations within which the farthest point of a walk stays, as for momenta
FARTHEST = 5 / sqrt(3)


class Dual:
    """H, its round-off, f, dH and B of a scene on the dual algebroid, in rows of z = (x, μ)."""

    def __init__(self, s: SceneSymbols, parameters: Sequence[Any], v0: Sequence[Any]) -> None:
        self.n, self.m = len(s.x), len(s.mu)
        self.canonical = s.groupoid.canonical and not s.degenerate
        slope = [e for part in energy_gradient(s) for e in part]
        letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
        values = [[energy(s)], [energy_terms(s)], list(rates(s)), slope]
        bracket = [] if self.canonical else list(poisson_tensor(s, s.x, s.mu))
        # all of it is in the natural basis, free of h; for a wrong groupoid it need not be
        *values, bracket = ([sympy.sympify(e).xreplace({s.h: sympy.Integer(1)}) for e in v]
                            for v in (*values, bracket))  # fmt: skip
        self._at = numeric(letters, values, NUMBERS, columns=True)
        if not self.canonical:  # it needs no velocity
            letters.pop("u")
            self._bracket = numeric(letters, [bracket], NUMBERS, columns=True)
        self._inverse = legendre_inverse(s, NUMBERS)
        self._parameters = [NUMBERS.number(p) for p in parameters]
        self._near = np.array([float(NUMBERS.number(v)) for v in v0])

    def flow(self, scheme: Scheme, step: Any) -> Flow:
        """Return the flow whose steps are looked at."""
        return scheme.flow(step, 16)

    def unit(self, size: np.ndarray) -> np.ndarray:
        """Return the sizes of which coordinates have round-offs: here each its own."""
        return size

    def velocity(self, z: np.ndarray) -> np.ndarray:
        """Return ξ(x, μ) of each row, (r, m)."""
        x, mu = self.split(z)
        start = np.broadcast_to(self._near, mu.shape)
        return np.asarray(self._inverse(x, mu, self._parameters, start))

    def split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x (r, n) and μ (r, m) of rows of z."""
        parts = z[:, : self.n], z[:, self.n :]
        x, mu = (np.ascontiguousarray(part) for part in parts)
        return x, mu

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return H and the sum of its absolute terms (r,), f and dH (r, n+m)."""
        x, mu = self.split(z)
        values = self._at(x.T, self.velocity(z).T, mu.T, self._parameters)
        H, terms, f, slope = (_in_rows(e, len(z)) for e in values)
        return H[:, 0], terms[:, 0], f, slope

    def tensor(self, z: np.ndarray) -> np.ndarray:
        """Return B of each row, (r, n+m, n+m); not on pairs, whose B is constant."""
        x, mu = self.split(z)
        values = _in_rows(self._bracket(x.T, mu.T, self._parameters), len(z))
        return values.reshape(-1, *[self.n + self.m] * 2)

    def poisson(self, z: np.ndarray) -> np.ndarray:
        """Return B of each row, (r, n+m, n+m), on pairs too."""
        if not self.canonical:
            return self.tensor(z)
        one, none = np.eye(self.n), np.zeros((self.n, self.n))
        return np.broadcast_to(
            np.block([[none, one], [-one, none]]), (len(z), 2 * self.n, 2 * self.n)
        )

    def covector(self, z: np.ndarray, v: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Return an α with B(z) α = v, of each row; size: the unit of each coordinate."""
        if self.canonical:
            return np.hstack([-v[:, self.n :], v[:, : self.n]])
        return self._covector(self.tensor(z), v, size)

    def _covector(self, tensor: np.ndarray, v: np.ndarray, size: np.ndarray) -> np.ndarray:
        tensor = tensor / size[:, None] / size
        inverse = np.full_like(tensor, np.nan)  # a state that was not reached has no α
        there = np.isfinite(tensor).all(axis=(1, 2))
        inverse[there] = np.linalg.pinv(tensor[there], rcond=1e-9)
        return np.einsum("rij,rj->ri", inverse, v / size) / size

    def moved(self, z: np.ndarray, v: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Return the part of v that is tangent to the symplectic leaf at z, of each row."""
        tensor = self.tensor(z)
        return np.einsum("rij,rj->ri", tensor, self._covector(tensor, v, size))


def _in_rows(values: Any, rows: int) -> np.ndarray:
    """Return k values that are columns, or constant, as (r, k)."""
    array = np.asarray(values, dtype=float)
    return np.broadcast_to(array.reshape(len(array), -1), (len(array), rows)).T


def has_dual(scene: Scene) -> bool:
    """True if z = (x, μ) is a free state, and the energy need not change.

    Under constraints states are not free, and under a force or in time the energy has to change.
    """
    free = not (scene.all_constraints or scene.timed)
    return free and scene.lagrangian is not None and scene.force is None


@remembered(maxsize=64)
def dual_of(scene: Scene) -> Dual | None:
    """Return `Dual` of a scene; None without free states (`has_dual`)."""
    if not has_dual(scene):
        return None
    return Dual(SceneSymbols(scene), scene.parameter_values, scene.v0)


@dataclass(frozen=True)
class Changes:
    """The change of the modified energy from the start of a run to some of its states.

    times, of_energy (H itself), of_modified (H̃), bounds (of quadrature, differences and
    round-off), round_off (the part of round-off in them), walks (the change of H̃ by single steps
    beyond its series), paths (∫ |α·(f̃ − f)| ds: no H̃ can explain more), forms (the possible
    change of H̃ if the method keeps another form, `_other_form`; 0 unless it was requested), each
    (k,), in units of H.
    """

    times: np.ndarray
    of_energy: np.ndarray
    of_modified: np.ndarray
    bounds: np.ndarray
    round_off: np.ndarray
    walks: np.ndarray
    paths: np.ndarray
    forms: np.ndarray

    def rows(self, scale: float) -> list[Change]:
        """Return one row per state, over a scale of the energy."""
        values = (self.of_energy, self.of_modified, self.bounds, self.round_off, self.walks,
                  self.paths, self.forms)  # fmt: skip
        rows = zip(self.times, *(e / scale for e in values), strict=True)
        return [Change(*map(float, row)) for row in rows]


def changes(
    scheme: Scheme, step: Any, run: Any, done: int, states: int = STATES, form: bool = False,
    dual: Any = None,
) -> Changes | None:  # fmt: skip
    """Return `Changes` of a run that took `done` steps of that size, or None.

    run: a `Trajectory` from the start on; states: how many are compared with the start; form: True
    to seek another form that the method may keep, which costs its derivative. dual: H, f and dH
    of a system that is no scene. None for a scene
    without free states (`dual_of`), and for a method that remembers more than its state. States
    that cannot be reached from the start (a singularity, another leaf) are left out.
    """
    rule = scheme.rule
    able = not rule.is_recorded and rule.unit(16) <= EPS  # it makes its own steps, in doubles
    if dual is None and able:
        dual = dual_of(scheme.scene)
    parts = [np.asarray(part, dtype=float) for part in (run.x, run.mu)]
    times = np.asarray(run.t, dtype=float)
    if (
        dual is None
        or not able
        or len(times) < 2
        or not all(np.isfinite(part).all() for part in parts)
    ):
        return None

    def rows(at: Any) -> np.ndarray:  # a run may have a million states, of which few are used
        return np.hstack([part[at] for part in parts])

    flow = dual.flow(scheme, step)
    with np.errstate(all="ignore"):
        columns = [column for part in parts for column in part.T]
        size = np.array([max(column.max(), -column.min()) for column in columns])
        size = np.where(size > 0, size, size.max() or 1.0)
        moved = np.array([np.ptp(column) for column in columns])
        away = np.zeros(len(times))
        for column, most in zip(columns, moved, strict=True):
            away += ((column - column[0]) / (most or 1.0)) ** 2
        edges = np.unique(np.linspace(1, len(times), states + 1).astype(int))
        chosen = [a + int(away[a:b].argmin()) for a, b in itertools.pairwise(edges)]
        start = rows(slice(1))[0]
        if not _has_no_memory(flow, dual, start):
            return None
        walk = _walk(flow, dual, rows, len(times), moved, size)
        if walk is None:
            return None
        arrays = _along(flow, dual, start, rows(chosen), size, NODES[0])
        coarse = ~(arrays[2] < 1e-3 * np.abs(arrays[0]))  # bounds beside changes of the energy
        if coarse.any():
            again = _along(flow, dual, start, rows(np.array(chosen)[coarse]), size, NODES[1])
            for first, second in zip(arrays, again, strict=True):
                first[coarse] = second
    made = np.maximum(1.0, np.array(chosen) * (done / (len(times) - 1)))
    substeps = max(1, len(scheme.substeps))
    own, rounded, one_way, lost = walk
    walked = FARTHEST * np.sqrt(made)  # the farthest point of so many steps
    round_off = 4 * own + EPS * (walked * rounded * sqrt(substeps) + made * one_way * substeps)
    bounds = arrays[2] + round_off
    forms = np.zeros(len(chosen))
    if form:
        with np.errstate(all="ignore"):
            even = np.unique(np.linspace(0, len(times) - 1, FASTEST).astype(int))
            ways = start, rows(chosen)
            forms = _other_form(flow, dual, rows(even), moved, size, *ways)
    good = np.isfinite(bounds) & np.isfinite(arrays[1])
    if not good.any():
        return None
    parts_of = (times[chosen], arrays[0], arrays[1], bounds, round_off, walked * lost, arrays[3],
                forms)  # fmt: skip
    return Changes(*(part[good] for part in parts_of))


def mean_differences(
    scheme: Scheme, starts: Sequence[Sequence[float]], quantity: Any = None
) -> list[tuple[float, float, float]]:
    """Return (at the scene's step, at half of it, error) of differences of means along motions.

    They are differences between the motion from the first of the starts z = (x, μ) and those from
    each other one, over `TIMES` times the scene's duration: of a quantity of states (r, n + m), or
    of H̃ − H. H̃ is constant along a run, so its mean there is that of −H, and a way from start to
    start joins the two. Values are weighted by a function that is flat at both ends, so that the
    mean of a quasi-periodic motion converges fast; its error is the difference from the mean of
    half the time. Starts whose runs fail are left out.
    """
    dual = dual_of(scheme.scene)
    if dual is None or len(starts) < 2:
        return []
    z0, made = np.array(starts, dtype=float), []
    size = np.abs(z0).max(axis=0)
    size = np.where(size > 0, size, size.max() or 1.0)
    for part in (1, 2):
        step = Fraction(scheme.scene.step) / part
        flow = scheme.flow(step, 16)
        count = min(int(TIMES * scheme.scene.duration / step), MOST_STEPS) + 2 * K
        rows = []
        with np.errstate(all="ignore"):
            for k, at in enumerate(z0):
                z = _states(flow, dual, at[None], count)[0]
                values = -dual(z)[0] if quantity is None else quantity(z)
                between = bound = 0.0
                if quantity is None:
                    values = values - values[K]  # `_along` carries both ends on by K steps
                    if k:
                        arrays = _along(flow, dual, z0[0], at[None], size, NODES[1])
                        between, bound = float(arrays[1][0] - arrays[0][0]), float(arrays[2][0])
                whole, half = map(_smooth_mean, (values, values[: len(values) // 2]))
                rows.append((whole + between, abs(whole - half), bound))
        made.append(np.array(rows))
    told = []
    for k in range(1, len(z0)):
        ends = [rows[k, 0] - rows[0, 0] for rows in made]
        error = max(rows[i, 1] + rows[i, 2] for rows in made for i in (0, k))
        if np.isfinite([*ends, error]).all():
            told.append((float(ends[0]), float(ends[1]), float(error)))
    return told


def _smooth_mean(values: np.ndarray) -> float:
    """Return the mean weighted by exp(−1/(s(1 − s))), s the time as a part of the whole."""
    s = (np.arange(len(values)) + 0.5) / len(values)
    weights = np.exp(-1 / (s * (1 - s)))
    return float(values @ weights / weights.sum())


def _has_no_memory(flow: Flow, dual: Dual, start: np.ndarray) -> bool:
    """Return True if a run continues from its own state as before: no method with memory does."""
    states = _states(flow, dual, start[None], 4)[0]
    beside = states[2] * (1 + 4 * EPS * np.array([[0.0], [1.0], [-1.0]]))
    again, *others = _states(flow, dual, beside, 2)
    rounded = np.abs(np.array(others) - again).max(axis=(0, 1))
    moved = np.ptp(states, axis=0)
    off = np.abs(again - states[2:]).max(axis=0)
    size = dual.unit(np.abs(states).max(axis=0))
    return bool((off <= 4 * rounded + 64 * EPS * size + SAME * moved).all())


def _states(flow: Flow, dual: Dual, starts: np.ndarray, steps: int) -> np.ndarray:
    """Return the states of runs from some starts, (r, steps + 1, n + m); NaN if one fails."""
    runs = np.full((len(starts), steps + 1, dual.n + dual.m), np.nan)
    for k, at in enumerate(starts):
        if not np.isfinite(at).all():
            continue
        x0 = at[: dual.n] if dual.n else None
        try:
            run = flow.trajectory(steps, x0=x0, mu0=at[dual.n :])
        except (StepFailure, DiscmechError):
            continue
        runs[k] = np.hstack([np.asarray(run.x, dtype=float), np.asarray(run.mu, dtype=float)])
    return runs


def _fields(states: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return f̃ at the states in the middle, of order 2K and of order 2K − 2, (r, n + m) each."""
    fields = []
    for k in (K, K - 1):
        total: Any = 0.0
        for j in range(1, k + 1):
            weight = (-1) ** (j + 1) * factorial(k) ** 2 / (j * factorial(k - j) * factorial(k + j))
            total = total + weight * (states[:, K + j] - states[:, K - j])
        fields.append(total / step)
    return fields[0], fields[1]


def _walk(
    flow: Flow, dual: Dual, rows: Callable[[Any], np.ndarray], count: int, moved: np.ndarray,
    size: np.ndarray,
) -> tuple[float, float, float, float] | None:  # fmt: skip
    """Return the largest effects of a step on the measured H̃, at the run's fastest states.

    (round-off of H itself, the effect of one rounding of each coordinate in units of ε in the mean
    square, the common effect of roundings that go one way in each step in units of ε, and the
    change of H̃ in one step: beyond its series, of which a walk remains, no symplectic method
    changes it). One way go a rounded coefficient of a step, and the last rounding of each
    coordinate of a program: a rotation matrix of numbers is not quite orthogonal, and always so.
    """
    some = np.unique(np.linspace(0, count - 1, 4096).astype(int))
    speed = (np.abs(dual(rows(some))[2]) / np.where(moved > 0, moved, np.inf)).max(axis=1)
    fast = some[np.argsort(np.nan_to_num(speed, nan=-1.0))[-FASTEST:]]
    even = np.linspace(0, count - 1, FASTEST).astype(int)
    at = rows(np.union1d(fast, even))
    next_ones = _states(flow, dual, at, 1)[:, 1]
    good = np.isfinite(next_ones).all(axis=1)
    if not good.any():
        return None
    at, next_ones = at[good], next_ones[good]
    _, terms, f, slope, *_ = dual(at)
    rounded = np.sqrt(((slope * at) ** 2).sum(axis=1)).max()
    one_way = abs(float(flow.step)) * np.abs(slope * f).sum(axis=1).max()
    if not flow.scheme.rule.is_formula:
        one_way += np.abs(slope * at).sum(axis=1).max()
    _, lost, _, _ = _along(flow, dual, at, next_ones, size, SHORT)
    lost = np.abs(lost[np.isfinite(lost)]).max(initial=0.0)
    return EPS * float(terms.max()), float(rounded), float(one_way), float(lost)


def _other_form(
    flow: Flow, dual: Dual, at: np.ndarray, moved: np.ndarray, size: np.ndarray,
    start: np.ndarray, ends: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the apparent change of H̃ between the start and each end, if B + E is kept, (k,).

    at: states of the run.

    A method that is conjugate to a symplectic one, as the trapezoidal rule is to the midpoint rule
    (Hairer, Lubich, Wanner VI.8), keeps B + E, and −∫ α·f̃ ds is then off by ∫ α·E B⁻¹f̃ ds. For a
    step with the derivative M, D = M B Mᵀ − B′ is about −h times the rate at which E changes, so
    that |E| is about |D|/(hλ), λ the fastest rate of the motion. A part of the way along f changes
    no H̃ of any form. So if a slow part of the motion goes away, this goes with it; a loss of
    energy goes away by itself alone, of which this is a small part. Only for a method whose step
    back undoes the step: a damped one damps both ways.
    """
    count, steps = dual.n + dual.m, size * EPS ** (1 / 3)
    around = at[:, None] + np.concatenate([np.diag(steps), -np.diag(steps)])
    after = _states(flow, dual, around.reshape(-1, count), 1)[:, 1].reshape(around.shape)
    there = _states(flow, dual, at, 1)[:, 1]
    M = np.swapaxes((after[:, :count] - after[:, count:]) / (2 * steps)[:, None], 1, 2)
    B = [dual.poisson(e) for e in (at, there)]
    D = np.abs(M @ B[0] @ np.swapaxes(M, 1, 2) - B[1])
    back = _states(flow.scheme.flow(-flow.step, 16), dual, there, 1)[:, 1]
    one_way = (np.abs(back - at) / size).max()
    unit = np.outer(size, size)
    of_form = (D / unit).max() / np.abs(B[0] / unit).max()
    if not one_way <= ONE_WAY * of_form + ROUNDED * EPS:
        return np.zeros(len(ends))
    rate = (np.abs(dual(at)[2]) / np.where(moved > 0, moved, np.inf)).max()
    E = np.nanmax(D, axis=0) / (abs(float(flow.step)) * rate)
    *_, f, slope = dual(start[None])[:4]
    way = (ends - start) / size
    along = f[0] / size
    across = (way - np.outer(way @ along / (along @ along), along)) * size
    alpha = np.abs(dual.covector(np.repeat(start[None], len(ends), axis=0), across, size))
    change: np.ndarray = np.nan_to_num(alpha @ E @ np.abs(slope[0]), posinf=0.0)
    return change


def _along(
    flow: Flow, dual: Dual, start: np.ndarray, ends: np.ndarray, size: np.ndarray, nodes: int
) -> list[np.ndarray]:
    """Return (of energy, of modified, bounds, paths) from a state, or one each, to others, (k,)
    each.

    The path is carried along by K steps, which change no H̃, so that f̃ is a central difference.
    """
    at = (1 - np.cos(np.pi * np.arange(nodes + 1) / nodes)) / 2
    paths = _paths(dual, start, ends, size, at)
    shape = paths.shape
    states = _states(flow, dual, paths.reshape(-1, shape[2]), 2 * K)
    middle, h = states[:, K], float(flow.step)
    H, terms, f, *_ = dual(middle)
    slopes = np.einsum("ij,kjl->kil", _derivative(at), middle.reshape(shape))
    alpha = dual.covector(middle, slopes.reshape(middle.shape), size)
    field, before = _fields(states, h)
    rate, last = (-(alpha * e).sum(axis=1).reshape(shape[:2]) for e in (field - f, field - before))
    weights, halves = _weights(at), _weights(at[::2])
    whole = rate @ weights
    levels = H.reshape(shape[:2])
    energy_change = levels[:, -1] - levels[:, 0]
    noise = (np.abs(alpha) * np.abs(middle)).sum(axis=1).reshape(shape[:2]) @ weights / abs(h)
    bounds = (
        np.abs(last) @ weights
        + np.abs(whole - rate[:, ::2] @ halves)
        + 2 * EPS * (noise + terms.reshape(shape[:2]).max(axis=1))
    )
    arrived = (np.abs(paths[:, -1] - ends) / size).max(axis=1) < 1e-6
    bounds[~arrived] = np.inf
    return [energy_change, energy_change + whole, bounds, np.abs(rate) @ weights]


def _paths(
    dual: Dual, start: np.ndarray, ends: np.ndarray, size: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Return paths of a leaf from start, (n + m,) or (k, n + m), to ends: (k, nodes, n + m).

    On pairs they are straight. Otherwise the remaining way is gone as far as the leaf allows, by
    the Runge–Kutta rule; if that does not arrive, the end is on another leaf or too far.
    """
    z = np.broadcast_to(start, ends.shape)
    if dual.canonical:
        return z[:, None, :] + at[None, :, None] * (ends - z)[:, None, :]
    nodes = [z]

    def rate(z: np.ndarray, t: float) -> np.ndarray:
        return dual.moved(z, (ends - z) / (1 - t), size)

    parts = 2
    for first, last in itertools.pairwise(at):
        d = (last - first) / parts
        for k in range(parts):
            t = first + k * d
            if t + d > 1 - 1e-9:  # the remainder, within the last interval's half
                z = z + dual.moved(z, ends - z, size)
                continue
            a = rate(z, t)
            b = rate(z + d / 2 * a, t + d / 2)
            c = rate(z + d / 2 * b, t + d / 2)
            e = rate(z + d * c, t + d)
            z = z + d / 6 * (a + 2 * b + 2 * c + e)
        nodes.append(z)
    close = (np.abs(nodes[-1] - ends) / size).max(axis=1) < 1e-3  # except for the quadrature of it
    nodes[-1] = np.where(close[:, None], ends, nodes[-1])
    return np.stack(nodes, axis=1)


def _derivative(at: np.ndarray) -> np.ndarray:
    """Return the matrix from values at nodes to the derivatives of their polynomial there."""
    gaps = at[:, None] - at + np.eye(len(at))
    size = np.prod(gaps, axis=1)
    matrix = size[:, None] / size / gaps
    np.fill_diagonal(matrix, 0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return np.asarray(matrix)


def _weights(at: np.ndarray) -> np.ndarray:
    """Return weights of the quadrature that is exact for polynomials on these nodes of [0, 1]."""
    degrees = np.arange(len(at))
    values = np.polynomial.chebyshev.chebvander(2 * at - 1, len(at) - 1)
    even = degrees % 2 == 0
    integrals = np.where(even, 1.0 / (1.0 - np.where(even, degrees, 0) ** 2), 0.0)
    return np.asarray(np.linalg.solve(values.T, integrals))
