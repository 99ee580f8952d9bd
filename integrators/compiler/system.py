"""One step of a method as plain data: what the compiler is given.

Rows E(x, w; q) in w = (u, s) are solved against (μ, 0); then (x, μ) grows by (increment, gain).
Everything is an expression in x, w, y, q and the letters of `definitions`; nothing here
knows a scheme, a groupoid or a rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from ..numbers import Definition, Letters
from ..numbers.types import Column, Expression, Letter, Mpf, SymbolicMatrix


@dataclass(frozen=True, eq=False)
class System:
    """The equations of one step (paper, sections 2.4 and 3.5, on the dual algebroid).

    q: h first, then parameters, the numbers of the rule, and the entries of a translate.
    rows: E/h, as many as w; solved against `wanted`, which is (μ, 0) if it is not given. slope:
    ∂(E/h)/∂w, square. y: the letters of the target where an expression needs it. increment: y − x,
    n. gain: (F⁺ − F⁻)/h, m.
    explicit: the rows are w − E, and E holds no w, directly or in the letters of `definitions`.
    more: unknowns behind u in w that a run's rows hold.
    scaled: those u that the chart depends on; kernels write them as ξ = hu.
    along: (letters, values) where the solution of the linear equations is not dw itself but a
    displacement c in the group: c's letters, and dw in them.
    extents: [(kind, expression)], sizes that tell how near the edge of the chart a step is.
    branch: the number that tells solutions apart, or None.
    constants: letters of q that are irrational numbers of the rule, as functions digits → mpf.
    composed: whether a step is a row of substeps of this system and of `adjoint`.
    in_two_units: whether w holds slopes of x and of μ, which have no unit in common.
    """

    name: str
    q: Letters
    x: Letters
    u: Letters
    w: Letters
    mu: Letters
    y: Letters
    rows: Column
    slope: SymbolicMatrix
    increment: Column
    gain: Column
    definitions: tuple[Definition, ...] = ()
    scaled: Letters = ()
    along: tuple[Letters, tuple[Expression, ...]] | None = None
    extents: tuple[tuple[str, Expression], ...] = ()
    branch: Expression | None = None
    constants: Mapping[Letter, Callable[[int], Mpf]] = field(default_factory=dict)
    wanted: tuple[Expression, ...] = ()
    explicit: bool = False
    more: int = 0
    composed: bool = False
    in_two_units: bool = False
    adjoint: System | None = None


def written(*parts: Any) -> str:
    """All of a system (or of expressions) as text, each subexpression once."""
    known: dict[Expression, int] = {}
    lines: list[str] = []

    def number(e: Expression) -> int:
        if e not in known:
            inner = [number(a) for a in getattr(e, "args", ())]
            lines.append(f"{type(e).__name__} {inner or e}")
            known[e] = len(known)
        return known[e]

    def visit(item: Any) -> Any:
        if is_dataclass(item):
            return [visit(getattr(item, f.name)) for f in fields(item) if f.name != "constants"]
        if isinstance(item, (str, bool, type(None))):
            return item
        return [visit(i) for i in item] if hasattr(item, "__len__") else number(item)

    return f"{visit(parts)}\n" + "\n".join(lines)
