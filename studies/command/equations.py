"""The equations of a scheme written out: what was derived, in the paper's letters.

Exact: terms are only collected in powers of h and factored; F⁺ and F⁻ are divided by h. The points
of a step are kept as letters.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.equations import SceneSymbols, constraint, constraint_matrix

from ..report.formulas import Typesetter, ascending

Terms = Sequence[Any]


@dataclass(frozen=True)
class Written:
    """Terms that add up to each side of each equation, as sympy has them; `letters` names symbols.

    force: its components; constraints: what vanishes; points: (letter, b there); momenta: (μ,
    F⁻/h); shared: denominators by their letter; residual: (F⁺/h of this step, F⁻/h of the next).
    Under constraints momenta are (μ + h/2 A(x)ᵀλ, F⁻/h), residual (F⁺/h, μ′ − h/2 A(y)ᵀν).
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


def written(scheme: Scheme) -> Written:
    """The equations of a scheme."""
    s: SceneSymbols = scheme.s
    of = discrete(scheme)
    points = [p for p in of.points if not p.is_end]
    inner = [z for p in points for z in p.letters]
    base = {*s.x, *s.y, *inner}
    letters = letters_of(scheme)
    after = dict(zip([*s.x, *s.u, *inner], [*s.y, *s.v, *map(_after, inner)], strict=True))
    below: dict[Any, Any] = {}  # denominators that the equations share, by their letter

    def terms(expression: Any, named: dict[Any, Any] | None = None) -> list[Any]:
        return ascending(expression, s.h, base, named)

    plus = [terms(e / s.h, below) for e in of.at_points.plus]
    minus = [terms(e / s.h, below) for e in of.at_points.minus]
    for letter, value in below.items():
        after[letter] = _after(letter)
        for symbol, names in ((letter, ("x", "u")), (after[letter], ("y", "v"))):
            shown = names if value.free_symbols & set(s.x) else names[1:]
            letters[symbol] = f"{letter}({', '.join(shown)})"
    values = [(p.letters, p.values) for p in points]
    if len(s.x):
        values.append((s.y, of.groupoid.target(s.x, s.u, s.h)))
    momenta: list[tuple[Terms, Terms]] = [([mu], e) for mu, e in zip(s.mu, minus, strict=True)]
    residual = [(here, [e.xreplace(after) for e in there])
                for here, there in zip(plus, minus, strict=True)]  # fmt: skip
    vanishing: list[Any] = []
    if scheme.scene.constrained:
        leaving, arriving, mu_after, vanishing = _impulses(s, letters)
        momenta = [(_sum(mu, push), e) for mu, push, e in zip(s.mu, leaving, minus, strict=True)]
        residual = [(here, _sum(mu, -push))
                    for here, mu, push in zip(plus, mu_after, arriving, strict=True)]  # fmt: skip
    return Written(
        letters,
        terms(s.lagrangian) if scheme.scene.lagrangian else [],
        [terms(e) for e in s.force],
        [terms(e) for e in vanishing],
        terms(of.at_points.discrete_lagrangian),
        [(z, terms(b)) for column, value in values for z, b in zip(column, value, strict=True)],
        momenta,
        list(below.items()),
        residual,
    )


def _sum(*given: Any) -> list[Any]:
    return [e for e in given if e != 0]


def discrete(scheme: Scheme) -> Any:
    """What F⁻ and F⁺ are derived in: under constraints, the equations without these."""
    return scheme.equations.discrete if scheme.scene.constrained else scheme


