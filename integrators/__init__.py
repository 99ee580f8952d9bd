"""Discrete mechanics on Lie groupoids, in local coordinates.

After J. C. Marrero, D. Martín de Diego, E. Martínez, *The local description of discrete
mechanics*. Importing this package loads neither sympy nor llvmlite; what needs them loads them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import scenes
from .numbers.lazy import on_demand, provide

if TYPE_CHECKING:
    from .algebras import MatrixAlgebra, se, sl, so, sp, su
    from .bisections import Bisection, EvolutionOperator
    from .control import Control
    from .errors import BadInput, DiscmechError, StepFailure
    from .flows import Scheme, mean_multipliers
    from .foreign import black_box, external, recorded
    from .groupoids import Groupoid, LocalGroupoid, action, lie_group, pair, product
    from .lattices import Lattice
    from .retractions import cayley, exponential
    from .rules import (
        Discretisation,
        compose,
        discrete_hamiltonian,
        discretisation,
        imex,
        midpoint,
        one_step,
        rectangle,
        splitting,
        trapezoidal,
    )
    from .scene import Conserved, Scene, on_group
    from .steps import in_own_time, vary
else:
    __getattr__ = on_demand(
        __name__,
        algebras="MatrixAlgebra se sl so sp su",
        bisections="Bisection EvolutionOperator",
        control="Control",
        errors="BadInput DiscmechError StepFailure",
        flows="Scheme mean_multipliers",
        foreign="black_box external recorded",
        groupoids="Groupoid LocalGroupoid action lie_group pair product",
        lattices="Lattice",
        retractions="cayley exponential",
        rules="Discretisation compose discrete_hamiltonian discretisation imex midpoint one_step "
              "rectangle splitting trapezoidal",
        scene="Conserved Scene on_group",
        steps="in_own_time vary",
    )  # fmt: skip

#: what is in rooms that a scene or a lattice does not import: it loads one that it needs
provide(
    ContactFlow=f"{__name__}.contact",
    LatticeScheme=f"{__name__}.lattices",
    Scheme=f"{__name__}.flows",
    check_gaps=f"{__name__}.contact",
    export=f"{__name__}.extensions.export",
)

__all__ = [
    "BadInput",
    "Bisection",
    "Conserved",
    "Control",
    "DiscmechError",
    "Discretisation",
    "EvolutionOperator",
    "Groupoid",
    "Lattice",
    "LocalGroupoid",
    "MatrixAlgebra",
    "Scene",
    "Scheme",
    "StepFailure",
    "action",
    "black_box",
    "cayley",
    "compose",
    "discrete_hamiltonian",
    "discretisation",
    "exponential",
    "external",
    "imex",
    "in_own_time",
    "lie_group",
    "mean_multipliers",
    "midpoint",
    "on_group",
    "one_step",
    "pair",
    "product",
    "recorded",
    "rectangle",
    "scenes",
    "se",
    "sl",
    "so",
    "sp",
    "splitting",
    "su",
    "trapezoidal",
    "vary",
]
