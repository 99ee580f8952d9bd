"""Lattices: many sites of one groupoid, whose equations are derived once, of a site and a bond."""

from .blocks import at_ends, of_all
from .contact_lattice import ContactLatticeTrajectory, SiteImpacts
from .dual_step import DualStep, poisson_defect
from .lattice import Lattice
from .lattice_flow import LatticeFlow, LatticeTrajectory
from .lattice_run import LatticeRun
from .lattice_scheme import LatticeScheme
from .restricted_step import Linearised, RestrictedStep, step_derivative
from .velocities import velocities

__all__ = [
    "ContactLatticeTrajectory", "DualStep", "Lattice", "LatticeFlow", "LatticeRun", "LatticeScheme",
    "LatticeTrajectory", "Linearised", "RestrictedStep", "SiteImpacts", "at_ends", "of_all",
    "poisson_defect", "step_derivative", "velocities",
]  # fmt: skip
