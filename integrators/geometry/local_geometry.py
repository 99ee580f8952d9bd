"""First-order geometry of one step: TΨ, the prolongation PΨ, the Poisson map, and their defects.

All derivatives are exact, from the implicit function theorem; none is a difference quotient.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ..compiler import cached_text, text_key
from ..equations.discrete_equations import DiscreteEquations
from ..equations.step_system import step_system
from ..numbers.interpreting import run_text
from ..numbers.lazy import sympy
from ..numbers.multi_output import with_tables
from ..numbers.printing import function_text

#: what `local` returns, in order; F± and their derivatives are those of L_d, unscaled
_PARTS = (
    "target", "rho", "L", "R", "minus", "plus",
    "target_x", "target_u", "minus_x", "minus_u", "plus_x", "plus_u",
)  # fmt: skip
#: with internal stages s also these, from which the derivatives above follow s = s(x, u)
_OF_STAGES = ("minus_s", "plus_s", "stages_x", "stages_u", "stages_s")


class StagesNotFound(ArithmeticError):
    """Newton did not find the internal stages of an arrow."""


def newton(
    change: Callable[[np.ndarray], np.ndarray], start: np.ndarray, scale: Any, eps: Any
) -> np.ndarray | None:
    """Newton from `start` to round-off, `change` giving the correction; None if it is not reached.

    It ends when a correction is round-off of the solution (or of `scale`), or when corrections
    near it no longer halve.
    """
    point, before = start, None
    for _ in range(60):
        try:
            step = change(point)
        except (ArithmeticError, ValueError):  # Python's own functions outside their domain
            return None
        point = point + step
        size = sum(abs(c) for c in step)
        unit = eps * max(scale, sum(abs(c) for c in point))
        if size <= 4 * unit or (before is not None and size >= before / 2 and size < 2**12 * unit):
            return point
        before = size
    return None


class LocalGeometry:
    """A scheme's maps and their derivatives as numbers at a point, in one arithmetic."""

    def __init__(self, scheme: DiscreteEquations, numbers: Any, q: list[Any]) -> None:
        self.scheme, self.numbers, self.q = scheme, numbers, q
        self.n, self.m, self.k = len(scheme.x), len(scheme.u), len(scheme.s.stages)

    def at(self, x: Any, u: Any) -> dict[str, np.ndarray]:
        """Every part at (x, u): vectors of length n or m, matrices of the shapes they have.

        Internal stages are solved for, and derivatives are along ∂L_d/∂s = 0 (Schur complements).
        Raises `StagesNotFound` if Newton from s = 0 does not converge.
        """
        n, m, k = self.n, self.m, self.k
        shapes = {"target": (n,), "rho": (n, m), "target_x": (n, n), "target_u": (n, m),
                  "minus": (m,), "plus": (m,), "minus_x": (m, n), "plus_x": (m, n),
                  "minus_s": (m, k), "plus_s": (m, k),
                  "stages_x": (k, n), "stages_u": (k, m), "stages_s": (k, k)}  # fmt: skip
        x, u = list(x), list(u)
        values = self._local(x, u, self.stages(x, u), self.q)
        parts = {
            name: np.array(value, dtype=self.numbers.dtype).reshape(shapes.get(name, (m, m)))
            for name, value in zip((*_PARTS, *(_OF_STAGES if k else ())), values, strict=True)
        }
        if k:
            follow = np.hstack([parts.pop("stages_x"), parts.pop("stages_u")])
            follow = -self.numbers.solve(parts.pop("stages_s"), follow)
            for map_ in ("minus", "plus"):
                through = parts.pop(f"{map_}_s")
                parts[f"{map_}_x"] = parts[f"{map_}_x"] + through @ follow[:, :n]
                parts[f"{map_}_u"] = parts[f"{map_}_u"] + through @ follow[:, n:]
        return parts

    def stages(self, x: Any, u: Any) -> list[Any]:
        """The s with ∂L_d/∂s (x, u, s) = 0, by Newton from 0; an empty list without stages."""
        if not self.k:
            return []
        start = self.numbers.zeros(self.k)

        def change(s: np.ndarray) -> np.ndarray:
            values, slope = self._stages(list(x), list(u), list(s), self.q)
            matrix = np.array(slope, dtype=self.numbers.dtype).reshape(self.k, self.k)
            return -self.numbers.solve(matrix, np.array(values, dtype=self.numbers.dtype))

        scale = sum(abs(e) for e in u)
        found = newton(change, start, scale, self.numbers.eps)
        if found is None:
            raise StagesNotFound
        return list(found)

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
        return _generated(self.scheme.origin, self.numbers, "local")

    @cached_property
    def _stages(self) -> Any:
        return _generated(self.scheme.origin, self.numbers, "stages")

    def branch(self, x: Any, u: Any) -> Any:
        """The number of the branch at (x, u), where L_d is given on the group."""
        return _generated(self.scheme, self.numbers, "branch")(list(x), list(u), self.q)[0]

    @cached_property
    def _natural(self) -> Any:
        return _generated(self.scheme.origin, self.numbers, "natural")


