"""Conserved quantities a scene declares: momentum maps, Casimirs, first integrals.

By the discrete Noether theorem a symmetry of L_d keeps its momentum map to round-off, and Casimirs
of the dual algebroid are kept by every Poisson map (paper, section 2.4; Marrero, Martín de Diego,
Martínez 2006). First integrals of the flow that no symmetry of L_d stands behind are kept only
approximately: no claim to round-off is made of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Conserved:
    """A quantity formula(x, mu, p) → expression or column of them.

    x (n×1) and mu (m×1, natural basis: μ = F/h) are sympy columns, p the parameters. With
    `attitude` the scene is a group's and x is the attitude as an N×N matrix. With `value` the
    quantity is a constraint: the start must have exactly this value (|Γ|² = 1). With `stretch` it
    is compared over so many steps at a time, the attitude starting anew at e: where the attitude
    grows exponentially (SL(2)), its digits say nothing over a whole run.
    """

    name: str
    formula: Callable[[Any, Any, Any], Any]
    kind: Literal["momentum map", "Casimir", "first integral"] = "momentum map"
    attitude: bool = False
    value: Any = None
    stretch: int | None = None

    @property
    def to_roundoff(self) -> bool:
        """Whether a variational integrator keeps it to round-off."""
        return self.kind != "first integral"
