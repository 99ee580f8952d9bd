"""Runs that several studies make: long ones kept at intervals, and the largest stable step."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.equations import DiscretisedScene, SceneSymbols, energy, state_function
from discmech.integrators.flows import Flow, Trajectory
from discmech.integrators.numbers import Double, arithmetic

from .case import Case, Progress

MOST_ROWS = 10**6


def interval(steps: int) -> int:
    """Each how-many-th row is kept: all of a million, so memory stays bounded."""
    return -(-steps // MOST_ROWS) if steps > MOST_ROWS else 1


def long_run(case: Case, scheme: Scheme, steps: int, progress: Progress) -> Trajectory:
    """`steps` steps at the scene's step, up to a million rows kept, with progress."""
    flow = scheme.flow(case.scene.step, case.digits)
    label = f"{case.scene.name} {case.label}"

    def show(done: int) -> None:
        progress(f"{label}: {done} steps", done / steps)

    return flow.trajectory(steps, interval(steps), progress=show)


Rows = Callable[[Trajectory], tuple[np.ndarray, np.ndarray]]


def with_terms(scheme: DiscretisedScene, quantity: Any, digits: int) -> Rows:
    """A function of a run that gives, per row, a quantity's components and their sums of
    absolute terms, (r, k) each."""
    from sympy import Abs, Add

    entries = list(quantity) if hasattr(quantity, "shape") else [quantity]
    entries = [scheme.s.scalar(e, "conserved quantity").expand() for e in entries]
    sums = [Add(*[Abs(t) for t in Add.make_args(e)]) for e in entries]
    numbers = arithmetic(digits)
    with numbers.working():
        p = [numbers.number(v) for v in scheme.scene.parameter_values]
        double = isinstance(numbers, Double)
        f = state_function(scheme.s, [entries, sums], numbers, columns=double)

    def all_at_once(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
        with numbers.working():
            values, terms = f(run.x.T, run.mu.T, p)
        shape = (len(run.t), len(entries))
        return np.broadcast_to(values.T, shape), np.broadcast_to(terms.T, shape)

    def row_by_row(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
        with numbers.working():
            rows = [
                f([numbers.number(e) for e in x], [numbers.number(e) for e in mu], p)
                for x, mu in zip(run.x, run.mu, strict=True)
            ]
        return np.array([v for v, _ in rows]), np.array([t for _, t in rows])

    return all_at_once if double else row_by_row


def relative_drifts(found: tuple[np.ndarray, np.ndarray], digits: int) -> np.ndarray:
    """Per row: largest |J − J₀| over the components, over their largest sum of absolute terms.

    `found` is what `with_terms` gives. The sum is that row's or the start's, whichever is larger:
    terms that grow later hide nothing.
    """
    values, terms = found
    with arithmetic(digits).working():
        drifts = np.abs(values - values[0]).max(axis=1)
        scale = np.maximum(terms.max(axis=1), terms[0].max())
        if digits == 16:  # all rows at once
            return np.divide(drifts, scale, out=np.zeros_like(drifts), where=drifts != 0)
        return np.array([float(d / s) if d else 0.0 for d, s in zip(drifts, scale, strict=True)])


def energy_errors(scheme: DiscretisedScene, run: Trajectory, digits: int = 16) -> np.ndarray:
    """(H − H₀)/scale per row, signed; scale is the largest sum of absolute terms of H."""
    values, terms = with_terms(scheme, _energy(scheme.s), digits)(run)
    with arithmetic(digits).working():
        errors = values[:, 0] - values[0, 0]
        return np.asarray(errors / terms.max() if terms.max() else errors, dtype=float)


@lru_cache(maxsize=256)
def _energy(s: SceneSymbols) -> Any:
    return energy(s)


def bins(length: int, most: int) -> list[tuple[int, int]]:
    """At most `most` stretches [first, last) of about equal length that cover range(length)."""
    edges = np.unique(np.linspace(0, length, min(length, most) + 1).astype(int)).tolist()
    return list(itertools.pairwise(edges))


def largest_stable_step(scheme: Scheme, steps: int = 200) -> Fraction:
    """The largest of step·2^k, k ≤ 6, at which a short run goes through with bounded energy.

    Bounded: the error stays below a quarter of the sum of the energy's absolute terms.
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
    errors = energy_errors(flow.scheme, run)
    return bool(np.isfinite(errors).all() and np.abs(errors).max() < 0.25)
