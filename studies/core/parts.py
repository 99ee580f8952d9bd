"""The parts of a system that can be measured: a study asks for a part, and never for a kind."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from discmech.integrators import Lattice
from discmech.integrators.extensions.lattices import scenes as systems

#: a state at a time that is known without any rule; long runs; the symplectic form; the equations
#: of one step; laws of contact; sites that are joined by bonds
PARTS = ("end", "energy", "momenta", "form", "equations", "contact", "sites")
SMOOTH = frozenset(("end", "energy", "momenta", "form"))
#: the rules by which a lattice runs if none is chosen; those with stages meet no constraints
RULES = ("trapezoidal", "midpoint", "gauss-2")
STAGED = ("gauss-2",)
#: fewer rules for these lattices: the rest shows nothing new, or takes long to compile
FEWER = {"toda": ("trapezoidal",),
         "breather-box": ("midpoint",),
         **dict.fromkeys(("rotors", "membrane"), ("trapezoidal", "midpoint")),
         **dict.fromkeys(("cradle", "bead-chain"), ("midpoint",)),
         **dict.fromkeys(("kink", "bodies", "beam", "spaghetti", "rods", "links-spherical",
                          "links-revolute"), ("trapezoidal",))}  # fmt: skip
#: a beam as the other, that moves more, and chains as the rods, of bodies
BY_NAME = ("spaghetti", "links-spherical", "links-revolute")


@singledispatch
def parts_of(thing: Any) -> frozenset[str]:
    """Return the `PARTS` that a scene has; at impacts energy and form change, and orders differ."""
    if thing.contact is None:
        return SMOOTH | {"equations"}
    kept = any(q.to_roundoff for q in thing.symmetries)
    return frozenset({"contact", "momenta"} if kept else {"contact"})


@parts_of.register
def _(thing: Lattice) -> frozenset[str]:
    if not (thing.has_contact or thing.forced or thing.timed):
        return SMOOTH | {"sites"}
    # these change what is kept otherwise; steps are held against their equations
    others = {"sites"} if thing.has_contact else {"end", "sites"}
    return frozenset(others | {"momenta"} if thing.symmetries else others)


def why_not(thing: Any) -> str:
    """Return the reason why a system lacks the other parts."""
    if "contact" in parts_of(thing):
        return "has contact"
    more = {" with contact": thing.has_contact, " with forces": thing.forced,
            " with explicit time": thing.timed}  # fmt: skip
    return "is a lattice" + next((words for words, so in more.items() if so), "")


def is_built_in(lattice: Lattice) -> bool:
    """True if it is the built-in lattice of that name, and not another of the same name."""
    return lattice.name in systems.NAMES and systems.get(lattice.name) is lattice


def usual_lattices() -> tuple[Lattice, ...]:
    """Return the lattices that are measured if no system is chosen."""
    return tuple(systems.get(name) for name in systems.NAMES if name not in BY_NAME)


def usual_rules(lattice: Lattice) -> tuple[str, ...]:
    """Return the names of the rules by which a lattice runs if none is chosen."""
    usual = FEWER.get(lattice.name, RULES) if is_built_in(lattice) else RULES
    staged = STAGED if lattice.constraint is not None else ()
    return tuple(name for name in usual if name not in staged)
