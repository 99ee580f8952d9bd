"""A lattice: many sites of one groupoid, terms on sites and on bonds, as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from keyword import iskeyword
from typing import Any, ClassVar, TypeAlias

import numpy as np

from ...algebras import MatrixAlgebra
from ...errors import (
    BadInput,
    check_function,
    check_parameters,
    names_checked,
    shown,
)
from ...groupoids import Groupoid, LieGroup, RowAction
from ...numbers import exact_nested
from ...numbers.lazy import LazyModule
from ...numbers.types import Column, Function, Given, Parameters, Point, Rows
from ...rules import Discretisation
from ...scene import System, arguments_of

#: the values of parameters by name: exact ones, or arrays with a row for each site or bond
Values: TypeAlias = dict[str, Any]

_room: Any = LazyModule(str(__package__))  # its schemes, which are made of lattices

INTEGER = (int, np.integer)
MOST_SITES = 10**9  # one coordinate of so many sites takes eight gigabytes


@names_checked
@dataclass(frozen=True, eq=False, repr=False)
class Lattice(System):
    """N sites of one groupoid: L = Σ on_site(x_i, v_i, p) + Σ on_bond(x_i, x_j, p) over bonds.

    site: the groupoid of a site, with base dimension n and fibre dimension m. On lie_group(...) a
    site carries its element: x is the k×k matrix A with A′ = A ξ^, n = k².
    sites: N. on_site(x, v, p), on_bond(x, y, p): functions of sympy columns x and y (n×1; k×k
    matrices on a group) and v (m×1); a bond's energy enters with a minus, L = T − V.
    A bond with velocities is a function of five arguments, on_bond(x, y, v, w, p), where v and w
    are the velocities of x and y, for example for kinetic energy at the middle of a square of the
    grid; on_site may then be left out. Each of these functions may have the time t as one more
    argument, on_site(x, v, p, t), on_bond(x, y, p, t), and so may the forces.
    force(x, v, p): m components in the natural basis, the force on a site beside that of L (as for
    a `Scene`); bond_force(x, y, v, w, p): 2m components, the forces of a bond on its site at x and
    on that at y, such as those of a damper.
    bonds: "chain" joins i and i + 1, "ring" also N − 1 and 0; otherwise pairs (i, j), i ≠ j.
    parameters: numbers and lists are shared by all; a numpy array has one entry per site (first
    axis of length N; on_bond reads a column of two, those of x and of y) or one per bond. If both
    lengths are equal, on_site reads it by sites and on_bond by bonds.
    x0 (N, n), v0 (N, m): floats, natural velocities; on a group x0 may be (N, k, k), or left out.
    duration, step: see `Scene`. fixed_ends: True if the first and the last site of a chain stay at
    their x0; fixed: further fixed sites, as a list of numbers or as True or False for each site.
    constraint(x, y, p): a list of expressions φ(x_i, x_j) that vanish on every bond (i, j), such as
    joints; on_bond may then be left out. A site may then be the second one of at most one bond, as
    in chains, rings and trees.

    contact(x, p): a list of gaps φ(x) ≥ 0 of each site, bond_contact(x, y, p): a list of gaps of
    each bond, such as that between two balls, and restitution, e in [0, 1], as for a `Scene`;
    impacts happen at the end of a step, without friction. on_bond may then be left out.

    symmetries: name → ξ(x, p), a list of m entries: the natural velocity with which a one-parameter
    group that leaves L unchanged moves a site at x, all sites at once; or a list of such lists. The
    group conserves Σ μ_i·ξ(x_i) (`discmech momentum`).

    Raises `BadInput` for wrong shapes, non-finite numbers, and bonds to missing sites, and on a
    group for an x0 that is not an element.
    """

    name: str
    site: Groupoid
    sites: int
    parameters: Mapping[str, Given] = field(default_factory=dict)
    on_site: Function | None = None
    on_bond: Function | None = None
    bonds: str | Sequence[tuple[int, int]] | np.ndarray = "chain"
    x0: Rows | None = None
    v0: Rows | None = None
    duration: Given = 10
    step: Given = None
    fixed_ends: bool = False
    fixed: Sequence[int] | np.ndarray = ()
    constraint: Function | None = None
    contact: Function | None = None
    restitution: Given = 0
    symmetries: Mapping[str, Function] = field(default_factory=dict)
    source: str = ""
    title: str = ""
    force: Function | None = None
    bond_force: Function | None = None
    bond_contact: Function | None = None

    functions: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "on_site": ("(x, v, p)", "(x, v, p, t)"),
        "on_bond": ("(x, y, p)", "(x, y, p, t)", "(x, y, v, w, p)", "(x, y, v, w, p, t)"),
        "force": ("(x, v, p)", "(x, v, p, t)"),
        "bond_force": ("(x, y, v, w, p)", "(x, y, v, w, p, t)"),
        "constraint": ("(x, y, p)",),
        "contact": ("(x, p)",),
        "bond_contact": ("(x, y, p)",),
    }

    def __post_init__(self) -> None:
        self.check_name("lattice", "site")
        if not isinstance(self.sites, INTEGER) or isinstance(self.sites, bool) or self.sites < 2:
            raise BadInput(
                f"{self.name}: sites is {shown(self.sites)}; give a whole number from 2."
            )
        if self.sites > MOST_SITES:
            raise BadInput(f"{self.name}: {shown(self.sites)} sites are more than memory holds; "
                           f"give up to {MOST_SITES:,}.")  # fmt: skip
        self.check_features()
        beside = (self.constraint, self.bond_force, self.bond_contact)
        if self.on_bond is None and any(term is not None for term in beside):
            self.put(on_bond=no_term)
        if self.bonds_move and self.on_site is None:
            self.put(on_site=no_term)
        self.check_functions("on_site", "on_bond")
        self.take_restitution()
        named = self.symmetries
        if not isinstance(named, Mapping) or not all(map(callable, named.values())):
            raise BadInput(f"{self.name}: symmetries is {shown(named)}; give a dictionary of "
                           "functions ξ(x, p) by name.")  # fmt: skip
        for key, xi in named.items():
            check_function(xi, f"{self.name}: the symmetry {key}", "(x, p)")
        self.take_times()
        try:
            self.start, self.pairs, self.free, self.split_parameters  # noqa: B018 - checked now
        except MemoryError:
            raise BadInput(
                f"{self.name}: {self.sites:,} sites do not fit into memory; give fewer."
            ) from None

    def discretise(self, rule: Discretisation) -> Any:
        """Return the `LatticeScheme` by a rule, which `Scheme(lattice, rule)` is."""
        return _room.LatticeScheme(self, rule)

    def __repr__(self) -> str:
        return f"the lattice {self.name}"

    @cached_property
    def groupoid(self) -> Groupoid:  # type: ignore[override]
        """The groupoid of a site; for a group its action on itself, so bonds see the element."""
        if not isinstance(self.site, LieGroup):
            if not self.site.dim_x:
                raise BadInput(f"{self.name}: {self.site.name} has no base that a bond can use.")
            return self.site
        algebra = self.site.algebra
        return RowAction(algebra, self.site.tau, rows=algebra.real.size)

    @cached_property
    def bonds_move(self) -> bool:
        """True if a bond's Lagrangian contains the velocities of its ends."""
        return arguments_of(self.on_bond) > 4

    def shaped(self, x: Column) -> Column:
        """Return a site's x in the form that functions get: a column, or a matrix on a group."""
        k = self.matrix_size
        return x.reshape(k, k) if k else x

    @property
    def matrix_size(self) -> int:
        """The size k if a site carries a k×k matrix, else 0."""
        return self.site.algebra.real.size if isinstance(self.site, LieGroup) else 0

    @property
    def shape(self) -> str:
        """The elimination of a step's equations: of a "chain" or "ring", or a "list" of bonds."""
        if not isinstance(self.bonds, str) or (self.bonds == "ring" and not self.free.all()):
            return "list"
        return self.bonds

    @cached_property
    def pairs(self) -> np.ndarray:
        """The bonds as pairs of sites, (B, 2)."""
        N = int(self.sites)
        if isinstance(self.bonds, str):
            if self.bonds not in ("chain", "ring"):
                raise BadInput(f'{self.name}: bonds is "{self.bonds}"; say "chain" or "ring", or '
                               "give pairs (i, j).")  # fmt: skip
            if self.bonds == "ring" and N < 3:
                raise BadInput(f"{self.name}: a ring needs three sites, this one has {N}.")
            first = np.arange(N - 1 if self.bonds == "chain" else N)
            return np.stack([first, (first + 1) % N], axis=1)
        try:
            pairs = np.array(self.bonds)
        except ValueError:
            pairs = np.array(0)
        if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
            raise BadInput(
                f"{self.name}: bonds must be pairs of whole numbers (i, j), one or more; these "
                f"have the shape {pairs.shape}."
            )
        away = np.flatnonzero((pairs < 0).any(axis=1) | (pairs >= N).any(axis=1))
        if len(away):
            k = int(away[0])
            raise BadInput(f"{self.name}: bond {k} joins {_pair(pairs[k])}, but the sites are "
                           f"0 to {N - 1}.")  # fmt: skip
        loops = np.flatnonzero(pairs[:, 0] == pairs[:, 1])
        if len(loops):
            k = int(loops[0])
            raise BadInput(f"{self.name}: bond {k} is the loop {_pair(pairs[k])}; a term of one "
                           "site belongs into on_site.")  # fmt: skip
        second, counts = np.unique(pairs[:, 1], return_counts=True)
        if self.constraint is not None and counts.max() > 1:
            i = second[counts.argmax()]
            raise BadInput(f"{self.name}: site {i} is the second one of {counts.max()} bonds with "
                           "a constraint, and can have one; turn a bond round.")  # fmt: skip
        return pairs.astype(np.int64)

    @cached_property
    def free(self) -> np.ndarray:
        """True for each site that moves, (N,)."""
        free = np.ones(self.sites, dtype=bool)
        if not isinstance(self.fixed_ends, (bool, np.bool_)):
            raise BadInput(f"{self.name}: fixed_ends is {shown(self.fixed_ends)}; say True or "
                           "False.")  # fmt: skip
        if self.fixed_ends:
            if not isinstance(self.bonds, str) or self.bonds != "chain":
                raise BadInput(f"{self.name}: only a chain has ends to fix; name sites by fixed=.")
            free[[0, -1]] = False
        fixed = np.array(self.fixed, dtype=object).ravel()
        if any(isinstance(i, bool) for i in fixed):
            if len(fixed) != self.sites or not all(isinstance(i, bool) for i in fixed):
                raise BadInput(
                    f"{self.name}: fixed holds True or False; give numbers of sites, or one "
                    f"truth value per site, {self.sites}."
                )
            fixed = np.flatnonzero(fixed)
        for i in fixed:
            if not isinstance(i, INTEGER) or not 0 <= i < self.sites:
                raise BadInput(f"{self.name}: fixed names the site {shown(i)}, but the sites are 0 "
                               f"to {self.sites - 1}.")  # fmt: skip
            free[i] = False
        if not free.any():
            raise BadInput(f"{self.name}: no site is left to move.")
        return free

    @cached_property
    def split_parameters(self) -> dict[str, Values]:
        """{"shared": exact values, "site": arrays (N, ...), "bond": arrays (B, ...)} by name."""
        check_parameters(self.parameters, self.name)
        tables: dict[str, Values] = {"shared": {}, "site": {}, "bond": {}}
        lengths = {"site": int(self.sites), "bond": len(self.pairs)}
        for key, value in self.parameters.items():
            if iskeyword(key):
                raise BadInput(f"{self.name}: parameter {shown(key)} is a word of Python's, so "
                               f"p.{key} cannot be written; call it {key}_.")  # fmt: skip
            what = f"{self.name}: parameter {key}"
            if not isinstance(value, np.ndarray) or value.ndim == 0:
                plain = value.item() if isinstance(value, np.ndarray) else value
                tables["shared"][key] = exact_nested(plain, what)
                continue
            where = [w for w, length in lengths.items() if len(value) == length]
            if not where:
                raise BadInput(
                    f"{what} is an array of {len(value)}; give {lengths['site']} entries, one per "
                    f"site, or {lengths['bond']}, one per bond; a shared value is a list."
                )
            array = floats(value, what)
            if array.ndim > 2:
                raise BadInput(f"{what} has {array.ndim} axes; give one or two.")
            for w in where:
                tables[w][key] = array
        return tables

    @cached_property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """The start: x0 (N, n) and v0 (N, m)."""
        v0 = floats(self.v0, f"{self.name}: v0")
        wanted = (self.sites, self.groupoid.dim_u)
        if v0.shape != wanted:
            raise BadInput(f"{self.name}: v0 has the shape {v0.shape}; give one row per site, "
                           f"{wanted}.")  # fmt: skip
        return self.positions(self.x0), v0

    def positions(self, rows: Rows | None) -> np.ndarray:
        """Return x of all sites, (N, n); on a group `rows` may be matrices (N, k, k), or None for
        e.

        Raises `BadInput` for another shape, and on a group for a matrix that is not an element.
        """
        N, n, k = self.sites, self.groupoid.dim_x, self.matrix_size
        if rows is None and k:
            return np.broadcast_to(np.eye(k), (N, k, k)).reshape(N, n)
        x = floats(rows, f"{self.name}: x0")
        if x.shape != (N, n) and not (k and x.shape == (N, k, k)):
            raise BadInput(f"{self.name}: x0 has the shape {x.shape}; give one row per site, "
                           f"({N}, {n}).")  # fmt: skip
        if isinstance(self.site, LieGroup):
            for i in strangers(self.site.algebra.real, x.reshape(N, k, k)):
                raise BadInput(f"{self.name}: x0 of site {i} is no element of {self.site.name}; "
                               f"give a matrix of that group, {k}×{k}.")  # fmt: skip
        return x.reshape(N, n)


