"""Runs that several studies need: long ones kept at intervals, and the largest stable step."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.equations import (
    DiscretisedScene,
    SceneSymbols,
    absolute_terms,
    energy,
    energy_terms,
    legendre_inverse,
)
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import Flow, Trajectory
from discmech.integrators.numbers import Arithmetic, Double, arithmetic, mpmath, numeric
from discmech.integrators.scene import Scene

from ..core.case import Case, Progress
from .moving_energy import moving_energy

if TYPE_CHECKING:
    pass

MOST_ROWS = 10**6
FAR = 4  # an error of so many times the sum of the energy's terms at the start is an escape
COLUMN = 2**14  # rows that are evaluated at once
#: flights, the longest of a run under contact, and the steps of the shortest one
FLIGHTS, SHORTEST = 2, 8
UNDER_CONTACT = 4096  # most steps of a run under contact, where each impact is found in Python


def interval(steps: int) -> int:
    """Return k so that every k-th row is kept: all of a million, so memory stays bounded."""
    return -(-steps // MOST_ROWS) if steps > MOST_ROWS else 1


#: the latest run, for the study that asks for the same one next; only one, for it is large
_latest: dict[tuple[Any, ...], Trajectory] = {}


def long_run(case: Case, scheme: Scheme, steps: int, progress: Progress) -> Trajectory:
    """Return `steps` steps at the scene's step, up to a million rows kept, with progress.

    Of recorded runs it is one of them (`recorded_run`). The latest run is returned again, once: so
    that of momentum serves energy too. Raises `CannotMeasure` if the motion itself leaves every
    bound (`follow`).
    """
    if (recorded := recorded_run(case)) is not None:
        return recorded
    key = (scheme, case.scene.step, steps, case.digits)
    latest = _latest.pop(key, None)
    _latest.clear()  # before the next run needs the memory
    if latest is not None:
        return latest
    flow = scheme.flow(case.scene.step, case.digits)
    label = f"{case.scene.name} {case.label}"

    def show(done: int) -> None:
        progress(f"{label}: {done} of {steps} steps", done / steps)

    run = follow(case, flow, steps, interval(steps), progress=show)
    if not float(_growth(run, slice(-1, None))[0]) < BEYOND:
        _refuse_unbounded(case, flow, run)
    _latest[key] = run
    return run


def follow(case: Case, flow: Flow, steps: int, *how: Any, **also: Any) -> Trajectory:
    """Return flow.trajectory(steps, ...); raises `CannotMeasure` if the motion itself ends.

    A geodesic that runs to the boundary ends; a method that fails on a bounded motion is raised as
    its own `StepFailure`.
    """
    try:
        return flow.trajectory(steps, *how, **also)
    except StepFailure as failure:
        if failure.trajectory is not None:
            _refuse_unbounded(case, flow, failure.trajectory)
        raise


# factors of its size at the start: the motion grows, it ends out of bounds
GROWN, ESCAPED = 1e3, 1e6
BEYOND = 1e100  # a run that ends beyond this is near to overflow
ALIKE = 0.1  # relative difference of runs of two step sizes that grow alike
#: rows from GROWN to ESCAPED of which one is a part of about ALIKE; in fewer any two runs agree
RESOLVED = 5


def _growth(run: Trajectory, rows: slice = slice(None)) -> np.ndarray:
    """Return per row the largest entry of x, or of μ, over the largest of the first hundredth."""
    growth = np.ones(len(run.t[rows]))
    for part in (run.x, run.mu):
        start, sizes = (_largest(np.abs(np.asarray(part[which], dtype=float)))
                        for which in (slice(1 + len(part) // 100), rows))  # fmt: skip
        first = start.max()
        growth = np.maximum(growth, sizes / first if first else growth)
    return growth


def _largest(rows: np.ndarray) -> np.ndarray:
    """Return the largest entry ≥ 0 of each row; by columns, of which there are few."""
    return reduce(np.maximum, rows.T, np.zeros(len(rows), rows.dtype))


def _refuse_unbounded(case: Case, flow: Flow, run: Trajectory) -> None:
    """Raise `CannotMeasure` if a run ended because the motion, not the method, is unbounded.

    It grew to ESCAPED times its size, and a run of half the step is in the same place where this
    one was GROWN times, or takes as long from GROWN to ESCAPED: out of an unstable equilibrium the
    time of leaving is given by round-off, and the speed by the motion. An unstable method grows
    differently at another step.
    """
    growth = _growth(run) if len(run.t) > 1 else np.zeros(1)
    if not np.nanmax(growth) >= ESCAPED:
        return
    row = int(np.argmax(growth >= GROWN))
    apart = float(run.t[1] - run.t[0])
    every = round(apart / float(flow.step))
    half = flow.scheme.flow(flow.step / 2, case.digits)
    rows = min(len(run.t) - 1, 2 * int(np.argmax(growth >= ESCAPED)))
    try:
        other = half.trajectory(2 * every * rows, 2 * every)
    except StepFailure as failure:
        if failure.trajectory is None:
            return
        other = failure.trajectory
    grown = _growth(other) if len(other.t) > 1 else np.zeros(1)
    alike = row < len(other.t) and _same_place(run, other, row)
    if not alike:
        if not np.nanmax(grown) >= ESCAPED:
            return
        lengths = [int(np.argmax(g >= ESCAPED) - np.argmax(g >= GROWN)) for g in (growth, grown)]
        if min(lengths) < RESOLVED or not abs(lengths[0] - lengths[1]) <= 1 + ALIKE * lengths[0]:
            return
    raise CannotMeasure(
        f"{case.scene.name}: a run of {case.label} leaves every bound: at t = "
        f"{float(run.t[row]):.4g} it is {growth[row]:.2g} times its size at the start, and a run "
        f"of half the step grows alike; it ended at t = {float(run.t[-1]):.4g}. If the motion "
        "itself leaves, take fewer --steps; if it stays, the method follows another motion, which "
        "`discmech order` shows."
    )


def _same_place(run: Trajectory, other: Trajectory, row: int) -> bool:
    """True if two runs are in one place in that row, to a share of its size."""
    for name in ("x", "mu"):
        here, there = (np.asarray(getattr(r, name)[row], dtype=float) for r in (run, other))
        size = np.abs(here).max(initial=0)
        if not np.abs(here - there).max(initial=0) <= ALIKE * size:
            return False
    return True


def recorded_run(case: Case) -> Trajectory | None:
    """Return the run that stands for long ones if runs were recorded.

    It is that of the third smallest step: what a method loses grows faster with the step than the
    band in which a sound one varies, and hides in it at the smallest.
    """
    return case.scheme.runs[-3:][0] if case.rule.is_recorded else None


def usual_steps(case: Case, claimed: bool = True) -> int:
    """Return the steps of a long run in double precision: a million for a formula.

    For a program it is the number that it can make soon, or the scene's duration if nothing is
    claimed; and under contact that duration, up to `UNDER_CONTACT` steps.
    """
    if case.scene.contact is not None:
        return min(UNDER_CONTACT, int(case.scene.steps_for(case.scene.step)))
    if case.rule.is_formula:
        return 10**6
    if not claimed:
        return int(case.scene.steps_for(case.scene.step))
    long_run: int = getattr(case.rule, "long_run", 10**6)
    return long_run


def flights(scene: Scene, run: Any) -> list[Scene]:
    """Return the scene without its contact, begun at its longest flights, each as long as that.

    run: one under its contact: without, the motion from its start may go where the scene never is.
    With explicit time only the start's own flight is known: a scene begins at t = 0.
    """
    free = scene.with_values(contact=None)
    struck = [-1, *np.flatnonzero(abs(run.impulses).any(axis=(1, 2))), len(run.t) - 1]
    lengths = sorted(((b - a, a + 1) for a, b in itertools.pairwise(struck) if b - a > SHORTEST),
                     reverse=True)  # fmt: skip
    if scene.timed:
        lengths = [flight for flight in lengths if flight[1] == 0]
    n, pieces = len(scene.x0), []
    for count, k in lengths[:FLIGHTS]:
        start = {} if k == 0 else {"x0": [*map(float, run.base[k][:n])],
                                   "v0": [*map(float, run.u[k])]}  # fmt: skip
        pieces.append(free.with_values(duration=(count - 1) * scene.step, **start))
    return pieces or [free]


Rows = Callable[[Trajectory], tuple[np.ndarray, np.ndarray]]


def with_terms(scheme: DiscretisedScene, entries: Any, digits: int) -> Rows:
    """Return a function of a run: (components, sums of absolute terms) of a quantity, (r, k) each.

    entries: those of the quantity, in x, μ and the parameters.
    """
    numbers = arithmetic(digits)
    f = of_states(scheme.s, list(entries), list(map(absolute_terms, entries)), numbers)
    return lambda run: in_rows(scheme, f, run, numbers)


def energy_with_terms(scheme: DiscretisedScene, digits: int) -> Rows:
    """Return a function of a run that gives, per row, H and the sum of its absolute terms, (r, 1)
    each.

    H = ⟨μ, ξ⟩ − l(x, ξ), where ξ solves μ = ∂l/∂ξ(x, ξ), for any regular Lagrangian.
    """
    if scheme.scene.in_numbers:
        return lambda run: _energy_in_numbers(scheme, run)
    numbers = arithmetic(digits)
    f, inverse = _energy(scheme.s, numbers), legendre_inverse(scheme.s, numbers)
    return lambda run: in_rows(scheme, f, run, numbers, inverse)


def _energy_in_numbers(scheme: Any, run: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return H of a scene in numbers, per row, and |H| + |p·∂H/∂p|, a lower bound of its terms."""
    system = scheme.flow(scheme.scene.step).system
    values = np.array([system.H(x, mu) for x, mu in zip(run.x, run.mu, strict=True)])[:, None]
    moved = np.abs((run.mu * run.u).sum(axis=1))[:, None]
    return values, np.abs(values) + moved


