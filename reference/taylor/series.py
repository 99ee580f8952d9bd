"""The tape of a scene's equations, printed as a Python function over gmpy2 numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gmpy2
import sympy

from ..equations import Equations, number_to_mpfr
from .tape import Linear, Tape

# What k = 0 and each k >= 1 append to a node's series; {a}, {b} are arguments, {n} the node.
FIRST = {
    "times": "{a}[0] * {b}[0]", "square": "{a}[0] * {a}[0]", "over": "{a}[0] / {b}[0]",
    "inverse": "1 / {a}[0]", "sqrt": "gmpy2.sqrt({a}[0])", "power": "{a}[0] ** {r}",
    "exp": "gmpy2.exp({a}[0])", "sin": "gmpy2.sin({a}[0])", "cos": "gmpy2.cos({a}[0])",
    "sinh": "gmpy2.sinh({a}[0])", "cosh": "gmpy2.cosh({a}[0])",
    "Abs": "abs({a}[0])", "sign": "gmpy2.mpfr(gmpy2.sign({a}[0]))",
}  # fmt: skip
NEXT = {
    "times": "fsum(map(mul, {a}, reversed({b})))",
    "square": "half_square({a})",
    "over": "({a}[k] - fsum(map(mul, {n}, reversed({b})))) / {b}[0]",
    "inverse": "-fsum(map(mul, {n}, reversed({a}))) / {a}[0]",
    "sqrt": "({a}[k] - half_square({n}[1:])) / (2 * {n}[0])",
    "power": "({r} * fsum(map(mul, reversed({da}), {n}))"
    " - fsum(map(mul, {dn}, reversed({a}[:k])))) / (k * {a}[0])",
    "exp": "fsum(map(mul, {da}, reversed({n}))) / k",
    "Abs": "{a}[k] if {a}[0] > 0 else -{a}[k]",
    "sign": "ZERO",
}
# position of the derivative's node relative to the node, its sign, and its known length
SLOPES = {
    "sin": (1, "", ""),
    "cos": (-1, "-", "[:k]"),
    "sinh": (1, "", ""),
    "cosh": (-1, "", "[:k]"),
}


def half_square(a: list[Any]) -> Any:
    """Return the last coefficient of the square of the polynomial with coefficients a."""
    half, odd = divmod(len(a), 2)
    total = 2 * gmpy2.fsum(map(gmpy2.mul, a[:half], reversed(a)))
    return total + a[half] * a[half] if odd else total


@dataclass(frozen=True)
class SeriesProgram:
    """Taylor coefficients of the solution through a given state.

    ``nodes(order, state, constants)`` gives one list z_0 ... z_order for each state, then those of
    the other nodes of the tape, which end at order - 1.
    """

    name: str
    constants: tuple[sympy.Expr, ...]
    nodes: Callable[[int, list[Any], list[Any]], list[list[Any]]]
    products: int
    size: int
    operations: tuple[tuple[Any, ...], ...]
    rates: tuple[Linear, ...]

    def constants_at(self, digits: int) -> list[Any]:
        """Return the constants, rounded once to the current gmpy2 precision."""
        return [number_to_mpfr(constant, digits) for constant in self.constants]


class _Printer:
    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.constants: list[sympy.Expr] = []
        #: the nodes whose coefficients times k are needed, too
        self.differentiated: set[int] = set()

    def derivative(self, node: int) -> str:
        """Return the name of the series k n_k of a node, which is t times its derivative's."""
        self.differentiated.add(node)
        return f"dn{node}"

    def constant(self, value: Any) -> str:
        value = sympy.sympify(value)
        if value not in self.constants:
            self.constants.append(value)
        return f"c{self.constants.index(value)}"

    def form(self, form: Linear, index: str) -> str:
        """Return a linear form at one coefficient; its constant term counts only at index 0."""
        terms = []
        for node, factor in form.items():
            if node is None:
                if index == "0":
                    terms.append(self.constant(factor))
            elif factor == 1:
                terms.append(f"n{node}[{index}]")
            elif factor == -1:
                terms.append(f"-n{node}[{index}]")
            else:
                terms.append(f"{self.constant(factor)} * n{node}[{index}]")
        return " + ".join(terms).replace("+ -", "- ") or "ZERO"

    def lines(self, node: int, operation: tuple[Any, ...]) -> tuple[str, str]:
        """Return the statements for k = 0 and for k >= 1."""
        kind, name = operation[0], f"n{node}"
        if kind == "linear":
            form = dict(operation[1])
            first = f"{name}.append({self.form(form, '0')} + ZERO)"
            return first, f"{name}.append({self.form(form, 'k')})"
        if kind == "integral":
            function, a, slope = operation[1:]
            first = f"{name}.append(gmpy2.{function}(n{a}[0]))"
            rate = f"reversed({self.derivative(a)})"
            return first, f"{name}.append(fsum(map(mul, {rate}, n{slope})) / k)"
        words = {"n": name, "a": f"n{operation[1]}", "b": f"n{operation[-1]}"}
        if kind in ("power", "exp"):
            words["da"] = self.derivative(operation[1])
        if kind == "power":
            words |= {"dn": self.derivative(node), "r": self.constant(operation[2])}
        first = f"{name}.append({FIRST[kind].format(**words)})"
        if kind in SLOPES:
            away, sign, known = SLOPES[kind]
            mate = f"reversed(n{node + away}{known})"
            rate = self.derivative(operation[1])
            return first, f"{name}.append({sign}fsum(map(mul, {rate}, {mate})) / k)"
        return first, f"{name}.append({NEXT[kind].format(**words)})"


