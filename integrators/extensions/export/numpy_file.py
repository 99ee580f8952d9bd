"""Python with numpy: arrays at the outside, numbers of Python inside, where they are faster."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from textwrap import fill, indent
from typing import Any, ClassVar

from .exported import STATUSES, Exported, Parameter, constants, head, used_fields
from .printer import WIDTH, Printer

OWN = {"one_step": "_advance", "rows_of_run": "_rows", "momenta": "_momenta", "energy": "_energy",
       "multipliers": "_multipliers", "start": "_start"}  # fmt: skip


class Python(Printer):
    """Prints Python."""

    stop: ClassVar[str] = ""
    mark: ClassVar[str] = "#"
    end: ClassVar[str] = ""
    heads: ClassVar[dict[str, str]] = {"if": "if {}:", "else": "else:", "while": "while {}:"}
    names: ClassVar[dict[str, str]] = OWN
    words: ClassVar[dict[type, str]] = {
        **Printer.words, ast.And: "and", ast.Or: "or", ast.Not: "not ", ast.FloorDiv: "//",
    }  # fmt: skip
    truth: ClassVar[dict[bool, str]] = {True: "True", False: "False"}
    said: str = ""

    def attribute(self, owner: str, name: str) -> str:
        return f"{owner}.{name}"

    def choice(self, test: str, yes: str, no: str) -> str:
        return f"{yes} if {test} else {no}"

    def power(self, base: ast.expr, exponent: ast.expr) -> tuple[str, int]:
        return f"{self.of(base, 9)}**{self.of(exponent, 9)}", 8

    def put(self, text: str) -> None:
        """Write a line; a long value goes into parentheses."""
        if len(text) + 4 * self.depth > WIDTH and not text.startswith("def "):
            text = re.sub(r"^(return |if |while |[^=]+? = )(.*?)(:?)$", r"\1(\2)\3", text)
        super().put(text)

    def about(self, text: str) -> None:
        """Keep what a function does until its head is written."""
        self.said = " ".join(text.split())

    def head(self, f: ast.FunctionDef) -> None:
        """Write the first line of a function, and what it does."""
        self.put(f"def {self.names.get(f.name, f.name)}({', '.join(a.arg for a in f.args.args)}):")
        if self.said:
            said = fill(
                f'"""{self.said}"""', WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 4
            )
            self.lines.append(said)
        self.said = ""

    def unused(self, name: str) -> None:
        """Write nothing: Python does not mind."""

    def array(self, name: str, size: str) -> str:
        return f"{name} = [0.0] * {size}"

    def declared(self, kind: str) -> str:
        """Return a letter, {}: Python declares none."""
        return "{}"

    def _pass(self, s: ast.Pass) -> None:
        self.put("pass")

    def _for(self, s: ast.For) -> None:
        self.put(f"for {self.of(s.target)} in {self.of(s.iter)}:")
        self.body(s.body)


FILE = '''"""{head}
"""

from math import acos, asin, atan, atan2, cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh

import numpy as np

{constants}
X0 = {x}
MU0 = {mu}
#: name -> value
PARAMETERS = {{
{parameters}
}}
#: names of the entries of momenta(state)
QUANTITIES = {quantities}
TOLD = {told}


class StepFailed(ArithmeticError):
    """A step was not solved; the state is as it was."""


class State:
    """The state of a run: x and mu, and what a step leaves for the next."""

    def __init__(self):
{fields}


def begin(x=X0, mu=MU0, **parameters):
    """Return a state at x and mu; parameters: those that differ from PARAMETERS."""
    if unknown := parameters.keys() - PARAMETERS.keys():
        raise TypeError(f"there is no parameter {{min(unknown)}}, but {{', '.join(PARAMETERS)}}")
    values = [np.ravel(np.array(parameters.get(name, value), dtype=float))
              for name, value in PARAMETERS.items()]
    s = State()
    s.x, s.mu = np.array(x, dtype=float).tolist(), np.array(mu, dtype=float).tolist()
    for i, value in enumerate(np.concatenate([[0.0], *values]).tolist()):
        s.q[i] = value
    if (len(s.x), len(s.mu)) != (N, M):
        raise ValueError(f"x has {{N}} entries and mu {{M}}, not {{len(s.x)}} and {{len(s.mu)}}")
    _start(s)
    return s


def step(state, h):
    """Do one step of size h, in place; raises StepFailed, and leaves x and mu as they were."""
    try:
        status = _advance(state, h)
    except (ArithmeticError, ValueError):  # a division by 0, a root of what is negative
        undo(state)
        status = SINGULAR
    if status != OK:
        raise StepFailed(TOLD[status])
    return state


def run(state, h, steps, every=1):
    """Return arrays x (rows, N) and mu (rows, M): the start, and a row after each `every` steps."""
    xs, mus = [list(state.x)], [list(state.mu)]
    for k in range(1, steps + 1):
        step(state, h)
        if k % every == 0:
            xs.append(list(state.x))
            mus.append(list(state.mu))
    return np.array(xs), np.array(mus)
{more}

{functions}
'''
ENERGY = '''

def energy(state):
    """Return the energy of a state."""
    return _energy(state)
'''
MOMENTA = '''

def momenta(state):
    """Return the quantities that the scene declares, as QUANTITIES names them."""
    values = [0.0] * len(QUANTITIES)
    _momenta(state, values)
    return np.array(values)
'''
MULTIPLIERS = '''

def multipliers(state):
    """Return the multipliers of the constraints at the start of the last step."""
    values = [0.0] * MULTIPLIERS
    _multipliers(state, values)
    return np.array(values)
'''
HARNESS = '''

def answer(line):
    """Return the rows of one run that a JSON line asks for, as JSON."""
    asked = json.loads(line)
    try:
        state = begin({x}, asked["mu"], **asked["parameters"])
        {run}
    except (ArithmeticError, TypeError, ValueError) as failure:
        return json.dumps({{"error": str(failure)}})
    return json.dumps({{"x": {rows}, "mu": mus.tolist()}})


if __name__ == "__main__":
    import json
    import sys

    for line in sys.stdin:
        print(answer(line), flush=True)
'''


def nested(parameter: Parameter) -> Any:
    """Return a parameter's value: a number, or lists in its shape."""
    values = list(parameter.values)
    if len(parameter.shape) == 2:
        wide = parameter.shape[1]
        return [values[i : i + wide] for i in range(0, len(values), wide)]
    return values if parameter.shape else values[0]


