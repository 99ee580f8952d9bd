"""Energy exchange between the stiff springs of fpu, and its adiabatic invariant over long times."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from integrators import Scheme, StepFailure, scenes, trapezoidal
from integrators.scenes.fpu import HALF

from .case import scheme_of
from .stiff import FAMILIES

OMEGA = Fraction(50)  # Hairer, Lubich, Wanner, I.5.1
DURATION = 100  # the first spring has handed most of its energy on, and chaos is not yet seen
SAMPLES = 500
MEAN = 25  # samples: over 5 units of time, 40 periods of a spring
STEPS_OF_Z = tuple(map(Fraction, ("0.1", "0.3", "1", "2.5", "5")))  # hω of the comparison
RIGHT = 0.1  # of all the springs' energy: an exchange nearer than that is the right one
LONG_Z, LONG_TIME = Fraction(10), 10**5
LONG_OMEGAS = tuple(Fraction(w) for w in (50, 100, 200, 500, 1000))


def spring_energies(run: Any, omega: float) -> np.ndarray:
    """½(μ² + ω²x²) of each stiff spring, (r, HALF)."""
    return np.asarray((run.mu[:, HALF:] ** 2 + omega**2 * run.x[:, HALF:] ** 2) / 2)


def slow_energies(run: Any) -> np.ndarray:
    """Their running means over MEAN samples: what the slow exchange is seen in."""
    energies = spring_energies(run, float(OMEGA))
    return np.lib.stride_tricks.sliding_window_view(energies, MEAN, axis=0).mean(axis=-1)


@lru_cache(maxsize=1)
def reference() -> tuple[np.ndarray, float]:
    """The springs' slow energies, and how far they are certain.

    By Störmer–Verlet at three small steps, hω = 0.005 the smallest, extrapolated in h²: what is
    left is less than the difference of the two extrapolations.
    """
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), trapezoidal), OMEGA)
    found = []
    for inside in (500, 1000, 2000):
        step = Fraction(DURATION, SAMPLES * inside)
        found.append(slow_energies(scheme.flow(step).trajectory(SAMPLES * inside, every=inside)))
    coarse, fine = ((4 * b - a) / 3 for a, b in pairwise(found))
    return fine, float(np.abs(fine - coarse).max())


def exchange_errors(derived: Scheme) -> list[dict[str, Any]]:
    """Rows {z, step, error, cause}: the largest error of a spring's slow energy over DURATION,
    relative to all their energy at the start."""
    wanted, _ = reference()
    scheme = FAMILIES["fpu"].scheme(derived, OMEGA)
    rows = []
    for z in STEPS_OF_Z:
        inside = -(-DURATION * OMEGA // (SAMPLES * z))  # steps from one sample to the next
        step = Fraction(DURATION, SAMPLES * inside)
        row: dict[str, Any] = {"z": float(step * OMEGA), "step": float(step), "cause": ""}
        try:
            run = scheme.flow(step).trajectory(SAMPLES * int(inside), every=int(inside))
            gap = np.abs(slow_energies(run) - wanted).max()
            row["error"] = float(gap / wanted[0].sum())
        except StepFailure as failure:
            row |= {"error": None, "cause": failure.cause}
        rows.append(row)
    return rows


def adiabatic(derived: Scheme) -> list[dict[str, Any]]:
    """Rows {omega, z, time, change, cause}: the largest relative change of the springs' energy over
    LONG_TIME at hω = LONG_Z, ω by ω."""
    rows = []
    for omega in LONG_OMEGAS:
        scheme, step = FAMILIES["fpu"].scheme(derived, omega), LONG_Z / omega
        steps = int(LONG_TIME / step)
        row: dict[str, Any] = {"omega": float(omega), "z": float(LONG_Z), "cause": ""}
        try:
            run = scheme.flow(step).trajectory(steps, every=max(1, steps // 100_000))
            energies = spring_energies(run, float(omega)).sum(axis=1)
            row |= {"time": float(run.t[-1]),
                    "change": float(np.abs(energies / energies[0] - 1).max())}  # fmt: skip
        except StepFailure as failure:
            row |= {"time": failure.time, "change": None, "cause": failure.cause}
        rows.append(row)
    return rows
