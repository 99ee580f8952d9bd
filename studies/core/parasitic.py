"""Parasitic modes: what a discrete Lagrangian makes of one that is linear in the velocity.

The motion of ϑ(x)·v − H(x) is of first order, and the discrete Euler–Lagrange equations of a
discrete Lagrangian of it have two steps. So half of their solutions are none of the motion: they
alternate from step to step, and may grow (Rowley, Marsden 2002; Ellison et al. 2018). They are seen
in what μ is off ϑ(x), which the motion never is.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.numbers import arithmetic, numeric

from .case import Case
from .outcome import named

STEPS = 64
DIGITS = 30  # of the runs, in which no round-off is in the way
ROUND_OFF = 10.0 ** (5 - DIGITS)  # of the largest momentum


def parasitic(case: Case) -> dict[str, Any] | None:
    """The cause and its sentence, where μ leaves ϑ(x) in steps of a discrete Lagrangian."""
    scheme = case.scheme
    if case.control is not None or scheme.arrows is None:
        return None
    if not getattr(scheme.s, "degenerate", False):
        return None
    step = Fraction(case.scene.step)
    try:
        gaps, size = gaps_of(scheme, step, STEPS)
    except StepFailure:
        return None
    largest = np.abs(gaps).max(axis=1)
    if not largest.max() > ROUND_OFF * size:
        return None
    changes = np.diff(gaps, axis=0)
    turns = np.einsum("ki,ki->k", changes[:-1], changes[1:]) < 0
    evidence = {
        "first": float(largest[1]), "largest": float(largest.max()),
        "turns": float(np.mean(turns)),
    }  # fmt: skip
    return named(
        "parasitic modes",
        "the Lagrangian is linear in the velocity, so the discrete Euler–Lagrange equations have "
        f"two steps where the motion has one: μ leaves ϑ(x) by {evidence['first']:.2g} in one step "
        f"of {float(step):.3g} and by up to {evidence['largest']:.2g} in {STEPS}, to and fro in "
        f"{100 * evidence['turns']:.0f} % of the steps; take projected-gauss-1, or "
        "degenerate-gauss-1 where half of ϑ vanishes.",
        evidence,
    )


def gaps_of(scheme: Scheme, step: Fraction, steps: int) -> tuple[np.ndarray, float]:
    """Return μ − ϑ(x) along a run, (steps + 1, n), and the largest |μ|."""
    s, numbers = scheme.s, arithmetic(DIGITS)
    run = scheme.flow(step, DIGITS).trajectory(steps)
    theta = numeric({"x": s.x, "p": s.parameter_list}, [list(s.one_form)], numbers)
    with numbers.working():
        p = [numbers.number(e) for e in scheme.scene.parameter_values]
        rows = [[a - b for a, b in zip(map(numbers.number, mu), theta(list(
            map(numbers.number, x)), p), strict=True)]
            for x, mu in zip(run.x, run.mu, strict=True)]  # fmt: skip
        gaps = np.array([[float(e) for e in row] for row in rows])
        return gaps, float(abs(run.mu).max())
