"""Steps that the study has to catch: one loses momentum, one has no multisymplectic law."""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.extensions.lattices import at_ends, of_all
from discmech.integrators.extensions.lattices.dual_step import Covector, DualStep
from discmech.integrators.numbers import Double, jacobian, numeric

from . import DAMPED, FLIPPED, RUNGE_KUTTA

#: the lattice on which each control runs, its rule and step: the Runge–Kutta method breaks the law
#: by h⁵, so its step is long
CONTROLS = {DAMPED: ("rotors", "midpoint", "1/20"), FLIPPED: ("bodies", "trapezoidal", "1/20"),
            RUNGE_KUTTA: ("breather", "midpoint", "1/8")}  # fmt: skip
KEPT = 1 - 1e-6  # share of the momenta that a damped step keeps


class DampedStep(DualStep):
    """A step whose μ′ is a little too small."""

    def __init__(self, flow: Any, x: np.ndarray, mu: np.ndarray) -> None:
        super().__init__(flow, x, mu)
        self.after = self.after[0], KEPT * self.after[1]

    def applied(self, variation: Covector) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the result of a `DualStep`, damped."""
        dx, dmu, dw = super().applied(variation)
        return dx, KEPT * dmu, dw

    def transposed(self, alpha: Covector) -> Covector:
        """Return the result of a `DualStep`, damped."""
        return super().transposed((alpha[0], KEPT * alpha[1]))


class RungeKuttaStep:
    """The classical method of order 4 on a lattice on pairs whose masses do not depend on x.

    The flux through a bond is weighted as the stages are: h Σ b_j δX_j ∧ δF_j.
    """

    def __init__(self, flow: Any, x: np.ndarray, mu: np.ndarray) -> None:
        self.h, self.lattice = float(flow.step), flow.lattice
        scheme, numbers = flow.scheme, Double()
        self.mass = flow.momenta(x, np.ones_like(mu))
        self.maps = []
        for s, p, ends in scheme.terms:
            force = jacobian([s.lagrangian], s.x).T
            letters = {"x": s.x, "p": s.parameter_list}
            f = numeric(letters, [force, jacobian(list(force), s.x)], numbers, columns=True)
            self.maps.append((f, p, ends))
        self.stages: list[tuple[np.ndarray, np.ndarray]] = []
        rates: list[Any] = []
        for share in (0, 1 / 2, 1 / 2, 1):
            dx, dmu = rates[-1] if rates else (0 * x, 0 * mu)
            X, P = x + share * self.h * dx, mu + share * self.h * dmu
            (own, slope), (tie, slopes) = self._forces(X)
            self.stages.append((slope, slopes))
            rates.append((P / self.mass * self._free, (own + self._at_sites(tie)) * self._free))
        self.after = x + self._mean([r[0] for r in rates]), mu + self._mean([r[1] for r in rates])

    @property
    def _free(self) -> np.ndarray:
        return np.asarray(self.lattice.free[:, None])

    def _mean(self, rates: list[np.ndarray]) -> np.ndarray:
        a, b, c, d = rates
        return self.h / 6 * (a + 2 * b + 2 * c + d)

    def _forces(self, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return forces and their slopes of sites, (N, 1) and (N, 1, 1), and of bonds, (B, 2), …"""
        pairs = []
        for f, p, ends in self.maps:
            force, slope = of_all(f, len(ends), *at_ends(ends, x), p)
            pairs.append((force[:, 0].T, np.moveaxis(slope, 2, 0)))
        return pairs

    def _at_sites(self, ties: np.ndarray) -> np.ndarray:
        sums = np.zeros((self.lattice.sites, 1))
        np.add.at(sums, self.lattice.pairs, ties[:, :, None])
        return sums

    def _varied(self, variation: Covector) -> tuple[list[Any], list[Any], list[Any]]:
        """Return rates of a variation, its x, and the forces of bonds on it, at each stage."""
        dx, dmu = variation
        rates: list[Any] = []
        places, ties = [], []
        for share, (slope, slopes) in zip((0, 1 / 2, 1 / 2, 1), self.stages, strict=True):
            before = rates[-1] if rates else (0 * dx, 0 * dmu)
            X, P = dx + share * self.h * before[0], dmu + share * self.h * before[1]
            tie = np.einsum("bij,bj->bi", slopes, X[self.lattice.pairs][:, :, 0])
            force = slope[:, :, 0] * X + self._at_sites(tie)
            places.append(X)
            ties.append(tie)
            rates.append((P / self.mass * self._free, force * self._free))
        return rates, places, ties

    def applied(self, variation: Covector) -> tuple[np.ndarray, np.ndarray, None]:
        """Return the same as a `DualStep`."""
        rates, _, _ = self._varied(variation)
        dx, dmu = (self._mean([r[k] for r in rates]) for k in (0, 1))
        return variation[0] + dx, variation[1] + dmu, None

    def fluxes(self, one: Covector, other: Covector) -> np.ndarray:
        """Return the same as a `DualStep`."""
        (_, X, F), (_, Y, G) = self._varied(one), self._varied(other)
        pairs = self.lattice.pairs
        return self._mean([x[pairs][:, :, 0] * g - y[pairs][:, :, 0] * f
                           for x, f, y, g in zip(X, F, Y, G, strict=True)])  # fmt: skip
