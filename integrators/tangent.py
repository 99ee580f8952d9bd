"""First-order geometry of one step: TΨ, the prolongation PΨ, the Poisson map, and their defects.

All derivatives are exact, from the implicit function theorem; none is a difference quotient.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from .compiling import cached_text, run_text
from .equations import Scheme
from .printing import function_text
from .tables import with_tables

#: what `local` returns, in order; F± and their derivatives are those of L_d, unscaled
_PARTS = (
    "target", "rho", "L", "R", "minus", "plus",
    "target_x", "target_u", "minus_x", "minus_u", "plus_x", "plus_u",
)  # fmt: skip


class LocalGeometry:
    """A scheme's maps and their derivatives as numbers at a point, in one arithmetic."""

    def __init__(self, scheme: Scheme, numbers: Any, q: list[Any]) -> None:
        self.scheme, self.numbers, self.q = scheme, numbers, q
        self.n, self.m = len(scheme.x), len(scheme.u)

    def at(self, x: Any, u: Any) -> dict[str, np.ndarray]:
        """Every part at (x, u): vectors of length n or m, matrices of the shapes they have."""
        shapes = {"target": (self.n,), "rho": (self.n, self.m), "target_x": (self.n, self.n),
                  "target_u": (self.n, self.m), "minus": (self.m,), "plus": (self.m,),
                  "minus_x": (self.m, self.n), "plus_x": (self.m, self.n)}  # fmt: skip
        values = self._local(list(x), list(u), self.q)
        return {
            name: np.array(value, dtype=self.numbers.dtype).reshape(
                shapes.get(name, (self.m, self.m))
            )
            for name, value in zip(_PARTS, values, strict=True)
        }

    def anchor_and_bracket(self, x: Any) -> tuple[np.ndarray, np.ndarray]:
        """ρ̂(x), n×m, and Ĉ as an array [γ, μ, ν], in the natural basis."""
        rho, c = self._natural(list(x), self.q)
        m = self.m
        return (
            np.array(rho, dtype=self.numbers.dtype).reshape(self.n, m),
            np.array(c, dtype=self.numbers.dtype).reshape(m, m, m),
        )

    def poisson_tensor(self, x: Any, mu: Any, bracket_sign: int = 1) -> np.ndarray:
        """Π(x, μ) of {x^i, μ_γ} = ρ̂^i_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ, (n+m)×(n+m)."""
        rho, c = self.anchor_and_bracket(x)
        n, m = self.n, self.m
        tensor = self.numbers.zeros(n + m, n + m)
        tensor[:n, n:] = rho
        tensor[n:, :n] = -rho.T
        tensor[n:, n:] = -bracket_sign * sum((mu[t] * c[t] for t in range(m)), 0 * c[0])
        return tensor

    def tangent(self, here: dict[str, Any], there: dict[str, Any]) -> np.ndarray:
        """TΨ: (δx, δu) ↦ (δy, δv), from F⁻(y, v) = F⁺(x, u), y = b(x, u)."""
        top = np.hstack([here["target_x"], here["target_u"]])
        pushed = np.hstack([here["plus_x"], here["plus_u"]])
        bottom = self.numbers.solve(there["minus_u"], pushed - there["minus_x"] @ top)
        return np.vstack([top, bottom])

    def prolongation(
        self, here: dict[str, Any], there: dict[str, Any], tangent: np.ndarray
    ) -> np.ndarray:
        """PΨ on (a, c), 2m×2m: a* = −c, L(y,v) c* = δv + R(y,v) c, with δx = −ρa, δu = Ra + Lc."""
        n, m = self.n, self.m
        zero, one = self.numbers.zeros(n, m), self._eye(m)
        into = np.vstack([np.hstack([-here["rho"], zero]), np.hstack([here["R"], here["L"]])])
        dv = (tangent @ into)[n:]
        only_c = np.hstack([self.numbers.zeros(m, m), one])
        c_star = self.numbers.solve(there["L"], dv + there["R"] @ only_c)
        return np.vstack([-only_c, c_star])

    def omega(self, here: dict[str, Any]) -> np.ndarray:
        """Ω on (a, c), 2m×2m, with W_γμ = L^θ_μ ∂F⁻_γ/∂u^θ.

        The sign is that of dΘ±, in matrices W = −FLᵀ L:
        [misprint: omega-sign], [misprint: FL-transposed].
        """
        w = here["minus_u"] @ here["L"]
        zero = self.numbers.zeros(self.m, self.m)
        return np.vstack([np.hstack([zero, w]), np.hstack([-w.T, zero])])

    def dual_step(self, here: dict[str, Any], h: Any) -> np.ndarray:
        """Derivative of (x, μ) ↦ (b, F⁺/h) with u from F⁻(x, u) = hμ, (n+m)×(n+m)."""
        n, m = self.n, self.m
        rhs = np.hstack([-here["minus_x"], h * self._eye(m)])
        du = self.numbers.solve(here["minus_u"], rhs)
        base = np.hstack([self._eye(n), self.numbers.zeros(n, m)])
        top = here["target_x"] @ base + here["target_u"] @ du
        bottom = (here["plus_x"] @ base + here["plus_u"] @ du) / h
        return np.vstack([top, bottom])

    def _eye(self, size: int) -> np.ndarray:
        one = self.numbers.zeros(size, size)
        for i in range(size):
            one[i, i] += 1
        return one

    # -- generated functions ----------------------------------------------------------------------

    @cached_property
    def _local(self) -> Any:
        return _generated(self.scheme, self.numbers, "local")

    @cached_property
    def _natural(self) -> Any:
        return _generated(self.scheme, self.numbers, "natural")