def _impulses(s: SceneSymbols, letters: dict[Any, str]) -> tuple[Any, Any, Any, Any]:
    """(h/2 A(x)ᵀλ, h/2 A(y)ᵀν, μ′, what the constraints say to vanish); names their letters."""
    from sympy import Matrix, Symbol

    matrix = constraint_matrix(s, s.x)
    columns = {}
    for name, size in (("λ", matrix.rows), ("ν", matrix.rows), ("μ′", len(s.mu))):
        columns[name] = Matrix([Symbol(f"{name}{i}", real=True) for i in range(size)])
        letters |= {e: name if size == 1 else f"{name}_{i + 1}"
                    for i, e in enumerate(columns[name])}  # fmt: skip
    at_end = matrix.xreplace(dict(zip(s.x, s.y, strict=True)))
    return (s.h / 2 * matrix.T * columns["λ"], s.h / 2 * at_end.T * columns["ν"], columns["μ′"],
            constraint(s, s.x) if s.holonomic else matrix * s.u)  # fmt: skip


def equations_of(scheme: Scheme) -> dict[str, Any] | None:
    """The equations of one scheme for the page, as MathML; None of a one-step map, which derives
    nothing but derivatives from its formula."""
    constrained = scheme.scene.constrained
    if scheme.one_step and not constrained:
        return None
    from discmech.integrators.compiler import is_affine
    from discmech.integrators.equations import step_system

    s: SceneSymbols = scheme.s
    out = written(scheme)
    inner = [z for p in discrete(scheme).points if not p.is_end for z in p.letters]
    coordinates = [*s.x, *s.y, *inner, *s.u, *s.v, *map(_after, inner)]
    under = "constrained_" if constrained else ""
    typeset = Typesetter(out.letters, s.h, coordinates)
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
        "affine": is_affine(step_system(scheme.equations)),
        "source": scheme.rule.source,
    }


def plain_text(terms: Terms, letters: Mapping[Any, str]) -> str:
    """A sum as one line of text: h²·sin(z) − μ₁."""
    from sympy import Symbol

    names = {symbol: Symbol(subscript(name)) for symbol, name in letters.items()}
    shown = " + ".join(str(term.xreplace(names)) for term in terms) or "0"
    shown = re.sub(r"\*\*(\d+)", lambda m: m[1].translate(_SUPER), shown)
    return shown.replace("*", "·").replace("+ -", "− ").replace("-", "−")


_SUPER = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUB = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def subscript(name: str) -> str:
    """x_1 as x₁."""
    letter, _, index = name.rpartition("_")
    return letter + index.translate(_SUB) if letter and index.isdigit() else name


def notation(scheme: Scheme) -> str:
    """What the letters of a scheme's equations stand for."""
    if not len(scheme.x):
        return "u is the velocity during this step, v during the next; h is the step size."
    words = "x is the base point at the start of this step and u the velocity during it, y and v "
    words += "the same for the next step; h is the step size."
    if scheme.s.clocked:
        words += " The last entry of a point is its time."
    for number, point in enumerate(p for p in discrete(scheme).points if not p.is_end):
        z, w = (letter + "′" * number for letter in "zw")
        words += f" {z} is the point at the fraction {point.theta} of this step, {w} of the next."
    return words


def letters_of(scheme: Scheme) -> dict[Any, str]:
    """Indices from 1, as the paper has them; z for a point inside the step, w inside the next."""
    s: SceneSymbols = scheme.s
    mapped = scheme.one_step and not scheme.scene.constrained
    points = () if mapped else discrete(scheme).points
    columns = [("x", s.x), ("u", s.u), ("v", s.v), ("y", s.y), ("μ", s.mu)]
    for number, point in enumerate(p for p in points if not p.is_end):
        columns.append(("z" + "′" * number, point.letters))
        columns.append(("w" + "′" * number, [_after(z) for z in point.letters]))
    letters = {
        symbol: letter if len(column) == 1 else f"{letter}_{i + 1}"
        for letter, column in columns for i, symbol in enumerate(column)
    }  # fmt: skip
    for parameter in s.parameter_list:
        name, _, index = str(parameter).rpartition("_")
        if index.isdigit() and name:
            letters[parameter] = f"{name}_{int(index) + 1}"
    return letters


def _after(symbol: Any) -> Any:
    """The same point in the next step."""
    from sympy import Symbol

    return Symbol(f"after {symbol}", real=True)
