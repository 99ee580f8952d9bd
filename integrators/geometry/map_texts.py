"""Texts of a scheme's maps and their derivatives, as functions of numbers at a point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..equations import Arrows, StepEquations, discrete_force, poisson_tensor
from ..numbers import jacobian, numeric_text, sympy
from ..numbers.numeric import Result
from ..numbers.types import Column, Entries, Expression, Expressions, Letter, Letters


@dataclass(frozen=True)
class ComposedArrows:
    """The arrow of all steps from x, in terms of the arrow before the last step and of that step.

    letters: what the arrow before is made of: hu of pairs, the entries of group elements, and chart
    coordinates where a groupoid is known by its product alone. begin: their values at e. after:
    their values behind the step u, in `letters`, u, h, the x of that step and that of the first
    (`origin`). velocity: the ξ at x
    of a curve of arrows through e, in its derivative there (in `letters`) and x.
    """

    letters: Expressions
    begin: list[int]
    after: Expressions
    velocity: Expressions


@lru_cache(maxsize=256)
def composed_arrows(groupoid: Any) -> ComposedArrows:
    """Return how arrows of a groupoid are composed."""
    s = groupoid.symbols
    return _composed(groupoid, s["x"], s["u"], s["h"], 0)


def _composed(groupoid: Any, x: Column, u: Column, h: Expression, first: int) -> ComposedArrows:
    before = _letters(len(u), first)
    if groupoid.canonical:
        return ComposedArrows(list(before), [0] * len(u), list(before + h * u), list(before))
    if groupoid.parts:
        places, fibres = groupoid.base(x), groupoid.fibre(u)
        connected = groupoid.connection is not None
        if connected:  # ξ of the group, of which the fibre has ξ + A(x) ẋ
            ((_, turn),) = groupoid.group_parts(x, u, h)
            fibres = fibres[0], turn / h
        arrows = list[ComposedArrows]()
        for part, place, fibre in zip(groupoid.parts, places, fibres, strict=True):
            behind = first + sum(len(e.letters) for e in arrows)
            arrows.append(_composed(part, place, fibre, h, behind))
        one, other = arrows
        turning = other.velocity
        if connected:
            moved = sympy.Matrix(groupoid.connection(x)) * sympy.Matrix(one.velocity)
            turning = list(sympy.Matrix(turning) + moved)
        return ComposedArrows(
            [*one.letters, *other.letters], [*one.begin, *other.begin],
            [*one.after, *other.after], [*one.velocity, *turning],
        )  # fmt: skip
    if not hasattr(groupoid, "algebra"):
        after = h * groupoid.product(
            sympy.Matrix(len(x), 1, list(map(origin, x))), before / h, u, h
        )
        return ComposedArrows(list(before), [0] * len(u), list(after), list(before))
    algebra = groupoid.algebra.real
    N = algebra.size
    g = _letters(N * N, first).reshape(N, N)
    after, dual = g * groupoid.tau.element(algebra, h * u), algebra.dual
    entries = sympy.Matrix(N * N, 1, list(g))
    return ComposedArrows(list(g), list(map(int, sympy.eye(N))), list(after), list(dual * entries))


def origin(x: Letter) -> Letter:
    """Return the letter for an entry of x where the first of several steps begins."""
    return sympy.Symbol(f"a{x}".replace("_", ""), real=True)


def _letters(count: int, first: int = 0) -> Column:
    return sympy.Matrix([sympy.Symbol(f"ar{first + i}", real=True) for i in range(count)])


def _arrows(e: StepEquations) -> Arrows:
    return e.arrows_for("Legendre maps")


def _values(e: StepEquations) -> list[Any]:
    """Return E and Z: of arrows by the Legendre maps, else the rows and the state with its
    growth."""
    g, at = e.graph, e.arrows
    if at is not None:
        return [e.rows, [*at.target, *at.plus_of_rows]]
    return [e.rows, g.plus(g.letters(e.z), e.increment)]


def _with_slopes(e: StepEquations, rows: list[Any], after: Entries) -> list[Result]:
    """Return rows, their derivatives by w and z, the state after a step or its growth, and its
    derivatives by w and z."""
    by = (e.w, e.z)
    return [rows, *(e.total(rows, c) for c in by), list(after), *(e.total(after, c) for c in by)]


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


#: name ↦ (letters of the arguments, what a function gives): the parts of a scheme in numbers. An
#: "action" is L_d/h of a step by w from x, and the arrow of all steps with it; a "velocity" that at
#: x of the derivative a of a curve of arrows
TEXTS: dict[str, tuple[str, Callable[[StepEquations], list[Result]]]] = {
    "map": ("x mu w", lambda e: _with_slopes(e, *_values(e))),
    "values": ("x mu w", _values),
    "rows": ("x mu w", lambda e: [(rows := _values(e)[0]), e.total(rows, e.w)]),
    "fields": ("x u", lambda e: [_arrows(e).rho, _arrows(e).L_at_translate, _arrows(e).R]),
    "along": ("x u c", lambda e: [list(e.step.along[1])]),  # type: ignore[index]
    "force": ("x u s", _force),
    "branch": ("x u", lambda e: [e.arrows_for("branch").element.branch]),  # type: ignore[union-attr]
    "natural": ("x", _natural),
    "bracket": ("x", lambda e: [poisson_tensor(e.s, e.s.x, e.s.mu)]),
    "one_step": ("x mu w", lambda e: _with_slopes(e, e.rows, e.increment)),
    "step": ("x mu w", lambda e: [e.rows, e.increment]),
    "action": ("x w x0 a", lambda e: [_arrows(e).of.expression / e.h,
                                      composed_arrows(e.groupoid).after]),
    "velocity": ("x a", lambda e: [composed_arrows(e.groupoid).velocity]),
}  # fmt: skip


def text_in(equations: StepEquations, what: str) -> str:
    """Return the text of `TEXTS` with that name."""
    words, parts = TEXTS[what]
    s, names = equations.s, words.split()
    letters: dict[str, Letters] = {"x": s.x, "u": s.u, "s": s.stages, "mu": s.mu}
    if "c" in names:
        letters["c"] = equations.step.along[0]  # type: ignore[index]
    if "w" in names:
        letters["w"] = equations.w
    if "a" in names:
        letters |= {"x0": [*map(origin, s.x)], "a": composed_arrows(equations.groupoid).letters}
    return text_of(equations, {e: letters[e] for e in names}, parts(equations))


def text_of(equations: StepEquations, vectors: dict[str, Letters], results: list[Result]) -> str:
    """Return the text of the results as a function of vectors and q (`numeric_text`)."""
    return numeric_text({**vectors, "q": equations.s.q}, results, graph=equations.graph)
