"""Where a step fails because the equations are singular at that point: in which direction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..equations.continuous import mass_matrix
from ..numbers.evaluation import evaluate_matrix
from ..numbers.exact import exact, to_sympy
from ..numbers.identities import null_direction, shown
from ..numbers.lazy import sympy

if TYPE_CHECKING:
    from .flow import Flow


def singular_direction(flow: Flow, x: Any, u: Any, translate: int = 0) -> tuple[str, str] | None:
    """Which of ∂²l/∂ξ² and FL is singular to round-off at (x, u) and where to, with the mend.

    The mass matrix comes first: where it is singular no step size helps, and FL need be so only at
    the solution, whereas u is where Newton started. FL alone is singular at certain steps. None if
    neither is.
    """
    asked = (
        (_mass(flow, x, u), "∂²l/∂ξ²", "ξ", "no smaller step helps, begin elsewhere"),
        (_FL(flow, x, u, translate), "FL", "u", "take another step, or begin elsewhere"),
    )
    for matrix, name, letter, mend in asked:
        if matrix is None or not all(e.is_real and e.is_finite for e in matrix):
            continue
        direction = null_direction(matrix, 2**10 * float(flow.numbers.eps))
        if direction is not None:
            told = f"{name} is singular in the direction ({shown(direction)}) of {letter}"
            return told, mend
    return None


def _FL(flow: Flow, x: Any, u: Any, translate: int) -> Any:
    """∂F⁻/∂u, m×m, as sympy's Floats; None where it has no value."""
    try:
        found = flow.parts[0].geometry_in(translate).at(x, u)["minus_u"]
        return sympy.Matrix(found.tolist()).applyfunc(
            lambda e: sympy.Float(str(e), flow.numbers.digits + 5)
        )
    except (ArithmeticError, ValueError):  # the maps have no value there, or one that is infinite
        return None


def _mass(flow: Flow, x: Any, u: Any) -> Any:
    """∂²l/∂ξ², m×m; None where the scene has no Lagrangian or this has no value."""
    s = flow.scheme.s
    if flow.scheme.scene.lagrangian is None:
        return None
    at = dict(zip(s.parameter_list, map(to_sympy, s.parameter_values), strict=True))
    try:
        at |= {v: to_sympy(exact(e, "x")) for v, e in zip([*s.x, *s.u], [*x, *u], strict=True)}
        return evaluate_matrix(mass_matrix(s).xreplace(at), flow.numbers.digits)
    except (ArithmeticError, ValueError):
        return None
