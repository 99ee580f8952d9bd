"""Energy exchange between the stiff springs of fpu, and its adiabatic invariant over long times."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure, scenes
from discmech.integrators.scenes.fpu import HALF

from ..core.case import scheme_of
from ..evidence.own_rules import WITNESS
from .stiff import FAMILIES

OMEGA = Fraction(50)  # Hairer, Lubich, Wanner, I.5.1
TURNS = 2  # until T = 2ω the first spring passes on most of its energy
SAMPLES = 500
MEAN = 25  # samples: over 5 units of time at ω = 50, 40 periods of a spring
STEPS_OF_Z = tuple(map(Fraction, ("0.1", "0.3", "1", "2.5", "5")))  # hω of the comparison
COARSE = Fraction(5)  # hω at which stiffer springs are compared
STIFFER = tuple(map(Fraction, (50, 100, 200, 500)))
THOROUGH = (*STIFFER, Fraction(1000), Fraction(10_000))
AT = Fraction("0.1")  # hω at which a rule must be right
LONG_Z, LONG_TIME = Fraction(10), 10**5
LONG_OMEGAS = tuple(Fraction(w) for w in (50, 100, 200, 500, 1000))


def spring_energies(run: Any, omega: float) -> np.ndarray:
    """Return ½(μ² + ω²x²) of each stiff spring, (r, HALF)."""
    return np.asarray((run.mu[:, HALF:] ** 2 + omega**2 * run.x[:, HALF:] ** 2) / 2)


def slow_energies(scheme: Scheme, omega: Fraction, z: Fraction) -> tuple[np.ndarray, Fraction]:
    """Return (running means of the springs' energies, the step).

    Means are over MEAN samples up to T = 2ω, long enough for the slow exchange; with the step, hω ≤
    z, samples lie on steps.
    """
    duration = TURNS * omega
    inside = int(-(-duration * omega // (SAMPLES * z)))  # steps from one sample to the next
    step = duration / (SAMPLES * inside)
    run = scheme.flow(step).trajectory(SAMPLES * inside, every=inside)
    energies = spring_energies(run, float(omega))
    means = np.lib.stride_tricks.sliding_window_view(energies, MEAN, axis=0).mean(axis=-1)
    return means, step


@lru_cache(maxsize=8)
def reference(omega: Fraction = OMEGA) -> np.ndarray:
    """Return the springs' slow energies, by a composition of order 8 at hω = 1/4.

    At ω = 50 they are certain to 10⁻⁷, their difference from hω = 1/2; stiffer springs take longer,
    and the soft ones are chaotic meanwhile.
    """
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), WITNESS), omega)
    return slow_energies(scheme, omega, Fraction(1, 4))[0]


def exchange_errors(
    derived: Scheme, omega: Fraction = OMEGA, several: Sequence[Fraction] = STEPS_OF_Z
) -> dict[float, float | None]:
    """Return {hω: the largest error of a spring's slow energy up to T = 2ω}, None for a run that
    stops.

    Errors are relative to the springs' whole energy at the start.
    """
    wanted, errors = reference(omega), dict[float, float | None]()
    scheme = FAMILIES["fpu"].scheme(derived, omega)
    for z in several:
        try:
            energies, step = slow_energies(scheme, omega, z)
        except StepFailure:
            errors[float(z)] = None
        else:
            errors[float(step * omega)] = float(np.abs(energies - wanted).max() / wanted[0].sum())
    return errors


def exchange_when_stiffer(derived: Scheme, thorough: bool) -> dict[float, float | None]:
    """Return {ω: error at hω = COARSE}, to T = 2ω."""
    errors = {float(omega): exchange_errors(derived, omega, [COARSE])
              for omega in (THOROUGH if thorough else STIFFER)}  # fmt: skip
    return {omega: next(iter(entry.values())) for omega, entry in errors.items()}


def adiabatic(derived: Scheme) -> dict[float, float | None]:
    """Return {ω: the largest relative change of the springs' energy over LONG_TIME at hω = LONG_Z}.

    The value of a run that stops is None.
    """
    changes = dict[float, float | None]()
    for omega in LONG_OMEGAS:
        scheme, step = FAMILIES["fpu"].scheme(derived, omega), LONG_Z / omega
        steps = int(LONG_TIME / step)
        try:
            run = scheme.flow(step).trajectory(steps, every=max(1, steps // 100_000))
        except StepFailure:
            changes[float(omega)] = None
        else:
            energies = spring_energies(run, float(omega)).sum(axis=1)
            changes[float(omega)] = float(np.abs(energies / energies[0] - 1).max())
    return changes
