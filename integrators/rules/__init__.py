"""Rules that turn a Lagrangian into a discrete Lagrangian, and one-step maps without one.

They are data, one kind per file.
"""

from __future__ import annotations

from ..errors import shown, unknown
from ..hooks import getter
from .composition import METHODS, Composition, Method, Substep, adjoint, compose
from .discrete_hamiltonian import discrete_hamiltonian
from .discretisation import Claims, Discretisation, check_rule, discretisation, own
from .galerkin import FAMILIES, gauss, lobatto
from .imex import imex
from .maps import MAPS, dual_gauss, map_of, newmark, whole
from .midpoint import midpoint
from .one_step import OneStepMap, one_step
from .parameters import of_scene, with_parameters
from .quadrature import Nodes, NodeValue
from .rectangle import rectangle
from .splitting import Share, splitting
from .trapezoidal import trapezoidal

__all__ = [
    "BUILT_IN", "Claims", "Composition", "Discretisation", "FAMILIES", "MAPS", "METHODS", "Method",
    "NodeValue", "Nodes", "OneStepMap", "Share", "Substep", "adjoint", "check_rule", "compose",
    "discrete_hamiltonian", "discretisation",
    "dual_gauss", "gauss", "get", "imex", "lobatto", "midpoint", "names", "newmark", "one_step",
    "of_scene", "own", "rectangle", "splitting", "trapezoidal", "with_parameters",
]  # fmt: skip


BUILT_IN = {rule.name: rule for rule in (rectangle, midpoint, trapezoidal, imex)}


def names() -> tuple[str, ...]:
    """Return the names that `get` knows: built-in rules, Galerkin rules, a composition per method.

    gauss-N and lobatto-N have N nodes, up to 20; any rule can follow the colon of a composition.
    """
    galerkin = [
        f"{family}-{least + i}" for family, (_, least) in FAMILIES.items() for i in range(4)
    ]
    return (*BUILT_IN, *galerkin, *(f"{method}:trapezoidal" for method in METHODS))


@getter
def get(name: str) -> Discretisation:
    """Return the rule of that name: built in, gauss-N, lobatto-N, own, a one-step map, or
    method:rule.

    A composition is named like kahan-li-8:midpoint. Raises `BadInput` for an unknown name and
    suggests the closest match.
    """
    if not isinstance(name, str):
        raise unknown("rule", shown(name), (*names(), *MAPS))
    if name in BUILT_IN or name == own.name:
        return BUILT_IN.get(name, own)
    if ":" in name:
        method, base = name.split(":", 1)
        composed: Discretisation = compose(get(base), method)
        return composed
    family, _, nodes = name.rpartition("-")
    if family in FAMILIES and (count := whole(nodes)) is not None:
        return FAMILIES[family][0](count)
    if (step_map := map_of(name)) is not None:
        return step_map
    raise unknown("rule", name, (*names(), *MAPS))