def python_parts(model: Exported) -> dict[str, str]:
    """Return the parts that all files in Python have."""
    x, mu = model.start
    rows = [f'    "{p.name}": {nested(p)!r},' for p in model.parameters]
    return {"x": repr(x), "mu": repr(mu), "parameters": "\n".join(rows),
            "quantities": repr(model.quantities), "told": repr([*STATUSES.values()])}  # fmt: skip


RUN = 'xs, mus = run(state, asked["h"], asked["steps"], asked["every"])'


def harness(model: Exported, run: str = RUN) -> str:
    """Return the adapter that speaks JSON lines; run: the statement that makes the rows."""
    n = model.constants["N"]
    x = 'asked["x"] + [asked["t"]]' if model.timed else 'asked["x"]'
    rows = f"[row[:{n - 1}] for row in xs.tolist()]" if model.timed else "xs.tolist()"
    return HARNESS.format(x=x, rows=rows, run=run)


def numpy_file(model: Exported, said: Sequence[str], with_harness: bool) -> str:
    """Return the Python file of a scheme."""
    lines = [f"{name} = {value!r}" for name, value in constants(model)]
    fields = []
    for name, (kind, length) in used_fields(model).items():
        zero = "0.0" if kind == "float" else "0"
        zero = zero if length is None else f"[{zero}] * {length}"
        fields.append(f"self.{name} = {zero}")
    functions = [Python().function(f) for f in model.functions if f.name != "rows_of_run"]
    more = ENERGY * model.has_energy + MOMENTA * bool(model.quantities)
    more += MULTIPLIERS * any(f.name == "multipliers" for f in model.functions)
    text = FILE.format(
        head="\n".join(head(model, "Python with numpy", said)), constants="\n".join(lines),
        fields=indent("\n".join(fields), " " * 8), more=more,
        functions="\n\n\n".join(functions), **python_parts(model),
    )  # fmt: skip
    return text + (harness(model) if with_harness else "")
