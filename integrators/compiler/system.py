"""One step of a method as plain data, the input of the compiler.

Rows E(x, w; q) in w = (u, s) are solved against (μ, 0); then (x, μ) grows by (increment, gain). All
are expressions in x, w, y, q and the letters of `definitions`; this file does not know schemes,
groupoids or rules.
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
    rows: E/h, as many as w, solved against `wanted`, which is (μ, 0) unless it is given. slope:
    ∂(E/h)/∂w, square. y: the letters of the target, if an expression needs it. increment: y − x,
    length n. gain: (F⁺ − F⁻)/h, length m.
    explicit: True if the rows are w − E and E contains no w, neither directly nor in definitions.
    multipliers: the number of unknowns in w after u that a run's rows hold.
    scaled: those u on which the chart depends; kernels write them as ξ = hu.
    along: (letters, values) if the linear equations are solved not for dw itself but for a
    displacement c in the group: c's letters, and dw in terms of them.
    extents: [(kind, expression)], sizes that tell how near the edge of the chart a step is.
    branch: the number that tells solutions apart, or None.
    constants: letters of q that are irrational numbers of the rule, with functions digits → mpf.
    composed: True if a step is a row of substeps of this system and of `adjoint`.
    in_two_units: True if w holds slopes of x and of μ, which have different units.
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
    multipliers: int = 0
    composed: bool = False
    in_two_units: bool = False
    adjoint: System | None = None


def written(*parts: Any) -> str:
    """Return a system (or expressions) as text, with each subexpression written once."""
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
