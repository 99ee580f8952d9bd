"""Single steps of a rule on a lattice: two neighbours and their bond, taken as a scene."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import Lattice, Scene
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.groupoids import product
from discmech.integrators.numbers import sympy

LARGE = 9  # numbers of a site's x: those of a body on SO(3)


@lru_cache(maxsize=32)
def scene_of(lattice: Lattice) -> Scene:
    """Return two neighbours that move, and their bond, as a scene; contact is left out.

    If bonds hold velocities, their other neighbours stand beside them at rest: one bond alone may
    have no regular mass matrix. Raises `CannotMeasure` if no bond joins two sites that move, or a
    site is without one.
    """
    i, j = _ends(lattice)
    moving = lattice.bonds_move
    groupoid, n, m = lattice.groupoid, lattice.groupoid.dim_x, lattice.groupoid.dim_u
    x0, v0 = lattice.start
    k = lattice.matrix_size
    others = [b for b, pair in enumerate(lattice.pairs) if moving and len({*pair} & {i, j}) == 1]
    own = [b for b, pair in enumerate(lattice.pairs) if {*pair} == {i, j}]
    fixed = {int(e) for b in others for e in lattice.pairs[b]} - {i, j}

    def site(x: Any, at: int) -> Any:
        return x[n * at : n * (at + 1), :]

    def shaped(x: Any) -> Any:
        return x.reshape(k, k) if k else x

    def places(x: Any) -> dict[int, Any]:
        held = {e: sympy.Matrix([sympy.Rational(float(c)) for c in x0[e]]) for e in fixed}
        return {**held, i: site(x, 0), j: site(x, 1)}

    def lagrangian(x: Any, v: Any, p: Any) -> Any:
        at, speed = places(x), {i: v[:m, :], j: v[m:, :]}
        total = sympy.Integer(0)
        for end in (i, j):
            if lattice.on_site is not None:
                total += lattice.on_site(shaped(at[end]), speed[end], _of_site(lattice, p, end))
        for b in (*own, *others):
            one, other = (int(e) for e in lattice.pairs[b])
            ends = shaped(at[one]), shaped(at[other])
            if moving:
                ends += tuple(speed.get(e, sympy.zeros(m, 1)) for e in (one, other))
            assert lattice.on_bond is not None
            total += lattice.on_bond(*ends, _of_bond(lattice, p, b))
        return total

    def tied(x: Any, p: Any) -> Any:
        at = places(x)
        assert lattice.constraint is not None
        return [e for b in own for one, other in [map(int, lattice.pairs[b])]
                for e in lattice.constraint(shaped(at[one]), shaped(at[other]),
                                            _of_bond(lattice, p, b))]  # fmt: skip

    pair = [i, j]
    return Scene(
        name=f"{lattice.name}-bond", groupoid=product(groupoid, groupoid), lagrangian=lagrangian,
        parameters=dict(lattice.split_parameters["shared"]),
        x0=[*x0[pair].flat], v0=[*v0[pair].flat], duration=lattice.duration, step=lattice.step,
        holonomic=None if lattice.constraint is None else tied,
    )  # fmt: skip


def _ends(lattice: Lattice) -> tuple[int, int]:
    """Return the ends of the middle one of the bonds that join two sites that move."""
    free = np.flatnonzero(lattice.free[lattice.pairs].all(axis=1))
    if not len(free):
        raise CannotMeasure(f"{lattice.name}: no bond joins two sites that move.")
    one, other = lattice.pairs[free[len(free) // 2]]
    return int(one), int(other)


class _Values:
    """Parameters by name, for the functions of a site or a bond."""

    def __init__(self, values: dict[str, Any]) -> None:
        vars(self).update(values)


def _exact(value: Any) -> Any:
    """Return a float or an array of floats as exact sympy numbers."""
    if np.ndim(value) == 0:
        return sympy.Rational(float(value))
    return sympy.Matrix([sympy.Rational(float(e)) for e in np.ravel(value)])


def _of_site(lattice: Lattice, p: Any, i: int) -> Any:
    own = lattice.split_parameters["site"]
    return _Values({**vars(p), **{key: _exact(a[i]) for key, a in own.items()}})


def _of_bond(lattice: Lattice, p: Any, b: int) -> Any:
    parts, ends = lattice.split_parameters, lattice.pairs[b]
    both = {key: _exact(a[ends]) for key, a in parts["site"].items()}
    return _Values({**vars(p), **both, **{key: _exact(a[b]) for key, a in parts["bond"].items()}})
