"""First-order geometry of one step: TΨ, the prolongation PΨ, the Poisson map, and their defects.

All derivatives are exact, from the implicit function theorem.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..compiler import cached_text, text_key
from ..equations import DiscreteEquations, step_system
from ..numbers import Arithmetic, inlined, newton, numeric_function, numeric_text
from ..numbers.types import Letters, Matrix, Number, Numbers, Vector

#: the results of `local` in order; F± are of L_d itself, not divided by h
_PARTS = (
    "target", "rho", "L", "R", "minus", "plus",
    "target_x", "target_u", "minus_x", "minus_u", "plus_x", "plus_u",
)  # fmt: skip
#: the further results with internal stages s: they complete the derivatives along s = s(x, u)
_OF_STAGES = ("minus_s", "plus_s", "stages_x", "stages_u", "stages_s")

#: a scheme's maps and derivatives at a point, by name
Maps = dict[str, np.ndarray]


def slopes(maps: Maps, name: str) -> Matrix:
    """The derivative of a map by (x, u), rows × (n+m)."""
    return np.hstack([maps[f"{name}_x"], maps[f"{name}_u"]])


class StagesNotFound(ArithmeticError):
    """Newton did not find the internal stages of an arrow."""


class LocalGeometry:
    """A scheme's maps and their derivatives as numbers at a point, in one arithmetic."""

    def __init__(self, equations: DiscreteEquations, numbers: Arithmetic, q: list[Number]) -> None:
        self.equations, self.numbers, self.q = equations, numbers, q
        self.n, self.m = len(equations.x), len(equations.u)
        self.k = len(equations.s.stages)

    def at(self, x: Numbers, u: Numbers) -> Maps:
        """Every part at (x, u): vectors of length n or m, matrices of the shapes they have.

        Internal stages are solved for, and derivatives are along ∂L_d/∂s = 0 (Schur complements).
        Raises `StagesNotFound` if Newton from s = 0 does not converge.
        """
        values = self._value("local", x, u, self.stages(x, u), self.q)
        names = (*_PARTS, *(_OF_STAGES if self.k else ()))
        parts: Maps = dict(zip(names, values, strict=True))
        if self.k:
            follow = -self.numbers.solve(parts.pop("stages_s"), slopes(parts, "stages"))
            for name in ("minus", "plus"):
                through = parts.pop(f"{name}_s") @ follow
                parts[f"{name}_x"] = parts[f"{name}_x"] + through[:, : self.n]
                parts[f"{name}_u"] = parts[f"{name}_u"] + through[:, self.n :]
        return parts

    def stages(self, x: Numbers, u: Numbers) -> Vector:
        """The s with ∂L_d/∂s (x, u, s) = 0, by Newton from 0; empty without stages."""
        if not self.k:
            return self.numbers.zeros(0)

        def change(s: Vector) -> Vector:
            values, slope = self._value("stages", x, u, s, self.q)
            return -self.numbers.solve(slope, values)

        scale = sum(abs(e) for e in u)
        stages = newton(change, self.numbers.zeros(self.k), scale, self.numbers.eps)
        if stages is None:
            raise StagesNotFound
        return stages

    def branch(self, x: Vector, u: Vector) -> Number:
        """The number of the branch at (x, u), where L_d is given on the group."""
        return self._value("branch", x, u, self.q)

    def _value(self, what: str, *arguments: Numbers) -> Any:
        return _function(self.equations, self.numbers, what)(*arguments)

    def poisson_tensor(self, x: Vector, mu: Vector, bracket_sign: int = 1) -> Matrix:
        """Π(x, μ) of {x^i, μ_γ} = ρ̂^i_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ, (n+m)×(n+m)."""
        rho, c = self._value("natural", x, self.q)  # ρ̂, n×m, and Ĉ as [θ, γ, ν]
        bracket = -bracket_sign * sum((mu[t] * c[t] for t in range(self.m)), 0 * c[0])
        return np.block([[self.numbers.zeros(self.n, self.n), rho], [-rho.T, bracket]])

    def tangent(self, here: Maps, there: Maps) -> Matrix:
        """TΨ: (δx, δu) ↦ (δy, δv), from F⁻(y, v) = F⁺(x, u), y = b(x, u)."""
        top = slopes(here, "target")
        pushed = slopes(here, "plus") - there["minus_x"] @ top
        return np.vstack([top, self.numbers.solve(there["minus_u"], pushed)])

    def prolongation(self, here: Maps, there: Maps, tangent: Matrix) -> Matrix:
        """PΨ on (a, c), 2m×2m: a* = −c, L(y,v) c* = δv + R(y,v) c, with δx = −ρa, δu = Ra + Lc."""
        n, m = self.n, self.m
        into = np.block([[-here["rho"], self.numbers.zeros(n, m)], [here["R"], here["L"]]])
        only_c = np.hstack([self.numbers.zeros(m, m), self.numbers.identity(m)])
        pushed = (tangent @ into)[n:] + there["R"] @ only_c
        return np.vstack([-only_c, self.numbers.solve(there["L"], pushed)])

    def omega(self, here: Maps) -> Matrix:
        """Ω on (a, c), 2m×2m, with W_γμ = L^θ_μ ∂F⁻_γ/∂u^θ.

        The sign is that of dΘ±, in matrices W = −FLᵀ L:
        [misprint: omega-sign], [misprint: FL-transposed].
        """
        w = here["minus_u"] @ here["L"]
        zero = self.numbers.zeros(self.m, self.m)
        return np.block([[zero, w], [-w.T, zero]])

    def dual_step(self, here: Maps, h: Number) -> Matrix:
        """Derivative of (x, μ) ↦ (b, F⁺/h) with u from F⁻(x, u) = hμ, (n+m)×(n+m)."""
        n, m = self.n, self.m
        dx = np.hstack([self.numbers.identity(n), self.numbers.zeros(n, m)])
        rhs = np.hstack([-here["minus_x"], h * self.numbers.identity(m)])
        along = np.vstack([dx, self.numbers.solve(here["minus_u"], rhs)])
        return np.vstack([slopes(here, "target") @ along, slopes(here, "plus") @ along / h])


