"""Linear stability: the exact step of a rule on ẍ = −ω²x, as a function of z = hω."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure, scenes
from discmech.integrators.numbers import LazyModule, sympy
from discmech.integrators.rules import Discretisation

from ..core.case import scheme_of
from .trace import DIGITS, StableSet, stable_set

FARTHEST = 1000.0  # as far as z = hω is looked at
GRID = np.concatenate([np.arange(0.02, 8.0, 0.02), np.geomspace(8.0, FARTHEST, 120)])
ON_CIRCLE = 1e-9  # eigenvalues this near to the unit circle are on it, off an interval's ends
LAST_BITS = {"xtol": 1e-15, "rtol": 2.0**-50}
Step = Callable[[float], np.ndarray]
optimize: Any = LazyModule("scipy.optimize")


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues of a step matrix at z: spectral radius, phase, Krein signature.

    krein: the sign of v̄ᵀJv/i for the eigenvalue e^{iφ} with 0 < φ < π (Krein, Gelfand, Lidskii;
    Hairer, Lubich, Wanner, XV.2); 0 where the eigenvalues are real.
    """

    z: float
    radius: float
    phase: float
    krein: int
    determinant: float

    @classmethod
    def of(cls, z: float, matrix: np.ndarray) -> Spectrum:
        """From a 2×2 matrix in (x, μ)."""
        values, vectors = np.linalg.eig(matrix)
        k = int(np.argmax(values.imag))
        v, krein = vectors[:, k], 0
        if values[k].imag > 0:
            turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
            krein = int(np.sign((v.conj() @ turn @ v / 1j).real))
        radius = float(np.abs(values).max())
        return cls(z, radius, float(np.angle(values[k])), krein, float(np.linalg.det(matrix)))


class Oscillator:
    """A rule on the oscillator with ω = 1: its step matrix at any z, and runs that really go.

    The columns of the matrix are two runs of one step, exact as the step is linear. A rule that
    splits has the whole spring as its fast part, but for the share `slow`.
    """

    def __init__(self, rule: Discretisation, slow: Fraction = Fraction(0)) -> None:
        scene = scenes.get("harmonic")
        if rule.splits:
            fast = sympy.Rational(1 - slow)
            scene = replace(scene, fast=lambda x, p: fast * p.stiffness * x[0] ** 2 / 2)
        self.scheme: Scheme = scheme_of(scene, rule)
        self._matrices: dict[float, np.ndarray] = {}

    def matrix(self, z: float) -> np.ndarray:
        """M(z) in (x, μ), 2×2; each made once, for all that is asked goes along one grid."""
        if z not in self._matrices:
            columns = [self._end(z, 1, x0, mu0) for x0, mu0 in ((1.0, 0.0), (0.0, 1.0))]
            self._matrices[z] = np.array(columns).T
        return self._matrices[z]

    def trace(self, z: Fraction) -> Any:
        """tr M(z) to `DIGITS`."""
        flow = self.scheme.flow(z, DIGITS)
        across = flow.trajectory(1, x0=[1], mu0=[0]).x[-1, 0]
        return across + flow.trajectory(1, x0=[0], mu0=[1]).mu[-1, 0]

    def proved(self) -> StableSet | None:
        """Where the step is stable, at every z up to FARTHEST; None if only a grid can tell."""
        try:
            return stable_set(self.trace, FARTHEST)
        except StepFailure:
            return None

    def grows(self, z: float, steps: int = 10**5) -> bool:
        """Whether that many steps make more than 10³ of a start of size 1."""
        try:
            return not max(map(abs, self._end(z, steps, 0.6, 0.8))) < 1e3
        except StepFailure:
            return True

    def _end(self, z: float, steps: int, x0: float, mu0: float) -> list[float]:
        run = self.scheme.flow(z).trajectory(steps, every=steps, x0=[x0], mu0=[mu0])
        return [float(run.x[-1, 0]), float(run.mu[-1, 0])]


def spectra(step: Step) -> list[Spectrum]:
    """Along the grid."""
    return [Spectrum.of(float(z), step(float(z))) for z in GRID]


def off_circle(found: list[Spectrum], end: float) -> float | None:
    """The first z below `end` with an eigenvalue off the unit circle: no symplectic step."""
    off = (s.z for s in found if s.z < end and abs(s.radius - 1) > ON_CIRCLE)
    return next(off, None)


def unstable_intervals(step: Step) -> list[tuple[float, float]]:
    """Open intervals of z up to FARTHEST where |tr M| > 2, each end found by Brent's method.

    A map with det M = 1 is stable where |tr M| < 2. Between grid points the largest |tr M| is
    looked for as well, so that narrow intervals are found; the last end may be FARTHEST.
    """

    def excess(z: float) -> float:
        return abs(float(np.trace(step(z)))) / 2 - 1

    points = sorted({*map(float, GRID), *_peaks(excess)})
    values = [excess(z) for z in points]
    ends = [0.0] if values[0] > 0 else []
    for (a, before), (b, after) in pairwise(zip(points, values, strict=True)):
        if (before > 0) is not (after > 0):
            ends.append(optimize.brentq(excess, a, b, **LAST_BITS))
    if len(ends) % 2:
        ends.append(FARTHEST)
    return list(zip(ends[::2], ends[1::2], strict=True))


def _peaks(excess: Callable[[float], float]) -> Iterator[float]:
    """Where |tr M| is largest beside grid points at which it is large."""
    values = [excess(float(z)) for z in GRID]
    for i in range(1, len(GRID) - 1):
        if -0.02 < values[i] < 0 and values[i] >= max(values[i - 1], values[i + 1]):
            found = optimize.minimize_scalar(
                lambda z: -excess(z), bounds=(GRID[i - 1], GRID[i + 1]), method="bounded",
                options={"xatol": 1e-9},
            )  # fmt: skip
            # at a double root |tr M| = 2 is only touched, and round-off decides the sign
            if -found.fun > 1e-12:
                yield float(found.x)


def resonances(step: Step) -> dict[str, float | None]:
    """The first z at which the phase of a step is 2π/3 and 2π/4 (tr M = −1 and 0); None if never.

    There nonlinear terms of the second and third degree add up from step to step.
    """

    def above(z: float, level: float) -> float:
        return float(np.trace(step(z))) - level

    found: dict[str, float | None] = {}
    for name, level in (("1:3", -1.0), ("1:4", 0.0)):
        pairs = pairwise((float(z), above(float(z), level)) for z in GRID)
        ends = [[a, b] for (a, before), (b, after) in pairs if before > 0 >= after]
        found[name] = optimize.brentq(above, *ends[0], (level,), **LAST_BITS) if ends else None
    return found