@lru_cache(maxsize=512)
def _generated(scheme: Scheme, numbers: Any, what: str) -> Any:
    """`local` or `natural` of a scheme in an arithmetic, derived once and kept on disk."""
    build = {"local": _local_text, "natural": _natural_text}[what]
    text = cached_text(scheme, what, lambda: build(scheme))
    return run_text(text, numbers.namespace())[what]


def _local_text(scheme: Scheme) -> str:
    s = scheme.s
    minus, plus = scheme.minus_at_points, scheme.plus_at_points
    target = scheme.scene.groupoid.target(s.x, s.u, s.h)
    of_target = (target.jacobian(s.x), target.jacobian(s.u)) if len(scheme.x) else ([], [])
    parts = [target, scheme.rho, scheme.L, scheme.R, minus, plus, *of_target]
    parts += [scheme.total_x(minus), scheme.total_u(minus)]
    parts += [scheme.total_x(plus), scheme.total_u(plus)]
    points = [(list(p.z), list(p.value)) for p in scheme.points]
    return _text(scheme, "local", {"x": s.x, "u": s.u}, parts, points)


def _natural_text(scheme: Scheme) -> str:
    s, groupoid = scheme.s, scheme.scene.groupoid
    structure = [c / s.h for c in groupoid.structure_functions(s.x, s.h)]
    parts = [groupoid.rho(s.x, s.h) / s.h, [entry for c in structure for entry in c]]
    return _text(scheme, "natural", {"x": s.x}, parts, [])


def _text(scheme: Scheme, name: str, vectors: dict[str, Any], parts: Any, points: Any) -> str:
    from sympy import Symbol

    numbered = {q: Symbol(f"q{i}", real=True) for i, q in enumerate(scheme.s.q)}
    results = [[e.xreplace(numbered) for e in part] for part in parts]
    before = [(z, [e.xreplace(numbered) for e in values]) for z, values in points]
    arguments = {**vectors, "q": list(numbered.values())}
    return with_tables(function_text(name, arguments, results, before))


def frobenius(matrix: np.ndarray) -> Any:
    """√Σ|entry|², in any arithmetic."""
    return sum(entry * entry for entry in matrix.ravel()) ** 0.5


def relative_defect(pulled: np.ndarray, given: np.ndarray, map_: np.ndarray) -> Any:
    """‖pulled − given‖ / (‖map‖² ‖given‖): a few units of round-off whatever the conditioning."""
    difference = frobenius(pulled - given)
    if difference == 0:
        return difference  # also where there is nothing to keep: Π = 0 on an abelian group
    return difference / (frobenius(map_) ** 2 * frobenius(given))