@lru_cache(maxsize=512)
def _function(equations: DiscreteEquations, numbers: Arithmetic, what: str) -> Callable[..., Any]:
    """A function of `_TEXTS` of equations in an arithmetic, derived once; its text is on disk."""
    key = text_key(what, step_system(equations), *equations.fields, equations.mark)
    text = cached_text(f"{what}_{key}.txt", lambda: _TEXTS[what](equations))
    return numeric_function(text, numbers)


def _local_text(equations: DiscreteEquations) -> str:
    s, at, total = equations.s, equations.at_points, equations.at_points.total
    maps = [at.target, at.minus, at.plus]
    target, minus, plus = map(list, maps)
    parts = [target, equations.rho, equations.L_at_translate, equations.R, minus, plus]
    parts += [total(part, letters) for part in maps for letters in (s.x, s.u)]
    if len(s.stages):
        parts += [total(part, s.stages) for part in maps[1:]]
        parts += [total(at.stage_equations, letters) for letters in (s.x, s.u, s.stages)]
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _stages_text(equations: DiscreteEquations) -> str:
    s, stages = equations.s, equations.at_points.stage_equations
    parts = [list(stages), equations.at_points.total(stages, s.stages)]
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _branch_text(equations: DiscreteEquations) -> str:
    assert equations.element is not None
    return text_of(equations, {"x": equations.s.x, "u": equations.s.u}, [equations.element.branch])


def _natural_text(equations: DiscreteEquations) -> str:
    s, groupoid = equations.s, equations.groupoid
    structure = [(c / s.h).tolist() for c in groupoid.structure_functions(s.x, s.h)]
    return text_of(equations, {"x": s.x}, [groupoid.rho(s.x, s.h) / s.h, structure])


def _one_step_text(equations: Any) -> str:
    """Of a one-step map: rows, ∂rows/∂w, ∂rows/∂z, Z − z and its derivatives by w and by z."""
    e, total = equations, equations.total
    parts = [list(e.rows), e.slope, total(e.rows, e.z), list(e.increment)]
    parts += [total(e.increment, letters) for letters in (e.w, e.z)]
    return text_of(equations, {"x": e.s.x, "mu": e.s.mu, "w": e.w}, parts)


_TEXTS = {"local": _local_text, "stages": _stages_text, "branch": _branch_text,
          "natural": _natural_text, "one_step": _one_step_text}  # fmt: skip


def text_of(equations: DiscreteEquations, vectors: dict[str, Letters], results: list[Any]) -> str:
    """Text of the results as a function of vectors and q (`numeric_text`)."""
    flat = [e for result in results for e in np.array(result, dtype=object).flat]
    before = inlined(equations.definitions(flat))
    definitions = [(list(d.letters), list(d.values)) for d in before]
    return numeric_text({**vectors, "q": equations.s.q}, results, definitions)


def frobenius(matrix: Matrix) -> Number:
    """√Σ|entry|², in any arithmetic."""
    return sum(entry * entry for entry in matrix.ravel()) ** 0.5


def relative_defect(pulled: Matrix, given: Matrix, map_: Matrix) -> Number:
    """‖pulled − given‖ / (‖map‖² ‖given‖): a few units of round-off whatever the conditioning."""
    difference = frobenius(pulled - given)
    if difference == 0:
        return difference  # also where there is nothing to keep: Π = 0 on an abelian group
    return difference / (frobenius(map_) ** 2 * frobenius(given))
