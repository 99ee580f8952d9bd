"""One step of a method as plain data, the input of the compiler.

Rows E(x, w; q) in the unknowns w are solved against (μ, 0); then (x, μ) grows by (increment, gain).
All are expressions in x, w, y, q and the letters of `graph` for held nodes; this file does not know
schemes, groupoids or rules.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, Literal

from ..numbers import Graph, Letters, Node
from ..numbers.nodes import HELD
from ..numbers.types import Entries, Expression, Letter, Mpf

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
    graph: that of the letters for held nodes; expressions may be nodes of it.
    kinds: those of the unknowns, one each; slopes and impulses have units of their own.
    explicit: True if the rows are w − E and E contains no w, neither directly nor in held nodes.
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
    rows: Entries
    slope: Entries
    increment: Entries
    gain: Entries
    graph: Graph | None = None
    scaled: Letters = ()
    along: tuple[Letters, tuple[Expression, ...]] | None = None
    extents: tuple[tuple[str, Expression], ...] = ()
    branch: Expression | None = None
    constants: Mapping[Letter, Callable[[int], Mpf]] = field(default_factory=dict)
    wanted: tuple[Expression | Node, ...] = ()
    kinds: Sequence[Kind] = ()
    explicit: bool = False
    composed: bool = False
    adjoint: Step | None = None

    @cached_property
    def nodes(self) -> StepNodes:
        """The step in nodes of its graph."""
        return StepNodes(self)

    def at(self, swap: Mapping[Letter, Expression | Node]) -> Step:
        """Return the step with expressions in place of letters in all that a step computes."""
        nodes, graph = self.nodes, self.nodes.graph
        parts = [nodes.rows, *nodes.slope, nodes.increment, nodes.gain, nodes.wanted, nodes.y]
        swapped = {graph.read(a).index: graph.node(e) for a, e in swap.items()}
        made = iter(graph.rebuilt([e for part in parts for e in part], swapped))
        rows, *slope, increment, gain, wanted, y = ([next(made) for _ in part] for part in parts)
        # a held y has a new letter if its value changes
        ends = (graph.shown(e) if e.kind == HELD else a for e, a in zip(y, self.y, strict=True))
        return replace(
            self, graph=graph, rows=rows, slope=[e for row in slope for e in row],
            increment=increment, gain=gain, wanted=tuple(wanted), y=tuple(ends),
        )  # fmt: skip

    @property
    def multipliers(self) -> int:
        """The number of multipliers that a run's rows hold."""
        return self.kinds.count("multiplier")


class StepNodes:
    """The letters x, u, w, mu, y, q and the expressions of a step, as lists of nodes.

    slope is a list of rows; wanted has as many entries as rows.
    """

    def __init__(self, step: Step) -> None:
        self.step = step
        self.graph = graph = step.graph or Graph()
        letters = (step.x, step.u, step.w, step.mu, step.y, step.q)
        self.x, self.u, self.w, self.mu, self.y, self.q = map(graph.letters, letters)
        self.rows, self.increment, self.gain = map(
            graph.column, (step.rows, step.increment, step.gain)
        )
        entries, m = graph.column(step.slope), len(step.w)
        self.slope = [entries[i * m : i * m + m] for i in range(m)]
        self.wanted = graph.column(step.wanted or [*step.mu, *[0] * (m - len(step.mu))])

    @property
    def keys(self) -> list[object]:
        """Return everything that a step's kernels are made from, as text."""
        step, graph = self.step, self.graph
        along = step.along[1] if step.along else ()
        branch = () if step.branch is None else (step.branch,)
        columns = (self.rows, self.increment, self.gain, *self.slope, self.wanted,
                   graph.column([*along, *branch, *(e for _, e in step.extents)]))  # fmt: skip
        letters = (step.q, step.x, step.u, step.w, step.mu, step.y, step.scaled,
                   step.along[0] if step.along else ())  # fmt: skip
        facts = (step.name, [kind for kind, _ in step.extents], [*step.kinds], step.explicit,
                 step.composed)  # fmt: skip
        other = step.adjoint.nodes.keys if step.adjoint else None
        return [facts, [[*map(str, e)] for e in letters],
                [[graph.key(e) for e in column] for column in columns], other]  # fmt: skip


def written(*parts: object) -> str:
    """Return a step (or expressions) as text, with each subexpression written once."""
    known: dict[Expression, int] = {}
    lines: list[str] = []

    def number(e: Expression) -> int:
        if e not in known:
            inner = [number(a) for a in getattr(e, "args", ())]
            lines.append(f"{type(e).__name__} {inner or e}")
            known[e] = len(known)
        return known[e]

    def visit(item: Any) -> object:
        if isinstance(item, Step):
            return item.nodes.keys
        if isinstance(item, Node):
            return item.graph.key(item)
        if is_dataclass(item):
            return [visit(getattr(item, f.name)) for f in fields(item) if f.name != "constants"]
        if isinstance(item, (str, bool, type(None))):
            return item
        return [visit(i) for i in item] if hasattr(item, "__len__") else number(item)

    return f"{visit(parts)}\n" + "\n".join(lines)
