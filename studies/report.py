"""The report: every study, the equations of every scheme, one page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from integrators import Scheme
from integrators.exact import flatten
from integrators.scene import Scene
from integrators.symbols import SceneSymbols

from . import NAMES, get
from .case import Choice, Progress, run_study, silent


def make_report(
    choice: Choice, folder: Path, progress: Progress = silent
) -> tuple[list[dict[str, Any]], Path]:
    """Run all studies and write the page; returns (results, path of the page).

    Studies that apply to none of the chosen scenes are left out.
    """
    from .rendering.page import write_report

    results = []
    for i, name in enumerate(NAMES):
        study = get(name)
        if not list(study.cases(choice)):
            continue

        def share(label: str, fraction: float, i: int = i, name: str = name) -> None:
            progress(f"{name} · {label}", (i + fraction) / (len(NAMES) + 1))

        results.append(run_study(study, choice, share, keep=True))
    progress("equations and figures", len(NAMES) / (len(NAMES) + 1))
    pairs = list(choice.pairs())
    scenes = list({scene.name: scene for scene, _ in pairs}.values())
    equations = [equations_of(Scheme(scene, rule)) for scene, rule in pairs]
    page = write_report(results, equations, [about(s) for s in scenes], folder, "make report")
    return results, page


def about(scene: Scene) -> dict[str, Any]:
    """A scene's line in the report."""
    values = {
        name: "(" + ", ".join(map(str, flatten(value))) + ")" if isinstance(value, tuple) else value
        for name, value in scene.parameters.items()
    }
    return {
        "name": scene.name,
        "title": scene.title or scene.name,
        "source": scene.source,
        "groupoid": scene.groupoid.name,
        "dim_x": scene.groupoid.dim_x,
        "dim_u": scene.groupoid.dim_u,
        "parameters": ", ".join(f"{name} = {value}" for name, value in values.items()),
        "symmetries": [f"{q.name} ({q.kind})" for q in scene.symmetries],
    }


def equations_of(scheme: Scheme) -> dict[str, Any]:
    """The discrete Euler–Lagrange equations F⁺(x, u) = F⁻(y, v), typeset, points kept as letters."""
    from sympy import Eq, factor_terms
    from sympy.printing.mathml import mathml

    from integrators.kernels import KernelBuilder

    shown = _letters(scheme)

    def typeset(expression: Any) -> str:
        return str(mathml(expression.xreplace(shown), printer="presentation"))

    s = scheme.s
    here = [factor_terms(e) for e in scheme.plus_at_points]
    there = [factor_terms(e) for e in scheme.minus_at_points]
    next_step = {**dict(zip(s.x, s.y, strict=True)), **dict(zip(s.u, s.v, strict=True))}
    points = [
        typeset(Eq(z, b, evaluate=False))
        for p in scheme.points for z, b in zip(p.z, p.value, strict=True)
    ]  # fmt: skip
    primed = {z: _after(z) for p in scheme.points for z in p.z}
    residual = [
        typeset(Eq(plus, minus.xreplace({**primed, **next_step}), evaluate=False))
        for plus, minus in zip(here, there, strict=True)
    ]
    return {
        "scene": scheme.scene.name,
        "rule": scheme.rule.name,
        "retraction": scheme.scene.groupoid.retraction,
        "lagrangian_mathml": typeset(s.lagrangian) if scheme.scene.lagrangian else "",
        "discrete_lagrangian_mathml": typeset(scheme.discrete_lagrangian_at_points),
        "residual_mathml": residual + points,
        "legendre_minus_mathml": [typeset(e) for e in there],
        "self_adjoint": scheme.self_adjoint,
        "affine": KernelBuilder(scheme).affine,
        "source": scheme.rule.source,
    }


def _letters(scheme: Scheme) -> dict[Any, Any]:
    """Indices from 1, as the paper has them; one letter z a point inside the step."""
    from sympy import Symbol

    s: SceneSymbols = scheme.s
    letters = {}
    for letter, column in (("x", s.x), ("u", s.u), ("v", s.v), ("y", s.y)):
        for i, symbol in enumerate(column):
            letters[symbol] = Symbol(letter if len(column) == 1 else f"{letter}_{i + 1}")
    for number, point in enumerate(p for p in scheme.points if not p.is_end):
        letter = "z" + "'" * number
        for i, symbol in enumerate(point.z):
            letters[symbol] = Symbol(letter if len(point.z) == 1 else f"{letter}_{i + 1}")
            letters[_after(symbol)] = Symbol(str(letters[symbol]).replace("z", "w"))
    for parameter in s.parameter_list:
        name, _, index = str(parameter).rpartition("_")
        if index.isdigit() and name:
            letters[parameter] = Symbol(f"{name}_{int(index) + 1}")
    return letters


def _after(symbol: Any) -> Any:
    from sympy import Symbol

    return Symbol(f"after {symbol}", real=True)
