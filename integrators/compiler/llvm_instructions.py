"""LLVM instructions of a straight-line function, from its syntax tree (`straight_line`)."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .straight_line import Text

_OPERATORS: dict[type, tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("fadd", operator.add),
    ast.Sub: ("fsub", operator.sub),
    ast.Mult: ("fmul", operator.mul),
    ast.Div: ("fdiv", operator.truediv),
    ast.Pow: ("", operator.pow),
}


class Value:
    """A number or an array: numba's type and LLVM's value."""

    def __init__(self, type_: Any, value: Any) -> None:
        self.type, self.value = type_, value


def unpacked(builder: Any, type_: Any, value: Any) -> Any:
    """Tuples as Python's, so that only what is used is ever loaded."""
    from numba.core import cgutils, types

    if isinstance(type_, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value, len(type_))
        return tuple(unpacked(builder, t, v) for t, v in zip(_members(type_), parts, strict=True))
    return Value(type_, value)


def _members(tuple_type: Any) -> list[Any]:
    return list(tuple_type)


def packed(context: Any, builder: Any, type_: Any, found: Any) -> Any:
    """LLVM's value of that numba type, from a number, an array or Python's tuple of them."""
    from numba.core import types

    if isinstance(type_, types.BaseTuple):
        parts = [
            packed(context, builder, t, f) for t, f in zip(_members(type_), found, strict=True)
        ]
        return context.make_tuple(builder, type_, parts)
    if found is None:
        return context.get_dummy_value()
    if isinstance(type_, types.Float):
        return _float(builder, found)
    return found.value


def _float(builder: Any, found: Any) -> Any:
    """LLVM's value of a number, which may still be one of Python's."""
    from llvmlite import ir
    from numba.core import types

    if not isinstance(found, Value):
        return ir.Constant(ir.DoubleType(), float(found))
    if isinstance(found.type, types.Integer):
        return builder.sitofp(found.value, ir.DoubleType())
    return found.value


