"""From symbolic expressions to a plain function of numbers: the one way.

    f = numeric({"x": x, "h": h}, [target, jacobian], arithmetic(50));  b, J = f([1, 2], step)

`numeric_text` is the first half, for who stores the text; `numeric_function` the second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import CodeType
from typing import Any, TypeAlias

import numpy as np

from .arithmetic import Arithmetic
from .graph import Graph
from .operations import Operations
from .registered import registered_names, with_tables
from .statements import body
from .types import (
    Expression,
    Expressions,
    Function,
    Letter,
    Letters,
    Namespace,
    Number,
    Numbers,
    SymbolicMatrix,
)

#: a number, a vector, or an array of two or three dimensions as a result
Result: TypeAlias = Expression | Expressions | SymbolicMatrix | Sequence[SymbolicMatrix]
#: decorators of functions in generated modules; only machine code uses them
_DECORATORS = ("kernel", "ordered", "node", "aside", "helper", "table")


def numeric(
    arguments: Mapping[str, Letter | Letters],
    results: Sequence[Result],
    numbers: Arithmetic,
    columns: bool = False,
    graph: Graph | None = None,
) -> Function:
    """Return the results as a function of the arguments, in an arithmetic that must be active.

    arguments: name → a symbol, or a vector of symbols. results: an expression gives a number, a
    list of k expressions a vector (k,), a sympy matrix or a list of matrices an array of its shape;
    a single result is returned by itself. columns: True if each argument's entries may be numpy
    columns of r numbers (at more than 16 digits, if the results call no tables); arrays that vary
    then have one more dimension, r. graph: that of nodes, or of letters for held nodes, in the
    results. Raises `BadInput` for functions that no arithmetic has.
    """
    return numeric_function(numeric_text(arguments, results, graph), numbers, columns)


def numeric_text(
    arguments: Mapping[str, Letter | Letters], results: Sequence[Result], graph: Graph | None = None
) -> str:
    """Return the text of the function that `numeric` makes, valid in every arithmetic.

    graph: that of letters for held nodes in the results.
    """
    shaped = [np.array(result, dtype=object) for result in results]
    entries = [e for array in shaped for e in array.flat]
    graph = graph or Graph()
    operations = Operations(graph)
    vectors: dict[str, list[str]] = {}
    for name, entry in arguments.items():  # a letter's own name may be a word of Python
        if hasattr(entry, "__len__"):
            vectors[name] = [f"{name}_{i}" for i in range(len(entry))]
        for letter, own in zip(*(entry, vectors[name]) if name in vectors else ([entry], [name]),
                               strict=True):  # fmt: skip
            operations.name(graph.node(letter), own)
    values = operations.values(graph.column(entries))
    lines, written = body(operations, values, vectors)
    texts, returned = iter(written), []
    for array in shaped:
        inner = ", ".join(next(texts) for _ in array.flat)
        shape = ", ".join(map(str, array.shape))
        returned.append(f"array([{inner}], {shape})" if shape else inner)
    head, tail = f"def function({', '.join(arguments)}):", f"    return {', '.join(returned)}"
    return with_tables("\n".join([head, *lines, tail]))


def numeric_function(text: str, numbers: Arithmetic, columns: bool = False) -> Function:
    """Return the function of a text that `numeric_text` wrote, in an arithmetic."""
    namespace = getattr(numbers, "array_namespace" if columns else "namespace")()
    start = text.rindex("def function(")
    with numbers.working():  # tables compute their constants first
        if columns and start and numbers.dtype is not object:  # they compute on numbers alone
            tables = run_text(text[:start], numbers.namespace())
            namespace |= {name: _on_columns(tables[name])
                          for name in registered_names() if name in tables}  # fmt: skip
            text = text[start:]
        return run_text(text, namespace)["function"]


def _on_columns(function: Function) -> Function:
    """Return a function of numbers as one of columns; each of its results is a column."""

    def on_columns(*arguments: Numbers | Number) -> Number | np.ndarray:
        columns = np.broadcast_arrays(*arguments)
        if not columns[0].ndim:
            return function(*arguments)
        rows = np.array([function(*row) for row in zip(*columns, strict=True)])
        return np.moveaxis(rows, 0, -1)

    return on_columns


@lru_cache(maxsize=256)
def registered_function(name: str, numbers: Arithmetic) -> Function:
    """Return the function registered (`registered.register`) under a name, in an arithmetic."""
    return run_text(with_tables(f"# {name}()"), numbers.namespace())[name]


def run_text(text: str, namespace: Mapping[str, Any]) -> Namespace:
    """Return the names of a generated text after it was executed on numbers of any kind."""
    names = {**dict.fromkeys(_DECORATORS, lambda function: function), **namespace}
    exec(_code(text), names)
    return names


@lru_cache(maxsize=64)  # flows of one scheme at several steps run the same text
def _code(text: str) -> CodeType:
    return compile(text, "<generated by discmech>", "exec")
