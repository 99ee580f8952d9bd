"""Functions whose path depends on numbers: their statements become LLVM blocks and branches.

Python evaluates the expressions on numbers whose operators write instructions. Constructs that
Python would decide itself (`if` in an expression, `and`, `not`, `int`) become functions of this
file.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Sequence
from functools import lru_cache, partial, reduce
from types import CodeType, FunctionType
from typing import Any

from ..numbers.types import Function
from .llvm_values import Operand, Value, mapped, register

UNROLLED = 16  # a longer loop of constant length is not unrolled
#: words and signs that are not in a text of one function whose lines are plain assignments; it may
#: be found in others that are plain, too, which are then only parsed in full
_STEERING = re.compile(
    r"\b(?:if|and|or|not|for|while|with|yield|del|try|raise|assert|import|global|def|class)\b"
    r"|[-+*/%]= | = .* = |: |^\S", re.MULTILINE,
)  # fmt: skip
LOOPS = (ast.While, ast.For)
STATEMENTS = (ast.Assign, ast.AugAssign, ast.Return, ast.Expr, ast.If, ast.Break, ast.Pass, *LOOPS)


@lru_cache(maxsize=512)  # the drivers' functions are the same in most modules
def parsed(text: str) -> list[ast.stmt]:
    """Return the statements of a part of a text.

    A function of plain assignments, which Python runs itself, is left without them: most are long.
    """
    head, _, body = text.partition("):\n")
    if body and text.startswith(("@", "def ")) and not _STEERING.search(body):
        text = f"{head}):\n    return"
    return ast.parse(text).body


def runnable(module: Any, node: ast.FunctionDef, text: str, function: FunctionType) -> Function:
    """Return a function of a part of a module's text as a callable that writes its instructions.

    It is Python's own `function` if its path does not depend on numbers. A call of a generator
    gives a function that writes its loops round those of `turn(value)`, where it yields.
    """
    if not _steered(node):
        return FunctionType(function.__code__, module.names)
    node, often, yields = _read(text, node.name)
    if yields:
        return lambda *arguments: partial(module.scope(module, node, often).call, arguments)
    return lambda *arguments: module.scope(module, node, often).call(arguments)


@lru_cache(maxsize=512)
def _read(text: str, name: str) -> tuple[ast.FunctionDef, set[str], bool]:
    """Return a function in the form that `Scope` runs, and two facts.

    They are the names that it assigns in more than one place, and whether it yields.
    """
    (node,) = (n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef) and n.name == name)
    _Language().generic_visit(node)
    ast.fix_missing_locations(node)
    return node, _assigned_often(node), any(isinstance(n, ast.Yield) for n in ast.walk(node))


class Scope:
    """One call of a function whose path depends on numbers."""

    def __init__(self, module: Any, node: ast.FunctionDef, often: set[str]) -> None:
        self.module, self.routine, self.node, self.often = module, module.routine, node, often
        self.names = dict(module.names)
        self.places: dict[str, Operand] = {}  # variables assigned in several places, and "return"
        self.ends: list[str] = []  # the end labels of the enclosing loops
        self.branches = 0  # number of enclosing branches that numbers decide
        # the returned value, if no number decides whether it is returned
        self.returned: list[Operand] = []
        self.left = False  # True if the function may have returned earlier

    def call(
        self, arguments: Sequence[Operand], turn: Callable[[Operand], None] | None = None
    ) -> Operand:
        """Write the function's instructions and return its result, a number or a tuple."""
        self.turn: Any = turn
        for argument, value in zip(self.node.args.args, arguments, strict=True):
            self._bind(argument.arg, value)
        self.exit = self.routine.name("exit")
        self._run(self.node.body)
        if self.returned:
            return self.returned[0]
        self.routine.begin(self.exit)
        return loaded(self.places["return"]) if "return" in self.places else None

    def value(self, node: ast.expr) -> Any:
        """Return the value of an expression, evaluated by Python."""
        names, code = _evaluated(node)
        for name in names:
            if name in self.places:
                self.names[name] = loaded(self.places[name])
        return eval(code, self.names)

    def _run(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            if self.returned or not self.routine.open:
                return
            match statement:
                case ast.Assign(targets=[target], value=node):
                    self._assign(target, self.value(node))
                case ast.Return(value=node):
                    self._return(None if node is None else self.value(node))
                case ast.Expr(value=ast.Yield(value=ast.expr() as node)):
                    self.turn(self.value(node))
                case ast.Expr(value=node):
                    self.value(node)
                case ast.If():
                    self._if(statement)
                case ast.While(test=test, body=body):
                    self._loop(partial(self.value, test), partial(self._run, body))
                case ast.For():
                    self._for(statement)
                case ast.Break():
                    self.routine.jump(f"label %{self.ends[-1]}")

    def _assign(self, target: Any, numbers: Operand) -> None:
        if isinstance(target, ast.Tuple):
            for one, value in zip(target.elts, numbers, strict=True):
                self._assign(one, value)
        elif isinstance(target, ast.Subscript):
            self.value(target.value)[self.value(target.slice)] = numbers
        else:
            self._bind(target.id, numbers)

    def _bind(self, name: str, numbers: Operand) -> None:
        """Bind a name to its value, or to a variable if several places assign it."""
        if name in self.often:
            self._put(name, numbers)
        else:
            self.names[name] = numbers

    def _put(self, name: str, numbers: Operand) -> None:
        """Assign a number or a tuple of numbers to variables."""
        if name not in self.places:
            self.places[name] = mapped(lambda v: self.routine.memory(register(v).kind), numbers)
        mapped(lambda v, place: place.__setitem__(0, v), numbers, self.places[name])

    def _return(self, numbers: Operand) -> None:
        if not (self.branches or self.left):
            self.returned = [numbers]
            return
        self.left = True
        if numbers is not None:
            self._put("return", numbers)
        self.routine.jump(f"label %{self.exit}")

    def _if(self, node: ast.If) -> None:
        test = self.value(node.test)
        if not isinstance(test, Value):
            self._run(node.body if test else node.orelse)
            return
        yes, no, after = (self.routine.name(label) for label in ("yes", "no", "after"))
        self.routine.jump(f"i1 {test.name}, label %{yes}, label %{no}")
        self.branches += 1
        for label, body in ((yes, node.body), (no, node.orelse)):
            self.routine.begin(label)
            self._run(body)
            self.routine.jump(f"label %{after}")
        self.branches -= 1
        self.routine.begin(after)

    def _loop(self, test: Callable[[], Operand], turn: Callable[[], None]) -> None:
        """Write a loop: the code of `turn()` while the condition of `test()` holds."""
        routine = self.routine
        head, body, end = (routine.name(label) for label in ("head", "body", "end"))
        routine.begin(head)
        if (goes := test()) is not True:
            routine.jump(f"{routine.operand('b', goes)}, label %{body}, label %{end}")
        routine.begin(body)
        self.ends.append(end)
        self.branches += 1
        turn()
        self.branches -= 1
        self.ends.pop()
        routine.jump(f"label %{head}")
        routine.begin(end)

    def _for(self, node: ast.For) -> None:
        if not _counts(node):
            turns: Operand = self.value(node.iter)
            if isinstance(turns, partial):
                self._each(node, turns)
                return
        else:
            bounds = [self.value(a) for a in node.iter.args]  # type: ignore[attr-defined]
            leaves = any(isinstance(n, ast.Break) for n in ast.walk(node))
            known = not leaves and all(isinstance(b, int) for b in bounds)
            turns = range(*bounds) if known else None
            if turns is None or len(turns) > UNROLLED:
                self._count(node, *(bounds if len(bounds) > 1 else (0, *bounds)))
                return
        for item in turns:
            self._turn(node, item)

    def _each(self, node: ast.For, write: Function) -> None:
        """Write the loops of a generator round this loop's body."""
        self.ends.append(self.routine.name("end"))
        self.branches += 1
        write(partial(self._turn, node))
        self.branches -= 1
        self.routine.begin(self.ends.pop())

    def _turn(self, node: ast.For, value: Operand) -> None:
        self._assign(node.target, value)
        self._run(node.body)

    def _count(self, node: ast.For, start: Operand, stop: Operand, step: int = 1) -> None:
        """Write a loop over integers with a constant step."""
        self.module.loops = True
        turns = f"turns of the loop in line {node.lineno}"
        self._put(turns, start)

        def turn() -> None:
            at = loaded(self.places[turns])
            self._assign(node.target, at)
            self._run(node.body)
            self._put(turns, at + step)

        word = "lt" if step > 0 else "gt"
        self._loop(lambda: self.routine.binary(word, loaded(self.places[turns]), stop), turn)


class _Language(ast.NodeTransformer):
    """Rewrites conditions in expressions as calls, and `a += b` as `a = a + b`."""

    def visit(self, node: ast.AST) -> Any:
        """Transform the node; fail if the language does not have it."""
        plain = not isinstance(node, ast.stmt) or isinstance(node, STATEMENTS)
        several = isinstance(node, ast.Assign) and len(node.targets) > 1
        loose = getattr(node, "ifs", ()) or (isinstance(node, LOOPS) and node.orelse)
        assert plain and not several and not loose, f"{ast.unparse(node)} is not of the language"
        return super().visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        """Return a plain assignment."""
        read = ast.parse(ast.unparse(node.target), mode="eval").body
        value = ast.BinOp(read, node.op, node.value)
        return self.generic_visit(ast.Assign([node.target], value))

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """Return a call of `chosen`, which evaluates what it needs."""
        self.generic_visit(node)
        none = ast.arguments([], [], None, [], [], None, [])
        return _call("chosen", node.test, *(ast.Lambda(none, e) for e in (node.body, node.orelse)))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """Return a call of `combined`."""
        self.generic_visit(node)
        return _call("combined", ast.Constant(isinstance(node.op, ast.And)), *node.values)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """Return a call of `negated` for `not`."""
        self.generic_visit(node)
        return _call("negated", node.operand) if isinstance(node.op, ast.Not) else node


@lru_cache(maxsize=4096)
def _evaluated(node: ast.expr) -> tuple[list[str], CodeType]:
    """Return the names in an expression, and its code."""
    names = sorted({n.id for n in ast.walk(node) if isinstance(n, ast.Name)})
    return names, compile(ast.Expression(node), "<kernels>", "eval")


def loaded(place: Operand) -> Operand:
    """Return the numbers in variables."""
    return mapped(lambda one: one[0], place)


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(f"_{name}", ast.Load()), list(arguments), [])