class Writer:
    """Writes the instructions of one call of a straight-line function."""

    def __init__(self, context: Any, builder: Any, text: Text) -> None:
        self.context, self.builder, self.text = context, builder, text
        self.known: dict[str, Any] = {}

    def call(self, arguments: Sequence[Any]) -> Any:
        """What the function returns; tuples as Python's."""
        self.known = dict(zip(self.text.names, arguments, strict=True))
        for statement in self.text.statements:
            match statement:
                case ast.Return(value=node):
                    return self.value(node)
                case ast.Assign(targets=[target], value=node):
                    self._assign(target, self.value(node))
                case ast.Expr(value=node):
                    self.value(node)
                case ast.Pass():
                    pass
                case _:
                    raise self._unknown(statement)
        return None

    def _unknown(self, node: Any) -> NotImplementedError:
        return NotImplementedError(
            f"{self.text.function.__name__}: no straight line: {ast.unparse(node)}"
        )

    def _assign(self, target: Any, found: Any) -> None:
        if isinstance(target, ast.Tuple):
            for one, value in zip(target.elts, found, strict=True):
                self._assign(one, value)
        elif isinstance(target, ast.Subscript):
            self.builder.store(_float(self.builder, found), self._place(target))
        else:
            self.known[target.id] = found

    def value(self, node: Any) -> Any:
        """A number, an array or a tuple: `Value`, Python's own number, or Python's tuple."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name():
                return self.known.get(node.id, self.text.function.__globals__.get(node.id))
            case ast.Tuple():
                return tuple(self.value(e) for e in node.elts)
            case ast.UnaryOp(op=ast.USub()):
                return self._negative(self.value(node.operand))
            case ast.BinOp():
                return self._binary(node.op, self.value(node.left), self.value(node.right))
            case ast.Subscript():
                return self._entry(node)
            case ast.Call(func=ast.Name(id=name), keywords=[]):
                return self._called(name, [self.value(a) for a in node.args])
        raise self._unknown(node)

    def _negative(self, found: Any) -> Any:
        if not isinstance(found, Value):
            return -found
        return self._number(self.builder.fneg(_float(self.builder, found), flags=self.text.flags))

    def _binary(self, op: Any, left: Any, right: Any) -> Any:
        name, exact = _OPERATORS[type(op)]
        if not isinstance(left, Value) and not isinstance(right, Value):
            return exact(left, right)
        if not name and isinstance(right, int):
            return self._power(left, right)
        if not name:
            return self._foreign(exact, [left, right])
        sides = (_float(self.builder, side) for side in (left, right))
        return self._number(getattr(self.builder, name)(*sides, flags=self.text.flags))

    def _power(self, base: Any, exponent: int) -> Any:
        """A whole power by squaring: numba's would want the error argument of its functions."""
        one, times = ast.Constant(1.0), ast.Mult()
        if exponent < 0:
            return self._binary(ast.Div(), one.value, self._power(base, -exponent))
        result: Any = None
        while exponent:
            if exponent & 1:
                result = base if result is None else self._binary(times, result, base)
            exponent >>= 1
            base = self._binary(times, base, base) if exponent else base
        return one.value if result is None else result

    def _number(self, value: Any) -> Value:
        from numba.core import types

        return Value(types.float64, value)

    def _entry(self, node: Any) -> Any:
        held = node.value.value if isinstance(node.value, ast.Subscript) else node.value
        if isinstance(held, ast.Name) and isinstance(self.known.get(held.id), Value):
            return self._number(self.builder.load(self._place(node)))
        return self.value(node.value)[ast.literal_eval(node.slice)]

    def _place(self, node: Any) -> Any:
        """Where an entry of a C-contiguous array is: its index has one number, or two."""
        from llvmlite import ir
        from numba.np import arrayobj

        indices = [*node.slice.elts] if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(node.value, ast.Subscript):  # a[i][j], as lists of lists have it
            node = node.value
            indices.insert(0, node.slice)
        held = self.known[node.value.id]
        if held.type.layout != "C":
            raise self._unknown(node)
        array = arrayobj.make_array(held.type)(self.context, self.builder, held.value)
        whole = ir.IntType(64)
        at: Any = None
        for axis, index in enumerate(map(self.value, indices)):
            number = index.value if isinstance(index, Value) else ir.Constant(whole, index)
            if at is not None:
                length = self.builder.extract_value(array.shape, axis)
                number = self.builder.add(self.builder.mul(at, length), number)
            at = number
        return self.builder.gep(array.data, [at])

    def _called(self, name: str, arguments: list[Any]) -> Any:
        function = self.text.function.__globals__.get(name)
        if name == "int":
            from llvmlite import ir
            from numba.core import types

            number = _float(self.builder, arguments[0])
            return Value(types.int64, self.builder.fptosi(number, ir.IntType(64)))
        if name == "R":
            return float(arguments[0])
        if name == "workspace":
            return self._workspace(arguments)
        if name == "abs":
            from llvmlite import ir

            kind = ir.DoubleType()
            fabs = self.builder.module.declare_intrinsic("llvm.fabs", [kind])
            return self._number(self.builder.call(fabs, [_float(self.builder, arguments[0])]))
        text = getattr(function, "straight_text", None)
        if text is None:
            return self._foreign(function, arguments)
        return self._shared(text, arguments) if text.shared else self._inline(text, arguments)

    def _inline(self, text: Text, arguments: list[Any]) -> Any:
        return Writer(self.context, self.builder, text).call(arguments)

    def _shared(self, text: Text, arguments: list[Any]) -> Any:
        """A call of a function of floats that returns floats, written once in each module."""
        from llvmlite import ir

        kind, module = ir.DoubleType(), self.builder.module
        returns = text.statements[-1]
        if not isinstance(returns, ast.Return) or not isinstance(returns.value, ast.Tuple):
            raise self._unknown(returns)  # a shared function returns a tuple of floats
        count = len(returns.value.elts)
        name = f"discmech.{text.function.__module__}.{text.function.__name__}"
        made = module.globals.get(name)
        if made is None:
            returned = ir.LiteralStructType([kind] * count)
            made = ir.Function(module, ir.FunctionType(returned, [kind] * len(text.names)), name)
            made.linkage = "internal"
            inner = ir.IRBuilder(made.append_basic_block("entry"))
            found = Writer(self.context, inner, text).call([self._number(a) for a in made.args])
            whole: Any = ir.Constant(returned, ir.Undefined)
            for i, one in enumerate(found):
                whole = inner.insert_value(whole, _float(inner, one), i)
            inner.ret(whole)
        whole = self.builder.call(made, [_float(self.builder, a) for a in arguments])
        return tuple(self._number(self.builder.extract_value(whole, i)) for i in range(count))

    def _foreign(self, function: Any, arguments: list[Any]) -> Any:
        """A call of anything that numba knows: math's functions, and loops compiled by it."""
        from llvmlite import ir
        from numba.core import types

        given = [
            a if isinstance(a, Value)
            else Value(types.int64, ir.Constant(ir.IntType(64), a)) if isinstance(a, int)
            else self._number(_float(self.builder, a))
            for a in arguments
        ]  # fmt: skip
        context, typing = self.context, self.context.typing_context
        kind = typing.resolve_value_type(function)
        signature = typing.resolve_function_type(kind, tuple(a.type for a in given), {})
        values = [
            context.cast(self.builder, a.value, a.type, wanted)
            for a, wanted in zip(given, signature.args, strict=True)
        ]
        found = context.get_function(kind, signature)(self.builder, values)
        return unpacked(self.builder, signature.return_type, found)

    def _workspace(self, shape: list[int]) -> Value:
        """An array of zeros on the stack."""
        from llvmlite import ir
        from numba.core import cgutils, types
        from numba.np import arrayobj

        kind, whole, builder = types.Array(types.float64, 2, "C"), ir.IntType(64), self.builder
        length = shape[0] * shape[1]
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), length))
        cgutils.memset(builder, place, ir.Constant(whole, 8 * length), 0)
        array = arrayobj.make_array(kind)(self.context, builder)
        arrayobj.populate_array(
            array,
            data=builder.bitcast(place, ir.DoubleType().as_pointer()),
            shape=[ir.Constant(whole, n) for n in shape],
            strides=[ir.Constant(whole, n) for n in (8 * shape[1], 8)],
            itemsize=ir.Constant(whole, 8),
            meminfo=None,
        )
        return Value(kind, array._getvalue())
