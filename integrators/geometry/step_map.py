"""Any step in numbers: its rows, where it leads, and all derivatives, in one arithmetic.

E(x, μ, w) = 0 determines the unknowns w of a step, which leads to Z(x, μ, w) = (x′, μ′). That is
all that a step is: its derivative, and the Legendre maps at arrows with TΨ, PΨ and Ω, follow from
E and Z by the implicit function theorem, with stages, slopes and impulses alike. Rules with a
discrete Lagrangian have E = (F⁻/h − μ, ∂L_d/∂s / h) and Z = (b, F⁺/h), without the formulas of
F⁺ − F⁻ that kernels have: their step is compared with the maps themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from functools import lru_cache
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ..compiler import cached_text, text_key
from ..equations import SceneSymbols, StepEquations, legendre_inverse, rates
from ..numbers import (
    Arithmetic,
    Tracked,
    inverse_sizes,
    newton,
    numeric,
    numeric_function,
    rounded,
    solve,
    tracked,
    tracked_later,
    with_running_errors,
)
from ..numbers.newton import MOST
from ..numbers.types import Array, Function, Matrix, Number, Numbers, Vector
from .map_texts import text_in

KEPT = 24  # results that are remembered: several forms are measured on one step
#: a scheme's maps and derivatives at a point, by name: arrays, plain or `Tracked`
Maps: TypeAlias = dict[str, Array]
Result = TypeVar("Result")


class StagesNotFound(ArithmeticError):
    """Newton did not find the internal stages of an arrow."""


class StepNotFound(StagesNotFound):
    """Newton did not find the step from a state."""


class StepMap:
    """A step, and what follows from it, as numbers at a state or an arrow, in one arithmetic.

    q: the values of the equations' letters `s.q`, of which the first is h.
    """

    def __init__(self, equations: StepEquations, numbers: Arithmetic, q: list[Number]) -> None:
        self.equations, self.numbers, self.q = equations, numbers, q
        self.n, self.m = len(equations.x), len(equations.u)
        self.k = len(equations.s.stages)
        self._kept: dict[Hashable, Any] = {}

    def velocities(self, x: Matrix, mu: Matrix, near: Matrix) -> Matrix:
        """Return ξ(x, μ) of rows, (r, m), from velocities nearby; NaN if there is none."""
        s = self.equations.s
        parameters = self.q[1 : 1 + len(s.parameter_list)]
        return legendre_inverse(s, self.numbers)(x[:, : self.n], mu, parameters, near)

    def start(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """Return Newton's start from a state and a velocity nearby.

        On arrows it is that velocity and its stages; else f(z) for each slope, ξ(z) for each
        velocity, and 0 for impulses, and for an explicit map, whose slope needs no start. Raises
        `StagesNotFound` like `stages`.
        """
        e: Any = self.equations
        s = e.s
        if e.explicit:
            return self.numbers.zeros(len(e.w))
        if e.arrows is not None and not s.degenerate:
            return self._with_stages(x, near)
        x = x[: self.n]  # of steps that vary the state holds more
        xi = self.velocities(x[None], mu[None], near[None])[0]
        known = {"velocity": xi}
        if e.discrete is None:
            f = _rates(s, self.numbers)(x, xi, mu, self.q[1 : 1 + len(s.parameter_list)])
            known |= {"slope": f[: len(e.state)], "place": x / self.q[0]}
        parts = ((known.get(kind), len(letters)) for kind, letters in e.unknowns)
        return np.concatenate([self.numbers.zeros(k) if v is None else v for v, k in parts])

    def unknowns(self, x: Vector, mu: Vector, start: Vector) -> Vector:
        """Return w with E(x, μ, w) = 0, by Newton from a start.

        Where L_d is a function of the group element, a correction is followed in the group. Raises
        `StepNotFound` if Newton diverges.
        """

        places = list[Vector]()

        def change(w: Vector) -> Vector:
            places.append(w)
            rows, slope = self._value("rows", x, mu, w, self.q)
            return self.along_group(x, w, -np.asarray(self.numbers.solve(slope, rows)))

        def solved_from(near: Vector) -> Vector | None:
            return newton(change, near, self._round_off(x, mu, near), self.numbers.eps)

        def solved() -> Vector:
            w = solved_from(start)
            if w is None and len(places) == MOST:
                # terms that are 0 at the start have no round-off there; once more from what follows
                # to see that this was round-off of the solution, not of a place farther off
                w = solved_from(places[-1])
                w = None if w is None else solved_from(w)
            if w is None:
                raise StepNotFound("Newton did not find a step again that a run has taken.")
            w.flags.writeable = False
            return w

        return self._once(("unknowns", *map(tuple, (x, mu, start))), solved)

    def along_group(self, x: Vector, u: Vector, du: Vector) -> Vector:
        """Return the change of u along R⁻¹du in the group if L_d is given on it, else du."""
        if self.equations.element is None:
            return du
        R = self._value("fields", x, u, self.q)[2]
        return self._value("along", x, u, self.numbers.solve(R, du), self.q)

    def parts(
        self, x: Vector, mu: Vector, start: Vector, errors: Vector | None = None
    ) -> list[Tracked]:
        """Return E, ∂E/∂w, ∂E/∂z, Z, ∂Z/∂w, ∂Z/∂z at the unknowns of the step from z = (x, μ).

        They are `Tracked`; errors: those of (x, μ), n+m, by default 0. Raises as `unknowns` does.
        """
        w, still = self.unknowns(x, mu, start), 0 * abs(np.concatenate([x, mu]))
        errors = still if errors is None else errors
        at, momentum = rounded(x, errors[: len(x)]), rounded(mu, errors[len(x) :])

        def with_errors() -> Iterable[Tracked]:
            own = rounded(w, self._round_off(at, momentum, w))
            return self._errors("map")(at, momentum, own, self._q)

        def found() -> list[Tracked]:
            return tracked_later(self._value("map", x, mu, w, self.q), with_errors)

        return self._once(("parts", *map(tuple, (x, mu, start, errors))), found)

    def step(self, x: Vector, mu: Vector, start: Vector) -> tuple[Vector, Vector, Tracked]:
        """Return (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′), (n+m)×(n+m), by Newton from a
        start.

        The derivative is exact, from the implicit function theorem, and `Tracked`. Raises
        `StepNotFound` if Newton diverges.
        """
        _, slope, by_z, after, of_w, of_z = self.parts(x, mu, start)
        derivative: Any = of_z - of_w @ solve(self.numbers, slope, by_z)
        return after.value[: self.n], after.value[self.n :], derivative

    def step_round_off(
        self, x: Vector, mu: Vector, start: Vector, errors: Vector | None = None
    ) -> Vector:
        """Return the effect of round-off on (x′, μ′) in the step from (x, μ), n+m units ε.

        It is a bound to first order: (x, μ) and every operation of E and Z round (`running_error`),
        and the rows are solved to the round-off of their terms. errors: those of (x, μ) at the
        start, which are propagated.
        """
        return abs(np.concatenate([x, mu])) + self.parts(x, mu, start, errors)[3].error

    def growth(self, x: Vector, mu: Vector, w: Vector) -> Vector:
        """Return (x′ − x, μ′ − μ) of a step by its unknowns w, by the kernels' formulas."""
        return np.asarray(self._value("step", x, mu, w, self.q)[1])

    def at(self, x: Numbers, u: Numbers) -> Maps:
        """Return every map at (x, u): vectors of length n or m, and matrices.

        They are "target" (b), "minus" and "plus" (F±, not divided by h), each with its derivative
        by (x, u), "of_target" and so on; "minus_u", ∂F⁻/∂u; "rho", "L", "R". Internal stages are
        solved for, and derivatives are along ∂L_d/∂s = 0 (Schur complements); "follow" is then
        ∂s/∂(x, u). Results are remembered, so the arrays are read-only. Raises `StagesNotFound` if
        Newton from s = 0 does not converge, `CannotMeasure` for a map without arrows.
        """
        self.equations.arrows_for("legendre_minus")

        def maps() -> Maps:
            with self.numbers.working():
                w = self._with_stages(x, u)
                parts = self._value("map", x, self.numbers.zeros(self.m), w, self.q)
                arrays = self._maps(parts, self._value("fields", x, u, self.q))
            for array in arrays.values():
                array.flags.writeable = False
            return arrays

        return dict(self._once(("at", tuple(x), tuple(u)), maps))

    def tracked(self, x: Vector, u: Vector) -> Maps:
        """Return `at` as `Tracked` arrays, for a u that solves F⁻(x, u) = hμ to round-off."""
        maps = self.at(x, u)

        def with_errors() -> Iterable[Tracked]:
            w, mu = self._with_stages(x, u), rounded(maps["minus"] / self.q[0])
            own = rounded(w, self._round_off(x, mu, w))
            parts = self._errors("map")(x, self.numbers.zeros(self.m), own, self._q)
            fields = self._errors("fields")(x, own[: self.m], self._q)
            return self._maps(parts, fields).values()

        return dict(zip(maps, tracked_later(maps.values(), with_errors), strict=True))

    def _maps(self, parts: Sequence[Array], fields: Sequence[Array]) -> Maps:
        """Return the maps from E, Z and their derivatives at μ = 0, where E is (F⁻/h, 0)."""
        (n, m), h = (self.n, self.m), self.q[0]
        rows, by_w, by_z, after, of_w, of_z = parts
        minus, ends = np.hstack([by_z[:, :n], by_w]), np.hstack([of_z[:, :n], of_w])
        follow = {}
        if self.k:
            own = minus[m:]
            along = -solve(self.numbers, own[:, n + m :], own[:, : n + m])
            minus, ends = (e[:, : n + m] + e[:, n + m :] @ along for e in (minus[:m], ends))
            follow = {"follow": along}
        of_minus = minus * h
        return {
            **dict(zip(("rho", "L", "R"), fields, strict=True)), **follow,
            "target": after[:n], "minus": rows[:m] * h, "plus": after[n:] * h,
            "of_target": ends[:n], "of_minus": of_minus, "of_plus": ends[n:] * h,
            "minus_u": of_minus[:, n:],
        }  # fmt: skip

    def stages(self, x: Numbers, u: Numbers) -> Vector:
        """Return s with ∂L_d/∂s (x, u, s) = 0, by Newton from 0; empty without stages.

        Raises `StagesNotFound` if it does not converge.
        """
        m, still = self.m, self.numbers.zeros(self.m)
        if not self.k:
            return self.numbers.zeros(0)

        def change(s: Vector) -> Vector:
            rows, slope = self._value("rows", x, still, [*u, *s], self.q)
            return -self.numbers.solve(slope[m:, m:], rows[m:])

        scale = sum(abs(e) for e in u)
        stages = newton(change, self.numbers.zeros(self.k), scale, self.numbers.eps)
        if stages is None:
            raise StagesNotFound("Newton did not find the internal stages of an arrow.")
        return stages

    def _with_stages(self, x: Numbers, u: Numbers) -> Vector:
        return np.concatenate([np.asarray(u, self.numbers.dtype), self.stages(x, u)])

    def with_round_off(self, x: Vector, u: Vector, of_x: Vector, of_u: Vector) -> list[Tracked]:
        """Return (b, F⁻/h, F⁺/h) at (x, u) as `Tracked` vectors, for errors of_x, of_u of x and
        u."""
        at, w, still = rounded(x, of_x), self._with_stages(x, u), self.numbers.zeros(self.m)
        own = rounded(w, self._round_off(at, still, w, of_u))
        rows, after = self._errors("values")(at, still, own, self._q)
        return [after[: self.n], rows[: self.m], after[self.n :]]

    def _round_off(
        self, x: Array, mu: Array, w: Vector, of_given: Vector | tuple[()] = ()
    ) -> Vector:
        """Return the round-off errors of w, in units ε, as the rows that it solves are rounded.

        of_given: the errors of its first entries, if these are no solution but given.
        """
        k = len(of_given)
        errors = np.concatenate([np.asarray(of_given, self.numbers.dtype), abs(w[k:])])
        if k == len(w):
            return errors
        rows = self._errors("values")(x, mu, rounded(w, errors), self._q)[0].error[k:]
        at, momentum = tracked(x).value, tracked(mu).value
        slope = self._value("rows", at, momentum, w, self.q)[1][k:, k:]
        try:
            errors[k:] += inverse_sizes(slope) @ rows
        except ZeroDivisionError:
            raise StepNotFound("the derivative of a step's equations is singular.") from None
        return errors

    def branch(self, x: Vector, u: Vector) -> Number:
        """Return the branch number at (x, u), or None unless L_d is given on the group."""
        return None if self.equations.element is None else self._value("branch", x, u, self.q)

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
        w = self._with_stages(x, u)
        own = rounded(w, self._round_off(x, self.numbers.zeros(self.m), w, abs(u)))
        force, *by = self._errors("force")(x, own[: self.m], own[self.m :], self._q)
        return force, np.hstack(by)  # type: ignore[return-value]

    def poisson_tensor(self, x: Vector, mu: Vector, bracket_sign: int = 1) -> Tracked:
        """Return Π(x, μ) of {x^i, μ_γ} = ρ̂^i_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ, (n+m)×(n+m).

        Of a degenerate Lagrangian the bracket is Dirac's, and depends on x alone.
        """
        if self.equations.s.degenerate:
            values = [self._value("bracket", x, self.q)]
            (tensor,) = tracked_later(values, lambda: [self._errors("bracket")(x, self._q)])
            return tensor
        rho, bracket = self._natural(x)[0], self.contracted(x, mu)
        anchor = self.numbers.zeros(self.n, self.n)
        bracket = -bracket if bracket_sign > 0 else bracket
        return tracked(np.block([[Tracked(anchor), rho], [-rho.T, bracket]]))

    def contracted(self, x: Vector, mu: Vector) -> Tracked:
        """Return μ_θ Ĉ^θ_{γν} at x, m×m."""
        c, none = self._natural(x)[1], Tracked(self.numbers.zeros(self.m, self.m))
        return sum((c[t] * mu[t] for t in range(self.m)), none)

    def _natural(self, x: Vector) -> list[Tracked]:
        """Return ρ̂ at x, n×m, and Ĉ there as [θ, γ, ν]."""

        def found() -> list[Tracked]:
            values = self._value("natural", x, self.q)
            return tracked_later(values, lambda: self._errors("natural")(x, self._q))

        return self._once(("natural", tuple(x)), found)

    def tangent(self, here: Maps, there: Maps) -> Matrix:
        """Return TΨ: (δx, δu) ↦ (δy, δv), from F⁻(y, v) = F⁺(x, u), y = b(x, u)."""
        top = here["of_target"]
        pushed = here["of_plus"] - there["of_minus"][:, : self.n] @ top
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
        rhs = np.hstack([-here["of_minus"][:, :n], h * self.numbers.identity(m)])
        along = np.vstack([dx, solve(self.numbers, here["minus_u"], rhs)])
        return np.vstack([here["of_target"] @ along, here["of_plus"] @ along / h])

    @property
    def _q(self) -> Tracked:
        """The step and the parameters, each rounded once."""
        return rounded(np.array(self.q, dtype=self.numbers.dtype))

    def _value(self, what: str, *arguments: Numbers) -> Any:
        return _function(self.equations, self.numbers, what)(*arguments)

    def _errors(self, what: str) -> Function:
        return _with_errors(self.equations, self.numbers, what)

    def _once(self, key: Hashable, function: Callable[[], Result]) -> Result:
        """Return what was found for a key, one of the latest, or find it."""
        if key not in self._kept:
            value = function()
            if len(self._kept) >= KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = value
        kept: Result = self._kept[key]
        return kept


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


@lru_cache(maxsize=256)
def _rates(s: SceneSymbols, numbers: Arithmetic) -> Function:
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return numeric(letters, [list(rates(s))], numbers)
