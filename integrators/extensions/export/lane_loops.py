"""Statements on lanes as loops over them: neighbours share a loop, what others read is an array.

A lane is a stage of a step. Names of lanes begin with T, P or V (`written.Writer`).
"""

from __future__ import annotations

import ast
from collections.abc import Sequence

Block = list[ast.stmt]
LANE = "lane"  # the index of a lane, and its letter in a text


def in_loops(block: Block, variables: dict[str, str], width: int) -> Block:
    """Return the statements with loops over the lanes; variables: gets those that are arrays."""
    if not width:
        return block
    block = _grouped(block, width)
    arrays = set[str]()
    seen = dict[str, int]()
    for e in (e for s in block for e in ast.walk(s)):
        if isinstance(e, ast.For) and ast.unparse(e.target) == LANE:
            for name in {n for s in e.body for n in _lanes(s)}:
                if seen.setdefault(name, id(e)) != id(e):
                    arrays.add(name)
        elif isinstance(e, ast.stmt):
            arrays |= set(_at_one_lane(e))
    for name in seen:
        if name in arrays:
            variables[name] = "v"
        elif name in variables:
            variables[name] = "f"
    return [_AtLane(arrays).visit(s) for s in block]


def _is_lanes(e: ast.AST) -> bool:
    return isinstance(e, ast.Name) and e.id[0] in "TPV" and e.id[-1] == "_"


def _at_one_lane(s: ast.AST) -> list[str]:
    """Return the lanes of which a statement reads one."""
    return [e.value.id for e in ast.walk(s) if isinstance(e, ast.Subscript)
            and isinstance(e.value, ast.Name) and _is_lanes(e.value)]  # fmt: skip


def _lanes(s: ast.AST) -> set[str]:
    one = {id(e.value) for e in ast.walk(s) if isinstance(e, ast.Subscript)}
    return {e.id for e in ast.walk(s)
            if isinstance(e, ast.Name) and _is_lanes(e) and id(e) not in one}  # fmt: skip


def _written(s: ast.stmt) -> set[str]:
    """Return the lanes and arrays that a statement writes."""
    targets = s.targets if isinstance(s, ast.Assign) else [getattr(s, "target", None)]
    return {ast.unparse(e.value if isinstance(e, ast.Subscript) else e) for e in targets if e}


def _grouped(block: Block, width: int) -> Block:
    """Return the statements with a loop round each group of statements on lanes.

    Another value goes before the loop, if it needs nothing of it.
    """
    statements, group = Block(), Block()
    written, single = set[str](), set[str]()  # by the group, and read at one lane by it

    def close() -> None:
        if group:
            lanes = ast.Call(ast.Name("range"), [ast.Constant(width)], [])
            statements.append(ast.For(ast.Name(LANE), lanes, [*group], []))
        for e in (group, written, single):
            e.clear()

    for s in block:
        plain = isinstance(s, (ast.Assign, ast.AnnAssign, ast.Expr))
        if plain and (_lanes(s) or any(_is_index(e) for e in ast.walk(s))):
            one, new = {*_at_one_lane(s)}, _written(s)
            if one & written or new & single:
                close()
            group.append(s)
            written.update(new)
            single.update(one)
        elif isinstance(s, ast.AnnAssign) and not _texts(s.value) & written:
            statements.append(s)
        else:
            close()
            for word in ("body", "orelse"):
                if hasattr(s, word):
                    setattr(s, word, _grouped(getattr(s, word), width))
            statements.append(s)
    close()
    return statements


def _is_index(e: ast.AST) -> bool:
    return isinstance(e, ast.Name) and e.id == LANE


def _texts(e: ast.AST | None) -> set[str]:
    """Return the names, fields and arrays of an expression."""
    parts: Sequence[ast.AST] = [*ast.walk(e)] if e is not None else []
    return {ast.unparse(n) for n in parts if isinstance(n, (ast.Name, ast.Attribute))}


class _AtLane(ast.NodeTransformer):
    """Writes arrays of lanes at the lane of a loop, and other lanes as numbers of it."""

    def __init__(self, arrays: set[str]) -> None:
        self.arrays = arrays

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        if not _is_lanes(node.value):
            self.generic_visit(node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Subscript(node, ast.Name(LANE)) if node.id in self.arrays else node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        if not _is_lanes(node.target):
            self.generic_visit(node)
            return node
        assert node.value is not None
        value = self.visit(node.value)
        if ast.unparse(node.target) in self.arrays:
            return ast.Assign([self.visit(node.target)], value)
        return ast.AnnAssign(node.target, ast.Name("float"), value, 1)
