"""Texts of a scheme's maps and their derivatives, as functions of numbers at a point."""

from __future__ import annotations

from collections.abc import Callable

from ..equations import Arrows, StepEquations, discrete_force, poisson_tensor
from ..numbers import jacobian, numeric_text, sympy
from ..numbers.numeric import Result
from ..numbers.types import Letters
from .composed_arrows import composed_arrows, origin


def _maps(equations: StepEquations) -> Arrows:
    return equations.arrows_for("Legendre maps")


def _local(e: StepEquations) -> list[Result]:
    """Return b, ρ, L, R, F⁻, F⁺, and the derivatives of b, F⁻, F⁺ and of the stages' equations."""
    s, at = e.s, _maps(e)
    maps = [at.target, at.minus, at.plus]
    parts = [list(at.target), at.rho, at.L_at_translate, at.R, *map(list, maps[1:])]
    parts += [e.total(part, letters) for part in maps for letters in (s.x, s.u)]
    if len(s.stages):
        parts += [e.total(part, s.stages) for part in maps[1:]]
        parts += [e.total(at.stage_equations, letters) for letters in (s.x, s.u, s.stages)]
    return parts


def _force(e: StepEquations) -> list[Result]:
    """Return the force's part of F⁻/h, F⁺/h and ∂L_d/∂s / h, and its derivatives."""
    s, arrows = e.s, e.discrete or e.arrows_for("force")
    force = sympy.Matrix.vstack(*discrete_force(arrows.of))
    letters = (s.x, s.u, *([s.stages] if len(s.stages) else []))
    return [list(force), *(jacobian(force, part) for part in letters)]


def _natural(e: StepEquations) -> list[Result]:
    """Return ρ̂ and Ĉ."""
    s, groupoid = e.s, e.groupoid
    structure = [(c / s.h).tolist() for c in groupoid.structure_functions(s.x, s.h)]
    return [groupoid.rho(s.x, s.h) / s.h, structure]


def _one_step(e: StepEquations) -> list[Result]:
    """Return the rows of a step by w from (x, μ), ∂rows/∂w, ∂rows/∂z, Z − z, its derivatives by w
    and z."""
    parts = [list(e.rows), e.slope, e.total(e.rows, e.z), list(e.increment)]
    return [*parts, *(e.total(e.increment, letters) for letters in (e.w, e.z))]


#: name ↦ (letters of the arguments, what a function gives): the parts of a scheme in numbers. An
#: "action" is L_d/h of a step by w from x, and the arrow of all steps with it; a "velocity" that at
#: x of the derivative a of a curve of arrows
TEXTS: dict[str, tuple[str, Callable[[StepEquations], list[Result]]]] = {
    "local": ("x u s", _local),
    "values": ("x u s", lambda e: [list(m) for m in (_maps(e).target, _maps(e).minus,
                                                     _maps(e).plus)]),
    "stages": ("x u s", lambda e: [list(_maps(e).stage_equations),
                                   e.total(_maps(e).stage_equations, e.s.stages)]),
    "stage values": ("x u s", lambda e: [list(_maps(e).stage_equations)]),
    "force": ("x u s", _force),
    "branch": ("x u", lambda e: [e.arrows_for("branch").element.branch]),  # type: ignore[union-attr]
    "natural": ("x", _natural),
    "bracket": ("x", lambda e: [poisson_tensor(e.s, e.s.x, e.s.mu)]),
    "one_step": ("x mu w", _one_step),
    "step": ("x mu w", lambda e: [list(e.rows), list(e.increment)]),
    "step slope": ("x mu w", lambda e: [e.slope]),
    "action": ("x w x0 a", lambda e: [_maps(e).of.expression / e.h,
                                      composed_arrows(e.groupoid).after]),
    "velocity": ("x a", lambda e: [composed_arrows(e.groupoid).velocity]),
}  # fmt: skip


def text_in(equations: StepEquations, what: str) -> str:
    """Return the text of `TEXTS` with that name."""
    words, parts = TEXTS[what]
    s, names = equations.s, words.split()
    letters: dict[str, Letters] = {"x": s.x, "u": s.u, "s": s.stages, "mu": s.mu}
    if "w" in names:
        letters["w"] = equations.w
    if "a" in names:
        letters |= {"x0": [*map(origin, s.x)], "a": composed_arrows(equations.groupoid).letters}
    return text_of(equations, {e: letters[e] for e in names}, parts(equations))


def text_of(equations: StepEquations, vectors: dict[str, Letters], results: list[Result]) -> str:
    """Return the text of the results as a function of vectors and q (`numeric_text`)."""
    return numeric_text({**vectors, "q": equations.s.q}, results, graph=equations.graph)
