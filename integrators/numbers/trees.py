"""Trees of sympy in which equal parts are one: each is visited once."""

from __future__ import annotations

from collections.abc import Iterable

from .types import Expression, Letter, Replacement


def parts_of(expressions: Iterable[Expression]) -> set[Expression]:
    """Return all subexpressions, each visited once: sympy's `atoms` visits shared ones again."""
    seen, pending = set[Expression](), list(expressions)
    while pending:
        e = pending.pop()
        if e not in seen:
            seen.add(e)
            pending += e.args
    return seen


def symbols_of(expressions: Iterable[Expression]) -> set[Letter]:
    """Return all symbols of the expressions."""
    return {e for e in parts_of(expressions) if e.is_Symbol}


def replaced(
    expressions: Iterable[Expression], swap: Replacement, known: Replacement | None = None
) -> list[Expression]:
    """Return the expressions with letters replaced; shared parts are rebuilt once.

    known: the parts that the same `swap` has rebuilt so far; it grows.
    """
    known = {} if known is None else known
    known.update(swap)

    def rebuilt(e: Expression) -> Expression:
        if e not in known:
            args = [rebuilt(a) for a in e.args]
            same = all(a is b for a, b in zip(args, e.args, strict=True))
            known[e] = e if same else e.func(*args)
        return known[e]

    return [rebuilt(e) for e in expressions]
