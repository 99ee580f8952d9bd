"""Single steps of a rule on a lattice: two neighbours and their bond, taken as a scene."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from discmech.integrators import Lattice, Scene
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions import lattices

LARGE = 9  # numbers of a site's x: those of a body on SO(3)


@lru_cache(maxsize=32)
def scene_of(lattice: Lattice) -> Scene:
    """Return two neighbours that move, and their bond, as a scene; contact is left out.

    If bonds hold velocities, their other neighbours stand beside them at rest: one bond alone may
    have no regular mass matrix. Raises `CannotMeasure` if no bond joins two sites that move, or a
    site is without one.
    """
    ends = {*_ends(lattice)}
    beside = [b for b, pair in enumerate(lattice.pairs)
              if {*pair} == ends or (lattice.bonds_move and {*pair} & ends)]  # fmt: skip
    scene = lattices.scene_of(lattice, _ends(lattice), beside)
    return replace(scene, name=f"{lattice.name}-bond", contact=None, restitution=0)


def _ends(lattice: Lattice) -> tuple[int, int]:
    """Return the ends of the middle one of the bonds that join two sites that move."""
    free = np.flatnonzero(lattice.free[lattice.pairs].all(axis=1))
    if not len(free):
        raise CannotMeasure(f"{lattice.name}: no bond joins two sites that move.")
    one, other = lattice.pairs[free[len(free) // 2]]
    return int(one), int(other)
