"""Terms: the Lagrangian at a point and a velocity, derived once and placed wherever a rule asks.

A term is a scalar function of letters of its own (a point X and a velocity V) with its gradient
and Hessian. On the straight step a rule places it at (b(x, u; θh), u): its derivatives there are
the term's derivatives with other letters. At a node of a curve w(θ) in the chart it is

    Λ(x, W, D) = l(b(x, W; 1), L(x, W)⁻¹ D),   W = hw(θ), D = dw/dθ,

and this function is derived once, too (`CurveTerm`): k nodes are k calls of one function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from ..groupoids import Groupoid
from ..numbers import Definition, Function, jacobian, replaced, sympy
from ..numbers.types import Column, Expression, Letter, SymbolicMatrix
from .chain_rule import Block, ChainRule, Row, partials
from .point_motion import gradient_along
from .quotients import quotients
from .symbols import column, vector


@dataclass(frozen=True, eq=False)
class Term:
    """A scalar `value` in `letters`: a column of point coordinates, then velocities.

    force: the force that acts where the value is asked, none or m×1. time: the letter that no
    displacement moves, if the point holds one.
    """

    letters: Column
    value: Expression
    force: Column
    time: Letter | None = None

    @cached_property
    def covector(self) -> Column:
        """∂value/∂letters, then the force."""
        gradient = jacobian([self.value], self.letters).T
        if self.time is not None:
            gradient[list(self.letters).index(self.time)] = sympy.S.Zero
        return gradient.col_join(self.force)

    def placed(self, columns: list[Column], letter: str) -> tuple[list[Column], Block]:
        """(gradient at a place, in a part a column, and the force last; its block).

        columns: the letters of the place, point and velocity. Those entries that are sums or
        functions get letters.
        """
        known = dict(zip(self.letters, (e for part in columns for e in part), strict=True))
        values = replaced(self.covector, {}, known)
        rows = [i for i, e in enumerate(values) if not (e.is_Symbol or e.is_Number)]
        block = Block(vector(letter, len(rows)), column(values[i] for i in rows))
        for row, name in zip(rows, block.letters, strict=True):
            values[row] = name

        def slopes(own: Column) -> SymbolicMatrix:
            found = jacobian([self.covector[i] for i in rows], own)
            return sympy.Matrix(*found.shape, replaced(found, {}, known))

        gradient, at = [], 0
        for part in columns:
            end = at + len(part)
            gradient.append(column(values[at:end]))
            if len(part):
                block.partials.append((part, partial(slopes, self.letters[at:end, :])))
            at = end
        return [*gradient, column(values[at:])], block


class CurveTerm:
    """Λ at a node of a curve, and all derivatives of it that are asked for, as one function.

    base: the letters of the node's base point (x, or the end y of the step). point: the letters of
    the node's point where they are known (the ends of the step), or None: then it is b(base, W; 1).
    moving: whether the velocity is L(base, W)⁻¹ D, or D itself. The function's results are named by
    letters r0, r1, …, and what is derived from them is written in these.
    """

    def __init__(
        self,
        groupoid: Groupoid,
        term: Term,
        name: str,
        base: Column,
        point: Column | None,
        moving: bool,
    ) -> None:
        self.name = name
        m, one = groupoid.dim_u, sympy.Integer(1)
        self.W, self.D = vector("cw0", m), vector("cd0", m)
        #: what the function takes: W, D and, where there is a time, how much of it W takes
        self.arguments = [*self.W, *self.D]
        self.columns = {"W": self.W, "D": self.D, "base": base, "point": point}
        self.chain = ChainRule()
        self.results: list[Expression] = []
        self.letters: dict[Letter, int] = {}  # the letter of each result, with its number
        self._known: dict[Expression, Letter] = {}
        self._function: Function | None = None
        self._slopes: dict[tuple[Letter, str], Row] = {}
        along = 0 * self.W
        if point is not None:
            z = point
        else:
            z, value = vector("zz0", len(base)), groupoid.target(base, self.W, one)
            if term.time is not None:
                self.arguments.append(sympy.Symbol("ct0", real=True))
                value[-1] = base[-1] + self.arguments[-1]
            motion = groupoid.point_motion(base, self.W, one, one, z)
            at = Block(z, value, partials(value, [base]), motion=motion)
            self.chain.add_point(at, self.W)
        xi, by = self.D, {"D": sympy.eye(m)}
        if moving:
            velocity = groupoid.inverse_left(base, self.W, one) * self.D
            xi, by = quotients(
                self.chain, velocity, {k: self.columns[k] for k in ("W", "D", "base")}
            )
        (at_z, at_xi, force), block = term.placed([z, xi], "gg0")
        self.chain.add(block)
        if point is None and len(z):
            if at.frame is None:
                along = (motion.anchor * motion.slope).T * at_z
            else:
                named = gradient_along(self.chain, at, at_z, "k0", bool(len(force)))
                along = motion.slope.T * named
            if len(force):
                along += groupoid.inverse_left(base, self.W, one).T * force
        turned = groupoid.R(base, self.W, one).T * along if any(along) else along
        zero = {"W": 0 * self.W, "D": 0 * self.D, "base": 0 * base}
        outputs = {k: by[k].T * at_xi if k in by else zero[k] for k in zero}
        outputs["W"] += along
        outputs |= {"point": 0 * z if point is None else at_z, "turned": turned}
        outputs["force"] = 0 * force if point is None else force
        self._value = term.value.xreplace(dict(zip(term.letters, [*z, *xi], strict=True)))
        #: ∂Λ by the chart values W, D and by the base; by the point where that is known, and the
        #: force there; what the motion of the base adds by e→(b) = 0: in letters of results
        self.gradient = {part: slopes.applyfunc(self._result) for part, slopes in outputs.items()}
        #: the letters that are entries of ∂Λ/∂(W, D), up to a sign: (which entry, sign)
        self._in_gradient = {
            sign * e: (i, sign)
            for i, e in enumerate([*self.gradient["W"], *self.gradient["D"]])
            for sign in (1, -1)
            if sign * e in self.letters and not len(force)  # a force is no gradient
        }

    @property
    def value(self) -> Expression:
        """Λ itself, in letters of results."""
        return self._result(self._value)

    def _result(self, value: Expression) -> Expression:
        """The letter of the value as a result; numbers and the arguments themselves need none."""
        if value.is_Number or (value.is_Symbol and value not in self.chain.owner):
            return value
        if value.could_extract_minus_sign():
            return -self._result(-value)
        if value not in self._known:
            self._known[value] = letter = sympy.Symbol(f"r{len(self.results)}", real=True)
            self.letters[letter] = len(self.results)
            self.results.append(value)
        return self._known[value]

    def partials_of(self, letter: Letter) -> list[tuple[str, Row]]:
        """[(part, derivatives of that result by it)] for the parts W, D, base and point."""
        return [
            (k, self._slope(letter, k)) for k, c in self.columns.items() if c is not None and len(c)
        ]

    def _slope(self, letter: Letter, part: str) -> Row:
        key = (letter, part)
        if key not in self._slopes:
            if part in ("W", "D") and letter in self._in_gradient:
                self._add_hessian()
            else:
                row = self.chain.total([self.results[self.letters[letter]]], self.columns[part])
                self._slopes[key] = [self._result(e) for e in row]
        return self._slopes[key]

    def _add_hessian(self) -> None:
        """Second derivatives by (W, D): symmetric, so only half of them are results."""
        m = len(self.W)
        H = sympy.zeros(2 * m, 2 * m)
        values = {letter: self.results[i] for letter, i in self.letters.items()}
        for i, e in enumerate([*self.gradient["W"], *self.gradient["D"]]):
            value = e.xreplace(values)
            row = [*self.chain.total([value], self.W), *self.chain.total([value], self.D)]
            for j in range(2 * m):
                H[i, j] = H[j, i] if j < i else self._result(row[j])
        for letter, (i, sign) in self._in_gradient.items():
            self._slopes[letter, "W"] = [sign * e for e in H[i, :m]]
            self._slopes[letter, "D"] = [sign * e for e in H[i, m:]]

    @property
    def function(self) -> Function:
        """The function of (W, D) with all results so far: one object for all nodes."""
        if self._function is None or len(self._function.results) < len(self.results):
            definitions = tuple(self.chain.definitions())
            results = tuple(self.results)
            self._function = Function(self.name, tuple(self.arguments), definitions, results)
        return self._function


class Node:
    """One placement of a `CurveTerm`, at letters W and D of the scheme; a block of its results.

    elapsed: the time that W takes, where the term asks for it.
    """

    def __init__(
        self, chain: ChainRule, term: CurveTerm, W: Column, D: Column, elapsed: Expression
    ) -> None:
        self.chain, self.term = chain, term
        self.arguments = [*W, *D, elapsed][: len(term.arguments)]
        self.columns = {**term.columns, "W": W, "D": D}
        self._prefix = f"t{len(chain.blocks)}"
        self._swap = dict(zip(term.arguments, self.arguments, strict=True))
        self._theirs: dict[Letter, Letter] = {}
        self.letters: tuple[Letter, ...] = ()
        chain.add(self)
        self.gradient = {part: self._own(slopes) for part, slopes in term.gradient.items()}

    @property
    def value(self) -> Expression:
        """Λ at this node."""
        return self._own(self.term.value)

    def _own(self, given: Any) -> Any:
        """An expression or a column, with the term's letters replaced by this node's."""
        for theirs in sorted(given.free_symbols & set(self.term.letters), key=str):
            if theirs not in self._swap:
                number = self.term.letters[theirs]
                mine = sympy.Symbol(f"{self._prefix}_{number}", real=True)
                self._swap[theirs], self._theirs[mine] = mine, theirs
                self.chain.owner[mine] = self
        return given.xreplace(self._swap)

    def partials_of(self, letter: Letter) -> list[tuple[Column, Row]]:
        """[(column of the scheme, derivatives of the letter by it)]."""
        return [
            (self.columns[part], [self._own(e) for e in row])
            for part, row in self.term.partials_of(self._theirs[letter])
        ]

    def definition(self) -> Definition:
        """The call that gives all results so far."""
        function = self.term.function
        letters = tuple(
            sympy.Symbol(f"{self._prefix}_{i}", real=True) for i in range(len(function.results))
        )
        return Definition(letters, (), function, tuple(self.arguments))
