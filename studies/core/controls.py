"""Methods that are not symplectic, and structure that is wrong: what the study has to catch.

A bench that never says no proves nothing, so these run beside the real schemes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from discmech.integrators.equations import DiscretisedScene, hamilton_field
from discmech.integrators.flows import Flow
from discmech.integrators.geometry import relative_defect
from discmech.integrators.numbers import arithmetic


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge–Kutta method: a strictly lower triangular, weights b (exact fractions)."""

    a: tuple[tuple[str, ...], ...]
    b: tuple[str, ...]


#: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, II.1
RUNGE_KUTTA = {
    "classical Runge-Kutta": Tableau(
        ((), ("1/2",), ("0", "1/2"), ("0", "0", "1")), ("1/6", "1/3", "1/3", "1/6")
    ),
    "Heun": Tableau(((), ("1",)), ("1/2", "1/2")),
    "explicit Euler": Tableau(((),), ("1",)),
}
DAMPED, FLIPPED = "damped residual", "flipped bracket"
NAMES = (*RUNGE_KUTTA, DAMPED, FLIPPED)
#: the damped residual is F⁻(y, v) = (1 − DAMPING) F⁺(x, u)
DAMPING = "1e-6"


class RungeKutta:
    """A Runge–Kutta step on (x, μ) with its exact derivative, in any arithmetic."""

    def __init__(self, scheme: DiscretisedScene, tableau: Tableau, digits: int) -> None:
        self.numbers = arithmetic(digits)
        self.n, self.size = len(scheme.x), len(scheme.x) + len(scheme.u)
        self.field = hamilton_field(scheme.s, self.numbers)
        with self.numbers.working():
            number = self.numbers.number
            self.p = [number(v) for v in scheme.scene.parameter_values]
            self.near = np.array([number(v) for v in scheme.scene.v0], self.numbers.dtype)
            self.a = [[number(e) for e in row] for row in tableau.a]
            self.b = [number(e) for e in tableau.b]

    def step(self, z: np.ndarray, h: Any) -> tuple[np.ndarray, np.ndarray]:
        """(z′, ∂z′/∂z) for z = (x, μ); derivatives go through the stages by the chain rule."""
        one = self.numbers.identity(self.size)
        slopes: list[np.ndarray] = []
        tangents: list[np.ndarray] = []
        for row in self.a:
            at, along = z, one
            for a, k, dk in zip(row, slopes, tangents, strict=True):
                at, along = at + h * a * k, along + h * a * dk
            f, df = self.field(at[: self.n], at[self.n :], self.p, self.near)
            slopes.append(f)
            tangents.append(df @ along)
        new = z + h * sum(b * k for b, k in zip(self.b, slopes, strict=True))
        return new, one + h * sum(b * dk for b, dk in zip(self.b, tangents, strict=True))


def runge_kutta_defects(flow: Flow, name: str, points: int) -> list[float]:
    """Poisson defects of a Runge–Kutta method along its own trajectory, at the flow's step."""
    numbers, geometry = flow.numbers, flow.geometry
    method = RungeKutta(flow.scheme, RUNGE_KUTTA[name], flow.digits)
    start = flow.trajectory(0)
    defects = []
    with numbers.working():
        h = numbers.number(flow.step)
        z = np.array([numbers.number(e) for e in (*start.x[0], *start.mu[0])], dtype=numbers.dtype)
        for _ in range(points):
            new, m = method.step(z, h)
            if not all(abs(e) < numbers.number(10) ** 100 for e in (*new, *m.ravel())):
                break  # it blows up at this step: there is nothing left to compare
            before = geometry.poisson_tensor(z[: method.n], z[method.n :])
            after = geometry.poisson_tensor(new[: method.n], new[method.n :])
            defects.append(float(relative_defect(m @ before @ m.T, after, m)))
            z = new
    return defects


def damped_defect(flow: Flow, x: Any, u: Any) -> float:
    """Pullback defect of the evolution with F⁻(y, v) = (1 − δ) F⁺(x, u), through its own TΨ."""
    numbers, geometry = flow.numbers, flow.geometry
    with numbers.working():
        kept = 1 - numbers.number(DAMPING)
        x = np.array([numbers.number(e) for e in x], dtype=numbers.dtype)
        u = np.array([numbers.number(e) for e in u], dtype=numbers.dtype)
        here = geometry.at(x, u)
        here = {**here, **{part: kept * here[part] for part in ("plus", "plus_x", "plus_u")}}
        y = here["target"]
        v = flow.inverse_legendre(y, here["plus"] / numbers.number(flow.step))
        there = geometry.at(y, [numbers.number(e) for e in v])
        p = geometry.prolongation(here, there, geometry.tangent(here, there))
        before, after = geometry.omega(here), geometry.omega(there)
        return float(relative_defect(p.T @ after @ p, before, p))
