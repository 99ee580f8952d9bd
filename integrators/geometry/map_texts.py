"""Texts of a scheme's maps and their derivatives, as functions of numbers at a point."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..equations import (
    StepEquations,
    discrete_force,
    poisson_tensor,
)
from ..numbers import inlined, jacobian, numeric_text, sympy
from ..numbers.types import Letters
from .composed_arrows import composed_arrows, origin


def _local_text(equations: StepEquations) -> str:
    s, arrows, total = equations.s, equations.arrows_for("Legendre maps"), equations.total
    at = arrows.at_points
    maps = [at.target, at.minus, at.plus]
    target, minus, plus = map(list, maps)
    parts = [target, arrows.rho, arrows.L_at_translate, arrows.R, minus, plus]
    parts += [total(part, letters) for part in maps for letters in (s.x, s.u)]
    if len(s.stages):
        parts += [total(part, s.stages) for part in maps[1:]]
        parts += [total(at.stage_equations, letters) for letters in (s.x, s.u, s.stages)]
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _maps(equations: StepEquations) -> Any:
    return equations.arrows_for("Legendre maps").at_points


def _stages_text(equations: StepEquations) -> str:
    s, stages = equations.s, _maps(equations).stage_equations
    parts = [list(stages), equations.total(stages, s.stages)]
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _values_text(equations: StepEquations) -> str:
    s, at = equations.s, _maps(equations)
    vectors = {"x": s.x, "u": s.u, "s": s.stages}
    return text_of(equations, vectors, [list(m) for m in (at.target, at.minus, at.plus)])


def _stage_values_text(equations: StepEquations) -> str:
    s, stages = equations.s, _maps(equations).stage_equations
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, [list(stages)])


def _force_text(equations: StepEquations) -> str:
    s, arrows = equations.s, equations.discrete or equations.arrows_for("force")
    force = sympy.Matrix.vstack(*discrete_force(arrows.of))
    letters = (s.x, s.u, *([s.stages] if len(s.stages) else []))
    parts = [list(force), *(jacobian(force, part) for part in letters)]
    return text_of(equations, {"x": s.x, "u": s.u, "s": s.stages}, parts)


def _branch_text(equations: StepEquations) -> str:
    assert equations.element is not None
    return text_of(equations, {"x": equations.s.x, "u": equations.s.u}, [equations.element.branch])


def _natural_text(equations: StepEquations) -> str:
    s, groupoid = equations.s, equations.groupoid
    structure = [(c / s.h).tolist() for c in groupoid.structure_functions(s.x, s.h)]
    return text_of(equations, {"x": s.x}, [groupoid.rho(s.x, s.h) / s.h, structure])


def _bracket_text(equations: StepEquations) -> str:
    s = equations.s
    return text_of(equations, {"x": s.x}, [poisson_tensor(s, s.x, s.mu)])


def _one_step_text(equations: StepEquations) -> str:
    """Return a one-step map's text: rows, ∂rows/∂w, ∂rows/∂z, Z − z, its derivatives by w, z."""
    e, total = equations, equations.total
    parts = [list(e.rows), e.slope, total(e.rows, e.z), list(e.increment)]
    parts += [total(e.increment, letters) for letters in (e.w, e.z)]
    return text_of(equations, {"x": e.s.x, "mu": e.s.mu, "w": e.w}, parts)


def _step_text(equations: StepEquations) -> str:
    """Return the text for a step by w from (x, μ): rows that vanish, and the growth of (x, μ)."""
    vectors = {"x": equations.s.x, "mu": equations.s.mu, "w": equations.w}
    return text_of(equations, vectors, [list(equations.rows), list(equations.increment)])


def _step_slope_text(equations: StepEquations) -> str:
    """Return the text for a step by w from (x, μ): ∂rows/∂w."""
    vectors = {"x": equations.s.x, "mu": equations.s.mu, "w": equations.w}
    return text_of(equations, vectors, [equations.slope])


def _action_text(equations: StepEquations) -> str:
    """Return the text for L_d/h of a step by w from x, and for the arrow of all steps with it."""
    s, arrows = equations.s, composed_arrows(equations.groupoid)
    vectors = {"x": s.x, "w": equations.w, "x0": list(map(origin, s.x)), "a": arrows.letters}
    return text_of(
        equations, vectors, [_maps(equations).discrete_lagrangian / equations.h, arrows.after]
    )


def _velocity_text(equations: StepEquations) -> str:
    """Return the text for ξ at x of the derivative a of a curve of arrows."""
    arrows = composed_arrows(equations.groupoid)
    vectors = {"x": equations.s.x, "a": arrows.letters}
    return text_of(equations, vectors, [arrows.velocity])


#: the parts of a scheme that are written as functions of numbers, by name
TEXTS = {"local": _local_text, "stages": _stages_text, "branch": _branch_text,
          "natural": _natural_text, "bracket": _bracket_text, "one_step": _one_step_text,
          "values": _values_text, "stage values": _stage_values_text, "force": _force_text,
          "step": _step_text, "step slope": _step_slope_text, "action": _action_text,
          "velocity": _velocity_text}  # fmt: skip


def text_of(equations: StepEquations, vectors: dict[str, Letters], results: list[Any]) -> str:
    """Return the text of the results as a function of vectors and q (`numeric_text`)."""
    flat = [e for result in results for e in np.array(result, dtype=object).flat]
    before = inlined(equations.definitions(flat))
    definitions = [(list(d.letters), list(d.values)) for d in before]
    return numeric_text({**vectors, "q": equations.s.q}, results, definitions)
