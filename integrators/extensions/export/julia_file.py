"""Julia: a module whose steps change a state in place and allocate nothing.

What a kernel needs beside numbers is allocated once, so states may not step in several threads.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import ClassVar

from .exported import STATUSES, Exported, constants, head, used_fields
from .numpy_file import nested
from .printer import Printer


class Julia(Printer):
    """Prints Julia, which counts from 1."""

    stop: ClassVar[str] = ""
    mark: ClassVar[str] = "#"
    end: ClassVar[str] = "end"
    heads: ClassVar[dict[str, str]] = {"if": "if {}", "else": "else", "while": "while {}"}
    names: ClassVar[dict[str, str]] = {
        "one_step": "step!", "rows_of_run": "rows!", "start": "start!", "momenta": "momenta!",
        "multipliers": "multipliers!",
        "atan2": "atan",
    }  # fmt: skip
    words: ClassVar[dict[type, str]] = {**Printer.words, ast.FloorDiv: "÷"}
    truth: ClassVar[dict[bool, str]] = {True: "true", False: "false"}

    def __init__(self) -> None:
        super().__init__()
        self.owner, self.scratch = "", list[str]()

    def attribute(self, owner: str, name: str) -> str:
        return f"{owner}.{name}"

    def index(self, e: ast.expr) -> str:
        """Return an index, counted from 1."""
        if isinstance(e, ast.Constant) and isinstance(e.value, int):
            return str(e.value + 1)
        return f"{self.of(e, 5)} + 1"

    def power(self, base: ast.expr, exponent: ast.expr) -> tuple[str, int]:
        return f"{self.of(base, 9)}^{self.of(exponent, 9)}", 8

    def about(self, text: str) -> None:
        self.lines.append(f'"{" ".join(text.split())}"')

    def head(self, f: ast.FunctionDef) -> None:
        kinds = {"float": "::Float64", "int": "::Int", "bool": "::Bool", "Vector": "", "Out": "",
                 "State": "::State"}  # fmt: skip
        self.owner = f.name
        arguments = [a.arg + kinds[ast.unparse(a.annotation)] for a in f.args.args if a.annotation]
        self.put(f"function {self.names.get(f.name, f.name)}({', '.join(arguments)})")

    def unused(self, name: str) -> None:
        """Write nothing: Julia does not mind."""

    def array(self, name: str, size: str) -> str:
        """Return the statement that clears an array, which is allocated once."""
        own = f"{self.owner}_{name}"
        self.scratch.append(f"const {own} = zeros({size})")
        return f"{name} = fill!({own}, 0.0)"

    def declared(self, kind: str) -> str:
        local = "local " if self.depth > 1 else ""
        return local + "{}::" + {"float": "Float64", "int": "Int", "bool": "Bool"}[kind]

    def _return(self, s: ast.Return) -> None:
        self.put(f"return {self.of(s.value)}" if s.value else "return nothing")

    def _for(self, s: ast.For) -> None:
        first, last = self.bounds(s)
        self.put(f"for {self.of(s.target)} in {self.of(first)}:({self.of(last)} - 1)")
        self.body(s.body)


FILE = """#=
{head}
=#
module Exported

export State, begin_at, step!, run!, energy, momenta!, multipliers!

{constants}
const X0 = {x}
const MU0 = {mu}
"name => value"
const PARAMETERS = (; {parameters})
"names of the entries of momenta!(values, state)"
const QUANTITIES = {quantities}
const TOLD = {told}

"The state of a run: x and mu, and what a step leaves for the next."
mutable struct State
{fields}
end

"Return a state at x and mu; parameters: those that differ from PARAMETERS."
function begin_at(x = X0, mu = MU0; parameters...)
    s = State({zeros})
    s.x .= x
    s.mu .= mu
    at = 1
    for (_, value) in pairs(merge(PARAMETERS, values(parameters))), entry in flat(value)
        s.q[at += 1] = entry
    end
    start!(s)
    return s
end

flat(value::Number) = (value,)
flat(value) = Iterators.flatten(map(flat, value))

"Return matrices x (N, rows) and mu (M, rows): the start, and a column after each `every` steps."
function run!(s::State, h, steps, every = 1)
    xs, mus = zeros(N, steps ÷ every + 1), zeros(M, steps ÷ every + 1)
    done = rows!(s, Float64(h), steps, every, vec(xs), vec(mus))
    done == steps || error("step $done was not solved")
    return xs, mus
end

{functions}

end
"""
HARNESS = """
using JSON  # one JSON line in and one out for each run

for line in eachline(stdin)
    asked = JSON.parse(line)
    parameters = (; (Symbol(k) => v for (k, v) in asked["parameters"])...)
    x = Float64[asked["x"]; {time}]
    answer = try
        s = Exported.begin_at(x, Float64[asked["mu"]...]; parameters...)
        xs, mus = Exported.run!(s, asked["h"], asked["steps"], asked["every"])
        Dict("x" => [xs[1:{positions}, k] for k in axes(xs, 2)], "mu" => collect(eachcol(mus)))
    catch failure
        Dict("error" => sprint(showerror, failure))
    end
    println(JSON.json(answer))
    flush(stdout)
end
"""


def written(value: object) -> str:
    """Return a number, a word or a list of them."""
    if isinstance(value, list | tuple):
        kind = "Float64" if all(isinstance(e, float) for e in value) else ""
        return f"{kind}[{', '.join(map(written, value))}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def julia_file(model: Exported, said: Sequence[str], with_harness: bool) -> str:
    """Return the Julia file of a scheme."""
    fields, zeros = [], []
    for name, (kind, length) in used_fields(model).items():
        one = "Float64" if kind == "float" else "Int"
        fields.append(f"    {name}::{one if length is None else f'Vector{{{one}}}'}")
        zeros.append(f"zero({one})" if length is None else f"zeros({one}, {length})")
    x, mu = model.start
    printer = Julia()
    functions = [printer.function(f) for f in model.functions]
    values = "\n".join(f"const {k} = {written(v)}" for k, v in constants(model))
    parameters = [f"{p.name} = {written(nested(p))}" for p in model.parameters]
    text = FILE.format(
        head="\n".join(head(model, "Julia", said)), x=written(x), mu=written(mu),
        constants=values,
        parameters=", ".join(parameters),
        quantities=f"String[{', '.join(map(written, model.quantities))}]",
        told=written([*STATUSES.values()]), fields="\n".join(fields), zeros=", ".join(zeros),
        functions="\n\n".join(["\n".join(printer.scratch), *functions]).lstrip(),
    )  # fmt: skip
    if with_harness:
        n = model.constants["N"] - model.timed
        text += HARNESS.format(time='asked["t"]' if model.timed else "", positions=n)
    return text
