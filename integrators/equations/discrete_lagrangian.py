"""A discrete Lagrangian as a weighted sum of values of L, and its derivatives.

The value that a rule gives is taken apart: each value of the Lagrangian becomes a node with a
weight, each point of the step a column of held nodes (`terms`), which e→ and e← move in a known
way. A change of L_d is then a sum of covectors applied to the changes of nodes.
"""

from __future__ import annotations

from collections.abc import Hashable

from ..errors import BadInput
from ..groupoids import Clocked
from ..numbers import Graph, Node, Nodes, Scope, jacobian, sympy
from ..numbers.types import Column, Expression, Expressions
from ..rules import Discretisation
from ..scene import OnGroup
from .on_group import Element
from .rule_view import GroupoidForRule, LagrangianForRule, answers_of, value_of_rule
from .symbols import SceneSymbols, column, vector
from .terms import CurveTerm, Placed, Point, place_point, placed

LONG = 2**20  # a fraction with a larger power of 2 as its denominator was written as a float


class DiscreteLagrangian:
    """L_d of a rule in a `graph`: its `value`, its `gradient` and the `points` of the step.

    scope: the held nodes: points, chart values, nodes of curves.
    element: the group element g, where L_d is given as a function of it.
    """

    def __init__(self, s: SceneSymbols, rule: Discretisation) -> None:
        self.s, self.groupoid = s, s.groupoid
        self.graph = Graph()
        self.scope = Scope(self.graph)
        self.graph.fixed = {e.index for e in self.graph.letters(s.q)}
        self.x, self.u, self.stages = map(self.graph.letters, (s.x, s.u, s.stages))
        self.h = self.graph.read(s.h)
        #: the points of the straight step and the group element: e→ and e← move them in a known way
        self.moved: list[Point] = []
        #: (nodes, covectors): L_d changes by Σ covector · d(node)
        self._covectors: list[tuple[Nodes, Nodes]] = []
        #: weighted forces at x and at points of the straight step, by the first of their letters
        self._forces: dict[int | None, list[Node]] = {}
        #: the change of points b(base, W) of a curve as x and y move, by e→(b) = 0, m each
        self.turned_x = self.turned_y = [self.graph.number(0)] * len(s.u)
        self.value: Node = self.graph.number(0)
        #: (weight, L at a point and a velocity) wherever the rule asks for L
        self.asked: list[tuple[Expression, Expression]] = []
        self._points: dict[Expression, Point] = {}
        self._charts: dict[Hashable, list[Node]] = {}
        self._curves: dict[tuple[Hashable, ...], CurveTerm] = {}
        #: of an L_d that is no weighted sum of values of L, and nothing else: what to do, or ""
        self.unweighted = "take another rule."
        self.element: Element | None = None
        self.L, self.G = LagrangianForRule(s), GroupoidForRule(s)
        if isinstance(s.given, OnGroup):
            self.element = Element(s.given, s)
            self.moved.append(self.element.placed(self.scope, self.u))
            self._add_direct(self.element.discrete_lagrangian(rule))
            return
        if s.given is None and s.hamiltonian is None:
            s.lagrangian  # noqa: B018 - a wrong Lagrangian is named before the rule
        self._take_apart(value_of_rule(rule, self.L, self.G))

    @property
    def weighted(self) -> bool:
        """Return True if L_d is a weighted sum of values of L, and nothing else."""
        return not self.unweighted

    @property
    def expression(self) -> Expression:
        """Return L_d in x, u, s and letters of held nodes."""
        return self.graph.shown(self.value)

    @property
    def points(self) -> tuple[Point, ...]:
        """Return the points b(x, u; θh) that L_d contains."""
        return tuple(self._points.values())

    @property
    def straight(self) -> bool:
        """Return True if all values of L are at points of the straight step, which `asked` has."""
        return not self._curves

    def _take_apart(self, formula: Expression) -> None:
        """Read L_d from an expression in x, u, s, q and in answers."""
        L = self.L
        calls = sorted(formula.atoms(L.Value, L.Fast), key=sympy.default_sort_key)
        outer = [c for c in calls if not any(c in o.args or o.has(c) for o in calls if o is not c)]
        names = {c: sympy.Dummy(f"l{i}", real=True) for i, c in enumerate(outer)}
        weighted = formula.xreplace(names)
        letters = list(names.values())
        weights = jacobian([weighted], letters)
        rest = weighted.xreplace(dict.fromkeys(letters, sympy.Integer(0)))
        linear = weighted - rest - sum(w * e for w, e in zip(weights, letters, strict=True))
        varied = weights.free_symbols - set(self.s.q)
        if varied or linear.expand() != 0:
            # no weighted sum: derived as a whole, also by letters that a Subs or an integral binds
            weighted, names, weights = formula.xreplace({c: c.written_out() for c in outer}), {}, []
            weighted = weighted.doit()
        if len(weights) and rest == 0:
            self.unweighted = ""
        elif varied & {*self.s.x, *self.s.u, *self.s.stages}:
            self.unweighted = "its weights depend on the state, and have to be constant."
        elif any(e.q > LONG and e.q & (e.q - 1) == 0 for e in formula.atoms(sympy.Rational)):
            self.unweighted = (
                "write its weights as fractions: L(x, u)/6 and not 1/6*L(x, u), which is a float."
            )
        if self.s.forced and not len(weights):
            raise BadInput(
                f"{self.s.name}: a force acts where the rule asks for L, with the weight that L "
                f"has there, and this rule is no weighted sum of values of L: {self.unweighted}"
            )
        for weight, call in zip(weights, names, strict=True):
            if weight != 0:
                self._place(call, self.resolved(weight))
        self._add_direct(self.resolved(weighted).xreplace(dict.fromkeys(letters, sympy.S.Zero)))

    def gradient(self) -> tuple[list[Node], list[Node], list[Node], list[list[Node]]]:
        """Return ∂L_d by x, u, the stages and each of `moved`, as if these were independent."""
        graph, parts = self.graph, [self.x, self.u, self.stages, *(p.nodes for p in self.moved)]
        seeds = [e for part in parts for e in part]
        pairs = [
            (1, covector, self.scope.row(node, seeds))
            for nodes, covectors in self._covectors
            for node, covector in zip(nodes, covectors, strict=True)
            if covector
        ]
        row, at = graph.combined(pairs), 0
        blocks = []
        for part in parts:
            blocks.append([row.get(at + i, graph.number(0)) for i in range(len(part))])
            at += len(part)
        x, u, stages, *moved = blocks
        if (self._curves or len(stages)) and not self.groupoid.canonical:  # sums over nodes
            u = self.scope.held_sums(u)
        return x, u, stages, moved

    def force_at(self, nodes: Nodes) -> list[Node]:
        """Return the weighted force at x or at a point of the straight step, m entries."""
        none = [self.graph.number(0)] * len(self.u)
        return self._forces.get(_key_of(nodes), none)

    def _add(self, nodes: Nodes, weight: Node, covectors: Nodes) -> None:
        self._covectors.append((nodes, [weight * e for e in covectors]))

    def _add_direct(self, e: Expression) -> None:
        """Add a part of L_d that is not a value of L."""
        value = self.graph.read(e)
        self._covectors.append(([value], [self.graph.one]))
        self.value = self.value + value

    def _place(self, call: Expression, weight: Expression) -> None:
        """Add weight·l at the point and velocity of a call."""
        n, size = len(self.s.x), self.graph.read(weight)
        point, W = self._point(call.args[:n])
        if isinstance(call, self.L.Fast):
            nodes = self._nodes_of(point, W)
            swap = dict(zip(self.s.x, nodes, strict=True))
            value = self.graph.read(self.s.fast_at(self.s.x), swap)
            self._covectors.append(([value], [size]))
            self.value = self.value + size * value
            return
        self.asked.append((weight, call))
        D, moving = self._velocity(call.args[n:])
        if W is not None and moving in (None, (point, W)):  # the point's own curve
            self._on_curve(point, None, moving is not None, W, D, size)
        elif moving is None:
            self._straight(self._nodes_of(point, W), self._chart(D), size)
        else:
            base, curve = moving
            self._nodes_of(point, W)
            self._on_curve(base, point, True, curve, D, size)

    def _straight(self, point: list[Node], velocity: list[Node], weight: Node) -> None:
        """Add the Lagrangian at nodes."""
        value, (at_x, at_xi), force = placed(self.graph, self.s, point, velocity)
        self._add(point, weight, at_x)
        self._add(velocity, weight, at_xi)
        self._act(point, weight, force)
        self.value = self.value + weight * value

    def _act(self, point: list[Node], weight: Node, force: list[Node]) -> None:
        if not force:
            return
        if any(point == e for e in (self.x, *(p.nodes for p in self.moved))):
            size = self.h * weight
            more = [size * e for e in force]
            self._forces[_key_of(point)] = self.graph.plus(self.force_at(point), more)
        elif self.groupoid.canonical:
            self._add(point[: len(force)], weight, force)  # moved as it is displaced
        else:
            raise BadInput(
                f"{self.s.name}: the rule asks for L at a point that is no b(x, w; h), so the "
                "displacement of a force there is unknown; write the point with G.target."
            )

    def _on_curve(
        self,
        base: Column,
        point: Column | None,
        moving: bool,
        W: Column,
        D: Column,
        weight: Node,
    ) -> None:
        """Add the Lagrangian at a node of a curve (`CurveTerm`)."""
        key = tuple(base), None if point is None else tuple(point), moving
        if key not in self._curves:
            name = f"node{1 + len(self._curves)}"
            at = None if point is None else self._nodes_of(point, None)
            self._curves[key] = CurveTerm(self.graph, self.s, name, base, at, moving)
        elapsed = self.groupoid.share(W) if isinstance(self.groupoid, Clocked) else sympy.S.Zero
        node = Placed(self.scope, self._curves[key], self._chart(W), self._chart(D),
                      self.graph.read(elapsed))  # fmt: skip
        for part, nodes in node.columns.items():
            if nodes:
                self._add(nodes, weight, node.gradient[part])
        if point is not None:
            self._act(self._nodes_of(point, None), weight, node.gradient["force"])
        if any(node.gradient["turned"]):
            size = self.h * weight
            turned = [size * e for e in node.gradient["turned"]]
            if base == self.s.x:
                self.turned_x = self.graph.plus(self.turned_x, turned)
            else:
                self.turned_y = self.graph.plus(self.turned_y, turned)
        self.value = self.value + weight * node.value

    def _point(self, args: Expressions) -> tuple[Column, Column | None]:
        """Return (letters or expressions of a point, None), or (base, W) of b(base, W; 1)."""
        s, n = self.s, len(self.s.x)
        rest = answers_of(args, self.G.Target)
        if rest is None or (base := self._base(rest[:n])) is None:
            return column(map(self.resolved, args)), None
        u, h = rest[n:-1], rest[-1]
        if base is s.x and tuple(u) == tuple(s.u) and (h / s.h).is_number:
            return self.point_of_step(h / s.h).letters, None
        return base, column(self.resolved(h * e) for e in u)

    def _velocity(self, args: Expressions) -> tuple[Column, tuple[Column, Column] | None]:
        """Return (D, None) for the velocity D, or (D, (base, W)) for L(base, W; 1)⁻¹ D."""
        s, n, m = self.s, len(self.s.x), len(self.s.u)
        if tuple(args) == tuple(s.u):
            return s.u, None
        rest = answers_of(args, self.G.Velocity)
        if rest is None or (base := self._base(rest[:n])) is None:
            return column(map(self.resolved, args)), None
        w, dw, h = rest[n : n + m], rest[n + m : -1], rest[-1]
        D = column(map(self.resolved, dw))
        return D, (base, column(self.resolved(h * e) for e in w))

    def _base(self, x: Expressions) -> Column | None:
        """Return the letters x or y that a target starts from, or None for another point."""
        s = self.s
        if tuple(x) == tuple(s.x):
            return s.x
        rest = answers_of(x, self.G.Target)
        if rest is not None and tuple(rest) == (*s.x, *s.u, s.h):
            return self.point_of_step(sympy.Integer(1)).letters
        return None

    def point_of_step(self, theta: Expression) -> Point:
        """Return the point b(x, u; θh)."""
        g, s = self.groupoid, self.s
        if theta not in self._points:
            z = s.y if theta == 1 else vector(f"z{self.graph.parts}", g.dim_x)
            value = g.target(s.x, s.u, theta * s.h)
            point = place_point(self.scope, z, value, self.u, [s.x])
            point.theta = theta
            point.move(g.point_motion(s.x, s.u, s.h, theta, z))
            if s.forced:
                right, left = g.displacement_at(s.x, s.u, s.h, theta)
                point.displacement = self.graph.matrix(right), self.graph.matrix(left)
            self._points[theta] = point
            self.moved.append(point)
        return self._points[theta]

    def _nodes_of(self, point: Column, W: Column | None) -> list[Node]:
        """Return the nodes of a point: the known ones of a point of the step, or new held ones."""
        if W is not None:
            point = self.groupoid.target(point, W, sympy.Integer(1))
        columns = [self.s.x, *(p.letters for p in self.moved)]
        return self.graph.letters(point) if any(point == c for c in columns) else self._chart(point)

    def _chart(self, value: Column) -> list[Node]:
        """Hold a column of expressions in x, u, s and points, unless it is u; return its nodes."""
        if value == self.s.u:
            return self.u
        nodes = [self.graph.expanded(self.graph.read(e)) for e in value]
        key = tuple(e.index for e in nodes)
        if nodes == self.u:
            return nodes
        if key not in self._charts:
            letters = vector(f"w{self.graph.parts}", len(nodes))
            self._charts[key] = self.scope.group(list(letters), nodes, named=False)
            self._charts[tuple(e.index for e in self._charts[key])] = self._charts[key]
        return self._charts[key]

    def _gradient(self, point: Expressions) -> Column:
        """Return letters of ∂V/∂x at a point."""
        at = self._nodes_of(column(map(self.resolved, point)), None)
        key = ("gradient", *(e.index for e in at))
        if key not in self._charts:
            value = self.L.part("gradient", self.graph.shown_column(at))
            letters = vector(f"d{self.graph.parts}", len(value))
            values = self.graph.column(value)
            self._charts[key] = self.scope.group(list(letters), values, named=False)
        return self.graph.shown_column(self._charts[key])

    def resolved(self, e: Expression) -> Expression:
        """Return the expression with straight points as letters, all other answers written out."""
        L, G = self.L, self.G
        while nodes := e.atoms(G.Target, G.Velocity, L.Value, L.Fast, L.Gradient, L.Mass):
            swap = {}
            for node in nodes:
                if isinstance(node, L.Gradient):
                    swap[node] = self._gradient(node.args[1:])[int(node.args[0])]
                    continue
                x, u = node.args[1 : 1 + len(self.s.x)], node.args[1 + len(self.s.x) : -1]
                theta = node.args[-1] / self.s.h
                straight = isinstance(node, self.G.Target) and theta.is_number
                if straight and (tuple(x), tuple(u)) == (tuple(self.s.x), tuple(self.s.u)):
                    swap[node] = self.point_of_step(theta).letters[int(node.args[0])]
                else:
                    swap[node] = node.written_out()
            e = e.xreplace(swap)
        return e


def _key_of(nodes: Nodes) -> int | None:
    """Return the number that identifies a column of nodes."""
    return nodes[0].index if nodes else None
