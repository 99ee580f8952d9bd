"""Any Lie groupoid near its identities, from its target and product alone (paper, section 3.2)."""

from __future__ import annotations

from functools import cached_property

from ..errors import RAISED, BadInput, at_line, line_of, remedy, shown
from ..numbers import floats_exact, refuse_large, short_numbers, sympy
from ..numbers.types import Column, Expression, Function
from .groupoid import Groupoid


class LocalGroupoid(Groupoid):
    """Any Lie groupoid near its identities, from its target and product alone.

    target(x, u, h) and product(x, u, v, h) take sympy columns and return n and m expressions;
    `inverse(x, u, h)` is only needed where sympy finds no closed form. The axioms are checked
    when the first scheme is built on it (`check_axioms`).
    """

    kind = "local"
    by_maps = True

    def __init__(
        self,
        dim_x: int,
        dim_u: int,
        *,
        target: Function,
        product: Function,
        inverse: Function | None = None,
        name: str = "local groupoid",
    ) -> None:
        if not type(dim_x) is type(dim_u) is int or dim_x < 0 or dim_u < 1:
            sizes = f"{shown(dim_x)} and {shown(dim_u)}"
            raise BadInput(f"{name}: needs dim_x ≥ 0 and dim_u ≥ 1, not {sizes}.")
        self.dim_x, self.dim_u, self._name = dim_x, dim_u, name
        self._target, self._product, self._inverse = target, product, inverse

    @property
    def name(self) -> str:
        return self._name

    @property
    def place(self) -> str:  # type: ignore[override]
        return line_of(self._product)

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return column_of(self._target, self.dim_x, f"{self.name}: target", x, u, h)

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        return column_of(self._product, self.dim_u, f"{self.name}: product", x, u, v, h)

    @cached_property
    def _inversion(self) -> Column | None:
        if self._inverse is None:
            return super()._inversion
        x, u, h = (self.symbols[k] for k in ("x", "u", "h"))
        return column_of(self._inverse, self.dim_u, f"{self.name}: inverse", x, u, h)


def column_of(
    function: Function, length: int, what: str, *arguments: Column | Expression
) -> Column:
    """Return a column of `length` exact entries from a function that the user wrote.

    Raises `BadInput` (naming `what` and the function's line) if the function cannot be evaluated
    with symbols or returns another number of entries.
    """

    def said(error: BaseException | None = None) -> str:
        return at_line(function, error) + what

    try:
        with short_numbers(what):
            values = function(*arguments)
        many = hasattr(values, "__iter__") or hasattr(values, "shape")  # columns have no __iter__
        entries = [sympy.sympify(e, strict=True) for e in (list(values) if many else [values])]
        infinite = sympy.nan, sympy.zoo, sympy.oo, -sympy.oo
        if any(not isinstance(e, sympy.Expr) or e.is_Matrix or e.has(*infinite) for e in entries):
            raise ValueError(f"{entries} are no finite expressions")
        for e in entries:
            refuse_large(e, said())
        entries = [floats_exact(e) for e in entries]
    except BadInput:
        raise
    except RAISED as error:
        raise BadInput(
            f"{said(error)} could not be evaluated with symbols ({type(error).__name__}: {error}); "
            f"{remedy(error)}."
        ) from error
    if len(entries) != length:
        raise BadInput(f"{said()} returned {len(entries)} entries, but {length} are needed.")
    known = set().union(*(getattr(a, "free_symbols", ()) for a in arguments))
    if foreign := set().union(*(e.free_symbols for e in entries)) - known:
        names = ", ".join(sorted(map(str, foreign)))
        raise BadInput(f"{said()} holds the unknown symbol {names}; write it with its arguments.")
    return sympy.Matrix(length, 1, entries)
