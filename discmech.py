"""A bench for people who design variational integrators.

You write one discrete Lagrangian; the bench derives everything else exactly, runs it compiled and
at any number of digits, and measures order, symplecticity, momentum, energy and stability. The
three packages behind it are `discmech.integrators`, `discmech.reference` and `discmech.studies`;
importing this one loads neither sympy nor numba.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

# sympy remembers the last thousand calls of each of its functions, and one derivation makes more:
# with these it takes a fifth less time. Sympy reads it when it is imported, so no later.
os.environ.setdefault("SYMPY_CACHE_SIZE", "20000")

__path__ = [
    str(Path(__file__).resolve().parent)
]  # in a checkout this file and its packages lie in one folder

if TYPE_CHECKING:
    from discmech.integrators import *
    from discmech.reference import solution
    from discmech.studies import check, explain, film, plot, prove, show

#: the packages that the names below come from, the lightest first
_PACKAGES = ("studies", "reference", "integrators")


#: public too, but `from discmech import *` must not hide `import sympy as sp`
_BY_NAME_ALONE = ("sp",)


def __getattr__(name: str) -> Any:
    """A public name, loaded when it is first asked for: `discmech list` needs few of them."""
    if name in (*__all__, *_BY_NAME_ALONE):
        for package in _PACKAGES:
            module = import_module(f"{__name__}.{package}")
            if name in module.__all__:
                return getattr(module, name)
    raise AttributeError(f"discmech has no {name!r}; it has {', '.join(__all__)}.")


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
    "check",
    "compose",
    "discrete_hamiltonian",
    "discretisation",
    "explain",
    "exponential",
    "external",
    "film",
    "imex",
    "in_own_time",
    "lie_group",
    "mean_multipliers",
    "midpoint",
    "on_group",
    "one_step",
    "pair",
    "plot",
    "product",
    "prove",
    "recorded",
    "rectangle",
    "scenes",
    "se",
    "show",
    "sl",
    "so",
    "solution",
    "splitting",
    "su",
    "trapezoidal",
    "vary",
]
