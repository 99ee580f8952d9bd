"""The equations of a scheme written out in the paper's letters.

They are exact: terms are only collected in powers of h and factored; F⁺ and F⁻ are divided by h.
The points of a step are kept as letters.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.equations import (
    SceneSymbols,
    constraint,
    met_by_velocity,
    reaction_matrix,
)
from discmech.integrators.flows.latex import parameter_names

from ..report import wording
from ..report.formulas import Typesetter, ascending
from .stage_sums import StageSum

MOST_SHARES = 8  # largest number of substep sizes that are listed for a composition
Terms = Sequence[Any]


@dataclass(frozen=True)
class Written:
    """Terms that add up to each side of each equation, as sympy has them; `letters` names symbols.

    force: its components; constraints: expressions that vanish; points: (letter, b there); momenta:
    (μ, F⁻/h); shared: denominators by their letter; residual: (F⁺/h of this step, F⁻/h of the
    next). With constraints momenta are (μ + h/2 A(x)ᵀλ, F⁻/h), and residual is (F⁺/h, μ′ − h/2
    A(y)ᵀν).
    """

    letters: Mapping[Any, str]
    lagrangian: Terms
    force: Sequence[Terms]
    constraints: Sequence[Terms]
    discrete_lagrangian: Terms
    points: Sequence[tuple[Any, Terms]]
    momenta: Sequence[tuple[Terms, Terms]]
    shared: Sequence[tuple[Any, Any]]
    residual: Sequence[tuple[Terms, Terms]]


def written(scheme: Scheme, most: int | None = None) -> Written:
    """Return the equations of a scheme; for a rule with stages only the short definition of L_d.

    most: the largest number of points, momenta and equations; None: all.
    """
    from sympy import Matrix

    s: SceneSymbols = scheme.s
    if len(s.stages):
        return _of_stages(scheme)
    maps = scheme.discrete
    points = [p for p in maps.of.points if not p.is_end]
    inner = [z for p in points for z in p.letters]
    base = {*s.x, *s.y, *inner}
    letters = letters_of(scheme)
    after = dict(zip([*s.x, *s.u, *inner], [*s.y, *s.v, *map(_after, inner)], strict=True))
    below: dict[Any, Any] = {}  # denominators that the equations share, by their letter

    def terms(expression: Any, named: dict[Any, Any] | None = None) -> list[Any]:
        return ascending(expression, s.h, base, named)

    kept = {*inner, *s.y}
    whole = (maps.plus[:most, :], maps.minus[:most, :], Matrix([maps.of.expression]))
    # kernels have their own letters for parts of these, which a page does not have
    plus, minus, L_d = (maps.of.graph.written_out(e, kept).xreplace(s.identity_translate)
                        for e in whole)  # fmt: skip
    plus, minus = ([terms(e / s.h, below) for e in column] for column in (plus, minus))
    for letter, value in below.items():
        after[letter] = _after(letter)
        for symbol, names in ((letter, ("x", "u")), (after[letter], ("y", "v"))):
            shown = names if value.free_symbols & set(s.x) else names[1:]
            letters[symbol] = f"{letter}({', '.join(shown)})"
    values = [(p.letters, p.values) for p in points]
    if len(s.x):
        values.append((s.y, s.groupoid.target(s.x, s.u, s.h)))
    momenta: list[tuple[Terms, Terms]] = [
        ([mu], e) for mu, e in zip(s.mu[:most], minus, strict=True)
    ]
    residual = [(here, [e.xreplace(after) for e in there])
                for here, there in zip(plus, minus, strict=True)]  # fmt: skip
    vanishing: list[Any] = []
    if scheme.scene.all_constraints:
        leaving, arriving, mu_after, vanishing = _impulses(s, letters)
        momenta = [
            (_sum(mu, push), e)
            for mu, push, e in zip(s.mu[:most], leaving[:most], minus, strict=True)
        ]
        residual = [(here, _sum(mu, -push)) for here, mu, push in
                    zip(plus, mu_after[:most], arriving[:most], strict=True)]  # fmt: skip
    return Written(
        letters,
        terms(s.lagrangian) if scheme.scene.lagrangian else [],
        [terms(e) for e in s.force],
        [terms(e) for e in vanishing],
        terms(L_d[0]),
        [
            (z, terms(b))
            for column, value in values
            for z, b in zip(column[:most], value[:most], strict=True)
        ],
        momenta,
        list(below.items()),
        residual,
    )


def _of_stages(scheme: Scheme) -> Written:
    """Return L_d alone: its derivatives, written out, would fill pages."""
    s, letters, equations = scheme.s, letters_of(scheme), scheme.discrete.of
    base = {*s.x, *s.y}
    if equations.weighted:
        summed = StageSum(s, equations)
        letters |= summed.letters
        discrete_lagrangian = summed.terms
    else:
        discrete_lagrangian = ascending(scheme.discrete_lagrangian, s.h, base)
        columns = enumerate(s.stage_columns, 1)
        letters |= {e: f"s_{j}{i}" for j, column in columns for i, e in enumerate(column, 1)}
    target = s.groupoid.target(s.x, s.u, s.h) if len(s.x) else []
    return Written(
        letters,
        ascending(s.lagrangian, s.h, base),
        [ascending(e, s.h, base) for e in s.force],
        [],  # constraints refuse rules with stages
        discrete_lagrangian,
        [(y, ascending(b, s.h, base)) for y, b in zip(s.y, target, strict=True)],
        momenta=[], shared=[], residual=[],
    )  # fmt: skip


def _sum(*terms: Any) -> list[Any]:
    return [e for e in terms if e != 0]


def _impulses(s: SceneSymbols, letters: dict[Any, str]) -> tuple[Any, Any, Any, Any]:
    """Return (h/2 A(x)ᵀλ, h/2 A(y)ᵀν, μ′, the expressions that vanish); name their letters."""
    from sympy import Matrix, Symbol

    matrix = reaction_matrix(s, s.x)
    columns = {}
    for name, size in (("λ", matrix.rows), ("ν", matrix.rows), ("μ′", len(s.mu))):
        columns[name] = Matrix([Symbol(f"{name}{i}", real=True) for i in range(size)])
        letters |= {e: name if size == 1 else f"{name}_{i + 1}"
                    for i, e in enumerate(columns[name])}  # fmt: skip
    at_end = matrix.xreplace(dict(zip(s.x, s.y, strict=True)))
    return (s.h / 2 * matrix.T * columns["λ"], s.h / 2 * at_end.T * columns["ν"], columns["μ′"],
            constraint(s, s.x).col_join(met_by_velocity(s, [(s.h, s.x)])))  # fmt: skip


def equations_of(scheme: Scheme) -> dict[str, Any] | None:
    """Return the equations of one scheme for the page, as MathML, or None for a one-step map.

    A map's equations are its own formula, so none are derived.
    """
    constrained = scheme.scene.all_constraints
    if scheme.equations.discrete is None:
        return None
    from discmech.integrators.compiler import is_affine

    s: SceneSymbols = scheme.s
    out = written(scheme)
    under = "constrained_" if constrained else ""
    typeset = Typesetter(out.letters)
    return {
        "scene": scheme.scene.name,
        "rule": scheme.rule.name,
        "retraction": scheme.scene.groupoid.retraction,
        "notation": notation(scheme),
        "lagrangian_mathml": typeset.sum(out.lagrangian) if out.lagrangian else "",
        "discrete_lagrangian_mathml": typeset.sum(out.discrete_lagrangian),
        "points_mathml": [typeset.equation([z], b) for z, b in out.points],
        "force_mathml": [typeset.sum(e) for e in out.force],
        "constraints_mathml": [typeset.equation(e, [s.h * 0]) for e in out.constraints],
        f"{under}momentum_mathml": [
            *(typeset.equation(mu, minus) for mu, minus in out.momenta),
            *(typeset.equation([letter], [value]) for letter, value in out.shared),
        ],
        f"{under}residual_mathml": [typeset.equation(here, there) for here, there in out.residual],
        "self_adjoint": scheme.self_adjoint,
        "affine": is_affine(scheme.equations.step),
        "source": scheme.rule.source,
    }


def plain_text(terms: Terms, letters: Mapping[Any, str]) -> str:
    """Return a sum as one line of text: h²·sin(z) − μ₁."""
    from sympy import Symbol

    names = {symbol: Symbol(subscript(name)) for symbol, name in letters.items()}
    shown = " + ".join(str(term.xreplace(names)) for term in terms) or "0"
    shown = re.sub(r"\*\*(\d+)", lambda m: wording.superscript(m[1]), shown)
    return shown.replace("**", "^").replace("*", "·").replace("+ -", "− ").replace("-", "−")


def subscript(name: str) -> str:
    """Return x_1 as x₁, a_1_2 as a₁,₂, and f_3[x_1] as f₃[x₁]."""
    return re.sub(
        r"(?<=\w)_(\d+(?:_\d+)*)(?!\w)",
        lambda match: wording.subscript(match[1].replace("_", ",")), name,
    )  # fmt: skip


def notation(scheme: Scheme) -> str:
    """Return a sentence that explains the letters of a scheme's equations."""
    if scheme.rule.method is not None:
        return f"{_substeps(scheme, scheme.rule.base.name)} {_of_one_step(scheme)}"
    return _of_one_step(scheme)


