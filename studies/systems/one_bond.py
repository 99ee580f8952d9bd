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
    have no regular mass matrix. Where no bond joins two sites that move it is one site with all its
    bonds. Raises `CannotMeasure` if no site with a bond moves.
    """
    ends = _ends(lattice)
    beside = [b for b, pair in enumerate(lattice.pairs) if {*pair} == {*ends}
              or ((lattice.bonds_move or len(ends) == 1) and {*pair} & {*ends})]  # fmt: skip
    scene = lattices.scene_of(lattice, ends, beside)
    return replace(scene, name=f"{lattice.name}-bond", contact=None, restitution=0)


def _ends(lattice: Lattice) -> tuple[int, ...]:
    """Return the sites that move of the middle one of the bonds that have most of them."""
    moving = lattice.free[lattice.pairs].sum(axis=1)
    if not moving.any():
        raise CannotMeasure(f"{lattice.name}: no site with a bond moves.")
    most = np.flatnonzero(moving == moving.max())
    return tuple(int(i) for i in lattice.pairs[most[len(most) // 2]] if lattice.free[i])
