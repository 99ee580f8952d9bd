"""Classes of scenes, each one scene whose function is a polynomial with letters as coefficients.

A step and the flow agree to h^K if they do for polynomials of degree K: their coefficients depend
on the derivatives up to that one, at one state, and a polynomial has any. Rules that ask for L
elsewhere too, or for derivatives of it, take a higher degree (docs/proofs.md).
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import Scene, action, exponential, lie_group, pair, product, sl, so
from discmech.integrators.algebras import MatrixAlgebra
from discmech.integrators.groupoids import Groupoid
from discmech.integrators.numbers import sympy

MOST_LETTERS = 500  # coefficients of a class, which take some ten seconds
#: the kinds by which classes are asked for
KINDS = ("pair", "separable", "magnetic", "symmetric", "cubic", "time", "force", "lie_group",
         "action", "product", "fast")  # fmt: skip
Powers = tuple[int, ...]


def _unit(n: int, i: int, j: int) -> list[list[int]]:
    return [[int((a, b) == (i, j)) for b in range(n)] for a in range(n)]


gl2 = MatrixAlgebra("gl(2)", [_unit(2, i, j) for i in range(2) for j in range(2)])  # type: ignore[arg-type]
#: R acting on R² by a matrix of no symmetry
r3 = MatrixAlgebra("r3", [[[2, 3, 0], [5, -1, 0], [0, 0, 0]], _unit(3, 0, 2), _unit(3, 1, 2)])  # type: ignore[arg-type]


@dataclass(frozen=True)
class SceneClass:
    """A class: a groupoid, and which monomials in (x, v), or (x, μ), its function has.

    part: "" for all monomials, "separable" for T(v) − V(x), "quadratic" for v·Mv/2 − V(x),
    "magnetic" for v·Mv/2 + A(x)·v − V(x), "moved" for those without x₁, "turned" for those in
    |x|², x·v and |v|², "cubic" for those of degree 3.
    keeps: the name of a quantity that is constant then, and its value of (x, μ).
    """

    name: str
    kind: str
    groupoid: Groupoid
    part: str = ""
    timed: bool = False
    forced: bool = False
    hamiltonian: bool = False
    fast: bool = False
    #: derivatives beyond the power of h that is asked: those that a rule takes itself, or a law
    further: int = 0
    #: states at which a step of length 0 asks for them
    places: int = 1
    #: how much longer it takes than others with as many coefficients
    dear: int = 1
    keeps: tuple[str, Callable[[Sequence[Any]], Any]] | None = None

    @property
    def still(self) -> bool:
        """True if L is a polynomial in v of degree 2, so that only places x matter."""
        return self.part in ("quadratic", "magnetic")

    def degree(self, power: int) -> int:
        """Return the degree of polynomials that have any derivatives up to h^power at `places`."""
        return self.places * (power + self.further + 1) - 1

    def powers(self, power: int) -> list[Powers]:
        """Return the exponents of the monomials, of x, t and then v."""
        n, degree = self.groupoid.dim_x + self.timed, self.degree(power)
        chosen: dict[str, Callable[[Powers, Powers], bool]] = {
            "": lambda a, b: True,
            "separable": lambda a, b: not (sum(a) and sum(b)),
            "quadratic": lambda a, b: (sum(a) == 0 and sum(b) == 2) or sum(b) == 0,
            "magnetic": lambda a, b: sum(b) < 2 or (sum(a) == 0 and sum(b) == 2),
            "moved": lambda a, b: a[0] == 0,
            "turned": lambda a, b: True,
            "cubic": lambda a, b: sum(a) + sum(b) <= 3,
        }
        every = _exponents(3 if self.part == "turned" else n + self.groupoid.dim_u, degree)
        return [e for e in every if chosen[self.part](e[:n], e[n:])]

    def count(self, power: int) -> int:
        """Return the number of coefficients."""
        forces, degree = self.groupoid.dim_u * self.forced, self.degree(power)
        n = self.groupoid.dim_x + self.timed + self.groupoid.dim_u
        own = len(self.powers(power)) if self.part else math.comb(n + degree, n)
        return own * (1 + forces) + len(self._fast(power))

    def linear(self, power: int) -> list[bool]:
        """Return for each coefficient whether it stays where a step of length 0 is linear in v."""
        n = self.groupoid.dim_x + self.timed
        in_v = [0, 1, 2] if self.part == "turned" else [0] * n + [1] * self.groupoid.dim_u
        own = [np.dot(in_v, e) <= 2 for e in self.powers(power)]
        return own + [True] * (self.count(power) - len(own))

    def _fast(self, power: int) -> list[Powers]:
        return list(_exponents(self.groupoid.dim_x, self.degree(power))) if self.fast else []

    def scene(self, power: int) -> Scene:
        """Return the scene with polynomials for that power; its numbers are only a start."""
        powers, rest = self.powers(power), self._fast(power)
        n, m, count, first = (
            self.groupoid.dim_x,
            self.groupoid.dim_u,
            self.count(power),
            len(powers),
        )

        def of(c: Sequence[Any], z: Sequence[Any], monomials: Sequence[Powers]) -> Any:
            return sympy.Add(*(
                a * sympy.Mul(*(e**k for e, k in zip(z, power, strict=True) if k))
                for a, power in zip(c, monomials, strict=True)
            ))  # fmt: skip

        def value(x: Any, v: Any, p: Any) -> Any:
            c = list(p.c)
            fast = of(c[len(c) - len(rest) :], list(x), rest) if rest else 0
            place = (x.dot(x), x.dot(v), v.dot(v)) if self.part == "turned" else (*x, *v)
            return of(c[:first], place, powers) - fast

        def timed(x: Any, v: Any, p: Any, t: Any) -> Any:
            return of(list(p.c)[:first], [*x, t, *v], powers)

        def force(x: Any, v: Any, p: Any, t: Any) -> Any:
            c = list(p.c)
            return [of(c[first * (i + 1) : first * (i + 2)], [*x, t, *v], powers) for i in range(m)]

        draw = random.Random(1)
        numbers = [Fraction(draw.randrange(1, 64), 64) for _ in range(count + n + m)]
        parts: dict[str, Any] = {"hamiltonian" if self.hamiltonian else "lagrangian":
                                 timed if self.timed else value}  # fmt: skip
        parts |= {"force": force} if self.forced else {}
        parts |= {"mu0" if self.hamiltonian else "v0": numbers[count + n :]}
        if self.fast:
            parts["fast"] = lambda x, p: of(list(p.c)[first:], list(x), rest)
        return Scene(name="generic", groupoid=self.groupoid, parameters={"c": numbers[:count]},
                     x0=numbers[count : count + n], duration=1, step="1/100", **parts)  # fmt: skip


def _exponents(length: int, degree: int) -> Iterator[Powers]:
    """Yield the exponents of all monomials up to a degree."""
    for total in range(degree + 1):
        for places in itertools.combinations_with_replacement(range(length), total):
            yield tuple(places.count(i) for i in range(length))


def _pairs(hamiltonian: bool) -> list[SceneClass]:
    letter, moving = ("H", "μ") if hamiltonian else ("L", "v")
    parts = (("T(μ) + V(x)", "μ·Nμ/2 + V(x)") if hamiltonian
             else ("T(v) − V(x)", "v·Mv/2 − V(x)"))  # fmt: skip
    classes = [SceneClass(f"{letter}(x, {moving}), n = {n}", "pair", pair(n)) for n in (1, 2, 3)]
    classes += [SceneClass(f"{e}, n = 2", "separable", pair(2), part)
                for e, part in zip(parts, ("separable", "quadratic"), strict=True)]  # fmt: skip
    form = "μ·Nμ/2 − a(x)·μ + V(x)" if hamiltonian else "v·Mv/2 + A(x)·v − V(x)"
    classes += [
        SceneClass(f"{form}, n = 2", "magnetic", pair(2), "magnetic"),
        SceneClass(f"{letter}(x, {moving}) without x₁, n = 2", "symmetric", pair(2), "moved",
                   keeps=("μ₁", lambda z: z[2])),
        SceneClass(f"{letter} of |x|², x·{moving}, |{moving}|², n = 2", "symmetric", pair(2),
                   "turned", keeps=("x ∧ μ", lambda z: z[0] * z[3] - z[1] * z[2])),
    ]  # fmt: skip
    if hamiltonian:
        classes += [SceneClass("H(x, μ) of degree 3, n = 2", "cubic", pair(2), "cubic")]
    classes += [SceneClass(f"{letter}(x, {moving}, t), n = 1", "time", pair(1), timed=True)]
    classes += [SceneClass(f"{letter}(x, {moving}, t) and a force f(x, v, t), n = 1", "force",
                           pair(1), timed=True, forced=True)]  # fmt: skip
    return classes


def _groups(hamiltonian: bool) -> list[SceneClass]:
    of = "H(μ)" if hamiltonian else "L(ξ)"
    both = "H(x, μ)" if hamiltonian else "L(x, ξ)"
    classes = [
        SceneClass(f"{of} on so(3), Cayley", "lie_group", lie_group(so(3)),
                   keeps=("|μ|²", lambda z: z[0] * z[0] + z[1] * z[1] + z[2] * z[2])),
        SceneClass(f"{of} on gl(2), Cayley", "lie_group", lie_group(gl2)),
        SceneClass(f"{of} on sl(2), exponential", "lie_group", lie_group(sl(2), exponential)),
        SceneClass(f"{of} on r3, exponential", "lie_group", lie_group(r3, exponential),
                   dear=3),
        SceneClass(f"{both} on R³ × so(3), Cayley", "action", action(so(3))),
        SceneClass(f"{both} on R × R × so(3), Cayley", "product",
                   product(pair(1), lie_group(so(3)))),
    ]  # fmt: skip
    return classes


def classes_of(hamiltonian: bool, splits: bool) -> list[SceneClass]:
    """Return the classes on which a rule, or a map of (x, μ), is tried.

    splits: True for a rule that treats a fast potential apart.
    """
    if splits:
        return [SceneClass(f"L(x, v) with a fast V(x), n = {n}", "fast", pair(n), fast=True)
                for n in (1, 2)]  # fmt: skip
    every = [*_pairs(hamiltonian), *_groups(hamiltonian)]
    return [replace(e, hamiltonian=hamiltonian) for e in every]
