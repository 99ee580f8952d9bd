"""Linear stability: the exact step of a rule on ẍ = −ω²x, as a function of z = hω."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from discmech.integrators import Scheme, StepFailure, scenes
from discmech.integrators.numbers import LazyModule, mpmath, sympy
from discmech.integrators.rules import Discretisation

from ..core.case import scheme_of
from .records import FARTHEST
from .trace import DIGITS, StableSet, stable_set

GRID = np.concatenate([np.arange(0.02, 8.0, 0.02), np.geomspace(8.0, FARTHEST, 120)])
#: round-off of det M, over its own terms and those of a step, in double precision: some thousand
#: roundings of entries and stages
ROUND_OFF = 2.0**-40
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
        """Return the spectrum of a 2×2 matrix in (x, μ)."""
        values, vectors = np.linalg.eig(matrix)
        k = int(np.argmax(values.imag))
        v, krein = vectors[:, k], 0
        if values[k].imag > 0:
            turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
            krein = int(np.sign((v.conj() @ turn @ v / 1j).real))
        radius = float(np.abs(values).max())
        return cls(z, radius, float(np.angle(values[k])), krein, float(np.linalg.det(matrix)))


class Oscillator:
    """A rule on the oscillator with ω = 1: its step matrix at any z, and real runs.

    The columns of the matrix are two runs of one step, exact as the step is linear. A rule that
    splits has the whole spring as its fast part, except for the share `slow`.
    """

    def __init__(self, rule: Discretisation, slow: Fraction = Fraction(0)) -> None:
        scene = scenes.get("harmonic")
        if rule.splits:
            fast = sympy.Rational(1 - slow)
            scene = replace(scene, fast=lambda x, p: fast * p.stiffness * x[0] ** 2 / 2)
        self.scheme: Scheme = scheme_of(scene, rule)
        self._matrices: dict[float, np.ndarray] = {}
        self.areas: list[float] = []

    def matrix(self, z: float) -> np.ndarray:
        """Return M(z) in (x, μ), 2×2; each is kept, for all questions are on one grid."""
        if z not in self._matrices:
            columns = [self._end(z, 1, x0, mu0) for x0, mu0 in ((1.0, 0.0), (0.0, 1.0))]
            self._matrices[z] = np.array(columns).T
        return self._matrices[z]

    def trace(self, z: Fraction) -> Any:
        """Return tr M(z) to `DIGITS`; `areas` gets |det M − 1| over its terms."""
        flow = self.scheme.flow(z, DIGITS)
        first, second = (flow.trajectory(1, x0=[x0], mu0=[1 - x0]) for x0 in (1, 0))
        with mpmath.workdps(DIGITS):
            one, other = first.x[-1, 0] * second.mu[-1, 0], first.mu[-1, 0] * second.x[-1, 0]
            self.areas.append(float(abs(one - other - 1) / (abs(one) + abs(other) + 1)))
        return first.x[-1, 0] + second.mu[-1, 0]

    def proved(self) -> StableSet | None:
        """Return the stable z up to FARTHEST, every one; None if only a grid can tell."""
        try:
            return stable_set(self.trace, FARTHEST)
        except StepFailure:
            return None

    def off_circle(self, end: float, proved: bool) -> float | None:
        """Return the first z below `end` where det M is not 1, so the step is not symplectic, or
        None.

        proved: the trace is a rational function; then det M = 1 at all points that showed it, to
        half of their digits, is the identity. Otherwise det M has to be 1 to the round-off of M.
        """
        if proved and max(self.areas, default=0.0) <= 10.0 ** (-DIGITS // 2):
            return None
        off = (float(z) for z in GRID if z < end and self._changes_area(float(z)))
        return next(off, float(GRID[0]) if proved else None)

    def _changes_area(self, z: float) -> bool:
        (a, b), (c, d) = self.matrix(z)
        # a step adds up x, hv and h²a, the last (hω)² times as large as x
        terms = (abs(a * d) + abs(b * c) + 1) * max(1.0, z**2)
        return bool(abs(a * d - b * c - 1) > ROUND_OFF * terms)

    def grows(self, z: float, steps: int = 10**5) -> bool:
        """True if that many steps enlarge a start of size 1 more than 10³ times.

        x and μ are in units in which a stable step turns a circle: it keeps cx² + (d − a)xμ − bμ²,
        whose ellipse may be long and oblique. Of a step without an ellipse only the axes count.
        """
        (a, b), (c, d) = self.matrix(z)
        half = (d - a) / 2
        area = -b * c - half**2
        if not area > 0:
            half, area = 0.0, abs(b * c) or 1.0
        long = np.sqrt((abs(c) or 1.0) / np.sqrt(area))
        circle = np.array([[long, half * np.sign(c) / np.sqrt(area) / long], [0.0, 1 / long]])
        try:
            end = circle @ self._end(z, steps, *np.linalg.solve(circle, (0.6, 0.8)))
        except StepFailure:
            return True
        return not np.linalg.norm(end) < 1e3

    def _end(self, z: float, steps: int, x0: float, mu0: float) -> list[float]:
        run = self.scheme.flow(z).trajectory(steps, every=steps, x0=[x0], mu0=[mu0])
        return [float(run.x[-1, 0]), float(run.mu[-1, 0])]


def spectra(step: Step) -> list[Spectrum]:
    """Return the spectra along the grid."""
    return [Spectrum.of(float(z), step(float(z))) for z in GRID]


def unstable_intervals(step: Step) -> list[tuple[float, float]]:
    """Return open intervals of z up to FARTHEST where |tr M| > 2, each end found by Brent's method.

    A map with det M = 1 is stable where |tr M| < 2. The largest |tr M| between grid points is
    sought as well, to find narrow intervals; the last end may be FARTHEST.
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
    """Yield the z where |tr M| is largest beside grid points at which it is large."""
    values = [excess(float(z)) for z in GRID]
    for i in range(1, len(GRID) - 1):
        if -0.02 < values[i] < 0 and values[i] >= max(values[i - 1], values[i + 1]):
            peak = optimize.minimize_scalar(
                lambda z: -excess(z), bounds=(GRID[i - 1], GRID[i + 1]), method="bounded",
                options={"xatol": 1e-9},
            )  # fmt: skip
            # at a double root |tr M| only touches 2, and round-off decides the sign
            if -peak.fun > 1e-12:
                yield float(peak.x)


def resonances(step: Step) -> dict[str, float | None]:
    """Return the first z at which a step's phase is 2π/3 and 2π/4 (tr M = −1 and 0); None if never.

    There nonlinear terms of the second and third degree add up from step to step.
    """

    def above(z: float, level: float) -> float:
        return float(np.trace(step(z))) - level

    crossings: dict[str, float | None] = {}
    for name, level in (("1:3", -1.0), ("1:4", 0.0)):
        pairs = pairwise((float(z), above(float(z), level)) for z in GRID)
        ends = [[a, b] for (a, before), (b, after) in pairs if before > 0 >= after]
        crossings[name] = optimize.brentq(above, *ends[0], (level,), **LAST_BITS) if ends else None
    return crossings