@lru_cache(maxsize=512)
def _generated(scheme: DiscreteEquations, numbers: Any, what: str) -> Any:
    """`local`, `stages` or `natural` of a scheme in an arithmetic, derived once, kept on disk."""
    build = {
        "local": _local_text,
        "stages": _stages_text,
        "natural": _natural_text,
        "branch": _branch_text,
    }[what]
    key = text_key(what, step_system(scheme), scheme.rho, scheme.L, scheme.R, scheme.mark)
    text = cached_text(f"{what}_{key}.txt", lambda: build(scheme))
    return run_text(text, numbers.namespace())[what]


def _local_text(scheme: DiscreteEquations) -> str:
    s, at, total = scheme.s, scheme.at_points, scheme.chain.total
    minus, plus, target = at.minus, at.plus, at.target
    of_target = (total(target, s.x), total(target, s.u)) if len(scheme.x) else ([], [])
    parts = [target, scheme.rho, scheme.L_at_translate, scheme.R, minus, plus, *of_target]
    parts += [total(minus, s.x), total(minus, s.u), total(plus, s.x), total(plus, s.u)]
    if len(s.stages):
        parts += [total(minus, s.stages), total(plus, s.stages)]
        parts += [total(at.stage_equations, c) for c in (s.x, s.u, s.stages)]
    return text_of(scheme, "local", {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _stages_text(scheme: DiscreteEquations) -> str:
    s, equations = scheme.s, scheme.at_points.stage_equations
    parts = [equations, scheme.chain.total(equations, s.stages)]
    return text_of(scheme, "stages", {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _branch_text(scheme: DiscreteEquations) -> str:
    vectors = {"x": scheme.s.x, "u": scheme.s.u}
    return text_of(scheme, "branch", vectors, [[scheme.element.branch]])


def _natural_text(scheme: DiscreteEquations) -> str:
    s, groupoid = scheme.s, scheme.scene.groupoid
    structure = [c / s.h for c in groupoid.structure_functions(s.x, s.h)]
    parts = [groupoid.rho(s.x, s.h) / s.h, [entry for c in structure for entry in c]]
    return text_of(scheme, "natural", {"x": s.x}, parts)


def text_of(scheme: DiscreteEquations, name: str, vectors: dict[str, Any], parts: Any) -> str:
    """Text of a function name(vectors..., q) of a scheme that gives parts, for `run_text`."""
    numbered = {q: sympy.Symbol(f"q{i}", real=True) for i, q in enumerate(scheme.s.q)}
    results = [[e.xreplace(numbered) for e in part] for part in parts]
    before = [(list(a.z), [e.xreplace(numbered) for e in a.value])
              for a in scheme.chain.needed(*parts)]  # fmt: skip
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
