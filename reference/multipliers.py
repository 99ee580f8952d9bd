"""The multipliers of constraints at a reference: the force of constraint is A(x)^T lambda."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .failures import ReferenceFailure
from .problem import scene_of
from .result import Solution

if TYPE_CHECKING:
    from .equations import Balance


@lru_cache
def _balance(scene: Any) -> Balance:
    from .equations import balance_of

    return balance_of(scene)


def multipliers(scene: Any, at: Solution) -> list[Any]:
    """lambda (k) of a scene (or of the scene of that name) at one of its references, as mpf.

    They follow from (x, v, t) by one linear system, M xi' - A^T lambda = f and A xi' = -(dA/dt) xi,
    to the digits of the reference but for what that system loses. Raises `ReferenceFailure` for a
    scene without constraints, and where they are dependent.
    """
    import mpmath
    import sympy

    from .equations import T

    scene = scene_of(scene)
    balance = _balance(scene)
    k = balance.mechanics.admitted.rows
    if not k:
        raise ReferenceFailure(f"scene {scene.name} has no constraints, so no multipliers")
    symbols = [*balance.mechanics.x, *balance.mechanics.v, T]
    functions = sympy.lambdify(symbols, [balance.mass, balance.force], "mpmath")
    with mpmath.workdps(at.certain_digits + 15):
        t = mpmath.mpf(at.t.numerator) / at.t.denominator
        mass, force = functions(*at.x, *at.v, t)
        try:
            found = mpmath.lu_solve(mass, force)
        except ZeroDivisionError:
            raise ReferenceFailure(
                f"the constraints of scene {scene.name} are dependent at t = {float(at.t):.3g}"
            ) from None
        return list(found)[-k:]
