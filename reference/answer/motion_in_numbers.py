"""Short pieces of motion of a scene in numbers from any state, as `Surroundings` has of formulas.

A state has the digits of doubles, v is μ, and the way to an end has those in which an extrapolation
over the whole and one over its halves agree. Outside the domain of the user's functions, as beyond
the end of a table, where they raise or are not finite, there is no motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from scipy.integrate import solve_ivp

from ..failures import ReferenceFailure
from .in_numbers import SMALLEST, TOLERANCE, extrapolated_step, field_anywhere
from .local_motion import ExactState

ROWS = 256  # states of a motion, and the relative tolerance of its rough run
ROUGH = 1e-9
ROUNDED = 2.0**-52  # relative round-off of the way to an end


class SurroundingsInNumbers:
    """`Surroundings` of a scene whose Hamiltonian is a function of numbers."""

    def __init__(self, scene: Any) -> None:
        self.key = repr((scene.name, scene.x0, scene.mu0, scene.step, scene.duration))
        self._scene, self._field = scene, field_anywhere(scene)

    def momentum(self, x: Sequence[Any], v: Sequence[Any], t: Fraction, digits: int) -> list[Any]:
        """Return μ (m), which stands in the place of v."""
        return list(v)

    def along(self, duration: Fraction) -> list[tuple[Fraction, list[Any], list[Any]]]:
        """Return (t, x, μ) of the scene's own motion to a few digits, until it leaves the domain of
        the user's functions.
        """
        times = [duration * k / ROWS for k in range(ROWS + 1)]
        z, at = self._state(self._scene.x0, self._scene.mu0), [float(t) for t in times]
        least = ROUGH * np.abs(z).max()
        run = solve_ivp(self._field, (0.0, at[-1]), z, "DOP853", at, rtol=ROUGH, atol=least)
        return [(t, *self._parts(z)) for t, z in zip(times, run.y.T, strict=False)]

    def length(self, x: Sequence[Any], v: Sequence[Any], t: Fraction) -> Fraction | None:
        """Return the time in which one extrapolation gives the motion to round-off; None at rest.

        It ends near a knot of a spline, beyond which the motion is another polynomial. Raises
        `ReferenceFailure` outside the domain of the user's functions.
        """
        z, span = self._state(x, v), Fraction(self._scene.duration)
        least = SMALLEST * span
        while span > least:
            way, off = self._way(z, float(span))
            if off.max() <= TOLERANCE * (np.abs(z).max() + np.abs(way).max()):
                return span if way.any() else None
            span /= 2
        raise ReferenceFailure(f"scene {self._scene.name} has no motion at such a state")

    def after(
        self, x: Sequence[Any], v: Sequence[Any], t: Fraction, steps: Sequence[Fraction],
        digits: int,
    ) -> list[ExactState]:  # fmt: skip
        """Return the states at t + h for each h of the steps, with their errors.

        Raises `ReferenceFailure` where one leaves the domain of the user's functions.
        """
        z, states = self._state(x, v), []
        for h in steps:
            way, off = self._way(z, float(h))
            if not np.isfinite(off).all():
                raise ReferenceFailure(f"scene {self._scene.name} has no motion from such a state")
            moved = zip(*map(self._parts, (z, way, off)), strict=True)
            (at, off_x), (mu, off_mu) = (
                ([a + b for a, b in zip(start, more, strict=True)], error)
                for start, more, error in moved
            )
            states.append(ExactState(at, mu, mu, off_x, off_mu))
        return states

    def _way(self, z: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return (how far z moves in a time, its error).

        The error is not finite outside the domain of the user's functions.
        """
        whole, half = (extrapolated_step(self._field, 0.0, z, span)[0] for span in (h, h / 2))
        way = half + extrapolated_step(self._field, 0.0, z + half, h / 2)[0]
        return way, np.abs(whole - way) + ROUNDED * np.abs(way)

    def _state(self, x: Sequence[Any], v: Sequence[Any]) -> np.ndarray:
        return np.array([float(e) for e in (*x, *v)])

    def _parts(self, z: np.ndarray) -> tuple[list[Any], list[Any]]:
        entries, n = [mpmath.mpf(float(e)) for e in z], self._scene.groupoid.dim_x
        return entries[:n], entries[n:]
