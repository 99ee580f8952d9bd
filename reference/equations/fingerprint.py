"""A scene's exact content in one short string: other mathematics gives another string.

It is a digest of the expressions themselves: the Lagrangian (or Hamiltonian), the force, the
constraints, the anchor, the structure functions, the attitude's matrices and the start. No two
systems share it, however similar they are at some points; the same formula in another form may have
another one, and is then computed anew.
"""

from __future__ import annotations

import hashlib
from typing import Any

import sympy

from .euler_lagrange import Mechanics


def fingerprint(system: Mechanics) -> str:
    """Return the SHA-256 of the system."""
    known: dict[Any, str] = {}
    structure = system.structure
    basis = [entry for matrix in structure.basis for entry in matrix]
    parts = [system.lagrangian, *system.start, *structure.rho, *basis]
    texts = [f"{structure.dim_x} {structure.dim_u}"]
    texts += [_digest(part, known) for part in parts]
    for index, constant in sorted(structure.constants.items()):
        texts.append(f"{index} {_digest(constant, known)}")
    texts += ["hamiltonian"] if system.hamiltonian else []
    texts += [f"force {_digest(e, known)}" for e in (*system.acting, *system.admitted)]
    if system.driven:  # or the constraints are those of A alone
        texts += [f"driven {_digest(e, known)}" for e in (*system.moving, *system.pushing)]
    return _sha("\n".join(texts))


def _digest(expression: Any, known: dict[Any, str]) -> str:
    """Return the digest of an expression's tree; the order of terms and factors does not count."""
    expression = sympy.sympify(expression)
    if expression not in known:
        parts = [_digest(part, known) for part in expression.args]
        if expression.is_Add or expression.is_Mul:
            parts.sort()
        name = type(expression).__name__ if parts else sympy.srepr(expression)
        known[expression] = _sha(" ".join([name, *parts]))
    return known[expression]


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
