"""Straight-line functions to machine code, past numba's type inference.

Most of a kernel is hundreds of lines of plain arithmetic on floats, and inferring their types costs
numba a millisecond a line. A function decorated here becomes one numba intrinsic instead: its lines
are read as a syntax tree and written as LLVM instructions where it is called. Everything in it is a
float but for arrays, tuples of its arguments, and `int(…)`; there are no branches and no loops.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from .llvm_instructions import Writer, packed, unpacked


def straight(*flags: str, shared: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: a numba intrinsic of a straight-line function.

    flags: LLVM's for fast arithmetic, such as "contract"; none: every operation as it is written.
    shared: one function in the machine code, of floats, called from several places of another such
    function; otherwise the instructions stand wherever it is called.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        from numba.extending import intrinsic

        text = Text(function, flags, shared)

        def define(typing_context: Any, *types: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                given = [
                    unpacked(builder, t, v) for t, v in zip(signature.args, values, strict=True)
                ]
                found = Writer(context, builder, text).call(given)
                return packed(context, builder, signature.return_type, found)

            return text.result_type(types)(*types), generate

        signature = inspect.signature(function)
        first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        define.__name__ = function.__name__
        define.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[first, *signature.parameters.values()]
        )
        made: Any = intrinsic(define)
        made.straight_text = text
        return made

    return decorate


class Text:
    """A straight-line function as a syntax tree, read when it is first needed."""

    def __init__(self, function: Callable[..., Any], flags: Sequence[str], shared: bool) -> None:
        self.function, self.flags, self._shared = function, tuple(flags), shared
        self.names = list(inspect.signature(function).parameters)

    @cached_property
    def statements(self) -> list[Any]:
        """The statements of the body."""
        source = textwrap.dedent(inspect.getsource(self.function))
        tree: Any = ast.parse(source).body[0]
        return list(tree.body)

    @cached_property
    def shared(self) -> bool:
        """Whether it is a function in the machine code; not if it calls one of numba's.

        Numba hands errors on through an argument of its own functions, which ours do not have.
        """
        return self._shared and not self._calls_numba

    @cached_property
    def _calls_numba(self) -> bool:
        calls = (n for s in self.statements for n in ast.walk(s) if isinstance(n, ast.Call))
        for call in calls:
            called = self.function.__globals__.get(getattr(call.func, "id", ""))
            text = getattr(called, "straight_text", None)
            if hasattr(called, "py_func") or (text is not None and text._calls_numba):
                return True
        return False

    def result_type(self, types: Sequence[Any]) -> Any:
        """Numba's type of what is returned."""
        last = self.statements[-1]
        from numba import types as numba_types

        if not isinstance(last, ast.Return) or last.value is None:
            return numba_types.none
        return _type_of(last.value, dict(zip(self.names, types, strict=True)))


def _type_of(node: Any, known: dict[str, Any]) -> Any:
    from numba import types

    if isinstance(node, ast.Tuple):
        return types.Tuple([_type_of(e, known) for e in node.elts])
    if isinstance(node, ast.Name) and node.id in known:
        return known[node.id]
    if isinstance(node, ast.Subscript):
        whole = _type_of(node.value, known)
        if isinstance(whole, types.BaseTuple):
            return whole[ast.literal_eval(node.slice)]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "int":
        return types.int64
    return types.float64
