"""Points that e→ and e← move in a known way, so that no expression is differentiated for them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import partial

from ..groupoids import Motion
from ..numbers import Frame, Graph, Node, NodeMatrix, Scope, opaque, symbols_of
from ..numbers.nodes import Nodes, Slopes
from ..numbers.types import Column, Expression
from .symbols import column


class Point:
    """A held point z: `letters` and `nodes`, and its motion, which `move` sets.

    ∂z/∂u is anchor · slope; e→ and e← move it by anchor · right and anchor · left. theta: its
    fraction of the straight step, or None for a point that is not on it. displacement: the matrices
    by which e→ and e← displace the point where a force acts, m×m each.
    """

    anchor: NodeMatrix
    slope: NodeMatrix
    right: NodeMatrix
    left: NodeMatrix

    def __init__(self, scope: Scope, letters: Column, nodes: list[Node], by: list[Node]) -> None:
        self.scope, self.letters, self.nodes, self.by = scope, letters, nodes, by
        self.theta: Expression | None = None
        self.frame: Frame | None = None
        self.displacement: tuple[NodeMatrix, NodeMatrix] | None = None

    @property
    def values(self) -> Column:
        """Return the values of the letters, in sympy."""
        return column(self.scope.graph.value_of(letter) for letter in self.letters)

    @property
    def is_end(self) -> bool:
        """Return True for the point y = b(x, u; h)."""
        return bool(self.theta == 1)

    def move(self, motion: Motion) -> None:
        """Set the motion of the point."""
        graph, scope = self.scope.graph, self.scope
        anchor, slope, right, left = motion
        self.anchor, self.slope, self.right = map(graph.matrix, (anchor, slope, right))
        more = graph.matrix(left - right)
        self.left = [graph.plus(*rows) for rows in zip(self.right, more, strict=True)]
        if not self.nodes:
            return
        partials = self.nodes[0].args[0].partials
        if anchor.cols < anchor.rows and symbols_of(anchor) & set(self.letters):
            letters = scope.names("e", anchor.cols)
            self.frame = Frame(graph.letters(letters), self.by, self.slope)
            scope.frames.append(self.frame)
            partials.insert(0, (self.frame.letters, self.anchor))
        elif anchor.cols:
            matrix = [graph.transposed(self.slope, row) for row in self.anchor]
            partials.insert(0, (self.by, matrix))


def place_point(
    scope: Scope, letters: Column, value: Column, by: list[Node], further: Sequence[Column]
) -> Point:
    """Hold a point. by: the nodes whose motion `Point.move` describes; further: columns of letters
    by which the value is differentiated."""
    graph = scope.graph
    values, symbols = graph.column(value), symbols_of(value)

    def slopes(nodes: list[Node]) -> NodeMatrix:
        return Scope(graph).jacobian(values, nodes)

    partials: list[tuple[Nodes, Slopes]] = [
        (nodes, partial(slopes, nodes))
        for nodes in (graph.letters(c) for c in further if len(c) and symbols & set(c))
    ]
    return Point(scope, letters, scope.group(list(letters), values, partials, False), by)


def difference(graph: Graph, one: NodeMatrix, other: NodeMatrix) -> NodeMatrix:
    """Return one − other with products multiplied out, so that like terms cancel.

    Those of functions of ours cancel unexpanded: multiplying their factors out would take long.
    """
    matrix = (graph.minus(*rows) for rows in zip(one, other, strict=True))
    return [[e if opaque(graph.order([e])) else graph.expanded(e) for e in row] for row in matrix]


def gradient_along(
    scope: Scope, point: Point, gradient: list[Node], name: str, forced: bool
) -> list[Node]:
    """Hold the gradient at a point along the k columns of its anchor.

    forced: True where a force acts; the covector may then be no gradient, without a symmetry.
    """
    graph = scope.graph
    values = graph.transposed(point.anchor, gradient)
    made = scope.group(scope.names(name, len(values)), values)
    if point.frame is not None and not forced:
        _add_symmetry(point, gradient, made)
    return [e if value else value for e, value in zip(made, values, strict=True)]


def _add_symmetry(point: Point, gradient: list[Node], along: list[Node]) -> None:
    """Give the group of a gradient along the columns A of a point's anchor the symmetry

        A_a⟨g, A_i⟩ = A_i⟨g, A_a⟩ + ⟨g, [A_a, A_i]⟩,   a < i

    along: the held nodes of ⟨g, A_i⟩. In an algebra the last terms are multiples of these.
    """
    graph, frame = point.scope.graph, point.frame
    assert frame is not None
    k = len(along)
    columns = [[row[i] for row in point.anchor] for i in range(k)]
    slopes = [Scope(graph).jacobian(c, point.nodes) for c in columns]
    commutators = [[graph.number(0)] * k for _ in range(k)]
    for a, i in itertools.combinations(range(k), 2):
        field = [
            graph.sum(
                [*((1, e * z) for e, z in zip(ahead, columns[a], strict=True) if e and z),
                 *((-1, e * z) for e, z in zip(back, columns[i], strict=True) if e and z)]
            )
            for ahead, back in zip(slopes[i], slopes[a], strict=True)
        ]  # fmt: skip
        if any(field):
            ratios = ((_ratio(field, c), e) for c, e in zip(columns, along, strict=True))
            multiples = (r * e for r, e in ratios if r is not None)
            whole = graph.sum((1, g * e) for g, e in zip(gradient, field, strict=True))
            commutators[i][a] = next(multiples, whole)
    along[0].args[0].symmetry = frame.letters, commutators


def _ratio(field: Sequence[Node], of: Sequence[Node]) -> Node | None:
    """Return r if the field is r times the other one, else None."""
    graph = field[0].graph
    pairs = [(e, f) for e, f in zip(field, of, strict=True) if e or f]
    if not pairs[0][1]:
        return None
    ratio = graph.product([(pairs[0][0], 1), (pairs[0][1], -1)])
    return ratio if all(e is ratio * f for e, f in pairs) else None
