"""The general discrete evolution operator through bisections (paper, section 4.2).

Arrows near g₀ are g = L_Σ(g_W), near h₀ they are h = R_Υ(h_W), with g_W = (x, u) and h_W = (y, v)
near the identities; (g, h) is composable iff y = b(x, u). The equations are

    e←_γ(g_W)(L_d∘L_Σ) = e→_γ(h_W)(L_d∘R_Υ)

This is the theory's form, evaluated as it stands: gradients of L_d pushed through T L_Σ and T R_Υ.
Runs use `integrators.bisections.edge_policies`: there a bisection of a group is a parameter of the
kernels.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ..errors import BadInput
from ..flows.scheme import Scheme
from ..numbers.differentiation import jacobian
from ..numbers.newton import newton
from ..numbers.numeric import numeric
from .bisection import Bisection

Arrow = tuple[np.ndarray, np.ndarray]


class GeneralOperator:
    """Ψ from near g₀ (on Σ = sigma) to near h₀ (on Υ = upsilon), and its inverse Ξ.

    Of several solutions it finds the one near the bisection, as in the theorem. Arrows are written
    in the groupoid's own chart, so L_d may be given on the group too: any element of that chart.
    Raises `BadInput` for bisections of another groupoid, step or number of digits.
    """

    def __init__(self, scheme: Scheme, sigma: Bisection, upsilon: Bisection, step: Any) -> None:
        self.scheme, self.sigma, self.upsilon = scheme, sigma, upsilon
        self.flow = scheme.flow(step, sigma.numbers.digits)
        for bisection in (sigma, upsilon):
            same = (bisection.step, bisection.numbers) == (self.flow.step, sigma.numbers)
            if bisection.groupoid is not scheme.scene.groupoid or not same:
                raise BadInput(
                    f"{scheme.scene.name}: a bisection is of another groupoid, step or number of "
                    "digits; take both through arrows of this scheme's groupoid at this step."
                )
        self.numbers = self.flow.numbers
        self.n, self.m = len(scheme.x), len(scheme.u)

    def plus(self, x: Any, u: Any) -> np.ndarray:
        """e←_γ(L_d∘L_Σ) at g_W = (x, u), m."""
        at = self.flow.geometry.at(x, u)
        d = self._gradient(*self.sigma.left(x, u)) @ self.sigma.left_tangent(x, u)
        return np.asarray(at["L"].T @ d[self.n :])

    def minus(self, y: Any, v: Any) -> np.ndarray:
        """e→_γ(L_d∘R_Υ) at h_W = (y, v), m."""
        at = self.flow.geometry.at(y, v)
        d = self._gradient(*self.upsilon.right(y, v)) @ self.upsilon.right_tangent(y, v)
        return np.asarray(at["R"].T @ d[self.n :] - at["rho"].T @ d[: self.n])

    def residual(self, x: Any, u: Any, v: Any) -> np.ndarray:
        """The equations at g_W = (x, u), h_W = (b(x, u), v), m."""
        return self.plus(x, u) - self.minus(self._target(x, u), v)

    def FL(self, y: Any, v: Any) -> np.ndarray:
        """(FL)^γ_μ = −∂/∂v^γ e→_μ(L_d∘R_Υ) at h_W = (y, v), row γ, m×m."""
        return -self._minus_slope(y, v).T

    def barred_FL(self, y: Any, v: Any) -> np.ndarray:
        """The same of (Implicit2): −∂/∂v̄^γ of −e←_μ(L_d∘L_Σ) in (x̄, ū) = (x, u)∘i, m×m.

        At g_W = i(y, v̄), where v̄ = v: the β-fibre over y. It decides whether F⁺ is regular at
        g = L_Σ(g_W) [misprint: implicit2].
        """
        return self._plus_slope(y, v).T

    def evolve(self, x: Any, u: Any) -> Arrow:
        """Ψ: the h = (y, w) that follows g = (x, u); raises `BadInput` if Newton finds none."""
        with self.numbers.working():
            x, u = self.flow._vectors(x, u)
            near, w = self.sigma.without_left(x, u)
            y, wanted = self._target(near, w), self.plus(near, w)

            def change(v: np.ndarray) -> np.ndarray:
                gap = wanted - self.minus(y, v)
                return np.asarray(self.numbers.solve(self._minus_slope(y, v), gap))

            starts = [0 * w, *self._written(lambda: self.upsilon.without_right(y, u)[1])]
            return self._public(self.upsilon.right(y, self._solved(change, starts)))

    def devolve(self, y: Any, v: Any) -> Arrow:
        """Ξ: the g = (x, u) that h = (y, v) follows, solved in (x̄, ū)."""
        with self.numbers.working():
            y, v = self.flow._vectors(y, v)
            _, w = self.upsilon.without_right(y, v)
            wanted = self.minus(y, w)

            def change(bar: np.ndarray) -> np.ndarray:
                gap = wanted - self.plus(*self._inverse(y, bar))
                return np.asarray(self.numbers.solve(self._plus_slope(y, bar), gap))

            found = self._solved(change, [0 * w])
            return self._public(self.sigma.left(*self._inverse(y, found)))

    # -- inner ----------------------------------------------------------------------------------

    def _solved(self, change: Any, starts: list[np.ndarray]) -> np.ndarray:
        """By Newton from the bisection, which is 0; else from the other starts."""
        for start in starts:
            found = newton(change, start, 1, self.numbers.eps)
            if found is not None:
                return found
        raise BadInput(
            f"{self.scheme.scene.name}: no solution was found near the bisections; take them "
            "through arrows nearer to the solution, or a smaller step."
        )

    @staticmethod
    def _written(last: Any) -> list[np.ndarray]:
        """The last arrow in the coordinates of the bisection, where it has any."""
        try:
            return [np.asarray(last())]
        except BadInput:
            return []

    def _minus_slope(self, y: Any, v: Any) -> np.ndarray:
        """∂/∂v of `minus`: F⁻ at h has the same value, and R_Υ keeps y."""
        slope = self.flow.geometry.at(*self.upsilon.right(y, v))["minus_u"]
        return np.asarray(slope @ self.upsilon.right_tangent(y, v)[self.n :, self.n :])

    def _plus_slope(self, y: Any, bar: Any) -> np.ndarray:
        """∂/∂v̄ of `plus` at i(y, v̄)."""
        near = self._inverse(y, bar)
        at = self.flow.geometry.at(*self.sigma.left(*near))
        tangent = self.sigma.left_tangent(*near) @ self._inverse_tangent(y, bar)
        return np.hstack([at["plus_x"], at["plus_u"]]) @ tangent

    def _inverse(self, y: Any, bar: Any) -> Arrow:
        """i(y, v̄) = (b, ι) in coordinates."""
        x, u, *_ = self._inversion(y, bar, self.flow._h)
        return x, u

    def _inverse_tangent(self, y: Any, bar: Any) -> np.ndarray:
        """∂/∂v̄ of i(y, v̄), (n+m)×m."""
        return np.vstack(self._inversion(y, bar, self.flow._h)[2:])

    def _target(self, x: Any, u: Any) -> np.ndarray:
        return np.asarray(self.flow.geometry.at(x, u)["target"])

    def _gradient(self, x: Any, u: Any) -> np.ndarray:
        return np.asarray(self._derivatives(x, u, self.flow._q))

    def _public(self, arrow: Arrow) -> Arrow:
        return self.numbers.public(arrow[0]), self.numbers.public(arrow[1])

    @cached_property
    def _derivatives(self) -> Any:
        """(∂L_d/∂x, ∂L_d/∂u) of L_d written out in (x, u)."""
        s, L_d = self.scheme.s, self.scheme.discrete_lagrangian
        gradient = [L_d.diff(w) for w in (*s.x, *s.u)]
        return numeric({"x": s.x, "u": s.u, "q": s.q}, [gradient], self.numbers)

    @cached_property
    def _inversion(self) -> Any:
        """(b, ι, ∂b/∂u, ∂ι/∂u) of the inverse arrow."""
        groupoid = self.scheme.scene.groupoid
        s = groupoid._symbols
        x, u, h = s["x"], s["u"], s["h"]
        b, iota = groupoid.target(x, u, h), groupoid.inversion(x, u, h)
        results = [list(b), list(iota), jacobian(b, u), jacobian(iota, u)]
        return numeric({"x": x, "u": u, "h": h}, results, self.numbers)