def compile_series(equations: Equations) -> SeriesProgram:
    """Flatten the equations to a tape and print it."""
    tape = Tape(equations.states, equations.name)
    for symbol, expression in equations.assignments:
        tape.assign(symbol, expression)
    shared, rates = sympy.cse(equations.rates, symbols=sympy.numbered_symbols("s", real=True))
    for symbol, expression in shared:
        tape.assign(symbol, expression)
    forms = [tape.linear(rate) for rate in rates]
    printer = _Printer(tape)
    size = len(equations.states)
    printed = {
        node: printer.lines(node, tape.operations[node])
        for node in range(size, len(tape.operations))
    }
    needed = printer.differentiated
    first = [at_zero for at_zero, _ in printed.values()]
    following: list[str] = []
    for node in range(len(tape.operations)):
        if node in printed:
            following.append(printed[node][1])
        if node in needed:
            following.append(f"dn{node}.append(k * n{node}[k])")
    first += [f"n{i}.append({printer.form(form, '0')} + ZERO)" for i, form in enumerate(forms)]
    following += [
        f"n{i}.append(({printer.form(form, 'k')}) / (k + 1))" for i, form in enumerate(forms)
    ]
    text = ["def series(order, state, constants):", "    ZERO = mpfr(0)"]
    text += [f"    c{i} = constants[{i}]" for i in range(len(printer.constants))]
    text += [f"    n{node} = [state[{node}]]" for node in range(size)]
    text += [f"    n{node} = []" for node in range(size, len(tape.operations))]
    text += [f"    dn{node} = []" for node in sorted(needed)]
    text += [f"    {line}" for line in first]
    text += ["    for k in range(1, order):"]
    text += [f"        {line}" for line in following]
    text += [f"    return [{', '.join(f'n{i}' for i in range(len(tape.operations)))}]", ""]
    source = "\n".join(text)
    scope: dict[str, Any] = {
        "gmpy2": gmpy2, "mpfr": gmpy2.mpfr, "fsum": gmpy2.fsum, "mul": gmpy2.mul,
        "half_square": half_square,
    }  # fmt: skip
    exec(compile(source, f"<Taylor series of {equations.name}>", "exec"), scope)
    products = sum(op[0] not in ("linear", "state") for op in tape.operations)
    return SeriesProgram(
        equations.name, tuple(printer.constants), scope["series"], products, size,
        tuple(tape.operations), tuple(forms),
    )  # fmt: skip
