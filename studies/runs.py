"""Runs that several studies make: long ones kept at intervals, and the largest stable step."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from integrators import Scheme, StepFailure
from integrators.arithmetic import arithmetic
from integrators.continuous import energy, state_function
from integrators.flow import Flow, Trajectory

from .case import Case, Progress


def long_run(case: Case, scheme: Scheme, steps: int, rows: int, progress: Progress) -> Trajectory:
    """`steps` steps at the scene's step, about `rows` rows kept, with progress."""
    flow = scheme.flow(case.scene.step, case.digits)
    label = f"{case.scene.name} {case.label}"

    def show(done: int) -> None:
        progress(f"{label}: {done} steps", done / steps)

    return flow.trajectory(steps, every=max(1, steps // rows), progress=show)


def term_sums(scheme: Scheme, quantity: Any, digits: int) -> Any:
    """f(x, μ) → (values, sums of absolute terms) of a column of expressions."""
    from sympy import Abs, Add

    entries = list(quantity) if hasattr(quantity, "shape") else [quantity]
    entries = [scheme.s.scalar(e, "conserved quantity").expand() for e in entries]
    sums = [Add(*[Abs(t) for t in Add.make_args(e)]) for e in entries]
    numbers = arithmetic(digits)
    f = state_function(scheme.s, [entries, sums], numbers)
    with numbers.working():
        p = [numbers.number(v) for v in scheme.s.parameter_values]

    def evaluate(x: Any, mu: Any) -> tuple[list[Any], list[Any]]:
        with numbers.working():
            values, terms = f([numbers.number(e) for e in x], [numbers.number(e) for e in mu], p)
        return list(values), list(terms)

    return evaluate


def relative_drifts(scheme: Scheme, quantity: Any, run: Trajectory, digits: int) -> list[float]:
    """Per row: largest |J − J₀| over the components, over the largest sum of absolute terms."""
    evaluate = term_sums(scheme, quantity, digits)
    rows = [evaluate(x, mu) for x, mu in zip(run.x, run.mu, strict=True)]
    scale = max(max(terms) for _, terms in rows)
    first = rows[0][0]
    if scale == 0:
        return [0.0 for _ in rows]
    return [
        float(max(abs(v - w) for v, w in zip(values, first, strict=True)) / scale)
        for values, _ in rows
    ]


def energy_errors(scheme: Scheme, run: Trajectory) -> np.ndarray:
    """(H − H₀)/scale per row, signed; scale is the largest sum of absolute terms of H."""
    evaluate = term_sums(scheme, energy(scheme.s), 16)
    rows = [evaluate(x, mu) for x, mu in zip(run.x, run.mu, strict=True)]
    values = np.array([v[0] for v, _ in rows])
    return (values - values[0]) / max(t[0] for _, t in rows)


def largest_stable_step(scheme: Scheme, steps: int = 200) -> Fraction:
    """The largest of step·2^k at which a short run goes through with bounded energy.

    Bounded: the energy stays within its own size. At most 64 times the scene's step.
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
