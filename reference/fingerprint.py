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
    import mpmath
    import sympy

    symbols = [*x, *v]
    functions = [lagrangian, *structure.rho]
    functions += [entry for matrix in structure.basis for entry in matrix]
    texts = [f"{structure.dim_x} {structure.dim_u}"]
    for index, constant in sorted(structure.constants.items()):
        texts.append(str(index))
        functions.append(constant)
    evaluate = sympy.lambdify(symbols, [*start, *functions], "mpmath")
    with mpmath.workdps(2 * DIGITS):
        for k in range(POINTS):
            point = [
                mpmath.mpf(2 * i + 3 * k + 5) / (7 * i + 11 + 4 * k) for i in range(len(symbols))
            ]
            texts += [mpmath.nstr(mpmath.mpmathify(value), DIGITS) for value in evaluate(*point)]
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()
