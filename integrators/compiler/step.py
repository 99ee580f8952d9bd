"""One step of a method as plain data, the input of the compiler.

Rows E(x, w; q) in the unknowns w are solved against (μ, 0); then (x, μ) grows by (increment, gain).
All are nodes of `graph` in the letters x, w, y, q; this file does not know schemes, groupoids or
rules.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import partial
from typing import Any, Literal

from ..numbers import Graph, Letters, Node
from ..numbers.nodes import HELD, NodeMatrix
from ..numbers.types import Expression, Letter, Mpf

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
    ∂(E/h)/∂w, square, row by row. y: the letters of the target, if an expression needs it.
    increment: y − x, length n. gain: (F⁺ − F⁻)/h, length m.
    graph: that of the nodes; expressions of sympy may be given, and are read.
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
    rows: list[Node]
    slope: NodeMatrix
    increment: list[Node]
    gain: list[Node]
    graph: Graph = field(default_factory=Graph)
    scaled: Letters = ()
    along: tuple[Letters, list[Node]] | None = None
    extents: Sequence[tuple[str, Node]] = ()
    branch: Node | None = None
    constants: Mapping[Letter, Callable[[int], Mpf]] = field(default_factory=dict)
    wanted: Sequence[Node] = ()
    kinds: Sequence[Kind] = ()
    explicit: bool = False
    composed: bool = False
    adjoint: Step | None = None

    def __post_init__(self) -> None:
        """Read all expressions as nodes of the graph, in one order, on which texts depend."""
        graph, put = self.graph, partial(object.__setattr__, self)
        for letters in (self.x, self.u, self.w, self.mu, self.y, self.q):
            graph.letters(letters)
        for name in ("rows", "increment", "gain"):
            put(name, graph.column(getattr(self, name)))
        put("slope", [graph.column(row) for row in self.slope])
        rest = [0] * (len(self.w) - len(self.mu))
        put("wanted", graph.column(self.wanted or [*self.mu, *rest]))
        if self.along is not None:
            put("along", (self.along[0], graph.column(self.along[1])))
        if self.branch is not None:
            put("branch", graph.node(self.branch))
        put("extents", tuple((kind, graph.node(e)) for kind, e in self.extents))

    def at(self, swap: Mapping[Letter, Node]) -> Step:
        """Return the step with nodes in place of letters in all that a step computes."""
        graph = self.graph
        ends = graph.letters(self.y)
        parts = [self.rows, *self.slope, self.increment, self.gain, self.wanted, ends]
        swapped = {graph.read(a).index: e for a, e in swap.items()}
        made = iter(graph.rebuilt([e for part in parts for e in part], swapped))
        rows, *slope, increment, gain, wanted, y = ([next(made) for _ in part] for part in parts)
        # a held y has a new letter if its value changes
        new = (graph.shown(e) if e.kind == HELD else a for e, a in zip(y, self.y, strict=True))
        return replace(
            self, rows=rows, slope=slope, increment=increment, gain=gain, wanted=wanted,
            y=tuple(new),
        )  # fmt: skip

    @property
    def system(self) -> list[Node]:
        """The rows, and behind them the entries of their slope."""
        return [*self.rows, *(e for row in self.slope for e in row)]

    @property
    def keys(self) -> list[object]:
        """Everything that a step's kernels are made from, as text."""
        along = self.along[1] if self.along else ()
        branch = () if self.branch is None else (self.branch,)
        columns = (self.rows, self.increment, self.gain, *self.slope, self.wanted,
                   [*along, *branch, *(e for _, e in self.extents)])  # fmt: skip
        letters = (self.q, self.x, self.u, self.w, self.mu, self.y, self.scaled,
                   self.along[0] if self.along else ())  # fmt: skip
        facts = (self.name, [kind for kind, _ in self.extents], [*self.kinds], self.explicit,
                 self.composed)  # fmt: skip
        return [facts, [[*map(str, e)] for e in letters],
                [[self.graph.key(e) for e in column] for column in columns],
                self.adjoint.keys if self.adjoint else None]  # fmt: skip

    @property
    def multipliers(self) -> int:
        """The number of multipliers that a run's rows hold."""
        return self.kinds.count("multiplier")


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
            return item.keys
        if isinstance(item, Node):
            return item.graph.key(item)
        if is_dataclass(item):
            return [visit(getattr(item, f.name)) for f in fields(item) if f.name != "constants"]
        if isinstance(item, (str, bool, type(None))):
            return item
        return [visit(i) for i in item] if hasattr(item, "__len__") else number(item)

    return f"{visit(parts)}\n" + "\n".join(lines)
