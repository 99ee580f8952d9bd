"""Discrete mechanics on Lie groupoids, in local coordinates.

After J. C. Marrero, D. Martín de Diego, E. Martínez, *The local description of discrete
mechanics*. Importing this package loads neither sympy nor numba; what needs them loads them.
"""

from __future__ import annotations

from . import scenes
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
    discretisation,
    imex,
    midpoint,
    one_step,
    rectangle,
    trapezoidal,
)
from .scene import Conserved, Scene, on_group

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
    "discretisation",
    "exponential",
    "external",
    "imex",
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
    "su",
    "trapezoidal",
]
