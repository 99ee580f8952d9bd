"""Lattices: many sites of one groupoid; the equations are derived for one site and one bond."""

from typing import TYPE_CHECKING

from ...numbers.lazy import on_demand

if TYPE_CHECKING:
    from .as_scene import scene_of
    from .blocks import at_ends, of_all
    from .contact_lattice import LatticeImpacts
    from .dual_step import DualStep, poisson_defect
    from .lattice import Lattice
    from .lattice_equations import rows_of
    from .lattice_flow import LatticeFlow
    from .lattice_run import LatticeRun
    from .lattice_scheme import LatticeScheme
    from .restricted_step import Linearised, RestrictedStep, step_derivative
    from .site_velocities import velocities
else:
    __getattr__ = on_demand(
        __name__,
        as_scene="scene_of",
        blocks="at_ends of_all",
        contact_lattice="LatticeImpacts",
        dual_step="DualStep poisson_defect",
        lattice="Lattice",
        lattice_equations="rows_of",
        lattice_flow="LatticeFlow",
        lattice_run="LatticeRun",
        lattice_scheme="LatticeScheme",
        restricted_step="Linearised RestrictedStep step_derivative",
        site_velocities="velocities",
    )  # fmt: skip

__all__ = [
    "DualStep", "Lattice", "LatticeFlow", "LatticeRun", "LatticeScheme",
    "Linearised", "RestrictedStep", "LatticeImpacts", "at_ends", "of_all",
    "poisson_defect", "rows_of", "scene_of", "step_derivative", "velocities",
]  # fmt: skip
