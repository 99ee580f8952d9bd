"""The methods of a page: each with its author's words, and its formula or its function's text."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable
from typing import Any

from discmech.integrators import Discretisation, Scheme, scenes
from discmech.integrators.errors import DiscmechError

from ..core.parts import parts_of
from ..core.side_by_side import answer
from ..core.store import Store
from ..report.formulas import Typesetter, display, spaced
from .stage_sums import StageSum

#: the scene of a general discrete Lagrangian: it has a base point, and no letters of a group
PLAIN = "pendulum"
MOST_STAGES = 3  # largest number of stages of a readable formula
MOST_LINES = 40  # largest number of lines of a function's text
MOST_SHARES = 9  # largest number of listed coefficients of a composition
LETTERS = "l is the Lagrangian, b(x, w) the point to which w leads from x, y = b(x, hu) the end"
STAGES = ", s the internal stages, in which L_d is stationary, V the velocity of a curve"


def about_methods(
    pairs: Iterable[tuple[Any, Discretisation]], store: Store | None = None
) -> list[dict[str, Any]]:
    """Return {"name", "facts", "words", "formula", "letters", "code"} of each rule, in order.

    Formulas are kept in the store.
    """
    met: dict[str, tuple[Any, Discretisation]] = {}
    for scene, rule in pairs:
        met.setdefault(rule.name, (scene, rule))
    return [_about(scene, rule, store) for scene, rule in met.values()]


def _about(scene: Any, rule: Discretisation, store: Store | None) -> dict[str, Any]:
    base = rule.of_step
    facts = [rule.kind, f"order {rule.order} declared" if rule.order else "no order declared"]
    words = [(inspect.getdoc(base.formula) or "").partition(" Raises `")[0]]
    if rule.method is not None:
        words.insert(0, _composed(rule))
    formula = _formula(scene, base, store)
    return {
        "name": rule.name,
        "facts": facts,
        "words": [said for said in words if said],
        "formula": formula,
        "letters": _letters(rule, base) if formula else "",
        "source": "" if rule.source in words else rule.source,
        "code": "" if formula else _text(base.formula),
    }


def _letters(rule: Discretisation, base: Discretisation) -> str:
    words = LETTERS + (STAGES if base.stages else "")
    return words + ("." if rule is base else ". The formula is that of one substep, of size h.")


def _composed(rule: Any) -> str:
    shares = [f"{float(c):.6g}".replace("-", "−") for c in rule.method.coefficients(20)]
    if len(shares) > MOST_SHARES:
        shares = [*shares[: MOST_SHARES // 2], "…", *shares[-(MOST_SHARES // 2) :]]
    of = f"{rule.base.name} and its adjoint in turn" if rule.method.in_turn else rule.base.name
    return f"A step of size h is made of substeps by {of}, of sizes {' h, '.join(shares)} h."


def _formula(scene: Any, rule: Discretisation, store: Store | None) -> str:
    """Return the formula of L_d, or "" if it is no short weighted sum of values of l."""
    if not rule.asks_lagrangian or rule.splits or rule.stages > MOST_STAGES:
        return ""
    plain = scenes.get(PLAIN)
    scene = plain if rule.applies(plain) else scene
    try:
        if "sites" in parts_of(scene) or scene.discrete_lagrangian is not None:
            return ""
        return str(answer(formula_of, store, (scene, rule)))
    except (DiscmechError, AttributeError):  # verdicts report equations that cannot be derived
        return ""


def formula_of(scheme: Scheme) -> str:
    """Return the formula of a scheme's L_d, or "" if it is no weighted sum of values of l."""
    from sympy import Symbol

    if not (of := scheme.discrete.of).weighted:
        return ""
    whole = StageSum(scheme.s, of)
    return display(spaced(Typesetter(whole.letters).equation([Symbol("L_d")], whole.terms)))


def _text(function: Any) -> str:
    """Return the text of the function if it is short and available, else ""."""
    try:
        lines = textwrap.dedent(inspect.getsource(function)).rstrip().splitlines()
    except (OSError, TypeError):
        return ""
    return "\n".join(lines) if len(lines) <= MOST_LINES else ""
