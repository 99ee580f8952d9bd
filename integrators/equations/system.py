"""One step of a scheme as data for the compiler."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

from ..compiler import Step, kinds_of
from ..errors import BadInput
from ..groupoids import chart_extents
from ..numbers.types import Expression, Letters
from .discrete_equations import DiscreteEquations
from .one_step_equations import OneStepEquations
from .symbols import vector


@lru_cache(maxsize=512)
def step_system(
    equations: DiscreteEquations | OneStepEquations,
    adjoint: DiscreteEquations | None = None,
    composed: bool = False,
) -> Step:
    """Return the rows, their derivative and the update of a scheme's step, all divided by h.

    adjoint: the equations of the adjoint, if a composition has steps of it.
    """
    other = None if adjoint is None else step_system(adjoint)
    if isinstance(equations, OneStepEquations):
        return replace(equations.system, composed=composed, adjoint=other)
    s, at_points, element = equations.s, equations.at_points, equations.element
    h = equations.h
    rows, gain = at_points.rows, at_points.per_step(at_points.gain)
    slope = at_points.slope_of_rows
    if element is not None:  # along e→, ∂F⁻/∂u · R
        slope = at_points.per_step(at_points.minus_along_right)
    branches = [] if element is None else [element.branch]
    groupoid = equations.groupoid
    used = equations.L.free_symbols
    return Step(
        name=s.name,
        q=tuple(s.q),
        x=tuple(equations.x),
        u=tuple(equations.u),
        w=tuple(equations.w),
        mu=tuple(s.mu),
        y=tuple(equations.y),
        rows=rows,
        slope=slope,
        increment=at_points.increment,
        gain=gain,
        definitions=tuple(at_points.definitions(rows, slope, gain, branches)),
        scaled=tuple(u for u in equations.u if u in used),
        along=None if element is None else _along_group(equations),
        extents=tuple(chart_extents(groupoid, equations.x, equations.u, h)),
        branch=None if element is None else element.branch,
        kinds=kinds_of(("velocity", s.u), ("stage", s.stages)),
        constants=dict(s.constants),
        composed=composed,
        adjoint=other,
    )


def _along_group(equations: DiscreteEquations) -> tuple[Letters, tuple[Expression, ...]]:
    """Return dw with τ(h(w + dw)) = τ(hc) τ(hw): the correction c of g, followed in the group.

    Newton in the chart alone fails near its edge (Moser–Veselov, rotations spread over the group,
    from the last step: it finds 55 of 100 steps; followed in the group 99).
    """
    groupoid: Any = equations.groupoid
    if not groupoid.tau.has_translates:
        raise BadInput(
            f"{equations.s.name}: a discrete Lagrangian given on the group runs in "
            "Cayley's chart and its translates; write retraction=cayley."
        )
    letters = vector("c_of_g", len(equations.w))
    product = groupoid.product(equations.x, letters, equations.w, equations.h)
    return tuple(letters), tuple(product - equations.w)
