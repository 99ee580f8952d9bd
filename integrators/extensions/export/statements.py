"""Functions as trees of Python's `ast`: what their text calls, and those that a file needs."""

from __future__ import annotations

import ast
from collections.abc import Iterable

#: the names that a text may use; others are functions of the text itself
KNOWN = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
         "sqrt", "abs"}  # fmt: skip


def parsed(text: str) -> list[ast.FunctionDef]:
    """Return the functions of a text."""
    return [e for e in ast.parse(text).body if isinstance(e, ast.FunctionDef)]


def last_of(called: str) -> int | None:
    """Return K of a table (c_0, ..., c_K) of Stumpff's functions; None for other functions."""
    word, _, last = called.partition("_")
    return int(last) if word == "stumpff" and last.isdigit() else None


def reached(functions: Iterable[ast.FunctionDef], roots: Iterable[str]) -> list[ast.FunctionDef]:
    """Return the functions that the roots need, each after those that it calls."""
    known = {f.name: f for f in functions}
    order: dict[str, ast.FunctionDef] = {}

    def visit(name: str) -> None:
        if name in known and name not in order:
            for called in called_in(known[name]):
                if called != name:
                    visit(called)
            order.setdefault(name, known[name])

    for root in roots:
        visit(root)
    return list(order.values())


def called_in(function: ast.FunctionDef) -> list[str]:
    """Return the names that a function calls, in the order of its text."""
    calls = [e for e in ast.walk(function) if isinstance(e, ast.Call)]
    return list(dict.fromkeys(e.func.id for e in calls if isinstance(e.func, ast.Name)))


def names_in(function: ast.FunctionDef) -> set[str]:
    """Return all names that a function's body uses."""
    return {e.id for s in function.body for e in ast.walk(s) if isinstance(e, ast.Name)}
