"""What can be measured of a system: a study says which part it asks for, and never for a kind."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from discmech.integrators import Lattice
from discmech.integrators.lattices import systems

#: a state at a time that no rule has a part in; long runs; the symplectic form; the equations of
#: one step; laws of contact; sites that are joined by bonds
PARTS = ("end", "energy", "momenta", "form", "equations", "contact", "sites")
SMOOTH = frozenset(("end", "energy", "momenta", "form"))
#: the rules by which a lattice runs where none is chosen; those with stages meet no constraints
RULES = ("trapezoidal", "midpoint", "gauss-2")
STAGED = ("gauss-2",)
#: of these lattices fewer: what others show, or takes long to compile. By gauss-2 the energy of
#: Toda's chain wanders so slowly that telling takes 8 million steps
FEWER = {"toda": ("trapezoidal",),
         "breather-box": ("midpoint",),
         **dict.fromkeys(("rotors", "membrane", "bead-chain"), ("trapezoidal", "midpoint")),
         **dict.fromkeys(("kink", "bodies", "beam", "spaghetti", "rods", "links-spherical",
                          "links-revolute"), ("trapezoidal",))}  # fmt: skip
#: a beam as the other, that moves more, and chains as the rods, of bodies
BY_NAME = ("spaghetti", "links-spherical", "links-revolute")


@singledispatch
def parts_of(thing: Any) -> frozenset[str]:
    """The `PARTS` that a scene has; at impacts energy and form change, and orders are others."""
    return SMOOTH | {"equations"} if thing.contact is None else frozenset({"contact"})


@parts_of.register
def _(thing: Lattice) -> frozenset[str]:
    return SMOOTH | {"sites"} if thing.contact is None else frozenset({"sites"})


def why_not(thing: Any) -> str:
    """What keeps a system from the parts that it has not."""
    return "has contact" if "contact" in parts_of(thing) else "is a lattice"


def is_built_in(lattice: Lattice) -> bool:
    """Whether it is the lattice of that name, and not another one called so."""
    return lattice.name in systems.NAMES and systems.get(lattice.name) is lattice


def usual_lattices() -> tuple[Lattice, ...]:
    """The lattices that are measured where no system is chosen."""
    return tuple(systems.get(name) for name in systems.NAMES if name not in BY_NAME)


def usual_rules(lattice: Lattice) -> tuple[str, ...]:
    """The names of the rules by which a lattice runs where none is chosen."""
    usual = FEWER.get(lattice.name, RULES) if is_built_in(lattice) else RULES
    staged = STAGED if lattice.constraint is not None else ()
    return tuple(name for name in usual if name not in staged)
