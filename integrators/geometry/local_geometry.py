"""First-order geometry of one step: TΨ, the prolongation PΨ, the Poisson map, and their defects.

All derivatives are exact, from the implicit function theorem.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from ..compiler import cached_text, text_key
from ..equations import StepEquations
from ..numbers import (
    Arithmetic,
    Tracked,
    inverse_sizes,
    newton,
    numeric_function,
    rounded,
    solve,
    tracked,
    tracked_later,
    with_running_errors,
)
from ..numbers.types import Array, Function, Matrix, Number, Numbers, Vector
from .map_texts import text_in

#: the results of `local` in order; F± are of L_d itself, not divided by h
_PARTS = (
    "target", "rho", "L", "R", "minus", "plus",
    "target_x", "target_u", "minus_x", "minus_u", "plus_x", "plus_u",
)  # fmt: skip
#: further results with internal stages s, which complete the derivatives along s = s(x, u)
_OF_STAGES = ("minus_s", "plus_s", "stages_x", "stages_u", "stages_s")

KEPT = 8  # number of points whose maps are remembered: several forms are measured on one step
#: a scheme's maps and derivatives at a point, by name: arrays, plain or `Tracked`
Maps: TypeAlias = dict[str, Array]


def slopes(maps: Maps, name: str) -> Matrix:
    """Return the derivative of a map by (x, u), rows × (n+m)."""
    return np.hstack([maps[f"{name}_x"], maps[f"{name}_u"]])


class StagesNotFound(ArithmeticError):
    """Newton did not find the internal stages of an arrow."""


class LocalGeometry:
    """A scheme's maps and their derivatives as numbers at a point, in one arithmetic."""

    def __init__(self, equations: StepEquations, numbers: Arithmetic, q: list[Number]) -> None:
        self.equations, self.numbers, self.q = equations, numbers, q
        self.n, self.m = len(equations.x), len(equations.u)
        self.k = len(equations.s.stages)
        self._latest: dict[Hashable, Maps] = {}

    def at(self, x: Numbers, u: Numbers) -> Maps:
        """Return every part at (x, u): vectors of length n or m, and matrices.

        Internal stages are solved for, and derivatives are along ∂L_d/∂s = 0 (Schur complements).
        The results for the latest points are remembered, so the arrays are read-only. Raises
        `StagesNotFound` if Newton from s = 0 does not converge.
        """
        point = tuple(x), tuple(u)
        if point not in self._latest:
            if len(self._latest) >= KEPT:
                del self._latest[next(iter(self._latest))]
            with self.numbers.working():
                found = self._value("local", x, u, self.stages(x, u), self.q)
                maps = self._completed(found)
            for array in maps.values():
                array.flags.writeable = False
            self._latest[point] = maps
        return dict(self._latest[point])

    def values(self, x: Numbers, u: Numbers) -> list[Vector]:
        """Return [b, F⁻, F⁺] at (x, u), without derivatives; raises as `at` does."""
        return list(self._value("values", x, u, self.stages(x, u), self.q))

    def tracked(self, x: Vector, u: Vector) -> Maps:
        """Return `at` as `Tracked` arrays, for a u that solves F⁻(x, u) = hμ to round-off."""
        maps = self.at(x, u)

        def with_errors() -> Iterable[Tracked]:
            inverse = inverse_sizes(maps["minus_u"])
            of_u = self.round_off_of_u(x, u, inverse, 0 * abs(x), self.numbers.zeros(self.m))
            arrow = rounded(u, of_u)
            found = self._errors("local")(x, arrow, self._rounded_stages(x, u, x, arrow), self._q)
            return self._completed(found).values()

        return dict(zip(maps, tracked_later(maps.values(), with_errors), strict=True))

    def _completed(self, values: Iterable[Array]) -> Maps:
        names = (*_PARTS, *(_OF_STAGES if self.k else ()))
        parts: Maps = dict(zip(names, values, strict=True))
        if self.k:
            parts["follow"] = -solve(self.numbers, parts.pop("stages_s"), slopes(parts, "stages"))
            for name in ("minus", "plus"):
                through = parts.pop(f"{name}_s") @ parts["follow"]
                parts[f"{name}_x"] = parts[f"{name}_x"] + through[:, : self.n]
                parts[f"{name}_u"] = parts[f"{name}_u"] + through[:, self.n :]
        return parts

    def discrete_force(self, x: Numbers, u: Numbers) -> tuple[Vector, Vector]:
        """Return the force's parts of F⁻/h and F⁺/h at an arrow, m numbers each, in the natural
        basis.

        They come from the displacement of points, not from F±. Raises `StagesNotFound` like `at`.
        """
        force = self._value("force", x, u, self.stages(x, u), self.q)[0]
        return force[: self.m], force[self.m : 2 * self.m]

    def force_and_slopes(self, x: Vector, u: Vector) -> tuple[Tracked, Tracked]:
        """Return the force's parts of F⁻/h, F⁺/h and ∂L_d/∂s / h, `Tracked`, and their derivative.

        There are 2m+k entries; the derivative is by x, u and s separately.
        """
        arrow = rounded(u)
        stages = self._rounded_stages(x, u, x, arrow)
        force, *by = self._errors("force")(x, arrow, stages, self._q)
        return force, np.hstack(by)  # type: ignore[return-value]

    def stages(self, x: Numbers, u: Numbers) -> Vector:
        """Return s with ∂L_d/∂s (x, u, s) = 0, by Newton from 0; empty without stages."""
        if not self.k:
            return self.numbers.zeros(0)

        def change(s: Vector) -> Vector:
            values, slope = self._value("stages", x, u, s, self.q)
            return -self.numbers.solve(slope, values)

        scale = sum(abs(e) for e in u)
        stages = newton(change, self.numbers.zeros(self.k), scale, self.numbers.eps)
        if stages is None:
            raise StagesNotFound("Newton did not find the internal stages of an arrow.")
        return stages

    def with_round_off(self, x: Vector, u: Vector, of_x: Vector, of_u: Vector) -> list[Tracked]:
        """Return (b, F⁻, F⁺) at (x, u) as `Tracked` vectors, for errors of_x, of_u of x and u."""
        at, arrow = rounded(x, of_x), rounded(u, of_u)
        stages = self._rounded_stages(x, u, at, arrow)
        return list(self._errors("values")(at, arrow, stages, self._q))

    def round_off_of_u(
        self, x: Vector, u: Vector, inverse: Matrix, of_x: Vector, of_mu: Vector
    ) -> Vector:
        """Return the round-off error of u, m units ε, since both sides of F⁻(x, u) = hμ are
        rounded.

        inverse: |(∂F⁻/∂u)⁻¹|. of_x and of_mu: the errors of x and μ.
        """
        minus = self.with_round_off(x, u, of_x, abs(u))[1]
        return abs(u) + inverse @ (minus.error + abs(minus.value) + abs(self.q[0]) * of_mu)

    def growth(self, x: Vector, mu: Vector, w: Vector) -> Tracked:
        """Return (x′ − x, μ′ − μ) of a step by its unknowns w, `Tracked`: its terms may cancel."""
        grown: Tracked = self._errors("step")(x, mu, rounded(w), np.array(self.q))[1]
        return grown

    def _rounded_stages(self, x: Vector, u: Vector, at: Vector | Tracked, arrow: Tracked) -> Array:
        stages = self.stages(x, u)
        if not self.k:
            return stages
        given = self._errors("stage values")(at, arrow, rounded(stages, 0), self._q)
        slope = self._value("stages", x, u, stages, self.q)[1]
        inverse = inverse_sizes(slope)
        return rounded(stages, abs(stages) + inverse @ given.error)

    @property
    def _q(self) -> Tracked:
        """The step and the parameters, each rounded once."""
        return rounded(np.array(self.q, dtype=self.numbers.dtype))

    def _errors(self, what: str) -> Function:
        return _with_errors(self.equations, self.numbers, what)

    def branch(self, x: Vector, u: Vector) -> Number:
        """Return the branch number at (x, u), or None unless L_d is given on the group."""
        return None if self.equations.element is None else self._value("branch", x, u, self.q)

    def _value(self, what: str, *arguments: Numbers) -> Any:
        return _function(self.equations, self.numbers, what)(*arguments)

    def poisson_tensor(self, x: Vector, mu: Vector, bracket_sign: int = 1) -> Tracked:
        """Return Π(x, μ) of {x^i, μ_γ} = ρ̂^i_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ, (n+m)×(n+m).

        Of a degenerate Lagrangian the bracket is Dirac's, and depends on x alone.
        """
        if self.equations.s.degenerate:
            values = [self._value("bracket", x, self.q)]
            (found,) = tracked_later(values, lambda: [self._errors("bracket")(x, self._q)])
            return found
        rho, c = self._natural(x)
        bracket = self._contracted(c, mu)
        anchor = self.numbers.zeros(self.n, self.n)
        bracket = -bracket if bracket_sign > 0 else bracket
        return tracked(np.block([[Tracked(anchor), rho], [-rho.T, bracket]]))

    def contracted(self, x: Vector, mu: Vector) -> Tracked:
        """Return μ_θ Ĉ^θ_{γν} at x, m×m."""
        return self._contracted(self._natural(x)[1], mu)

    def _contracted(self, c: Tracked, mu: Vector) -> Tracked:
        none = Tracked(self.numbers.zeros(self.m, self.m))
        return sum((c[t] * mu[t] for t in range(self.m)), none)

    def _natural(self, x: Vector) -> tuple[Tracked, Tracked]:
        """Return ρ̂ at x, n×m, and Ĉ there as [θ, γ, ν]."""
        values = self._value("natural", x, self.q)
        rho, c = tracked_later(values, lambda: self._errors("natural")(x, self._q))
        return rho, c

    def tangent(self, here: Maps, there: Maps) -> Matrix:
        """Return TΨ: (δx, δu) ↦ (δy, δv), from F⁻(y, v) = F⁺(x, u), y = b(x, u)."""
        top = slopes(here, "target")
        pushed = slopes(here, "plus") - there["minus_x"] @ top
        return np.vstack([top, solve(self.numbers, there["minus_u"], pushed)])

    def prolongation(self, here: Maps, there: Maps, tangent: Matrix) -> Matrix:
        """Return PΨ on (a, c), 2m×2m.

        a* = −c, L(y,v) c* = δv + R(y,v) c, with δx = −ρa, δu = Ra + Lc.
        """
        n, m = self.n, self.m
        into = np.block([[-here["rho"], self.numbers.zeros(n, m)], [here["R"], here["L"]]])
        only_c = np.hstack([self.numbers.zeros(m, m), self.numbers.identity(m)])
        pushed = (tangent @ into)[n:] + there["R"] @ only_c
        return np.vstack([-only_c, solve(self.numbers, there["L"], pushed)])

    def omega(self, here: Maps) -> Matrix:
        """Return Ω on (a, c), 2m×2m, with W_γμ = L^θ_μ ∂F⁻_γ/∂u^θ.

        The sign is that of dΘ±, in matrices W = −FLᵀ L: [misprint: omega-sign], [misprint:
        FL-transposed].
        """
        w = here["minus_u"] @ here["L"]
        zero = self.numbers.zeros(self.m, self.m)
        return np.block([[zero, w], [-w.T, zero]])

    def dual_step(self, here: Maps, h: Number) -> Matrix:
        """Return the derivative of (x, μ) ↦ (b, F⁺/h) with u from F⁻(x, u) = hμ, (n+m)×(n+m)."""
        n, m = self.n, self.m
        dx = np.hstack([self.numbers.identity(n), self.numbers.zeros(n, m)])
        rhs = np.hstack([-here["minus_x"], h * self.numbers.identity(m)])
        along = np.vstack([dx, solve(self.numbers, here["minus_u"], rhs)])
        return np.vstack([slopes(here, "target") @ along, slopes(here, "plus") @ along / h])


@lru_cache(maxsize=512)
def _function(equations: StepEquations, numbers: Arithmetic, what: str) -> Function:
    """Return a function of `TEXTS` in an arithmetic, derived once; its text is cached on disk."""
    return numeric_function(map_text(equations, what), numbers)


def map_text(equations: StepEquations, what: str) -> str:
    """Return a text of `TEXTS` for equations, from the cache on disk where it is there."""
    key = text_key(what, equations.step, *equations.fields, equations.mark)
    return cached_text(f"{what.replace(' ', '_')}_{key}.txt", lambda: text_in(equations, what))


@lru_cache(maxsize=512)
def _with_errors(equations: StepEquations, numbers: Arithmetic, what: str) -> Function:
    """Return the function of `_function` in `running_error` numbers."""
    return with_running_errors(map_text(equations, what), numbers)
