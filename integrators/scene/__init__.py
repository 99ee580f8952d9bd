"""A mechanical system as data, with its declared quantities."""

from ..errors import BadInput
from ..numbers import refuse_unwritten, short_numbers, without_text
from ..numbers.types import Column, Covector, Parameters, Point, Scalar, SymbolicMatrix, Velocity
from .constraints import Constraint, ConstraintKind, ConstraintParts, entries_of, velocity_rows
from .legendre import halves
from .pickled import Again, again, flow_of
from .quantities import Conserved, OnGroup, arguments_of, on_group, takes_fourth
from .reads import Opaque, reads, remembered
from .scene import Scene
from .system import System

#: the references import only from here, and share no formula with the rest; refusals of long
#: numbers are here too, and the names of what a scene's functions take and give
__all__ = [
    "Again", "BadInput", "Column", "Conserved", "Constraint", "ConstraintKind", "ConstraintParts",
    "Covector", "OnGroup", "Opaque", "Parameters", "Point", "Scalar", "Scene", "SymbolicMatrix",
    "System", "Velocity", "again", "arguments_of", "entries_of", "flow_of", "halves", "on_group",
    "reads", "refuse_unwritten", "remembered", "short_numbers", "takes_fourth", "velocity_rows",
    "without_text",
]  # fmt: skip