def _counts(node: ast.AST) -> bool:
    """Return True if a statement is a loop over a range."""
    call = node.iter if isinstance(node, ast.For) else None
    return isinstance(call, ast.Call) and getattr(call.func, "id", "") == "range"


def _steered(node: ast.FunctionDef) -> bool:
    """Return True if the path through a function may depend on numbers."""
    *before, last = node.body
    straight = all(isinstance(n, ast.Expr) or (isinstance(n, ast.Assign) and len(n.targets) == 1)
                   for n in (before if isinstance(last, ast.Return) else node.body))  # fmt: skip
    return not straight or any(map(_steers, ast.walk(node)))


def _steers(node: ast.AST) -> bool:
    """Return True if the value of an expression depends on a condition at this node."""
    if isinstance(node, ast.comprehension):
        return bool(node.ifs)
    return isinstance(node, (ast.IfExp, ast.BoolOp, ast.Not))


def _assigned_often(node: ast.FunctionDef) -> set[str]:
    """Return the names that a function assigns in more than one place."""
    inner = {id(n) for c in ast.walk(node) if isinstance(c, ast.ListComp) for n in ast.walk(c)}
    seen = [a.arg for a in node.args.args] + [
        n.id for n in ast.walk(node)
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store) and id(n) not in inner
    ]  # fmt: skip
    return {name for name in seen if seen.count(name) > 1}


