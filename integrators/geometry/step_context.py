"""A scheme at one step size in one arithmetic, as data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from ..equations import DiscretisedScene, StepEquations
from ..errors import SMALLER, CannotMeasure, StepFailure
from ..groupoids import GroupChart
from ..numbers import Arithmetic, arithmetic, listed
from ..numbers.types import GivenVector, Matrix, Number, Numbers, Vector
from ..runs import Trajectory
from ..scene import Scene
from .defects import poisson_defect, pullback_defect
from .step_map import Maps, StagesNotFound, StepMap

DOUBLE = np.dtype(np.float64)


def vector_in(numbers: Arithmetic, values: Any, length: int, what: str) -> Vector:
    """Return an array of numbers of an arithmetic, each rounded once; None is the empty vector.

    Raises `BadInput` (naming `what`) for anything but `length` numbers.
    """
    doubles = type(values) is np.ndarray and values.dtype is DOUBLE and numbers.dtype is np.float64
    fits = doubles and values.shape == (length,)
    if fits and (isfinite(values.dot(values)) or np.isfinite(values).all()):
        return values.copy()  # for many starts a Fraction for each entry would be slow
    entries = listed(() if values is None else values, length, what)
    rounded = [numbers.number(e, f"{what}[{i}]") for i, e in enumerate(entries)]
    return np.array(rounded, dtype=numbers.dtype)


@dataclass(frozen=True, eq=False)
class StepContext:
    """A discretised scene at one step size in one arithmetic.

    substeps: the contexts of a composition's substeps in order; empty for a rule of one step.
    """

    scheme: DiscretisedScene
    numbers: Arithmetic
    step: Fraction
    substeps: tuple[StepContext, ...] = ()

    @property
    def parts(self) -> tuple[StepContext, ...]:
        """The contexts whose steps, in turn, make one step; for a plain rule only this one."""
        return self.substeps or (self,)

    @property
    def equations(self) -> StepEquations:
        """The equations of a step."""
        return self.scheme.equations

    @property
    def scene(self) -> Scene:
        """The scene with its values."""
        return self.scheme.scene

    @cached_property
    def q(self) -> list[Number]:
        """The values of the equations' letters `s.q`: h, parameters, constants, B = e."""
        with self.numbers.working():
            values = self.scene.parameter_values
            return self.equations.s.q_values(self.step, values, self.numbers)

    @property
    def h(self) -> Number:
        """The step size in this arithmetic."""
        return self.q[0]

    @cached_property
    def exactly(self) -> StepContext:
        """The same step to twice the digits, where tests of the maps are free of round-off."""
        parts = tuple(part.exactly for part in self.substeps)
        return StepContext(
            self.scheme, arithmetic(max(16, 2 * self.numbers.digits)), self.step, parts
        )

    @cached_property
    def chart(self) -> GroupChart:
        """Cayley's chart of the group and its translates; raises `BadInput` if it has none."""
        return GroupChart(self.scene.groupoid, self.numbers)

    @cached_property
    def geometry(self) -> StepMap:
        """The maps and their derivatives as numbers at this step."""
        return StepMap(self.equations, self.numbers, self.q)

    def start(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """Return Newton's start for a step from (x, μ): the velocity nearby, or the map's own
        start."""
        if self.equations.arrows is not None:
            return near
        try:
            return self.geometry.start(x, mu, near)
        except (ArithmeticError, ValueError):  # the logarithm of what is negative
            raise self.failure(
                "the vector field has no value at the start", {"x": x, "mu": mu}
            ) from None

    def geometry_in(self, translate: int) -> StepMap:
        """Return the geometry in the chart of a translate B, by its number in the cover; 0 is e."""
        if translate == 0:
            return self.geometry
        letters = [e for matrix in self.chart.translates[translate] for e in matrix.ravel()]
        q = [*self.q[: len(self.q) - len(letters)], *letters]
        return StepMap(self.equations, self.numbers, q)

    def coordinates(self, g: np.ndarray, translate: int = 0) -> np.ndarray | None:
        """Return u with g = τ(hu) B, or None at the chart's edge and for g outside the group.

        There τ(hu) B differs from g by 2²⁰ round-offs, half a double's digits, of a column of g.
        """
        try:
            xi = self.chart.coordinates(g, translate)
            back = self.chart.element(xi, translate)
        except ArithmeticError:
            return None
        right = self.chart.alike(back, g, 2**20 * self.numbers.eps, floor=1)
        return xi / self.h if right else None

    def maps_at(self, x: Numbers, u: Numbers) -> Maps:
        """Return the maps and derivatives at (x, u) (`StepMap.at`).

        Raises `StepFailure` if stages are not found, or a map has no value.
        """
        try:
            return self.geometry.at(x, u)
        except StagesNotFound:
            cause = "the internal stages were not found"
        except CannotMeasure:  # it is a ValueError, but about the request
            raise
        # raised by Python's own functions outside their domain
        except (ArithmeticError, ValueError):
            cause = "L_d or a derivative of it is no number"
        raise self.failure(cause, {"x": x, "u": u})

    def arrow(self, x: Numbers, mu: Numbers, u: Numbers, translate: int = 0) -> Arrow:
        """Return the arrow (x, u) in the chart of a translate, with its μ and the maps there."""
        with self.numbers.working():
            (x, u), mu = self.vectors(x, u), self.vector(mu, len(self.equations.u))
            geometry = self.geometry_in(translate)
            return Arrow(x, u, mu, geometry, geometry.at(x, u))

    def vectors(self, x: GivenVector, u: GivenVector) -> tuple[np.ndarray, np.ndarray]:
        """Return x and u (or μ), checked and rounded (`vector`).

        The time of an x without one is 0.
        """
        s = self.equations.s
        if s.clocked:
            x = s.with_time(() if x is None else x)
        return self.vector(x, len(s.x)), self.vector(u, len(s.u))

    def vector(self, values: Any, length: int) -> Vector:
        """Numbers of this arithmetic (`vector_in`)."""
        return vector_in(self.numbers, values, length, f"{self.scene.name}: a vector")

    def number(self, value: Number) -> Number:
        """A number of this arithmetic as it is returned to users."""
        return self.numbers.public([value])[0]

    def check_one_arrow(self) -> None:
        """Raise `CannotMeasure` where a step is no map of arrows (x, u)."""
        scene, rule = self.scene, self.scheme.rule
        scene.refuse("arrows")
        use = "use dual_step and poisson_defect"
        if self.equations.arrows is None:
            why = f"it has no discrete Lagrangian, so no Ω on G; {use}"
            raise CannotMeasure(f"{rule.name} is a one-step map: {why}.")
        if self.substeps:
            why = f"it steps on (x, mu), not on arrows (x, u); {use}"
            raise CannotMeasure(f"{rule.name} is a composition: {why}.")

    def failure(
        self,
        cause: str,
        state: dict[str, Numbers],
        index: int = 0,
        trajectory: Trajectory | None = None,
        fix: str = SMALLER,
        look: Callable[[], tuple[str, str]] | None = None,
    ) -> StepFailure:
        """Return the failure of step `index` at a state of this arithmetic; `trajectory`: rows."""
        where = {name: self.numbers.public(value) for name, value in state.items()}
        names, time = (self.scene.name, self.scheme.rule.name), float(self.step * index)
        n = self.equations.s.n
        if len(x := where.get("x", ())) > n:  # with its time
            time = float(x[n])
        elif trajectory is not None and len(trajectory.t):
            time += float(trajectory.t[0])
        return StepFailure(*names, index, time, where, cause, trajectory, fix, look=look)


# The step between two arrows g, g′ = Ψ(g), which may lie in the charts of different translates: the
# Legendre maps at both are compared across charts (paper, section 4.2).


@dataclass(frozen=True)
class Arrow:
    """An arrow g with its (x, μ), its translate's geometry, and the maps at g (`geometry.at`)."""

    x: Vector
    u: Vector
    mu: Vector
    geometry: StepMap
    at: Maps


def residual(here: Arrow, there: Arrow) -> Number:
    """Return the largest |F⁺(g) − F⁻(g′)| relative to the largest of |F⁺(g)| and |F⁻(g′)|."""
    geometry = here.geometry
    with geometry.numbers.working():
        ends = here.at["plus"], there.at["minus"]
        size = max(abs(e) for end in ends for e in end)
        gap = max(abs(ends[0] - ends[1]))
        return geometry.numbers.public([gap / size if gap else gap])[0]


def defects(here: Arrow, there: Arrow) -> tuple[Number, Number]:
    """Return the defects (pullback, Poisson) of the step from g to g′, as in `Flow`."""
    geometry = here.geometry
    with geometry.numbers.working():
        at, after = (arrow.geometry.tracked(arrow.x, arrow.u) for arrow in (here, there))
        step = there.x, there.mu, geometry.dual_step(at, geometry.q[0])
        pair = [pullback_defect(geometry, at, after, geometry.tangent(at, after)),
                poisson_defect(geometry, here.x, here.mu, step)]  # fmt: skip
        pullback, poisson = geometry.numbers.public(pair)
        return pullback, poisson


def regularity(arrow: Arrow) -> float:
    """Return smallest over largest singular value of e→_μ(F⁻_γ) at fixed x, in double precision.

    It is 0 where FL is singular, and does not depend on a chart.
    """
    sizes = np.linalg.svd(_along(arrow))[1]
    return float(sizes[-1] / sizes[0])


def singular_sign(arrow: Arrow) -> float:
    """Return det of e→(F⁻) over ‖e→(F⁻)‖ᵐ: its sign changes where FL is singular."""
    along = _along(arrow)
    return float(np.linalg.det(along) / np.linalg.norm(along, 2) ** len(along))


def _along(arrow: Arrow) -> Matrix:
    """Return e→_μ(F⁻_γ), m×m, in double precision."""
    with arrow.geometry.numbers.working():
        return np.asarray(arrow.at["minus_u"] @ arrow.at["R"], dtype=float)