def no_term(x: Point, y: Point, p: Parameters) -> int:
    """Return 0, the value of a term that is left out."""
    return 0


def _pair(pair: np.ndarray) -> str:
    return f"({pair[0]}, {pair[1]})"


def floats(value: Rows | None, what: str) -> np.ndarray:
    """Return an array of finite floats; raises `BadInput`."""
    if value is None:
        raise BadInput(f"{what} is left out; give an array.")
    try:
        numbers = np.array(value)
        array = numbers.real.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(f"{what} is no array of numbers.") from None
    if numbers.dtype.kind == "c":
        raise BadInput(f"{what} holds complex numbers; give real ones.")
    if not np.isfinite(array).all():
        raise BadInput(f"{what} holds a number that is not finite.")
    return array


# Many matrices at once: which are elements of a group.


#: tolerance, relative to 1 and the largest entry of a column: half of a double's digits, as in
#: `StepContext.coordinates`; rows of a long run stay far below it
OFF = 2.0**-32
#: least |det(e + g B⁻¹)| for which the coordinates of Cayley's chart have digits to compare
OPEN = 2.0**-10


def strangers(algebra: MatrixAlgebra, g: np.ndarray) -> np.ndarray:
    """Return the indices of the matrices g (N, k, k) that are not elements of the algebra's group.

    An element is τ(ξ)B, where τ is Cayley's map and B a translate of the algebra. If the algebra
    has no cover, elements at the edge of the chart at e are accepted; if τ does not fit it, all
    are.
    """
    if not algebra.closed_under_triple_products:
        return np.zeros(0, dtype=np.int64)
    k, e = algebra.size, np.eye(algebra.size)
    basis = np.array(algebra.basis, dtype=np.float64).reshape(algebra.dim, k * k)
    within = np.linalg.pinv(basis) @ basis
    cover = np.array(algebra.translates, dtype=np.float64)
    openness = np.array([abs(np.linalg.det(e + g @ np.linalg.inv(B))) for B in cover])
    best = openness.argmax(axis=0)
    reached = openness.max(axis=0) > OPEN
    B = cover[best[reached]]
    moved = g[reached] @ np.linalg.inv(B)
    half = (moved - e) @ np.linalg.inv(moved + e)  # ξ^/2, if it is an element
    half = (half.reshape(-1, k * k) @ within).reshape(-1, k, k)
    off = np.full(len(g), np.inf if algebra.cover else 0.0)
    sizes = 1 + abs(g[reached]).max(axis=1, initial=0, keepdims=True)
    # (e − ξ^/2) g = (e + ξ^/2) B, without an inverse that a matrix outside the group may lack
    off[reached] = (abs((e - half) @ g[reached] - (e + half) @ B) / sizes).max(axis=(1, 2))
    return np.flatnonzero(~(off <= OFF))
