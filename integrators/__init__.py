"""Discrete mechanics on Lie groupoids, in local coordinates.

After J. C. Marrero, D. Martín de Diego, E. Martínez, *The local description of discrete
mechanics*. Importing this package loads neither sympy nor llvmlite; what needs them loads them.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from . import hooks, scenes
from .numbers.lazy import on_demand

if TYPE_CHECKING:
    from .algebras import MatrixAlgebra, se, sl, so, sp, su
    from .bisections import Bisection, EvolutionOperator
    from .errors import BadInput, DiscmechError, StepFailure
    from .extensions import Control, Lattice, black_box, external, in_own_time, recorded, vary
    from .flows import Scheme, mean_multipliers
    from .groupoids import Groupoid, LocalGroupoid, action, lie_group, pair, product
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
else:
    __getattr__ = on_demand(
        __name__,
        algebras="MatrixAlgebra se sl so sp su",
        bisections="Bisection EvolutionOperator",
        errors="BadInput DiscmechError StepFailure",
        extensions="Control Lattice black_box external in_own_time recorded vary",
        flows="Scheme mean_multipliers",
        groupoids="Groupoid LocalGroupoid action lie_group pair product",
        retractions="cayley exponential",
        rules="Discretisation compose discrete_hamiltonian discretisation imex midpoint one_step "
              "rectangle splitting trapezoidal",
        scene="Conserved Scene on_group",
    )  # fmt: skip


def _loaded(room: str, name: str) -> Any:
    return getattr(import_module(f".{room}", __name__), name)


hooks.scheme.fill(lambda: _loaded("flows", "Scheme"))
hooks.compose.fill(lambda: _loaded("rules", "compose"))
if find_spec(f"{__name__}.extensions"):  # the core runs without that folder
    import_module(f"{__name__}.extensions")

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
