"""A lattice, or a part of it, as one ordinary scene: the product of all its sites that move.

A lattice runs as this scene, to round-off; the scene's derivation grows with the number of sites.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...groupoids import product
from ...numbers import sympy, without_text
from ...numbers.types import Column, Expression, Expressions, Function, Number, Parameters
from ...scene import Scene
from .lattice import Lattice


def with_arguments(function: Function, timed: bool) -> Function:
    """Return a function(x, v, p, *t) with the arguments that a scene asks for: with t, or without.

    A scene reads from the number of arguments if something depends on the time.
    """
    if timed:
        return lambda x, v, p, t: function(x, v, p, t)
    return lambda x, v, p: function(x, v, p)


def scene_of(
    lattice: Lattice, sites: Iterable[int] | None = None, bonds: Iterable[int] | None = None
) -> Scene:
    """Return the sites that move, with all their bonds, as a scene; other sites stay at their x0.

    sites, bonds: numbers of those that are taken, if not all are. The scene's x holds site after
    site, its constraints and gaps those of site after site, then of bond after bond.
    """
    chosen = np.flatnonzero(lattice.free).tolist() if sites is None else [*sites]
    places = {int(i): k for k, i in enumerate(chosen)}
    pairs = [tuple(map(int, pair)) for pair in lattice.pairs]
    taken = [b for b in (range(len(pairs)) if bonds is None else map(int, bonds))
             if {*pairs[b]} & {*places}]  # fmt: skip
    groupoid, n, m = lattice.groupoid, lattice.groupoid.dim_x, lattice.groupoid.dim_u
    whole = groupoid
    for _ in range(1, len(places)):
        whole = product(whole, groupoid)
    terms = _Terms(lattice)

    def at(x: Column, i: int) -> Column:
        place = sympy.Matrix([sympy.Rational(float(e)) for e in lattice.start[0][i]])
        return lattice.shaped(x[n * places[i] : n * (places[i] + 1), :] if i in places else place)

    def moving(v: Column, i: int) -> Column:
        return v[m * places[i] : m * (places[i] + 1), :] if i in places else sympy.zeros(m, 1)

    def of_bond(
        word: str, b: int, x: Column, v: Column | None, p: Parameters, *t: Expression
    ) -> Expressions:
        ends = pairs[b]
        speeds = () if v is None else tuple(moving(v, i) for i in ends)
        return terms.value(word, p, "bond", b, *(at(x, i) for i in ends), *speeds, t=t)

    def lagrangian(x: Column, v: Column, p: Parameters, *t: Expression) -> Expression:
        velocity = v if lattice.bonds_move else None
        of_sites = (terms.value("on_site", p, "site", i, at(x, i), moving(v, i), t=t)
                    for i in places)  # fmt: skip
        of_bonds = (of_bond("on_bond", b, x, velocity, p, *t) for b in taken)
        return sum((*of_sites, *of_bonds), sympy.Integer(0))

    def force(x: Column, v: Column, p: Parameters, *t: Expression) -> list[Expression]:
        total = {i: sympy.zeros(m, 1) for i in range(lattice.sites)}
        for i in places if lattice.force else ():
            own = terms.value("force", p, "site", i, at(x, i), moving(v, i), t=t)
            total[i] += sympy.Matrix(own)
        for b in taken if lattice.bond_force else ():
            both = sympy.Matrix(of_bond("bond_force", b, x, v, p, *t))
            for k, i in enumerate(pairs[b]):
                total[i] += both[m * k : m * (k + 1), :]
        return [e for i in places for e in total[i]]

    def holonomic(x: Column, p: Parameters) -> list[Expression]:
        return [e for b in taken for e in of_bond("constraint", b, x, None, p)]

    def contact(x: Column, p: Parameters) -> list[Expression]:
        of_sites = [phi for i in places if lattice.contact
                    for phi in terms.value("contact", p, "site", i, at(x, i))]  # fmt: skip
        return of_sites + [phi for b in taken if lattice.bond_contact
                           for phi in of_bond("bond_contact", b, x, None, p)]  # fmt: skip

    more: dict[str, Any] = {}
    if lattice.force or lattice.bond_force:
        timed = lattice.takes_time("force") or lattice.takes_time("bond_force")
        more["force"] = with_arguments(force, timed)
    if lattice.constraint:
        more["holonomic"] = holonomic
    if lattice.has_contact:
        more |= {"contact": contact, "restitution": lattice.restitution}
    x0, v0 = (list(a[[*places]].ravel()) for a in lattice.start)
    timed = lattice.takes_time("on_site") or lattice.takes_time("on_bond")
    return Scene(
        f"{lattice.name}-scene", whole, with_arguments(lagrangian, timed),
        lattice.split_parameters["shared"], x0, v0, lattice.duration, lattice.step, **more,
    )  # fmt: skip


class _Terms:
    """Values of a lattice's functions, at one site or bond with its own parameters."""

    def __init__(self, lattice: Lattice) -> None:
        self.lattice = lattice

    def value(
        self, word: str, p: Parameters, kind: str, at: int, *columns: Column, t: Expressions = ()
    ) -> Any:
        time = t if self.lattice.takes_time(word) else ()
        answer = getattr(self.lattice, word)(*columns, self._values(p, kind, at), *time)
        return without_text(answer, f"{self.lattice.name}: {word}=")

    def _values(self, p: Parameters, kind: str, at: int) -> Parameters:
        """Return the parameters of a site, or of a bond, which sees those of both its ends."""
        parts, pairs = self.lattice.split_parameters, self.lattice.pairs
        sites = at if kind == "site" else pairs[at]
        own = {key: a[sites] for key, a in parts["site"].items()}
        if kind == "bond":
            own |= {key: a[at] for key, a in parts["bond"].items()}
        return SimpleNamespace(**{**vars(p), **{key: _exact(e) for key, e in own.items()}})


def _exact(value: Number | np.ndarray) -> Expression:
    """Return a float, or an array of floats, as exact numbers of sympy."""
    if np.ndim(value) == 0:
        return sympy.Rational(float(value))
    return sympy.Matrix([[sympy.Rational(float(e)) for e in np.ravel(row)] for row in value])
