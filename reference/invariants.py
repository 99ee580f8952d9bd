"""Energy and the conserved quantities that a scene declares, along a computed solution."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .agreement import EXACT, Blocks
from .exact import parameter_values
from .failures import ReferenceFailure

if TYPE_CHECKING:
    from .equations import Equations


@dataclass(frozen=True)
class Invariants:
    """Functions of (x, v, mu, attitude) that the motion keeps, each with its absolute terms."""

    names: tuple[str, ...]
    function: Callable[..., list[tuple[Any, Any]]]

    def digits(self, here: Blocks, start: Blocks, working: int) -> tuple[int, str]:
        """Digits to which all are kept, and the name of the worst.

        A drift is measured relative to the quantity's sum of absolute terms, here or at the start.
        """
        import mpmath

        worst, name = math.inf, ""
        with mpmath.workdps(working):
            pairs = zip(self._at(start), self._at(here), strict=True)
            for label, ((a, p), (b, q)) in zip(self.names, pairs, strict=True):
                drift = abs(b - a)
                if drift:
                    kept = float(mpmath.log10(max(p, q) / drift))
                    if not kept >= worst:
                        worst, name = kept, label
        return (EXACT if worst == math.inf else max(0, math.floor(worst))), name

    def _at(self, blocks: Blocks) -> list[tuple[Any, Any]]:
        return self.function(*blocks["x"], *blocks["v"], *blocks["mu"], *blocks.get("attitude", ()))


def invariants_of(scene: Any, equations: Equations) -> Invariants:
    """Those of the scene; of its attitude only if the equations carry one."""
    import sympy

    n, m, size = equations.dim_x, equations.dim_u, equations.attitude_size
    states = list(equations.states)
    x = sympy.Matrix(n, 1, states[:n])
    mu = sympy.Matrix(m, 1, lambda i, _: sympy.Symbol(f"mu{i}", real=True))
    names, values = ["energy"], [equations.energy]
    for quantity in getattr(scene, "symmetries", ()):
        if quantity.attitude and not size:
            continue
        base = sympy.Matrix(size, size, states[n + m :]) if quantity.attitude else x
        try:
            found = sympy.sympify(quantity.formula(base, mu, parameter_values(scene)))
        except Exception as error:
            raise ReferenceFailure(
                f"the conserved quantity {quantity.name} of scene {scene.name} cannot be evaluated "
                f"on symbols ({type(error).__name__}: {error}); write it with sympy functions"
            ) from error
        entries = list(found) if hasattr(found, "shape") else [found]
        names += [quantity.name] * len(entries)
        values += entries
    pairs = [
        (value, sum((abs(term) for term in sympy.Add.make_args(value)), sympy.S.Zero))
        for value in map(sympy.sympify, values)
    ]
    arguments = [*states[: n + m], *mu, *states[n + m :]]
    return Invariants(tuple(names), sympy.lambdify(arguments, pairs, "mpmath"))
