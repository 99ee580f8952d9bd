"""Lattices: many sites of one groupoid, whose equations are derived once, of a site and a bond."""

from .lattice import Lattice
from .lattice_flow import LatticeFlow, LatticeTrajectory
from .lattice_scheme import LatticeScheme

__all__ = ["Lattice", "LatticeFlow", "LatticeScheme", "LatticeTrajectory"]
