"""The Lagrangian at a node of a curve, as one function that is derived once.

On the straight step a rule asks for L at (b(x, u; θh), u), which is a small expression in the
letters of that point. At a node of a curve w(θ) in the chart it is

    Λ(x, W, D) = l(b(x, W; 1), L(x, W)⁻¹ D),   W = hw(θ), D = dw/dθ,

and this function is derived once (`CurveTerm`): k nodes are k calls of one function (`Placed`).

Points move along e→ and e← in a known way, so that no expression is differentiated for them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial

from ..groupoids import Motion
from ..numbers import (
    Frame,
    Graph,
    Node,
    NodeMatrix,
    Rational,
    Scope,
    opaque,
    symbols_of,
    sympy,
)
from ..numbers.nodes import Nodes, Slopes
from ..numbers.types import Column, Expression, Letter
from .symbols import SceneSymbols, column, vector


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


class CurveTerm:
    """Λ at a node of a curve, and all derivatives of it that are asked for, as one function.

    base: the letters of the node's base point (x, or the end y of the step). point: the letters of
    the node's point where they are known (the ends of the step), or None: then it is b(base, W; 1).
    moving: True if the velocity is L(base, W)⁻¹ D, False if it is D itself. Derivatives of the
    function's results are written in letters r0, r1, … of results, up to a number.
    """

    def __init__(
        self,
        graph: Graph,
        s: SceneSymbols,
        name: str,
        base: Column,
        point: list[Node] | None,
        moving: bool,
    ) -> None:
        self.graph, self.name, groupoid = graph, name, s.groupoid
        m, one = groupoid.dim_u, sympy.Integer(1)
        self.scope = Scope(graph)
        W, D = vector("cw0", m), vector("cd0", m)
        # where there is a time, W takes some of it
        letters: list[Letter] = [*W, *D]
        self.columns: dict[str, list[Node]] = {
            "W": graph.letters(W), "D": graph.letters(D), "base": graph.letters(base),
            "point": [] if point is None else point,
        }  # fmt: skip
        self.scope.given = [*self.columns["base"], *self.columns["point"]]
        self.results: list[Node] = []
        self._known: dict[int, Node] = {}
        self._numbers: dict[int, int] = {}  # number of each result, by the index of its letter
        self._slopes: dict[tuple[int, str], list[Node]] = {}
        none = [graph.number(0)] * m
        along, at = none, None
        if point is None:
            z, value = vector("zz0", len(base)), groupoid.target(base, W, one)
            if s.clocked:
                letters.append(sympy.Symbol("ct0", real=True))
                value[-1] = base[-1] + letters[-1]
            at = place_point(self.scope, z, value, self.columns["W"], [base])
            at.move(groupoid.point_motion(base, W, one, one, z))
        z_nodes = self.columns["point"] if at is None else at.nodes
        self.arguments = graph.letters(letters)
        xi = self.columns["D"]
        if moving:
            velocity = graph.column(groupoid.inverse_left(base, W, one) * D)
            above, below = zip(*(e.fraction() for e in velocity), strict=True)
            xi = self.scope.quotients(above, below, "v")
        self._value, (at_z, at_xi), force = placed(graph, s, z_nodes, xi)
        at_z = self.scope.held(at_z, "gg", named=False)
        at_xi = self.scope.held(at_xi, "gg", named=False)
        force = self.scope.held(force, "gg", named=False)
        if at is not None and len(z_nodes):
            along_anchor = graph.transposed(at.anchor, at_z)
            if at.frame is not None:
                along_anchor = gradient_along(self.scope, at, at_z, "k", bool(force))
            along = graph.transposed(at.slope, along_anchor, m)
            if force:
                pull = graph.matrix(groupoid.inverse_left(base, W, one))
                along = graph.plus(along, graph.transposed(pull, force))
        turned = along
        if any(along):
            turned = graph.transposed(graph.matrix(groupoid.R(base, W, one)), along)
        outputs = {
            part: graph.transposed(self.scope.jacobian(xi, self.columns[part]), at_xi)
            if self.columns[part] else []
            for part in ("W", "D", "base")
        }  # fmt: skip
        outputs["W"] = graph.plus(outputs["W"], along)
        outputs |= {"point": [] if point is None else at_z, "turned": turned}
        outputs["force"] = [] if point is None else force
        #: ∂Λ by the chart values W, D and by the base; by the point where its letters are known,
        #: and the force there; the terms that the motion of the base adds by e→(b) = 0
        self.gradient = {part: [self._result(e) for e in es] for part, es in outputs.items()}
        #: results that are entries of ∂Λ/∂(W, D), up to a sign: {number: (entry, sign)}
        self._in_gradient: dict[int, tuple[int, Rational]] = {}
        if not force:  # with a force, Λ's derivative is not a gradient
            for i, e in enumerate([*self.gradient["W"], *self.gradient["D"]]):
                sign, letter = e.scaled
                if letter.index in self._numbers and abs(sign) == 1:
                    self._in_gradient[self._numbers[letter.index]] = i, sign

    @property
    def value(self) -> Node:
        """Return Λ itself."""
        return self._result(self._value)

    def _result(self, value: Node) -> Node:
        """Return the letter of a value as a result; return an argument or a constant itself.

        What varies by no derivative, such as cos² + sin², still has letters of the function.
        """
        graph, (sign, core) = self.graph, value.scaled
        if core.is_letter or not (graph.slopes(value) or graph.varies(value)):
            return value
        if abs(sign) != 1:
            sign, core = 1, value
        if value.leads_negative:
            sign, core = -1, -value
        if core.index not in self._known:
            letter = graph.read(sympy.Symbol(f"r{len(self.results)}", real=True))
            self._known[core.index] = letter
            self._numbers[letter.index] = len(self.results)
            self.results.append(core)
        return graph.sum([(sign, self._known[core.index])])

    def slopes(self, number: int, part: str) -> list[Node]:
        """Return ∂(result)/∂(part) in letters of results, for the number of a result."""
        key = number, part
        if key not in self._slopes:
            if part in ("W", "D") and number in self._in_gradient:
                self._add_hessian()
            else:
                (row,) = self.scope.jacobian([self.results[number]], self.columns[part])
                self._slopes[key] = [self._result(e) for e in row]
        return self._slopes[key]

    def _add_hessian(self) -> None:
        """Add second derivatives by (W, D): they are symmetric, so half of them are results."""
        W, D = self.columns["W"], self.columns["D"]
        size = len(W) + len(D)
        H = [[self.graph.number(0)] * size for _ in range(size)]
        of_entry = {i: (number, sign) for number, (i, sign) in self._in_gradient.items()}
        for i, e in enumerate([*self.gradient["W"], *self.gradient["D"]]):
            if i in of_entry:
                number, sign = of_entry[i]
                value = self.graph.sum([(sign, self.results[number])])
            else:
                sign, letter = e.scaled
                known = self._numbers.get(letter.index)
                value = e if known is None else self.graph.sum([(sign, self.results[known])])
            row = [*self.scope.jacobian([value], W)[0], *self.scope.jacobian([value], D)[0]]
            for j in range(size):
                H[i][j] = H[j][i] if j < i else self._result(row[j])
                H[j][i] = H[i][j]
        for number, (i, sign) in self._in_gradient.items():
            row = [self.graph.sum([(sign, e)]) for e in H[i]]
            self._slopes[number, "W"], self._slopes[number, "D"] = row[: len(W)], row[len(W) :]


class Placed:
    """One placement of a `CurveTerm`, at nodes W and D of the step."""

    def __init__(
        self, scope: Scope, term: CurveTerm, W: list[Node], D: list[Node], elapsed: Node
    ) -> None:
        self.scope, self.function = scope, term
        self.columns = {**term.columns, "W": W, "D": D}
        self.arguments = [*W, *D, elapsed][: len(term.arguments)]
        self._prefix = f"t{term.graph.parts}"
        own = (e.index for e in term.arguments)
        self._swap = dict(zip(own, self.arguments, strict=True))
        scope.append(self)
        self.gradient = {k: [self._own(e) for e in es] for k, es in term.gradient.items()}

    @property
    def value(self) -> Node:
        """Return Λ at this node."""
        return self._own(self.function.value)

    def _own(self, e: Node) -> Node:
        """Return an expression of the function with the arguments and results of this node."""
        sign, letter = e.scaled
        if letter.index in self._swap:
            letter = self._swap[letter.index]
        elif (number := self.function._numbers.get(letter.index)) is not None:
            letter = self.function.graph.result(self, number)
            own = sympy.Symbol(f"{self._prefix}_{number}", real=True)
            self.function.graph.name([own], [letter])
        return self.function.graph.sum([(sign, letter)])

    def partials(self, number: int) -> list[tuple[Nodes, Callable[[], list[Node]]]]:
        """Return [(nodes of the step, function that gives the derivatives of a result by them)]."""
        return [
            (nodes, partial(self._slopes, number, part))
            for part, nodes in self.columns.items()
            if nodes
        ]

    def _slopes(self, number: int, part: str) -> list[Node]:
        return [self._own(e) for e in self.function.slopes(number, part)]


def placed(
    graph: Graph, s: SceneSymbols, point: Nodes, velocity: Nodes
) -> tuple[Node, tuple[list[Node], list[Node]], list[Node]]:
    """Return (l, (∂l/∂x, ∂l/∂ξ), force) at a point and a velocity, which are letters or held."""
    swap = dict(zip([*s.x, *s.u], [*point, *velocity], strict=True))
    value = graph.read(s.lagrangian, swap)
    scope = Scope(graph)
    (row,) = scope.jacobian([value], [*point, *velocity])
    if s.clocked:
        row[len(point) - 1] = graph.number(0)  # displacements do not change the time
    return value, (row[: len(point)], row[len(point) :]), [graph.read(e, swap) for e in s.force]
