"""A scene's exact content in one short string: other mathematics, another string.

The Lagrangian, the anchor and the structure functions are evaluated at fixed rational points to 60
digits, so that it does not matter how a formula is written, and a term of size 1e-50 does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .algebroid import Algebroid

DIGITS = 60
POINTS = 3


def fingerprint(x: Any, v: Any, lagrangian: Any, structure: Algebroid, start: Sequence[Any]) -> str:
    """SHA-256 of the numbers."""
    import sympy

    symbols = [*x, *v]
    texts = [f"{structure.dim_x} {structure.dim_u}", *map(_number, start)]
    texts += [_number(entry) for matrix in structure.basis for entry in matrix]
    functions = [lagrangian, *structure.rho]
    for index, constant in sorted(structure.constants.items()):
        texts.append(str(index))
        functions.append(constant)
    for k in range(POINTS):
        point = {
            symbol: sympy.Rational(2 * i + 3 * k + 5, 7 * i + 11 + 4 * k)
            for i, symbol in enumerate(symbols)
        }
        texts += [_number(function.subs(point)) for function in functions]
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()


def _number(value: Any) -> str:
    """A rational as it is, anything else to so many digits."""
    import sympy

    value = sympy.sympify(value)
    return str(value) if value.is_Rational else str(value.evalf(DIGITS, maxn=4 * DIGITS))
