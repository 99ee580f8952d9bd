"""Right-hand sides as a tape of elementary operations on power series.

Each node of the tape is a truncated series n(t) = sum_k n_k t^k. Sums are kept as linear forms
and cost no node; each other operation has a recurrence (Knuth, TAOCP 2, 4.7; Moore 1966):

    c = a b      c_k = sum_j a_j b_{k-j}
    c = a / b    c_k = (a_k - sum_{j<k} c_j b_{k-j}) / b_0
    c = a^r      k a_0 c_k = sum_{j<k} (r (k-j) - j) a_{k-j} c_j
    c' = g a'    k c_k = sum_{j=1..k} j a_j g_{k-j}      (exp, log, sin and cos, atan, ...)

The tape is printed as one Python function over gmpy2 numbers: the inner products are
``fsum(map(mul, a, reversed(b)))``, one call each, correctly rounded.
"""

from __future__ import annotations

from typing import Any

import sympy

from ..failures import ReferenceFailure

Linear = dict[int | None, Any]  # node (None: the constant term) -> exact coefficient

PAIRS = {"sin": ("sin", "cos"), "cos": ("sin", "cos"),
         "sinh": ("sinh", "cosh"), "cosh": ("sinh", "cosh")}  # fmt: skip
RATIOS = {"tan": ("sin", "cos"), "cot": ("cos", "sin"), "tanh": ("sinh", "cosh"),
          "coth": ("cosh", "sinh"), "sec": (None, "cos"), "csc": (None, "sin"),
          "sech": (None, "cosh"), "csch": (None, "sinh")}  # fmt: skip
INTEGRALS = {"log", "atan", "asin", "acos", "asinh", "acosh", "atanh"}


class Tape:
    """Nodes (operation, arguments), each stored once; the first are the states."""

    def __init__(self, states: tuple[sympy.Symbol, ...], owner: str) -> None:
        self.owner = owner
        self.operations: list[tuple[Any, ...]] = [("state",)] * len(states)
        self.forms: dict[Any, Linear] = {symbol: {i: 1} for i, symbol in enumerate(states)}
        self._known: dict[tuple[Any, ...], int] = {}

    def assign(self, symbol: sympy.Symbol, expression: sympy.Expr) -> None:
        """Define a symbol as a value that is computed before."""
        self.forms[symbol] = self.linear(expression)

    def linear(self, expression: sympy.Expr) -> Linear:
        """Return the expression as a linear form in nodes."""
        if expression in self.forms:
            return self.forms[expression]
        if not expression.free_symbols:
            form: Linear = {None: expression} if expression != 0 else {}
        elif expression.is_Add:
            form = {}
            for term in expression.args:
                for node, factor in self.linear(term).items():
                    form[node] = form.get(node, 0) + factor
            form = {node: factor for node, factor in form.items() if factor != 0}
        elif expression.is_Mul:
            form = self._product(expression)
        elif expression.is_Pow:
            form = self._power(*expression.as_base_exp())
        else:
            form = {self._function(expression): 1}
        self.forms[expression] = form
        return form

    def node(self, form: Linear) -> int:
        """Return the linear form as one node."""
        if len(form) == 1:
            (node, factor), *_ = form.items()
            if node is not None and factor == 1:
                return node
        terms = sorted(form.items(), key=lambda term: -1 if term[0] is None else term[0])
        return self._add("linear", tuple(terms))

    def _add(self, *operation: Any) -> int:
        if operation not in self._known:
            self._known[operation] = len(self.operations)
            self.operations.append(operation)
        return self._known[operation]

    def _times(self, a: int, b: int) -> int:
        return self._add("square", a) if a == b else self._add("times", *sorted((a, b)))

    def _product(self, expression: sympy.Expr) -> Linear:
        factor: Any = sympy.S.One
        above: list[int] = []
        below: list[int] = []
        sums: list[sympy.Expr] = []
        for argument in expression.args:
            base, exponent = argument.as_base_exp()
            if not argument.free_symbols:
                factor *= argument
            elif argument.is_Add:
                sums.append(argument)
            elif argument.is_Pow and exponent.is_Rational and exponent < 0:
                below.append(self.node(self._power(base, -exponent)))
            else:
                form = self.linear(argument)
                if len(form) == 1 and None not in form:
                    (node, scale), *_ = form.items()
                    factor *= scale
                    above.append(node)  # type: ignore[arg-type]
                else:
                    above.append(self.node(form))
        if len(sums) == 1 and not above and not below:  # a constant times a sum stays linear
            return {node: factor * scale for node, scale in self.linear(sums[0]).items()}
        above += [self.node(self.linear(argument)) for argument in sums]
        top, bottom = self._all(above), self._all(below)
        if bottom is None:
            return {top: factor}
        quotient = self._add("inverse", bottom) if top is None else self._add("over", top, bottom)
        return {quotient: factor}

    def _all(self, nodes: list[int]) -> int | None:
        result: int | None = None
        for node in sorted(nodes):
            result = node if result is None else self._times(result, node)
        return result

    def _power(self, base: sympy.Expr, exponent: sympy.Expr) -> Linear:
        if exponent.free_symbols:
            if base.free_symbols:
                inner = self.linear(exponent * sympy.log(base))
            else:
                scale = sympy.log(base)
                inner = {node: scale * factor for node, factor in self.linear(exponent).items()}
            return {self._add("exp", self.node(inner)): 1}
        if exponent == 1:
            return self.linear(base)
        a = self.node(self.linear(base))
        if not (2 * exponent).is_Integer:
            return {self._add("power", a, exponent): 1}
        whole, half = divmod(abs(int(2 * exponent)), 2)
        factors = [self._integer_power(a, whole)] if whole else []
        node = self._all(factors + ([self._add("sqrt", a)] if half else []))
        assert node is not None
        return {node if exponent > 0 else self._add("inverse", node): 1}

    def _integer_power(self, a: int, n: int) -> int:
        result = a
        for bit in bin(n)[3:]:
            result = self._times(result, result)
            if bit == "1":
                result = self._times(result, a)
        return result

    def _function(self, expression: sympy.Expr) -> int:
        name = type(expression).__name__
        if len(expression.args) == 1:
            argument = expression.args[0]
            a = self.node(self.linear(argument))
            if name == "exp":
                return self._add("exp", a)
            if name in PAIRS:
                return self._pair(name, a)
            if name in RATIOS:
                top, bottom = RATIOS[name]
                below = self._pair(bottom, a)
                if top is None:
                    return self._add("inverse", below)
                return self._add("over", self._pair(top, a), below)
            if name in INTEGRALS:
                inner = sympy.Dummy(real=True)
                slope = expression.func(inner).diff(inner).subs(inner, argument)
                return self._add("integral", name, a, self.node(self.linear(slope)))
            if name in ("Abs", "sign"):
                return self._add(name, a)
        raise ReferenceFailure(
            f"the equations of scene {self.owner} contain {name}, which the Taylor "
            "integrator cannot expand; write it with powers, exp, log, and (hyperbolic) "
            "trigonometric functions"
        )

    def _pair(self, name: str, a: int) -> int:
        """Add sin and cos (sinh and cosh) as neighbours on the tape, as one needs the other."""
        first, second = PAIRS[name]
        if (first, a) not in self._known:
            self._add(first, a)
            self._add(second, a)
        return self._known[name, a]