@lru_cache(maxsize=256)
def _energy(s: SceneSymbols, numbers: Arithmetic) -> Any:
    return of_states(s, [energy(s)], [energy_terms(s)], numbers)


def of_states(s: SceneSymbols, values: list[Any], terms: list[Any], numbers: Arithmetic) -> Any:
    """Return f(x, ξ, μ, parameters) → (values, terms), x with its time; columns in doubles."""
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return numeric(letters, [values, terms], numbers, columns=isinstance(numbers, Double))


def in_rows(
    scheme: DiscretisedScene, f: Any, run: Any, numbers: Arithmetic, inverse: Any = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return f in every row of a run; with ξ(x, μ) if the inverse Legendre map is given."""
    double = isinstance(numbers, Double)

    def of(column: Any) -> np.ndarray:
        if double:
            return np.asarray(column, dtype=float)
        entries = [numbers.number(e) for e in np.ravel(column)]
        return np.array(entries, dtype=object).reshape(np.shape(column))

    with numbers.working():
        p = [numbers.number(v) for v in scheme.scene.parameter_values]
        x, mu = of(getattr(run, "base", run.x)), of(run.mu)
        start: Any = None
        if inverse is not None:  # u is near to ξ; states that another method made have none
            near = getattr(run, "u", None)
            start = np.broadcast_to(of(scheme.scene.v0), mu.shape) if near is None else of(near)
        if not double:
            xi = mu if inverse is None else inverse(x, mu, p, start)
            pairs = [f(*at, p) for at in zip(x, xi, mu, strict=True)]
            return np.array([v for v, _ in pairs]), np.array([t for _, t in pairs])
        columns: list[np.ndarray] = []
        for first in range(0, max(1, len(mu)), COLUMN):  # as many rows as fit a processor's cache
            at = slice(first, first + COLUMN)
            b, m = (np.ascontiguousarray(e[at].T) for e in (x, mu))
            entries = f(b, m if inverse is None else inverse(x[at], mu[at], p, start[at]).T, m, p)
            columns = columns or [np.empty((len(e), len(mu))) for e in entries]
            for whole, e in zip(columns, entries, strict=True):
                whole.T[at] = e.T
        values, terms = columns
    return values.T, terms.T


def relative_drifts(pair: tuple[np.ndarray, np.ndarray], digits: int) -> np.ndarray:
    """Return per row the largest |J − J₀| over the components, over their largest absolute terms'
    sum.

    `pair` is the result of `with_terms`. The sum is that row's or the start's, whichever is
    larger, so that terms that grow later hide nothing.
    """
    values, terms = pair
    with arithmetic(digits).working():
        columns = (abs(column - column[0]) for column in values.T)
        drifts = reduce(np.maximum, columns, np.zeros(len(values), values.dtype))
        scale = np.maximum(_largest(terms), terms[0].max())
        if digits == 16:  # all rows at once
            return np.divide(drifts, scale, out=np.zeros_like(drifts), where=drifts != 0)
        return np.array([float(d / s) if d else 0.0 for d, s in zip(drifts, scale, strict=True)])


def energy_errors(scheme: DiscretisedScene, run: Trajectory, digits: int = 16) -> np.ndarray:
    """Return (H − H₀)/scale per row, signed; scale: the energy that moves (`moving_energy`).

    If nothing moves it is the sum of absolute terms of H at the start.
    """
    if digits < 16:  # of states in single precision the energy is computed in double
        names = ("x", "u", "mu", "base")
        wide = {name: getattr(run, name).astype(float) for name in names}
        digits, run = 16, replace(run, **wide)
    values, terms = energy_with_terms(scheme, digits)(run)
    scale = moving_energy(scheme.scene) or float(terms[0].max()) or 1.0
    with arithmetic(digits).working():
        errors = values[:, 0]
        errors -= errors[0]
        errors /= arithmetic(digits).number(scale)
        return np.asarray(errors, dtype=float)


def bins(length: int, most: int) -> list[tuple[int, int]]:
    """Return up to `most` stretches [first, last) of about equal length over range(length)."""
    edges = np.unique(np.linspace(0, length, min(length, most) + 1).astype(int)).tolist()
    return list(itertools.pairwise(edges))


def largest_stable_step(scheme: Scheme, steps: int = 200) -> Fraction:
    """Return the largest of step·2^k, k ≤ 6, at which a short run has bounded energy.

    Bounded: the error stays below a quarter of the largest sum of the energy's absolute terms, and
    below FAR times the sum at the start, for terms that grow without end would hide it.
    """
    step = Fraction(scheme.scene.step)
    while not _stable(scheme.flow(step), steps) and step > Fraction(scheme.scene.step) / 1024:
        step /= 2
    while step < 64 * scheme.scene.step and _stable(scheme.flow(2 * step), steps):
        step *= 2
    return step


def _stable(flow: Flow, steps: int) -> bool:
    try:
        run = flow.trajectory(steps)
    except StepFailure:
        return False
    if not all(np.isfinite(part).all() for part in (run.x, run.mu)):
        return False
    values, terms = energy_with_terms(flow.scheme, flow.digits)(run)
    with np.errstate(all="ignore"):
        error = np.abs(values - values[0]).max()
    return bool(error < terms.max() / 4 and error < FAR * (terms[0, 0] or np.inf))


def gap(got: Any, wanted: Any) -> tuple[Any, Any]:
    """Return (‖got − wanted‖₂, ‖wanted‖₂) in mpmath."""
    exact = [mpmath.mpf(w) for w in wanted]
    off = [mpmath.mpf(g) - w for g, w in zip(got, exact, strict=True)]
    nothing = mpmath.mpf(0)
    return (mpmath.norm(off, 2), mpmath.norm(exact, 2)) if exact else (nothing, nothing)