def _substeps(scheme: Scheme, base: str) -> str:
    """Return a sentence on the substeps of a composition of that rule."""
    shares = [f"{float(part.coefficient(20)):.6g}" + "*" * part.adjoint for part in scheme.substeps]
    listed = ", ".join(shares) if len(shares) <= MOST_SHARES else (
        ", ".join([*shares[: MOST_SHARES // 2], "…", *shares[-MOST_SHARES // 2 :]]))  # fmt: skip
    words = (
        f"A step is made of {len(shares)} substeps by {base}; their sizes are these multiples of "
    )
    words += f"the step's: {listed}" + " (*: by the adjoint)" * ("*" in listed)
    return f"{words}. The equations below are those of one substep, whose size is called h."


def _of_one_step(scheme: Scheme) -> str:
    s = scheme.s
    words = "u is the velocity during this step, v during the next; h is the step size."
    if s.n:
        words = "x is the base point at the start of this step and u the velocity during it, y and "
        words += "v the same for the next step; h is the step size."
    if s.clocked:
        words += " t is the time at the start of this step, t′ of the next."
    if len(s.stages):
        return words + _about_stages(s)
    for number, point in enumerate(p for p in scheme.discrete.of.points if not p.is_end):
        z, w = (letter + "′" * number for letter in "zw")
        words += f" {z} is the point at the fraction {point.theta} of this step, {w} of the next"
        words += f", t_{z} and t_{w} their times." if s.clocked else "."
    return words


def _about_stages(s: SceneSymbols) -> str:
    """Return a sentence that explains the letters of a rule's sum (`StageSum`)."""
    count = len(s.stage_columns)
    last = subscript(f"s_{count}")
    words = " s is the internal stage" if count == 1 else f" s₁ to {last} are internal stages"
    words += f", {len(s.u)} unknown{'s' * (len(s.u) > 1)}"
    words += f"{' each' * (count > 1)}: ∂L_d/∂s = 0. l is the Lagrangian"
    if len(s.x):
        words += ", b(x, w) the point to which w leads from x: y = b(x, h·u)"
    if not s.groupoid.left_is_identity:
        words += (
            ", V(w, ẇ) the velocity of a curve of arrows through w"
            if not len(s.x)
            else (", V(x, w, ẇ) the velocity of a curve of arrows through w")
        )
    return words + ("; decimals are rounded." if s.constants else ".")


def letters_of(scheme: Scheme) -> dict[Any, str]:
    """Return the letters with indices from 1, as in the paper; z: a point inside the step, w:
    inside the next."""
    s: SceneSymbols = scheme.s
    discrete = scheme.equations.discrete
    points = () if discrete is None else discrete.of.points
    columns = [("u", s.u), ("v", s.v), ("μ", s.mu)]
    places = [("x", "t", s.x), ("y", "t′", s.y)]
    for number, point in enumerate(p for p in points if not p.is_end):
        for letter, column in (("z", point.letters), ("w", [*map(_after, point.letters)])):
            name = letter + "′" * number
            places.append((name, f"t_{name}", column))
    for name, time, column in places:  # the last entry of a point is its time, if it has one
        columns += [(name, column[: s.n]), (time, column[s.n :])]
    letters = {
        symbol: letter if len(column) == 1 else f"{letter}_{i + 1}"
        for letter, column in columns for i, symbol in enumerate(column)
    }  # fmt: skip
    return letters | parameter_names(scheme)


def _after(symbol: Any) -> Any:
    """Return the symbol of the same point in the next step."""
    from sympy import Symbol

    return Symbol(f"after {symbol}", real=True)
