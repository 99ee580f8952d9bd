"""The general discrete evolution operator through bisections (paper, section 4.2).

Arrows near g₀ are g = L_Σ(g_W), those near h₀ are h = R_Υ(h_W), with g_W = (x, u) and h_W = (y, v)
near the identities; (g, h) is composable iff y = b(x, u). The equations are

    e←_γ(g_W)(L_d∘L_Σ) = e→_γ(h_W)(L_d∘R_Υ)

L_Σ carries e← to e← and R_Υ carries e→ to e→ (section 4.1), so the sides are F⁺(g) and F⁻(h). The
identity bisections, which move nothing, give the local operator of section 2.4. Runs use
`bisections.edge_policies`: there a bisection of a group is a parameter of the kernels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..errors import BadInput, shown
from ..geometry import Maps, StepContext, pullback_defect
from ..numbers import newton, whole_number
from ..numbers.types import Matrix, Number, Numbers, Vector
from .bisection import Bisection, Point, groupoid_maps, in_own_numbers

Pair = tuple[Bisection, Bisection]


class EvolutionOperator:
    """Ψ from near g₀ (on Σ = sigma) to near h₀ (on Υ = upsilon), and its inverse Ξ.

    context: that of a flow (`flow.context`). A missing bisection is the identity bisection. Of
    several solutions the one near the bisection is taken, as in the theorem. Arrows are written in
    the groupoid's own chart, even if L_d is given on the group. Raises `BadInput` for bisections of
    another groupoid, step or number of digits, `CannotMeasure` for a composition. All methods take
    numbers of any kind and return floats, beyond double precision mpmath's; they raise
    `StepFailure` if a map has no value.
    """

    def __init__(
        self, context: StepContext, sigma: Bisection | None = None, upsilon: Bisection | None = None
    ) -> None:
        if not isinstance(context, StepContext):
            raise BadInput(f"the context of an operator is {shown(context)}: give flow.context.")
        context.check_one_arrow()
        self.context, self.sigma, self.upsilon = context, sigma, upsilon
        self.numbers, self.groupoid = context.numbers, context.equations.groupoid
        self.n, self.m, self.vector = self.groupoid.dim_x, self.groupoid.dim_u, context.vector
        for bisection in (sigma, upsilon):
            if bisection is None:
                continue
            if not isinstance(bisection, Bisection):
                raise BadInput(
                    f"{context.scene.name}: {shown(bisection)} is no bisection: give "
                    "Bisection(groupoid, x0, u0, step)."
                )
            fits = (bisection.step, bisection.numbers) == (context.step, context.numbers)
            if bisection.groupoid is not self.groupoid or not fits:
                raise BadInput(
                    f"{context.scene.name}: a bisection is of another groupoid, step or number of "
                    "digits; take both through arrows of this scheme's groupoid at this step."
                )

    @in_own_numbers
    def evolve(self, x: Vector, u: Vector) -> Point:
        """Apply Ψ: return h = (y, v) after g = (x, u); raises `BadInput` if Newton diverges."""
        return self._public(self._step(x, u)[-1])

    @in_own_numbers
    def devolve(self, y: Vector, v: Vector) -> Point:
        """Apply Ξ: return g = (x, u) before h = (y, v); raises `BadInput` if Newton diverges."""
        goal = self._after(*_moved(self.upsilon, "without_right", y, v))["minus"]
        starts = (np.concatenate([y, w]) for w in (0 * v, v))
        near = self._solved(self.preceding, y, goal, starts)
        return self._public(_moved(self.sigma, "left", near[: self.n], near[self.n :]))

    def trajectory(
        self, steps: int, x: Numbers, u: Numbers, choose: Callable[..., Pair] | None = None
    ) -> Point:
        """Return (x, u) of the arrows g, Ψ(g), …: (steps + 1)×n and (steps + 1)×m.

        choose(x, u): the bisections (Σ, Υ) for the step from that arrow. By default they are this
        operator's own, or, if it has none, `bisections_at` each arrow. Raises `BadInput` for a
        number of steps below 0, and like `evolve`.
        """
        steps = whole_number("steps", steps, 0)
        if choose is None and self.sigma is None and self.upsilon is None:
            choose = self.bisections_at
        with self.numbers.working():
            rows = [self._public(self.context.vectors(x, u))]
        for _ in range(steps):
            through = choose(*rows[-1]) if choose else (self.sigma, self.upsilon)
            rows.append(EvolutionOperator(self.context, *through).evolve(*rows[-1]))
        x, u = zip(*rows, strict=True)
        return np.array(x), np.array(u)

    @in_own_numbers
    def bisections_at(self, x: Vector, u: Vector) -> Pair:
        """Return Σ through (x, u), and Υ through the arrow with the same u at its target."""
        y = groupoid_maps(self.groupoid, self.numbers, self.context.h, x, u, 0 * u)["target"]
        step, digits = self.context.step, self.numbers.digits
        sigma, upsilon = (Bisection(self.groupoid, z, u, step, digits) for z in (x, y))
        return sigma, upsilon

    @in_own_numbers
    def residual(self, x: Vector, u: Vector, v: Vector) -> Vector:
        """Return the residual of the equations at g_W = (x, u), h_W = (b(x, u), v), m numbers."""
        before = self._before(x, u)
        return self.numbers.public(before["plus"] - self._after(before["target"], v)["minus"])

    @in_own_numbers
    def FL(self, y: Vector, v: Vector) -> Matrix:
        """Return (FL)^γ_μ = −∂/∂v^γ e→_μ(L_d∘R_Υ) at h_W = (y, v), row γ, m×m."""
        return self.numbers.public(-self._after(y, v)["minus_u"].T)

    @in_own_numbers
    def barred_FL(self, y: Vector, v: Vector) -> Matrix:
        """Return −∂/∂v̄^γ of −e←_μ(L_d∘L_Σ) in (x̄, ū) = (x, u)∘i, row γ, m×m (Implicit2).

        It is taken at g_W = i(y, v̄), v̄ = v, on the β-fibre over y. It decides whether F⁺ is
        regular at g = L_Σ(g_W) [misprint: implicit2].
        """
        (x, u), tangent = self._inverse(y, v)
        at = self._before(x, u)
        return self.numbers.public((at["of_plus"] @ tangent).T)

    @in_own_numbers
    def tangent(self, x: Vector, u: Vector) -> Matrix:
        """Return TΨ at g = (x, u), (n+m)×(n+m): T R_Υ ∘ T(g_W ↦ h_W) ∘ (T L_Σ)⁻¹."""
        return self.numbers.public(self._tangent(*self._step(x, u)[:2]))

    @in_own_numbers
    def pullback_defect(self, x: Vector, u: Vector) -> Number:
        """Return the `entrywise_defect` of PΨᵀ Ω PΨ = Ω at g = (x, u), through the bisections."""
        *maps, end = self._step(x, u)
        geometry = self.context.geometry
        here, there = geometry.tracked(x, u), geometry.tracked(*end)
        defect = pullback_defect(geometry, here, there, self._tangent(*maps))
        return self.context.number(defect)

    def following(
        self, y: Vector, goal: Vector, start: Vector, scale: Number | Vector = 0
    ) -> Vector | None:
        """Return v with F⁻(R_Υ(y, v)) = goal, m numbers, by Newton from a start, or None.

        All numbers are the context's; scale: the size of v below which round-off is absolute.
        """

        def change(v: Vector) -> Vector:
            here = self._maps(self.context.geometry.at, self.upsilon, "right", y, v)
            dv = np.asarray(self.numbers.solve(here["minus_u"], goal - here["minus"]))
            return self.context.geometry.along_group(y, v, dv)

        return newton(change, start, scale, self.numbers.eps)

    def preceding(self, y: Vector, goal: Vector, start: Vector, scale: Number = 0) -> Vector | None:
        """Return (x, u) with b(x, u) = y and F⁺(L_Σ(x, u)) = goal, n+m numbers, or None."""
        n = self.n

        def change(point: Vector) -> Vector:
            x, u = point[:n], point[n:]
            here = self._maps(self.context.geometry.at, self.sigma, "left", x, u)
            matrix = np.vstack([here["of_target"], here["of_plus"]])
            gap = np.concatenate([y - here["target"], goal - here["plus"]])
            step = np.asarray(self.numbers.solve(matrix, gap))
            step[n:] = self.context.geometry.along_group(x, u, step[n:])
            return step

        return newton(change, start, scale, self.numbers.eps)

    def _before(self, x: Vector, u: Vector) -> Maps:
        return self._maps(self.context.maps_at, self.sigma, "left", x, u)

    def _after(self, y: Vector, v: Vector) -> Maps:
        return self._maps(self.context.maps_at, self.upsilon, "right", y, v)

    def _maps(
        self,
        maps_at: Callable[[Vector, Vector], Maps],
        bisection: Bisection | None,
        side: str,
        x: Vector,
        u: Vector,
    ) -> Maps:
        """Return the Legendre maps at L_Σ(x, u) or R_Σ(x, u) ("left", "right"); derivatives by (x,
        u).

        F⁺ is e←(L_d∘L_Σ), F⁻ is e→(L_d∘R_Σ). The target, its derivatives and R are those of (x, u)
        itself; "tangent" is T L_Σ or T R_Σ (only for a bisection). maps_at: evaluates the maps of
        L_d, and raises `StepFailure` outside of Newton's iteration.
        """
        if bisection is None:
            return maps_at(x, u)
        to, tangent_of = (getattr(bisection, side + end) for end in ("", "_tangent"))
        at, tangent, here = maps_at(*to(x, u)), tangent_of(x, u), bisection.maps(x, u, 0 * u)
        maps = {"target": here["target"], "of_target": np.hstack([here["b_x"], here["b_u"]]),
                "R": bisection.maps(x, 0 * u, u)["p_u"], "tangent": tangent}  # fmt: skip
        for name in ("minus", "plus"):
            maps |= {name: at[name], f"of_{name}": at[f"of_{name}"] @ tangent}
        return maps | {"minus_u": maps["of_minus"][:, self.n :]}

    def _step(self, x: Vector, u: Vector) -> tuple[Maps, Maps, Point]:
        """Return the maps at g_W and at h_W, and h, for the step from g = (x, u)."""
        before = self._before(*_moved(self.sigma, "without_left", x, u))
        y = before["target"]

        def starts() -> Iterator[Vector]:
            yield 0 * u  # the bisection itself
            # the last step, expressed on the bisection
            yield _moved(self.upsilon, "without_right", y, u)[1]

        v = self._solved(self.following, y, before["plus"], starts())
        return before, self._after(y, v), _moved(self.upsilon, "right", y, v)

    def _tangent(self, before: Maps, after: Maps) -> Matrix:
        tangent = self.context.geometry.tangent(before, after)
        if self.upsilon is not None:
            tangent = after["tangent"] @ tangent
        if self.sigma is not None:
            tangent = self.numbers.solve(before["tangent"].T, tangent.T).T
        return np.asarray(tangent)

    def _solved(
        self, solve: Callable[..., Vector | None], y: Vector, goal: Vector, starts: Iterator[Vector]
    ) -> Vector:
        """Return the solution by `following` or `preceding` from the first start with one."""
        for start in starts:
            solution = solve(y, goal, start, scale=1)
            if solution is not None:
                return solution
        raise BadInput(
            f"{self.context.scene.name}: no solution was found near the bisections; take them "
            "through arrows nearer to the solution, or a smaller step."
        )

    def _inverse(self, y: Vector, v: Vector) -> tuple[Point, Matrix]:
        """Return i(y, v̄) = (b, ι), with p(y, v̄, ι) = 0, and ∂i/∂v̄, (n+m)×m."""

        def maps(w: Vector) -> Maps:
            return groupoid_maps(self.groupoid, self.numbers, self.context.h, y, v, w)

        def change(w: Vector) -> Vector:
            at = maps(w)
            return np.asarray(-self.numbers.solve(at["p_v"], at["product"]))

        iota = newton(change, -v, 1, self.numbers.eps)
        if iota is None:
            raise BadInput(f"{self.groupoid.name}: that arrow has no inverse in this chart.")
        at = maps(iota)
        fibre = -self.numbers.solve(at["p_v"], at["p_u"])
        return (at["target"], iota), np.vstack([at["b_u"], fibre])

    def _public(self, arrow: Point) -> Point:
        return self.numbers.public(arrow[0]), self.numbers.public(arrow[1])


def _moved(bisection: Bisection | None, by: str, x: Vector, u: Vector) -> Point:
    """Return (x, u) translated by a method of `Bisection`, such as left or without_right."""
    return (x, u) if bisection is None else getattr(bisection, by)(x, u)
