"""A discrete Lagrangian as a weighted sum of placed terms, and its derivatives.

What a rule gave is taken apart: each value of the Lagrangian becomes a letter with a weight, each
point of the step a column of letters. The derivatives of L_d then are sums of derivatives of terms,
each derived once (`integrators.equations.terms`).
"""

from __future__ import annotations

from typing import Any

from ..errors import BadInput
from ..groupoids import Clocked
from ..numbers import jacobian, sympy
from ..numbers.types import Column, Expression, Expressions, Replacement
from ..rules import Discretisation
from ..scene import OnGroup
from .chain_rule import Block, ChainRule, partials
from .covectors import Covectors, key_of, times
from .on_group import Element
from .point_motion import lettered_motion
from .rule_view import GroupoidForRule, LagrangianForRule, answers_of, value_of_rule
from .symbols import SceneSymbols, column, vector
from .terms import CurveTerm, Node, Term


class DiscreteLagrangian:
    """L_d of a rule in the letters of `chain`: `expression`, `covectors`, `points` of the step.

    element: the group element g, where L_d is given as a function of it.
    """

    def __init__(self, s: SceneSymbols, rule: Discretisation) -> None:
        self.s, self.groupoid = s, s.groupoid
        self.chain = ChainRule()
        #: blocks that e→ and e← move in a known way: points of the straight step, a group element
        self.moved: list[Block] = []
        #: letters of gradients that are written out in kernels, with their values
        self.inline: Replacement = {}
        self.covectors = Covectors()
        self.expression: Expression = 0
        #: (weight, L at a point and a velocity) wherever the rule asks for L
        self.asked: list[tuple[Expression, Expression]] = []
        self._points: dict[Expression, Block] = {}
        self._charts: dict[tuple[Any, ...], Block] = {}
        self._terms: dict[str, Term] = {}
        self._curves: dict[tuple[Any, ...], CurveTerm] = {}
        self.weighted = False  # whether it is a weighted sum of values of L, and nothing else
        self.element: Element | None = None
        self.L, self.G = LagrangianForRule(s), GroupoidForRule(s)
        if isinstance(s.given, OnGroup):
            self.element = Element(s.given, s)
            self.chain.add(self.element.block)
            self.moved.append(self.element.block)
            self.expression = self.element.discrete_lagrangian(rule)
            self._add_direct(self.expression)
            return
        if s.given is None and s.hamiltonian is None:
            s.lagrangian  # noqa: B018 - a wrong Lagrangian is named before the rule
        self.expression = self._taken_apart(value_of_rule(rule, self.L, self.G))
        self._pass_charts_on()

    @property
    def points(self) -> tuple[Block, ...]:
        """The points b(x, u; θh) that L_d holds."""
        return tuple(self._points.values())

    @property
    def straight(self) -> bool:
        """Whether L is asked for at points of the straight step only, all of them in `asked`."""
        return not self._curves

    def _taken_apart(self, given: Expression) -> Expression:
        """L_d from an expression in x, u, s, q and in answers; its parts go to `covectors`."""
        L = self.L
        calls = sorted(given.atoms(L.Value, L.Fast), key=sympy.default_sort_key)
        outer = [c for c in calls if not any(c in o.args or o.has(c) for o in calls if o is not c)]
        names = {c: sympy.Dummy(f"l{i}", real=True) for i, c in enumerate(outer)}
        weighted = given.xreplace(names)
        letters = list(names.values())
        weights = jacobian([weighted], letters)
        rest = weighted.xreplace(dict.fromkeys(letters, sympy.Integer(0)))
        linear = weighted - rest - sum(w * e for w, e in zip(weights, letters, strict=True))
        if weights.free_symbols - set(self.s.q) or linear.expand() != 0:
            # no weighted sum: derived as it stands, letters bound by a Subs or an integral too
            weighted, names, weights = given.xreplace({c: c.written_out() for c in outer}), {}, []
            weighted = weighted.doit()
        self.weighted = bool(len(weights)) and rest == 0
        if self.s.forced and not len(weights):
            raise BadInput(
                f"{self.s.name}: a force acts where the rule asks for L, with the weight that L "
                "has there, and this rule is no weighted sum of values of L; take another rule."
            )
        weighted = self.resolved(weighted)
        values = {}
        for weight, (call, letter) in zip(weights, names.items(), strict=True):
            if weight != 0:
                values[letter] = self._place(call, self.resolved(weight))
        self._add_direct(weighted)
        value: Expression = weighted.xreplace(values)
        return value

    # -- covectors ------------------------------------------------------------------------------

    def _add_direct(self, e: Expression) -> None:
        """What L_d holds outside of terms."""
        s = self.s
        blocks = [b.letters for b in self.chain.blocks if isinstance(b, Block)]
        for letters in (s.x, s.u, s.stages, *blocks):
            if len(letters):
                self.covectors.add(letters, jacobian([e], letters).T)

    def _pass_charts_on(self) -> None:
        """Covectors at chart values go on to what these are made of, the last chart first."""
        for block in reversed(self._charts.values()):
            for by, matrix in block.partials:
                self.covectors.add(by, times(matrix.T, self.covectors.of(block.letters)))
        if any(isinstance(b, Node) for b in self.chain.blocks) or len(self.s.stages):
            u = self.covectors.of(self.s.u)  # a sum over nodes: its derivatives get letters
            letters = vector(f"f{len(self.chain.blocks)}", len(u))
            block = Block(letters, u, summed=True)
            self.covectors.columns[key_of(self.s.u)] = self.chain.add(block)

    # -- placing terms --------------------------------------------------------------------------

    def _place(self, call: Expression, weight: Expression) -> Expression:
        """Add weight·l at the point and velocity of a call; returns l there."""
        n = len(self.s.x)
        point, W = self._point(call.args[:n])
        if isinstance(call, self.L.Fast):
            return self._straight("fast", [self._lettered(point, W)], weight)
        self.asked.append((weight, call))
        D, moving = self._velocity(call.args[n:])
        if W is not None and moving in (None, (point, W)):  # the point's own curve
            return self._on_curve(point, None, moving is not None, W, D, weight)
        point = self._lettered(point, W)
        if moving is None:
            return self._straight("lagrangian", [point, D], weight)
        base, W = moving
        return self._on_curve(base, point, True, W, D, weight)

    def _term(self, name: str) -> Term:
        s = self.s
        if name not in self._terms and name == "fast":
            self._terms[name] = Term(s.x, s.fast_at(s.x), column(()))
        elif name not in self._terms:
            time = s.x[-1] if s.clocked else None
            self._terms[name] = Term(s.x.col_join(s.u), s.lagrangian, s.force, time)
        return self._terms[name]

    def _straight(self, name: str, columns: list[Column], weight: Expression) -> Expression:
        """A term at letters that are known: its derivatives are the term's with other letters."""
        term = self._term(name)
        (*gradient, force), block = term.placed(columns, f"g{len(self.chain.blocks)}")
        self.chain.add(block)
        if not len(self.s.stages):
            self.inline |= dict(zip(block.letters, block.values, strict=True))
        for letters, slope in zip(columns, gradient, strict=True):
            self.covectors.add(letters, weight * slope)
        self._act(columns[0], weight * force)
        place = [e for letters in columns for e in letters]
        return term.value.xreplace(dict(zip(term.letters, place, strict=True)))

    def _act(self, point: Column, force: Column) -> None:
        """A weighted force at a point whose letters are known."""
        if not len(force):
            return
        if any(point == c for c in (self.s.x, *(b.letters for b in self.moved))):
            self.covectors.add_force(point, self.s.h * force)
        elif self.groupoid.kind == "pair":
            self.covectors.add(point[: len(force), :], force)  # moved as it is displaced
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
        weight: Expression,
    ) -> Expression:
        """A term at a node of a curve (`CurveTerm`)."""
        key = key_of(base), None if point is None else key_of(point), moving
        if key not in self._curves:
            name, term = f"node{1 + len(self._curves)}", self._term("lagrangian")
            self._curves[key] = CurveTerm(self.groupoid, term, name, base, point, moving)
        elapsed = self.groupoid.share(W) if isinstance(self.groupoid, Clocked) else 0
        node = Node(self.chain, self._curves[key], self._chart(W), self._chart(D), elapsed)
        d = self.covectors
        for part, letters in node.columns.items():
            if letters is not None and len(letters):
                d.add(letters, weight * node.gradient[part])
        if point is not None:
            self._act(point, weight * node.gradient["force"])
        if any(node.gradient["turned"]):
            known = d.turned.get(key_of(base), 0 * self.s.u)
            d.turned[key_of(base)] = known + weight * self.s.h * node.gradient["turned"]
        return node.value

    # -- points, velocities, chart values -------------------------------------------------------

    def _point(self, args: Expressions) -> tuple[Column, Column | None]:
        """(letters or expressions of a point, None), or (base, W) of a point b(base, W; 1)."""
        s, n = self.s, len(self.s.x)
        rest = answers_of(args, self.G.Target)
        if rest is None or (base := self._base(rest[:n])) is None:
            return column(map(self.resolved, args)), None
        u, h = rest[n:-1], rest[-1]
        if base is s.x and tuple(u) == tuple(s.u) and (h / s.h).is_number:
            return self.point_of_step(h / s.h).letters, None
        return base, column(self.resolved(h * e) for e in u)

    def _velocity(self, args: Expressions) -> tuple[Column, tuple[Column, Column] | None]:
        """(D, None) for the velocity D, or (D, (base, W)) for L(base, W; 1)⁻¹ D."""
        s, n, m = self.s, len(self.s.x), len(self.s.u)
        if tuple(args) == tuple(s.u):
            return s.u, None
        rest = answers_of(args, self.G.Velocity)
        if rest is None or (base := self._base(rest[:n])) is None:
            return self._chart(column(map(self.resolved, args))), None
        w, dw, h = rest[n : n + m], rest[n + m : -1], rest[-1]
        D = column(map(self.resolved, dw))
        return D, (base, column(self.resolved(h * e) for e in w))

    def _base(self, x: Expressions) -> Column | None:
        """The letters x or y that a target starts from, None if it is another point."""
        s = self.s
        if tuple(x) == tuple(s.x):
            return s.x
        rest = answers_of(x, self.G.Target)
        if rest is not None and tuple(rest) == (*s.x, *s.u, s.h):
            return self.point_of_step(sympy.Integer(1)).letters
        return None

    def point_of_step(self, theta: Expression) -> Block:
        """The block of the point b(x, u; θh)."""
        g, s = self.groupoid, self.s
        if theta not in self._points:
            z = s.y if theta == 1 else vector(f"z{len(self.chain.blocks)}", g.dim_x)
            value = g.target(s.x, s.u, theta * s.h)
            motion = g.point_motion(s.x, s.u, s.h, theta, z)
            if theta != 1:  # e→ leaves the end where it is, so nothing is made of its motion
                motion = lettered_motion(self.chain, motion, s)
            block = Block(z, value, partials(value, [s.x]), theta=theta, motion=motion)
            if s.forced:
                block.displacement = g.displacement_at(s.x, s.u, s.h, theta)
            self._points[theta] = block
            self.chain.add_point(block, s.u)
            self.moved.append(block)
        return self._points[theta]

    def _lettered(self, point: Column, W: Column | None) -> Column:
        """Letters of a point: itself, or a chart block of its expressions."""
        if W is not None:
            point = self.groupoid.target(point, W, sympy.Integer(1))
        columns = [self.s.x, *(b.letters for b in self.moved)]
        return point if any(point == c for c in columns) else self._chart(point)

    def _chart(self, value: Column) -> Column:
        """Letters for a column of expressions in x, u, s and points; u itself needs none."""
        value = value.applyfunc(lambda e: e.expand())
        if value == self.s.u or any(value == block.letters for block in self._charts.values()):
            return value
        key = tuple(value)
        if key not in self._charts:
            letters = vector(f"w{len(self.chain.blocks)}", len(value))
            earlier = [self.s.x, self.s.u, self.s.stages, *(b.letters for b in self.moved)]
            self._charts[key] = Block(letters, value, partials(value, earlier))
            self.chain.add(self._charts[key])
        return self._charts[key].letters

    def _gradient(self, point: Expressions) -> Column:
        """Letters of ∂V/∂x at a point, whose derivatives by the point are the Hessian of V."""
        at = self._lettered(column(map(self.resolved, point)), None)
        key = ("gradient", *at)
        if key not in self._charts:
            value = self.L.part("gradient", at)
            block = Block(vector(f"d{len(self.chain.blocks)}", len(value)), value)
            block.partials = partials(value, [at])
            self._charts[key] = block
            self.chain.add(block)
        return self._charts[key].letters

    def resolved(self, e: Expression) -> Expression:
        """The expression with straight points as letters and every other answer written out."""
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
