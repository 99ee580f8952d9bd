"""The equations of one site and of one bond of a lattice, which do not depend on their number.

A rule gives a weighted sum of values of L, so L_d of a lattice is the sum of L_d of its sites and
of its bonds; a bond's is on the product of two sites. The same holds for the Legendre maps and
everything derived from them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ...compiler import LatticeStages, Step
from ...equations import (
    DiscreteEquations,
    DiscreteLagrangian,
    SceneSymbols,
    check_regular,
    no_stages,
    refuse_pieces,
    stage_source,
)
from ...errors import BadInput, CannotMeasure
from ...geometry import is_self_adjoint
from ...groupoids import Groupoid, check_axioms, clock, product
from ...numbers import Graph, Node, Scope, sympy
from ...numbers.types import Column, Expression, Function, Letter, Mpf, Parameters, Scalars
from ...rules import Discretisation
from ...scene import Scalar, Scene, entries_of
from .as_scene import scene_of, with_arguments
from .bond_constraints import BondConstraints
from .lattice import Lattice, Values, no_term
from .lattice_text import Kicks, LatticeSystem


class LatticeEquations:
    """The equations of one site and one bond of a lattice, by a rule of one step.

    site, bond: the `DiscreteEquations` of each. Raises `BadInput` if a function cannot be evaluated
    or FL is singular everywhere, `CannotMeasure` for a rule that is no weighted sum of values of L.
    """

    def __init__(self, lattice: Lattice, rule: Discretisation) -> None:
        check_axioms(lattice.groupoid)
        self.lattice, self.rule, self.groupoid = lattice, rule, lattice.groupoid
        scene = _site_scene(lattice)
        if refusal := rule.refusal(scene):
            raise CannotMeasure(refusal)
        s = SceneSymbols(scene, rule.stages)
        _check_lagrangian(s, "on_site", lattice.on_site, "x, v, p and t")
        check_symmetries(s, lattice)
        # with velocities in bonds a site may have none: only the mass matrix of all must be regular
        of = DiscreteLagrangian(s, rule) if lattice.bonds_move else None
        self.site = DiscreteEquations(s, rule, of)
        if not lattice.bonds_move:
            check_regular(self.site, scene, rule)
        if why := self.site.discrete.of.unweighted:
            raise CannotMeasure(
                f"{lattice.name}: {rule.name} is no weighted sum of values of L, so its step is "
                f"not one of sites and bonds: {why}"
            )
        bond = _bond_scene(lattice)
        if lattice.constraint is not None and (refusal := rule.refusal(bond)):
            raise CannotMeasure(refusal)
        self.bond_symbols = SceneSymbols(bond, rule.stages)
        self.bond_symbols.name = f"a bond of {lattice.name}"
        _check_lagrangian(self.bond_symbols, "on_bond", lattice.on_bond, "x, y, v, w, p and t")
        for one, term, force in (
            (s, "on_site", "force"), (self.bond_symbols, "on_bond", "bond_force"),
        ):  # fmt: skip
            for word, values in ((term, [one.lagrangian]), (force, one.force)):
                refuse_pieces(values, one, f"{word}= of {lattice.name}", getattr(lattice, word))

    @cached_property
    def bond(self) -> DiscreteEquations:
        """The equations of a bond by itself, which may contain no velocity."""
        of = DiscreteLagrangian(self.bond_symbols, self.rule)
        return DiscreteEquations(self.bond_symbols, self.rule, of)

    @cached_property
    def constraints(self) -> BondConstraints | None:
        """The rows and multipliers of holonomic constraints on bonds, or None."""
        if self.lattice.constraint is None:
            return None
        return BondConstraints(self.site, self.bond)

    @cached_property
    def contacts(self) -> tuple[Function | None, Function | None]:
        """The gaps of a site and of a bond, as functions of the column of their x and of p."""
        lattice, n = self.lattice, self.groupoid.dim_x
        one, two, shaped = lattice.contact, lattice.bond_contact, lattice.shaped
        return (
            None if one is None else lambda x, p: one(shaped(x), p),
            None if two is None else lambda x, p: two(shaped(x[:n, :]), shaped(x[n:, :]), p),
        )

    @cached_property
    def end_weights(self) -> tuple[Expression, Expression] | None:
        """The weights of L at a step's start and end, or None if the rule uses other points."""
        of, (start, end) = self.site.discrete.of, (self.site.x, self.site.y)
        if len(self.site.s.stages) or not of.straight:
            return None
        asked = [
            (weight, sympy.Matrix([of.resolved(e) for e in call.args[: len(start)]]))
            for weight, call in of.asked
        ]
        if any(point not in (start, end) for _, point in asked):
            return None
        first, last = (
            sympy.Add(*(weight for weight, point in asked if point == at)) for at in (start, end)
        )
        return first, last

    @cached_property
    def local(self) -> bool:
        """True if no bond couples two sites' unknowns: the bonds' L is taken at ends only."""
        still = self.constraints is None and not self.bonds_move
        return self.end_weights is not None and still

    @cached_property
    def bonds_move(self) -> bool:
        """True if a bond's term or its force contains the velocities of its ends."""
        bond = self.bond_symbols
        return self.lattice.bonds_move or bool(bond.force.free_symbols & {*bond.u})

    @cached_property
    def constants(self) -> Mapping[Letter, Callable[[int], Mpf]]:
        """The numbers of the rule, by letters."""
        return self.site.s.constants | ({} if self.local else self.bond.s.constants)

    @cached_property
    def system(self) -> LatticeSystem:
        """One step as the data that is compiled."""
        s, bond, (q, own, of_bond) = self.site.s, self.bond_symbols, self._letters
        if self.constraints is not None:
            return self._tied(*self.constraints.step())
        if self.local:
            kinetic, potential = self._split()
            kicks = (None if potential is None else
                     self._kicks("potential", s, _slope_of(s, potential), own),
                     self._kicks("bond", bond, _force_of(bond), of_bond))  # fmt: skip
            site = replace(_at_time(kinetic.step, s), q=(*q, *own))
            return LatticeSystem(self.lattice.name, q, site, own, of_bond, kicks, timed=self.timed)
        pair = _by_ends(self.bond.step, self.groupoid.dim_u)
        return self._tied(self.site.step, pair)

    @cached_property
    def stages(self) -> LatticeStages | None:
        """One step as collocation, or None.

        It is None if the rule is no collocation, if bonds have velocities or constraints, or if
        Newton's method is at least as fast: for two unknowns of a site along a chain or a ring (ns
        per site and step, fixed point and Newton: toda 107, 72, breather 74, 67, fput 28, 29; for a
        list, membrane 33, 107; for three unknowns, fput 46, 55; for twelve, beam 1258, 11540). With
        S unknowns Newton's method takes as long as 3S²/2 sweeps (S = 3: 13, 4: 25, 6: 50).
        """
        lattice, rule = self.lattice, self.rule
        tied = self.bonds_move or lattice.constraint is not None
        if rule.nodes is None or tied or self.timed:
            return None
        unknowns, listed = rule.nodes.unknown * self.groupoid.dim_u, lattice.shape == "list"
        if unknowns < 3 and not listed:
            return None
        word, values = "force_of_bonds", _site_values(lattice)
        while any(name.startswith(word) for name in values):
            word += "_"
        site = _site_scene(lattice)
        values, beside = {**values, word: (0,) * self.groupoid.dim_u}, site.force

        def force(x: Column, v: Column, p: Parameters) -> list[Expression]:
            push = beside(x, v, p) if beside else (0,) * len(v)
            return [a + b for a, b in zip(entries_of(push), getattr(p, word), strict=True)]

        s = SceneSymbols(replace(site, parameters=values, force=force), rule.stages)
        if no_stages(DiscreteEquations(s, rule), rule.nodes, alone=False):
            return None
        bond, (own, bond_own) = self.bond_symbols, self.own_letters
        pull = tuple(getattr(s.parameters, word))
        q = (s.h, *(p for p in self.site.s.parameter_list if p not in own))
        return LatticeStages(stage_source(s, rule.nodes), q, own, pull, tuple(bond.x), bond_own,
                             _force_of(bond),
                             None if listed else 3 * unknowns**2 // 2)  # fmt: skip

    @cached_property
    def projection(self) -> LatticeSystem:
        """The projection of momenta onto those that constraints admit, as a step that keeps x."""
        assert self.constraints is not None
        return self._tied(*self.constraints.projection())

    @property
    def _letters(self) -> tuple[tuple[Letter, ...], ...]:
        """The letters of h and the shared parameters, of a site's own, and of a bond's own."""
        s, (own, of_bond) = self.site.s, self.own_letters
        time = (clock(),) if self.timed else ()
        q = (s.h, *time, *(p for p in s.parameter_list if p not in own), *self.constants)
        return q, own, of_bond

    @property
    def timed(self) -> bool:
        """True if a term depends on the time, which is then the second entry of q."""
        return self.site.s.clocked or self.bond_symbols.clocked

    def _tied(self, site: Step, bond: Step) -> LatticeSystem:
        """Return the system of a site and of a bond that couples the unknowns of its two ends."""
        q, own, bond_own = self._letters
        site = replace(_at_time(site, self.site.s), q=(*q, *own))
        bond = replace(_at_time(bond, self.bond_symbols), q=(*q, *bond_own))
        return LatticeSystem(self.lattice.name, q, site, own, bond_own, None, bond,
                             timed=self.timed)  # fmt: skip

    @property
    def own_letters(self) -> tuple[tuple[Letter, ...], ...]:
        """The letters of the parameters that a site has of its own, and of those of a bond."""
        parts = self.lattice.split_parameters
        of_bond = [*parts["bond"], *(k for k in parts["site"] if k not in parts["bond"])]
        letters = _own(self.site.s, list(parts["site"])), _own(self.bond_symbols, of_bond)
        if self.constraints is None:
            return letters
        return (*letters[0], *self.constraints.own), (*letters[1], *self.constraints.bond_own)

    def _split(self) -> tuple[DiscreteEquations, Expression | None]:
        """Return a site's equations for L's part with velocities, and the rest of L or None."""
        s, lattice = self.site.s, self.lattice
        terms = sympy.Add.make_args(s.lagrangian.expand(deep=False))
        resting = [t for t in terms if not t.free_symbols & set(s.u)]
        if not resting:
            return self.site, None
        value = sympy.Add(*(t for t in terms if t not in resting))
        timed = lattice.takes_time("on_site")
        letters = [*s.position, *s.u, *([clock()] if timed else [])]

        def moving(x: Column, v: Column, p: Parameters, *t: Expression) -> Expression:
            return value.xreplace(dict(zip(letters, [*x, *v, *t], strict=True)))

        scene = replace(_site_scene(lattice), lagrangian=with_arguments(moving, timed))
        return DiscreteEquations(SceneSymbols(scene), self.rule), sympy.Add(*resting)

    def _kicks(
        self, name: str, s: SceneSymbols, force: list[Node], own: tuple[Letter, ...]
    ) -> Kicks:
        """Return F⁻/h = −w₀ f and F⁺/h = w₁ f of a term without velocities, of force f."""
        assert self.end_weights is not None
        graph = force[0].graph
        t, h, *weights = graph.letters([clock(), s.h, *self.end_weights])
        first, last = ([weight * e for e in force] for weight in weights)
        then = {t.index: t + h}  # the start of a step is the end of the one before
        last = graph.rebuilt(last, then)
        whole = graph.plus(last, graph.rebuilt(first, then))
        return Kicks(name, tuple(s.position), own, [-e for e in first], last, whole)

    @cached_property
    def self_adjoint(self) -> bool:
        """True if Φ₋ₕ inverts Φₕ, which holds if it does for site and bond separately.

        A bond without velocities has no stages by itself, but with its two sites.
        """
        if self.end_weights is not None and not self.bonds_move:
            return is_self_adjoint(self.site) and self.end_weights[0] == self.end_weights[1]
        if len(self.site.s.stages):
            s = SceneSymbols(scene_of(self.lattice, self.lattice.pairs[0], [0]), self.rule.stages)
            return is_self_adjoint(DiscreteEquations(s, self.rule))
        terms = [self.bond] if self.lattice.on_site is no_term else [self.site, self.bond]
        return all(map(is_self_adjoint, terms))


def _check_lagrangian(s: SceneSymbols, word: str, function: Function | None, letters: str) -> None:
    """Raise `BadInput` unless a term is finite and real, and holds known letters alone."""
    scalars = s.scalars([s.lagrangian], word, function)
    s.refuse_unknown(scalars, {*s.x, *s.u}, word, function, letters)


def _at_time(step: Step, s: SceneSymbols) -> Step:
    """Return a step with the time as a letter of q instead of the last entry of x and of y."""
    if not s.clocked:
        return step
    step = step.at({step.y[s.n]: step.graph.node(clock() + s.h)})
    return replace(step, x=step.x[: s.n], y=step.y[: s.n], increment=step.increment[: s.n])


def _slope_of(s: SceneSymbols, potential: Expression) -> list[Node]:
    """Return ρ̂ᵀ∂L/∂x of a term without velocities."""
    graph = Graph()
    h, x = graph.read(s.h), graph.letters(s.x)
    rho = [[graph.divided(e, h) for e in row] for row in graph.matrix(s.groupoid.rho(s.x, s.h))]
    (slope,) = Scope(graph).jacobian([graph.read(potential)], x)
    return graph.transposed(rho, slope, len(s.u))


def _force_of(s: SceneSymbols) -> list[Node]:
    """Return the force of a term without velocities: ρ̂ᵀ∂L/∂x, and the one beside L."""
    slope = _slope_of(s, s.lagrangian)
    graph = slope[0].graph
    return graph.plus(slope, graph.column(s.force)) if s.forced else slope


def _site_scene(lattice: Lattice) -> Scene:
    on_site, force = lattice.on_site, lattice.force
    assert on_site is not None

    def of_shape(function: Function, word: str) -> Function:
        def shaped(x: Column, *more: Any) -> Any:
            return function(lattice.shaped(x), *more)

        return with_arguments(shaped, lattice.takes_time(word))

    return _scene(
        lattice, "", lattice.groupoid, of_shape(on_site, "on_site"), _site_values(lattice),
        force=None if force is None else of_shape(force, "force"),
    )  # fmt: skip


def _bond_scene(lattice: Lattice) -> Scene:
    """Return the scene of one bond, on the product of its two sites."""
    n, m = lattice.groupoid.dim_x, lattice.groupoid.dim_u
    on_bond, push, joint = lattice.on_bond, lattice.bond_force, lattice.constraint
    assert on_bond is not None

    def ends(x: Column) -> tuple[Column, Column]:
        return lattice.shaped(x[:n, :]), lattice.shaped(x[n:, :])

    def speeds(v: Column) -> tuple[Column, Column]:
        return v[:m, :], v[m:, :]

    def lagrangian(x: Column, v: Column, *more: Any) -> Expression:
        return on_bond(*ends(x), *(speeds(v) if lattice.bonds_move else ()), *more)

    def force(x: Column, v: Column, *more: Any) -> Scalars:
        assert push is not None
        return push(*ends(x), *speeds(v), *more)

    return _scene(
        lattice, "-bond", product(lattice.groupoid, lattice.groupoid),
        with_arguments(lagrangian, lattice.takes_time("on_bond")), _bond_values(lattice),
        force=None if push is None else with_arguments(force, lattice.takes_time("bond_force")),
        holonomic=None if joint is None else lambda x, p: joint(*ends(x), p),
    )  # fmt: skip


def _scene(
    lattice: Lattice, word: str, groupoid: Groupoid, function: Function,
    values: Values, **more: Any,
) -> Scene:  # fmt: skip
    x0, v0 = lattice.start
    copies = groupoid.dim_x // lattice.groupoid.dim_x
    return Scene(
        name=f"{lattice.name}{word}", groupoid=groupoid, lagrangian=function, parameters=values,
        x0=[*x0[:copies].flat], v0=[*v0[:copies].flat], duration=lattice.duration, **more,
    )  # fmt: skip


def _site_values(lattice: Lattice) -> Values:
    parts = lattice.split_parameters
    return {**parts["shared"], **{k: a[0].tolist() for k, a in parts["site"].items()}}


def _bond_values(lattice: Lattice) -> Values:
    parts, (i, j) = lattice.split_parameters, lattice.pairs[0]
    both = {k: a[[i, j]].tolist() for k, a in parts["site"].items()}
    return {**parts["shared"], **both, **{k: a[0].tolist() for k, a in parts["bond"].items()}}


def _own(s: SceneSymbols, names: list[str]) -> tuple[Letter, ...]:
    """Return the letters of the named parameters, in that order."""
    parameters = s.parameters
    columns = [getattr(parameters, name) for name in names]
    return tuple(e for c in columns for e in (c if hasattr(c, "shape") else [c]))


def _by_ends(system: Step, m: int) -> Step:
    """Return a bond's system with all unknowns and rows of one end before those of the other.

    Before, u and each stage are columns of both ends.
    """
    order = [c + end * m + i for end in (0, 1) for c in range(0, len(system.w), 2 * m)
             for i in range(m)]  # fmt: skip
    return replace(
        system, w=tuple(system.w[i] for i in order), rows=[system.rows[i] for i in order],
        slope=[[system.slope[i][j] for j in order] for i in order],
    )  # fmt: skip


if TYPE_CHECKING:
    from ...equations import SceneSymbols

Rows = list[list[Scalar]]


def rows_of(answer: object) -> Rows:
    """Return the natural velocities that a symmetry's function gives, one row each."""
    entries = entries_of(answer)
    in_rows = (isinstance(e, list | tuple) or getattr(e, "shape", ()) for e in entries)
    return list(map(entries_of, entries)) if entries and all(in_rows) else [entries]


def check_symmetries(s: SceneSymbols, lattice: Lattice) -> None:
    """Raise `BadInput` unless each symmetry gives natural velocities of a site, one or several."""
    for name, xi in lattice.symmetries.items():
        what = f"the symmetry {name}"
        answer = s.evaluated(xi, what, lattice.shaped(s.x), s.parameters)
        for row in rows_of(answer):
            rates = s.scalars(row, what, xi)
            s.refuse_unknown(rates, {*s.x}, what, xi, "x and p")
            if len(rates) != len(s.mu):
                raise BadInput(f"{lattice.name}: {what} gives {len(rates)} entries; give a list of "
                               f"{len(s.mu)}, a natural velocity, or several.")  # fmt: skip
