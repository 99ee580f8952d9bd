"""One step of a method as plain data, the input of the compiler.

Rows E(x, w; q) in the unknowns w are solved against (μ, 0); then (x, μ) grows by (increment, gain).
All are expressions in x, w, y, q and the letters of `definitions`; this file does not know schemes,
groupoids or rules.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal

from ..numbers import Definition, Letters
from ..numbers.types import Column, Expression, Letter, Mpf, SymbolicMatrix

#: the kind of an unknown: u or another velocity, a stage, a slope of z = (x, μ), a multiplier that
#: the rows of a run hold, an impulse at the end of a step, a place over h
Kind = Literal["velocity", "stage", "slope", "multiplier", "impulse", "place"]


def kinds_of(*blocks: tuple[Kind, Iterable[Letter]]) -> tuple[Kind, ...]:
    """Return the kind of each unknown, for blocks of letters of one kind."""
    return tuple(kind for kind, letters in blocks for _ in letters)


@dataclass(frozen=True, eq=False)
class Step:
    """The equations of one step (paper, sections 2.4 and 3.5, on the dual algebroid).

    q: h first, then parameters, the numbers of the rule, and the entries of a translate.
    rows: E/h, as many as w, solved against `wanted`, which is (μ, 0) unless it is given. slope:
    ∂(E/h)/∂w, square. y: the letters of the target, if an expression needs it. increment: y − x,
    length n. gain: (F⁺ − F⁻)/h, length m.
    kinds: those of the unknowns, one each; slopes and impulses have units of their own.
    explicit: True if the rows are w − E and E contains no w, neither directly nor in definitions.
    scaled: those u on which the chart depends; kernels write them as ξ = hu.
    along: (letters, values) if the linear equations are solved not for dw itself but for a
    displacement c in the group: c's letters, and dw in terms of them.
    extents: [(kind, expression)], sizes that tell how near the edge of the chart a step is.
    branch: the number that tells solutions apart, or None.
    constants: letters of q that are irrational numbers of the rule, with functions digits → mpf.
    composed: True if a step is a row of substeps of this step and of `adjoint`.
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
    kinds: Sequence[Kind] = ()
    explicit: bool = False
    composed: bool = False
    adjoint: Step | None = None

    @property
    def multipliers(self) -> int:
        """The number of multipliers that a run's rows hold."""
        return self.kinds.count("multiplier")


def written(*parts: Any) -> str:
    """Return a step (or expressions) as text, with each subexpression written once."""
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
