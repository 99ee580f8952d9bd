"""From statements to the text of a language: a configuration, and what differs from the others.

The trees are those of `settling`: functions with annotated letters, loops over ranges, branches,
assignments, arithmetic. A language says how it writes each of them.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import ClassVar

WIDTH = 96
CUTS = (" + ", " - ", ", ", " && ", " || ", " and ", " or ")  # where a line may end
#: binding strength of an operation, the same in all these languages
STRENGTHS: dict[type, int] = {
    ast.Or: 1, ast.And: 2, ast.Not: 4, ast.Add: 5, ast.Sub: 5, ast.Mult: 6, ast.Div: 6, ast.Mod: 6,
    ast.FloorDiv: 6, ast.USub: 7,
}  # fmt: skip
COMPARE, ATOM, CHOICE = 4, 9, 0


@dataclass
class Printer:
    """Prints C, from which the others differ.

    names: functions by their names in this language; words: those of operators and constants.
    stop, end: those of a statement, and of a block; heads: the first lines of blocks, with
    {} for a condition.
    """

    stop: ClassVar[str] = ";"
    mark: ClassVar[str] = ""  # of a comment up to the end of its line
    end: ClassVar[str] = "}"
    heads: ClassVar[dict[str, str]] = {"if": "if ({}) {{", "else": "}} else {{",
                                       "while": "while ({}) {{"}  # fmt: skip
    names: ClassVar[dict[str, str]] = {"abs": "fabs", "int": "(int)", "one_step": "step",
                                       "rows_of_run": "run"}  # fmt: skip
    public: ClassVar[tuple[str, ...]] = ("start", "step", "run", "energy", "momenta", "multipliers")
    words: ClassVar[dict[type, str]] = {
        ast.And: "&&", ast.Or: "||", ast.Not: "!", ast.Add: "+", ast.Sub: "-", ast.Mult: "*",
        ast.Div: "/", ast.Mod: "%", ast.FloorDiv: "/", ast.USub: "-", ast.Lt: "<", ast.Gt: ">",
        ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    }  # fmt: skip
    truth: ClassVar[dict[bool, str]] = {True: "1", False: "0"}
    joined: ClassVar[int] = COMPARE  # what parts of `and` and `or` have to hold
    lines: list[str] = field(default_factory=list)
    depth: int = 0

    def of(self, e: ast.expr, needed: int = 0) -> str:
        """Return the text of an expression, in parentheses where it binds less than needed."""
        text, holds = self._written(e)
        return text if holds >= needed else f"({text})"

    def _written(self, e: ast.expr) -> tuple[str, int]:
        if isinstance(e, ast.Constant):
            return self.number(e.value), ATOM
        if isinstance(e, ast.Name):
            return self.name(e.id), ATOM
        if isinstance(e, ast.Attribute):
            return self.attribute(self.of(e.value, ATOM), e.attr), ATOM
        if isinstance(e, ast.Subscript):
            return f"{self.of(e.value, ATOM)}[{self.index(e.slice)}]", ATOM
        if isinstance(e, ast.Call):
            assert isinstance(e.func, ast.Name)
            arguments = ", ".join(map(self.of, e.args))
            return f"{self.names.get(e.func.id, e.func.id)}({arguments})", ATOM
        if isinstance(e, ast.IfExp):
            return self.choice(*(self.of(part, 1) for part in (e.test, e.body, e.orelse))), CHOICE
        if isinstance(e, ast.Compare):
            (right,) = e.comparators
            word = self.words[type(e.ops[0])]
            return f"{self.of(e.left, COMPARE + 1)} {word} {self.of(right, COMPARE + 1)}", COMPARE
        if isinstance(e, ast.UnaryOp):
            holds = STRENGTHS[type(e.op)]
            inner = self.of(e.operand, 8 if isinstance(e.op, ast.Not) else holds)
            return f"{self.words[type(e.op)]}{inner}", holds
        if isinstance(e, ast.BoolOp):
            parts = (self.of(p, self.joined) for p in e.values)
            return f" {self.words[type(e.op)]} ".join(parts), STRENGTHS[type(e.op)]
        assert isinstance(e, ast.BinOp)
        if isinstance(e.op, ast.Pow):
            return self.power(e.left, e.right)
        holds, word = STRENGTHS[type(e.op)], self.words[type(e.op)]
        space = " " if holds == 5 else ""
        left = self.of(e.left, holds)
        return f"{left}{space}{word}{space}{self.of(e.right, holds + 1)}", holds

    def number(self, value: object) -> str:
        """Return a number, or a truth value; what is no int of 32 bits becomes a float."""
        if isinstance(value, int) and abs(value) >= 2**31:
            value = float(value)
        return self.truth[value] if isinstance(value, bool) else repr(value)

    def name(self, name: str) -> str:
        """Return a letter or a constant."""
        return name

    def attribute(self, owner: str, name: str) -> str:
        """Return a field of the state."""
        return f"{owner}->{name}"

    def index(self, e: ast.expr) -> str:
        """Return an index, counted from 0."""
        return self.of(e)

    def choice(self, test: str, yes: str, no: str) -> str:
        """Return one of two values."""
        return f"{test} ? {yes} : {no}"

    def power(self, base: ast.expr, exponent: ast.expr) -> tuple[str, int]:
        """Return a power, with its binding strength."""
        return f"pow({self.of(base)}, {self.of(exponent)})", ATOM

    def put(self, text: str) -> None:
        """Write a line, in several where it is long."""
        first, rest = "    " * self.depth, "    " * (self.depth + 1)
        while len(first) + len(text) > WIDTH:
            cut = max(text.rfind(mark, 0, WIDTH - len(first)) for mark in CUTS)
            if cut <= 0:
                break
            cut = self.cut(text, cut)
            self.lines.append(first + text[:cut].rstrip())
            first, text = rest, text[cut:].lstrip()
        self.lines.append(first + text if text else "")

    def cut(self, text: str, place: int) -> int:
        """Return where a line is cut at an operator or a comma: behind it."""
        return place + (1 if text[place] == "," else text.index(" ", place + 1) - place)

    def block(self, statements: Sequence[ast.stmt]) -> None:
        """Write the statements of a block."""
        self.depth += 1
        for s in statements:
            getattr(self, f"_{type(s).__name__.lower()}")(s)
        self.depth -= 1

    def body(self, statements: Sequence[ast.stmt]) -> None:
        """Write the statements of a block, and its end."""
        self.block(statements)
        if self.end:
            self.put(self.end)

    def function(self, f: ast.FunctionDef) -> str:
        """Return the text of a function."""
        self.lines, self.depth = [], 0
        statements = list(f.body)
        first = statements[0]
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            self.about(str(first.value.value))
            statements = statements[1:]
        self.head(f)
        self.depth, used = 1, {e.id for s in f.body for e in ast.walk(s) if isinstance(e, ast.Name)}
        for argument in f.args.args:
            if argument.arg not in used:
                self.unused(argument.arg)
        self.depth = 0
        self.body(statements)
        return "\n".join(self.lines)

    def about(self, text: str) -> None:
        """Write what a function does."""
        self.lines += wrap(f"/* {' '.join(text.split())} */", WIDTH, subsequent_indent="   ")

    def comment(self, text: str) -> None:
        """Write a word about the statements that follow."""
        first = "    " * self.depth
        mark, end = (f"{self.mark} ", "") if self.mark else ("/* ", " */")
        self.lines += wrap(f"{text}{end}", WIDTH, initial_indent=first + mark,
                           subsequent_indent=first + (mark if self.mark else "   "))  # fmt: skip

    def head(self, f: ast.FunctionDef) -> None:
        """Write the first line of a function."""
        kinds = {"float": "double ", "int": "int ", "bool": "int ", "State": "state *",
                 "Vector": "const double *restrict ", "Out": "double *restrict ",
                 "None": "void "}  # fmt: skip
        arguments = ", ".join(kinds[ast.unparse(a.annotation)] + a.arg for a in f.args.args
                              if a.annotation)  # fmt: skip
        name = self.names.get(f.name, f.name)
        kept = "" if name in self.public else "static inline "
        self.put(f"{kept}{kinds[ast.unparse(f.returns or ast.Name('None'))]}{name}({arguments}) {{")

    def unused(self, name: str) -> None:
        """Write that an argument is not used."""
        self.put(f"(void){name};")

    def _assign(self, s: ast.Assign) -> None:
        self.put(f"{self.of(s.targets[0])} = {self.of(s.value)}{self.stop}")

    def _annassign(self, s: ast.AnnAssign) -> None:
        assert s.value is not None
        if isinstance(s.value, ast.BinOp) and isinstance(s.value.left, ast.List):
            self.put(self.array(self.of(s.target), self.of(s.value.right)))
            return
        kind = self.declared(ast.unparse(s.annotation))
        self.put(kind.format(self.of(s.target)) + f" = {self.of(s.value)}{self.stop}")

    def array(self, name: str, size: str) -> str:
        """Return the statement that declares an array of zeros."""
        return f"double {name}[{size}] = {{0}};"

    def declared(self, kind: str) -> str:
        """Return the declaration of a letter, {}, of a kind of number."""
        return {"float": "double {}", "int": "int {}", "bool": "int {}"}[kind]

    def _expr(self, s: ast.Expr) -> None:
        if isinstance(s.value, ast.Constant):  # a word about what follows
            self.comment(" ".join(str(s.value.value).split()))
            return
        self.put(f"{self.of(s.value)}{self.stop}")

    def _return(self, s: ast.Return) -> None:
        self.put(f"return {self.of(s.value)}{self.stop}" if s.value else f"return{self.stop}")

    def _break(self, s: ast.Break) -> None:
        self.put(f"break{self.stop}")

    def _pass(self, s: ast.Pass) -> None:
        pass

    def _if(self, s: ast.If) -> None:
        self.put(self.heads["if"].format(self.of(s.test)))
        self.block(s.body)
        if s.orelse:
            self.put(self.heads["else"].format())
            self.block(s.orelse)
        if self.end:
            self.put(self.end)

    def _while(self, s: ast.While) -> None:
        self.put(self.heads["while"].format(self.of(s.test)))
        self.body(s.body)

    def _for(self, s: ast.For) -> None:
        first, last = self.bounds(s)
        i = self.of(s.target)
        self.put(f"for (int {i} = {self.of(first)}; {i} < {self.of(last)}; {i}++) {{")
        self.body(s.body)

    @staticmethod
    def bounds(s: ast.For) -> tuple[ast.expr, ast.expr]:
        """Return the first index of a loop, and the one behind the last."""
        assert isinstance(s.iter, ast.Call)
        ends = s.iter.args
        return (ends[0], ends[1]) if len(ends) > 1 else (ast.Constant(0), ends[0])