# -- replacements of Python's own decisions, for numbers unknown until the code runs --------------


def chosen(test: Operand, yes: Callable[[], Operand], no: Callable[[], Operand]) -> Operand:
    """Return `yes() if test else no()`; if the test is not known yet, compute both and select."""
    if isinstance(test, Value):
        return mapped(partial(test.routine.select, test), yes(), no())
    return yes() if test else no()


def combined(both: bool, *parts: Operand) -> Operand:
    """Return `and` (or `or`) of all parts; all are computed, since they have no side effects."""
    values = [p for p in parts if isinstance(p, Value)]
    if any(bool(p) is not both for p in parts if not isinstance(p, Value)):
        return not both
    word = "and" if both else "or"
    return reduce(lambda a, b: a.routine.joint(word, a, b), values) if values else both


def negated(test: Operand) -> Operand:
    """Return `not test`."""
    if isinstance(test, Value):
        return test.routine.negated(test)
    return not test


def whole(number: Operand) -> Operand:
    """Return `int(number)`."""
    if isinstance(number, Value):
        return number.routine.whole(number)
    return int(number)


def mathematical(name: str, plain: Function) -> Function:
    """Return a mathematical function that uses `plain` if Python knows its arguments."""

    def function(*arguments: Operand) -> Operand:
        values = [a for a in arguments if isinstance(a, Value)]
        return values[0].routine.call(name, *arguments) if values else plain(*arguments)

    return function


#: the functions that the calls of `_Language` name
CONDITIONS = {"_chosen": chosen, "_combined": combined, "_negated": negated}
