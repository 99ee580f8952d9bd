"""The report: every study, the equations of every scheme, one page."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.equations import SceneSymbols
from discmech.integrators.numbers import flatten
from discmech.integrators.scene import Scene

from .. import NAMES, get
from ..core.case import Choice, Progress, silent
from ..core.fingerprint import of_views
from ..core.running import cores, run_studies
from ..core.store import Store


def make_report(
    choice: Choice,
    folder: Path,
    progress: Progress = silent,
    jobs: int | None = None,
    store: Store | None = None,
) -> tuple[list[dict[str, Any]], Path]:
    """Run all studies and write the page; returns (results, path of the page).

    Studies that apply to none of the chosen scenes are left out. Where nothing was chosen, what is
    about the bench and not about a scene joins in: the cost of references, and a sample of the
    mutation study.
    """
    from ..report.page import write_report

    studies = [study for study in map(get, NAMES) if list(study.cases(choice))]
    results, equations = run_studies(
        studies, choice, progress, store=store, jobs=jobs, also=equations_of
    )
    if choice == Choice():
        from ..power.results import power
        from ..references import measuring as costs

        results.append(costs.measure(progress, costs.DIGITS[:6], costs.TIMES[:6], store))
        results.append(power(progress, jobs or cores(), store=store))
    progress("figures", 1.0)
    scenes = list({scene.name: scene for scene, _ in choice.pairs()}.values())
    page = write_report(
        results, equations, [about(s) for s in scenes], folder, "make report", _drawn_once(store)
    )
    return results, page


def _drawn_once(store: Store | None) -> Callable[[Any, Callable[[], Any]], Any] | None:
    """What gives figures from the store, or draws them and keeps them there."""
    if store is None:
        return None

    def remembered(words: Any, make: Callable[[], Any]) -> Any:
        return store.remembered(of_views(json.dumps(words)), make)

    return remembered


def write_study(result: dict[str, Any], choice: Choice, folder: Path) -> Path:
    """The page of one study with its figures and tables in a folder; returns the page's path."""
    from ..report.page import write_report

    named = {case["scene"] for case in result["cases"]}
    scenes = {scene.name: about(scene) for scene, _ in choice.pairs() if scene.name in named}
    return write_report([result], [], list(scenes.values()), folder, result["command"])


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
    """What was derived for one scheme, typeset, the points of a step kept as letters.

    Exact: terms are only collected in powers of h and factored. F⁺ and F⁻ are divided by h.
    """
    from discmech.integrators.compiler import is_affine
    from discmech.integrators.equations import step_system

    from ..report.formulas import Typesetter, ascending

    s: SceneSymbols = scheme.s
    points = [p for p in scheme.points if not p.is_end]
    inner = [z for p in points for z in p.letters]
    base = {*s.x, *s.y, *inner}
    letters = _letters(scheme)
    typeset = Typesetter(letters, s.h, [*base, *s.u, *s.v, *map(_after, inner)])
    after = dict(zip([*s.x, *s.u, *inner], [*s.y, *s.v, *map(_after, inner)], strict=True))
    below: dict[Any, Any] = {}  # denominators that the equations share, by their letter

    def terms(expression: Any, named: dict[Any, Any] | None = None) -> list[Any]:
        return ascending(expression, s.h, base, named)

    plus = [terms(e / s.h, below) for e in scheme.at_points.plus]
    minus = [terms(e / s.h, below) for e in scheme.at_points.minus]
    for letter, value in below.items():
        after[letter] = _after(letter)
        for symbol, names in ((letter, ("x", "u")), (after[letter], ("y", "v"))):
            shown = names if value.free_symbols & set(s.x) else names[1:]
            letters[symbol] = f"{letter}({', '.join(shown)})"
    values = [(p.letters, p.values) for p in points]
    if len(s.x):
        values.append((s.y, scheme.scene.groupoid.target(s.x, s.u, s.h)))
    return {
        "scene": scheme.scene.name,
        "rule": scheme.rule.name,
        "retraction": scheme.scene.groupoid.retraction,
        "notation": _notation(scheme),
        "lagrangian_mathml": typeset.sum(terms(s.lagrangian)) if scheme.scene.lagrangian else "",
        "discrete_lagrangian_mathml": typeset.sum(terms(scheme.at_points.discrete_lagrangian)),
        "points_mathml": [
            typeset.equation([z], terms(b))
            for column, value in values for z, b in zip(column, value, strict=True)
        ],
        "momentum_mathml": [
            *(typeset.equation([mu], e) for mu, e in zip(s.mu, minus, strict=True)),
            *(typeset.equation([letter], [value]) for letter, value in below.items()),
        ],
        "residual_mathml": [
            typeset.equation(here, [e.xreplace(after) for e in there])
            for here, there in zip(plus, minus, strict=True)
        ],
        "self_adjoint": scheme.self_adjoint,
        "affine": is_affine(step_system(scheme.equations)),
        "source": scheme.rule.source,
    }  # fmt: skip


def _notation(scheme: Scheme) -> str:
    """What the letters of a scheme's equations stand for."""
    if not len(scheme.x):
        return "u is the velocity during this step, v during the next; h is the step size."
    words = "x is the base point at the start of this step and u the velocity during it, y and v "
    words += "the same for the next step; h is the step size."
    for number, point in enumerate(p for p in scheme.points if not p.is_end):
        z, w = (letter + "′" * number for letter in "zw")
        words += f" {z} is the point at the fraction {point.theta} of this step, {w} of the next."
    return words


def _letters(scheme: Scheme) -> dict[Any, str]:
    """Indices from 1, as the paper has them; z for a point inside the step, w inside the next."""
    s: SceneSymbols = scheme.s
    columns = [("x", s.x), ("u", s.u), ("v", s.v), ("y", s.y), ("μ", s.mu)]
    for number, point in enumerate(p for p in scheme.points if not p.is_end):
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
