"""From a name for each result to a text that one reads: what `specialised` wrote, settled.

Results that are used once go back where they are used, what nothing needs goes, and letters have
the names of the text that they come from.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from keyword import iskeyword

from .lane_loops import LANE, in_loops

Block = list[ast.stmt]
#: the names that a text may use; others are functions of the text itself
KNOWN = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
         "sqrt", "abs"}  # fmt: skip
KINDS = {"f": "float", "i": "int", "b": "bool", "v": "lanes"}
ZEROS: dict[str, float] = {"f": 0.0, "i": 0, "b": False}
FRESH = re.compile(r"[tpvTPV]\d+_$")  # new names (`written.Writer`) before `_named`
#: words of some language, which no letter may be called by
RESERVED = {"end", "double", "int", "float", "long", "short", "char", "const", "static", "void",
            "do", "switch", "case", "default", "struct", "union", "enum", "function", "begin",
            "let", "local", "module", "using", "s", "N", "M", "state", "signed", "auto", "goto",
            "register", "extern", "inline", "restrict", "typedef", "sizeof", LANE,
            *KNOWN}  # fmt: skip


def settled(
    block: Block, variables: dict[str, str], hints: Mapping[str, str], taken: Iterable[str],
    width: int,
) -> Block:  # fmt: skip
    """Return the statements without what nothing needs, each result where it is used, named.

    width: the number of lanes.
    """
    block = _lean(block, _needed(block))
    block = _Placing(block).block(block)
    beyond = _beyond(block, {LANE})
    block = [_Outside(beyond, variables).visit(s) for s in block]
    block = in_loops(block, variables, width)
    kept = {n for s in block for n in _names(s)}
    first: Block = [
        ast.AnnAssign(ast.Name(name), ast.Name(KINDS[kind]), ast.Constant(ZEROS[kind]), 1)
        if kind != "v" else zeros(name, width) for name, kind in variables.items() if name in kept
    ]  # fmt: skip
    return _named(first + block, hints, {*taken})


def zeros(name: str, length: int) -> ast.stmt:
    """Return the declaration of an array of zeros."""
    value = ast.BinOp(ast.List([ast.Constant(0.0)]), ast.Mult(), ast.Constant(length))
    return ast.AnnAssign(ast.Name(name), ast.Name("Out"), value, 1)


def _target(s: ast.stmt) -> str:
    """Return the new name that a statement gives a value without any other effect, or ""."""
    if not isinstance(s, (ast.Assign, ast.AnnAssign)) or calls_of_file(s.value):
        return ""
    target = s.targets[0] if isinstance(s, ast.Assign) else s.target
    return target.id if isinstance(target, ast.Name) and FRESH.match(target.id) else ""


def calls_of_file(e: ast.AST | None) -> bool:
    """Return True if an expression calls a function of the file, which may change arrays."""
    return isinstance(e, ast.Call) and ast.unparse(e.func) not in KNOWN | {"range", "int"}


def _needed(block: Block) -> set[str]:
    """Return the names that the effects of statements need."""
    uses, roots = dict[str, set[str]](), set[str]()

    def collect(block: Block, tests: set[str]) -> None:
        for s in block:
            reads = {*_own(s)} | tests
            if isinstance(s, (ast.If, ast.For, ast.While)):
                collect(s.body, reads)
                collect(getattr(s, "orelse", []), reads)
            elif (name := _target(s)) or _comment(s):
                uses.setdefault(name, set()).update(reads)
            else:
                roots.update(reads)

    collect(block, set())
    names, following = set[str](), roots
    while following:
        names |= following
        following = {e for name in following for e in uses.get(name, ())} - names
    return names


def _comment(s: ast.stmt) -> bool:
    return isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)


def _beyond(block: Block, known: set[str]) -> set[str]:
    """Return the results that are used outside the block in which they get their names."""
    here, results = set(known), set[str]()
    for s in block:
        results |= {n for n in _own(s) if _result(n)} - here
        if isinstance(s, ast.AnnAssign):
            here |= {ast.unparse(s.target)}
        inner = here | ({ast.unparse(s.target)} if isinstance(s, ast.For) else set())
        for part in (getattr(s, "body", []), getattr(s, "orelse", [])):
            results |= _beyond(part, inner)
        if isinstance(s, ast.While):
            results |= {n for n in _names(s.test) if _result(n)} - here
    return results


def _result(name: str) -> bool:
    return name[0] in "tpTP" and bool(FRESH.match(name))


class _Outside(ast.NodeTransformer):
    """Makes variables of results that are used outside their block."""

    def __init__(self, names: set[str], variables: dict[str, str]) -> None:
        self.names, self.variables = names, variables

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        name = ast.unparse(node.target)
        if name not in self.names or node.value is None:
            return node
        kinds = {word: kind for kind, word in KINDS.items()}
        self.variables[name] = kinds[ast.unparse(node.annotation)]
        return ast.Assign([node.target], node.value)


def _read(block: Sequence[ast.AST]) -> list[str]:
    """Return the names that are read, once for each time."""
    words = []
    for s in block:
        written = [*s.targets] if isinstance(s, ast.Assign) else []
        written += [s.target] if isinstance(s, (ast.AnnAssign, ast.For)) else []
        names = {id(e) for e in written if isinstance(e, ast.Name)}
        for e in ast.iter_child_nodes(s):
            if isinstance(e, ast.stmt):
                words += _read([e])
            elif id(e) not in names:
                words += [n.id for n in ast.walk(e) if isinstance(n, ast.Name)]
    return words


def _lean(block: Block, needed: set[str]) -> Block:
    """Return the statements without names that nothing needs, and without empty blocks."""
    statements: Block = []
    for s in block:
        name = _target(s)
        if isinstance(s, ast.If):
            yes, no = _lean(s.body, needed), _lean(s.orelse, needed)
            if yes or no:
                test = s.test if yes else ast.UnaryOp(ast.Not(), s.test)
                statements.append(ast.If(test, yes or no, no if yes else []))
        elif isinstance(s, ast.While):
            statements.append(ast.While(s.test, _lean(s.body, needed), []))
        elif isinstance(s, ast.For):
            body = _lean(s.body, needed)
            if not all(map(_comment, body)):
                statements.append(ast.For(s.target, s.iter, body, []))
        elif not name or name in needed:
            statements.append(s)
    return statements


class _Placing(ast.NodeTransformer):
    """Puts results that are used once into the place of their use, if nothing writes between."""

    def __init__(self, block: Block) -> None:
        self.read = Counter(_read(block))
        for e in (e for s in block for e in ast.walk(s) if isinstance(e, ast.Subscript)):
            self.read.update(_names(e.value))  # lanes of which one is read are an array
        self.waiting: dict[str, tuple[ast.AnnAssign, set[str]]] = {}

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id not in self.waiting:
            return node
        statement, _ = self.waiting.pop(node.id)
        assert statement.value is not None
        return statement.value

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        """Leave two signs out."""
        self.generic_visit(node)
        inner = node.operand
        if isinstance(node.op, ast.USub) and isinstance(inner, ast.UnaryOp):
            return inner.operand if isinstance(inner.op, ast.USub) else node
        return node

    def block(self, block: Block) -> Block:
        """Return the statements of a block."""
        statements: Block = []
        outer, self.waiting = self.waiting, {}
        last = {name: k for k, s in enumerate(block) for name in _own(s)}
        for k, s in enumerate(block):
            if isinstance(s, ast.AnnAssign) and (name := _target(s)):
                reads = {r for n in _names(s.value) if n in self.waiting
                         for r in self.waiting[n][1]} | _kept(s.value)  # fmt: skip
                s = ast.AnnAssign(s.target, s.annotation, self.visit(s.value), 1)  # type: ignore[arg-type]
                once = self.read[name] == 1 and name[0] in "tT"
                if once and last.get(name, -1) > k and not _zeros(s):
                    self.waiting[name] = (s, reads)
                else:
                    statements.append(s)
                continue
            written = _written([s])
            now = {*_own(s)}
            for name, (waits, reads) in [*self.waiting.items()]:
                if name not in now and reads & written:
                    statements.append(waits)
                    del self.waiting[name]
            statements.append(self._whole(s))
        statements += [waits for waits, _ in self.waiting.values()]
        self.waiting = outer
        return statements

    def _whole(self, s: ast.stmt) -> ast.stmt:
        if isinstance(s, ast.If):
            return ast.If(_plain(self.visit(s.test)), self.block(s.body), self.block(s.orelse))
        if isinstance(s, ast.For):
            return ast.For(s.target, self.visit(s.iter), self.block(s.body), [])
        if isinstance(s, ast.While):
            body, test = self.block(s.body), s.test
            first = body[0] if body else None
            if isinstance(first, ast.If) and not first.orelse and isinstance(
                first.body[0], ast.Break
            ):  # fmt: skip
                test, body = _plain(ast.UnaryOp(ast.Not(), first.test)), body[1:]
            return ast.While(test, body, [])
        made: ast.stmt = self.visit(s)
        return made


def _own(s: ast.stmt) -> list[str]:
    """Return the names that a statement reads itself, not in its blocks."""
    if isinstance(s, ast.While):
        return []
    if isinstance(s, (ast.If, ast.For)):
        return _names(s.test if isinstance(s, ast.If) else s.iter)
    return _read([s])


def _names(e: ast.AST | None) -> list[str]:
    return [n.id for n in ast.walk(e) if isinstance(n, ast.Name)] if e is not None else []


def _zeros(s: ast.AnnAssign) -> bool:
    return isinstance(s.value, ast.BinOp) and isinstance(s.value.left, ast.List)


def _kept(e: ast.AST | None) -> set[str]:
    """Return the arrays and variables that an expression reads."""
    arrays = {ast.unparse(n.value) for n in ast.walk(e) if isinstance(n, ast.Subscript)}  # type: ignore[arg-type]
    fields = {e for n in ast.walk(e) if isinstance(n, ast.Attribute)  # type: ignore[arg-type]
              for e in (ast.unparse(n), ast.unparse(n.value))}  # fmt: skip
    return arrays | fields | {n for n in _names(e) if FRESH.match(n) and n[0] in "vV"}


def _written(block: Sequence[ast.stmt]) -> set[str]:
    """Return the arrays and variables that statements write."""
    names = set[str]()
    for s in block:
        for e in ast.walk(s):
            if isinstance(e, ast.Assign):
                (target,) = e.targets
                inner = target.value if isinstance(target, ast.Subscript) else target
                names.add(ast.unparse(inner))
            if isinstance(e, (ast.Expr, ast.Assign)) and calls_of_file(e.value):
                names |= {n for a in e.value.args for n in _names(a)}  # type: ignore[attr-defined]
    return names


OPPOSITE: dict[type, type] = {ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}


def _plain(test: ast.expr) -> ast.expr:
    """Return a condition without two negations; a negated order stays, since NaN has none."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        inner = test.operand
        if isinstance(inner, ast.UnaryOp) and isinstance(inner.op, ast.Not):
            return _plain(inner.operand)
        if isinstance(inner, ast.Compare) and type(inner.ops[0]) in OPPOSITE:
            return ast.Compare(inner.left, [OPPOSITE[type(inner.ops[0])]()], inner.comparators)
    return test


def _named(block: Block, hints: Mapping[str, str], taken: set[str]) -> Block:
    """Return the statements with names that the text has, each used for one thing."""
    seen = Counter[str]()
    names: dict[str, str] = {}

    class Naming(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            if FRESH.match(node.id) and node.id not in names:
                word = hints.get(node.id) or node.id[0].lower()
                while True:
                    number, seen[word] = seen[word], seen[word] + 1
                    name = f"{word}_{number}" if number or word in RESERVED or iskeyword(word) \
                        else word  # fmt: skip
                    if name not in taken:
                        break
                taken.add(name)
                names[node.id] = name
            return ast.Name(names.get(node.id, node.id))

    return [Naming().visit(s) for s in block]
