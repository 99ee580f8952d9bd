"""A scene: one mechanical system as data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from ..errors import (
    BadInput,
    check_function,
    check_parameters,
    names_checked,
    nearest,
    shown,
)
from ..groupoids import Attitude, Groupoid, LieGroup, RowAction
from ..hooks import scheme
from ..numbers import exact_nested, exact_rational, exact_vector, flatten
from ..numbers.types import Exact, Function, Given
from ..retractions import Retraction
from .constraints import HOLONOMIC, NONHOLONOMIC, Constraint, entries_of
from .legendre import AffineLagrangian, LegendreTransform
from .pickled import Again, again
from .quantities import Conserved, OnGroup
from .system import System


@names_checked
@dataclass(frozen=True, eq=False)
class Scene(System):
    """A mechanical system: Lagrangian, groupoid, parameters, start and symmetries.

    lagrangian(x, v, p): sympy columns x (n×1) and v (m×1, natural velocities: ẋ = ρ̂(x)v), and p
    with one attribute per parameter (a list parameter is a column, a list of lists a matrix);
    lagrangian(x, v, p, t) depends on the time too.
    force(x, v, p) or force(x, v, p, t): m components in the natural basis of A*, the term f of d/dt
    ∂l/∂ξ = ρ̂ᵀ ∂l/∂x + ad* … + f (Lagrange–d'Alembert).
    holonomic(x, p) or holonomic(x, p, t): constraints φ(x, t) = 0 on the base, a list (with these,
    or contact, a Lie group has its attitude A as base, row by row, as by `with_attitude`);
    nonholonomic(x, p) or nonholonomic(x, p, t): the rows A of constraints A(x, t) ξ = 0, a list of
    lists of m (without x on a group without base), or a pair (rows, right sides) for A ξ = a(x, t).
    constraints: further ones, a list of `Constraint`, of kinds of one's own.
    contact(x, p): gaps φ(x) ≥ 0 on the base, a list; an entry (φ, [t, …]) gives the coordinates of
    the touching point along which it slips (default: x). friction: Coulomb's coefficient, a number
    or one per gap; restitution: e in [0, 1]; impacts: "stepped" or "located" inside a step.
    fast(x, p): the stiff part of the potential, for rules that treat it separately (`imex`);
    `lagrangian` contains it as well, with a minus.
    sigma(x, mu, p): a smooth positive σ for rules whose steps vary (`steps.vary`), dt = σ dτ: the
    time scale of the motion at x, of which a step is a fixed part.
    discrete_lagrangian(x, u, h, p) instead, for a given discrete Lagrangian; or on_group(formula(x,
    g, h, p)) for one of the group element g, then with lagrangian= too if it approximates a
    continuous system. mu0: the momentum of the start (m, natural basis: F⁻/h) if there is only a
    discrete Lagrangian; v0 is then a first guess of u, by default 0.
    numeric_hamiltonian(q, p) with gradient(q, p) → (∂H/∂q, ∂H/∂p) instead: functions of arrays (a
    table, a network), for scenes that only black boxes run on; with mu0.
    hamiltonian(x, mu, p) or hamiltonian(x, mu, p, t) instead: the energy as a function of x (n×1)
    and of the momentum mu (m×1, natural basis), with mu0: ẋ = ρ̂ ∂H/∂μ, μ̇ = −ρ̂ᵀ ∂H/∂x + ad* … .
    The arguments may have other names, as in (q, p, par).
    If v = ∂H/∂μ can be solved for μ in closed form, `lagrangian` is derived from it, and rules run
    on it; otherwise one-step maps and black boxes run.
    one_form(x, p) → ϑ, a list as long as x, with hamiltonian(x, p), on pair(n) with n even: the
    Lagrangian ϑ(x)·v − H(x), whose phase space is that of x: dϑ(·, ẋ) = dH, and μ is ϑ(x).
    Numbers are exact (`exact`). `duration` is the time of a study's runs, `step` a step size that
    resolves the motion at second order (default: duration/1000).

    Raises `BadInput` for wrong shapes, non-finite numbers and missing parts.
    """

    name: str
    groupoid: Groupoid
    lagrangian: Function | None = None
    parameters: Mapping[str, Given] = field(default_factory=dict)
    x0: Sequence[Given] = ()
    v0: Sequence[Given] = ()
    duration: Given = 10
    step: Given = None
    symmetries: Sequence[Conserved] = ()
    source: str = ""
    title: str = ""
    discrete_lagrangian: Function | OnGroup | None = None
    fast: Function | None = None
    force: Function | None = None
    mu0: Sequence[Given] | None = None
    holonomic: Function | None = None
    nonholonomic: Function | None = None
    constraints: Sequence[Constraint] = ()
    contact: Function | None = None
    friction: Given = 0
    restitution: Given = 0
    impacts: str = "stepped"
    numeric_hamiltonian: Function | None = None
    gradient: Function | None = None
    hamiltonian: Function | None = None
    sigma: Function | None = None
    one_form: Function | None = None

    functions: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one_form": ("(x, p)",),
        "lagrangian": ("(x, v, p)", "(x, v, p, t)"),
        "force": ("(x, v, p)", "(x, v, p, t)"),
        "holonomic": ("(x, p)", "(x, p, t)"),
        "nonholonomic": ("(x, p)", "(x, p, t)"),
        "contact": ("(x, p)",),
        "fast": ("(x, p)",),
        "sigma": ("(x, mu, p)",),
        "numeric_hamiltonian": ("(q, p)",),
        "gradient": ("(q, p)",),
    }

    def __post_init__(self) -> None:
        self.check_name("scene", "groupoid")
        if isinstance(self.groupoid, LieGroup) and (self.holonomic or self.contact) is not None:
            groupoid, identity = _of_attitude(self.groupoid)
            begun = not isinstance(self.x0, list | tuple) or bool(self.x0)
            self.put(groupoid=groupoid, x0=self.x0 if begun else identity)
        if isinstance(self.lagrangian, LegendreTransform | AffineLagrangian):
            self.put(lagrangian=None)  # it follows from the Hamiltonian, as below
        if (self.numeric_hamiltonian is None) != (self.gradient is None):
            raise BadInput(
                f"{self.name}: give both numeric_hamiltonian=f, a function (q, p) of arrays, and "
                "gradient=g, which gives the pair (∂H/∂q, ∂H/∂p) of arrays."
            )
        self.check_features()
        of_energy = ("(x, p)",) if self.one_form else ("(x, mu, p)", "(x, mu, p, t)")
        if self.hamiltonian is not None:
            check_function(self.hamiltonian, f"{self.name}: hamiltonian=", *of_energy)
        self.check_functions()
        if self.one_form is not None:
            if self.hamiltonian is None:
                raise BadInput(f"{self.name}: beside one_form= give hamiltonian=, of (x, p).")
            if not self.groupoid.canonical or self.groupoid.dim_x % 2:
                raise BadInput(
                    f"{self.name}: one_form= makes a phase space of the x of a pair(n) with n "
                    f"even, where dϑ can be regular; {self.groupoid.name} is none."
                )
            self.put(lagrangian=AffineLagrangian(self.one_form, self.hamiltonian))
        elif self.hamiltonian is not None:
            self.put(lagrangian=LegendreTransform(self.hamiltonian))
        given = self.lagrangian is not None, self.discrete_lagrangian is not None, self.in_numbers
        if not any(given) or (all(given[:2]) and not isinstance(self.discrete_lagrangian, OnGroup)):
            raise BadInput(
                f"{self.name}: give either lagrangian= or discrete_lagrangian=, or hamiltonian=."
            )
        if not all(isinstance(e, Constraint) for e in entries_of(self.constraints)):
            raise BadInput(
                f"{self.name}: constraints= is {shown(self.constraints)}, but is a list of "
                "Constraint, of kinds of one's own; say holonomic= for φ(x, t) = 0, nonholonomic= "
                "for A(x) ξ = a(x, t), contact= for φ(x) ≥ 0."
            )
        self.put(constraints=tuple(entries_of(self.constraints)))
        for each in self.constraints:
            check_function(each.function, f"{self.name}: constraints=", "(x, p)", "(x, p, t)")
        if self.has_contact:
            self._take_contact()
        check_parameters(self.parameters, self.name)
        n, m = self.groupoid.dim_x, self.groupoid.dim_u
        if n and isinstance(self.x0, list | tuple) and not self.x0:
            raise BadInput(f"{self.name} has no start: give x0=, a list of {n} numbers.")
        self.put(x0=exact_vector(self.x0, n, f"{self.name}: x0"))
        if self.mu0 is not None:
            self.put(mu0=exact_vector(self.mu0, m, f"{self.name}: mu0"))
        begun = self.one_form is not None or self.mu0 is not None
        if begun and isinstance(self.v0, tuple) and not self.v0:
            self.put(v0=(0,) * m)
        self.put(v0=exact_vector(self.v0, m, f"{self.name}: v0"))
        numbers = {
            k: exact_nested(v, f"{self.name}: parameter {k}") for k, v in self.parameters.items()
        }
        self.put(parameters=numbers)
        self.take_times()
        symmetries = tuple(entries_of(self.symmetries))
        for quantity in symmetries:
            if not isinstance(quantity, Conserved):
                raise BadInput(
                    f"{self.name}: symmetries is {shown(self.symmetries)}, where {shown(quantity)} "
                    "is no symmetry: give a list of Conserved(...)."
                )
        self.put(symmetries=symmetries)

    def _take_contact(self) -> None:
        """Make the numbers of contact exact; raises `BadInput` where they are out of range."""
        self.take_restitution()
        self.put(friction=exact_nested(self.friction, f"{self.name}: friction"))
        if min(flatten((self.friction,)), default=0) < 0:
            raise BadInput(f"{self.name}: the friction is negative; give a number from 0.")
        if not isinstance(self.impacts, str) or self.impacts not in ("stepped", "located"):
            raise BadInput(
                f'{self.name}: impacts={shown(self.impacts)}; say "stepped" or "located".'
            )

    @cached_property
    def all_constraints(self) -> tuple[Constraint, ...]:
        """The constraints that restrict the motion; empty if none does."""
        named = ((HOLONOMIC, self.holonomic), (NONHOLONOMIC, self.nonholonomic))
        return (*(kind(f) for kind, f in named if f is not None), *self.constraints)

    @property
    def no_form(self) -> str:
        """The reason why its constraints keep no symplectic form; "" if they leave one."""
        return next((c.kind.no_form for c in self.all_constraints if c.kind.no_form), "")

    @property
    def no_energy(self) -> str:
        """The reason why no band of the energy is demanded under its constraints, or ""."""
        return next((c.kind.no_energy for c in self.all_constraints if c.kind.no_energy), "")

    @property
    def in_numbers(self) -> bool:
        """True if its Hamiltonian is a function of numbers, from which nothing can be derived."""
        return self.numeric_hamiltonian is not None

    @cached_property
    def has_lagrangian(self) -> bool:
        """True if a Lagrangian is given, or follows from the Hamiltonian in closed form."""
        L = self.lagrangian
        return L.exists(self) if isinstance(L, LegendreTransform) else L is not None

    @cached_property
    def without_lagrangian(self) -> str:
        """The reason why its Hamiltonian has no Lagrangian, not even as an unknown; or ""."""
        L = self.lagrangian
        if not isinstance(L, LegendreTransform) or L.exists(self):
            return ""
        if not L.is_regular(self):
            return "∂²H/∂mu² of its Hamiltonian is singular, so it has no Lagrangian"
        if self.force is not None:
            return "a force acts with the weight of its Lagrangian, which has no closed form"
        return ""

    @property
    def is_continuous(self) -> bool:
        return self.lagrangian is not None or self.in_numbers

    @property
    def is_smooth(self) -> bool:
        """True without constraints, contact, friction and functions of numbers."""
        return not (self.all_constraints or self.contact or self.friction or self.in_numbers)

    def digits(self, wanted: int) -> int:
        """Return the digits in which its functions have values, at most so many."""
        return 16 if self.in_numbers else wanted

    @property
    def moving_constraints(self) -> bool:
        """True if a constraint depends on the time."""
        return any(c.timed for c in self.all_constraints)

    @cached_property
    def timed(self) -> bool:
        """True if the Lagrangian, the force or a constraint depends on the time."""
        return super().timed or self.moving_constraints

    @property
    def clocked(self) -> bool:
        """True if the time is a coordinate beside the base.

        It is if something depends on the time, and if a force acts on a group without a base, where
        only the time distinguishes its points.
        """
        return self.timed or (self.forced and not self.has_base)

    @property
    def laws(self) -> tuple[object, ...]:
        """All functions of the scene: scenes with equal laws differ only in numbers."""
        return (self.lagrangian, self.discrete_lagrangian, self.fast, self.force, self.holonomic,
                self.nonholonomic, self.constraints, self.contact, self.symmetries,
                self.hamiltonian, self.numeric_hamiltonian, self.gradient,
                self.one_form)  # fmt: skip

    @property
    def parameter_values(self) -> list[Exact]:
        """The exact values of all parameters, one after another and row by row."""
        return flatten(tuple(self.parameters.values()))

    def discretise(self, rule: Any) -> Any:
        """Return the `Scheme` by a rule, which `Scheme(scene, rule)` is."""
        return scheme(self, rule)

    def with_values(self, **changes: Any) -> Scene:
        """Return a copy with some fields changed; `parameters` are merged, not replaced.

        contact=None removes friction, restitution and impacts too.
        """
        names = [f.name for f in fields(self)]
        if foreign := set(changes) - set(names):
            near = nearest(min(foreign), (*self.parameters, *names))
            hint = f"did you mean {near}?" if near else f"its fields are {', '.join(names)}."
            own = f", and its parameters are {', '.join(self.parameters)}" * bool(self.parameters)
            raise BadInput(f"{self.name} has no {shown(min(foreign))}{own}: {hint}")
        if self.contact is not None and changes.get("contact", self.contact) is None:
            # the fields that belong to contact are reset with it
            changes = {"friction": 0, "restitution": 0, "impacts": "stepped"} | changes
        if isinstance(changes.get("parameters"), Mapping):  # anything else is refused later
            if unknown := set(changes["parameters"]) - set(self.parameters):
                raise BadInput(
                    f"{self.name} has no parameter {shown(min(unknown, key=str))}; "
                    f"it has {', '.join(self.parameters) or 'none'}."
                )
            changes["parameters"] = {**self.parameters, **changes["parameters"]}
        return replace(self, **changes)

    def with_retraction(self, retraction: Retraction, name: str | None = None) -> Scene:
        """Return this system in another retraction's chart; unchanged on a groupoid without
        retraction. name: that of the new scene, by default the same.

        Raises `BadInput` if the retraction does not fit the scene's algebra.
        """
        groupoid = self.groupoid.with_retraction(retraction)
        if groupoid is self.groupoid and name in (None, self.name):
            return self
        return replace(self, groupoid=groupoid, name=name or self.name)

    def with_attitude(self) -> Scene:
        """Return the motion on a group with the attitude A as base, A(0) = e, flattened row by row.

        Reconstruction A_{k+1} = A_k τ(hu_k) is the target map of the group's action on itself; for
        a complex group it is on the real form, 2N×2N. The result is remembered, so that its
        equations are derived once; it is its own scene with the attitude. Raises `BadInput` unless
        the groupoid is a Lie group.
        """
        return self._attitude_as_base

    @cached_property
    def _attitude_as_base(self) -> Scene:
        group = self.groupoid
        if isinstance(group, RowAction) and group.rows == group.algebra.size:
            return self
        if not isinstance(group, LieGroup):
            raise BadInput(
                f"{self.name}: only a scene on a Lie group has an attitude to reconstruct."
            )
        groupoid, identity = _of_attitude(group)
        return replace(self, groupoid=groupoid, x0=identity)

    def __reduce__(self) -> Again:
        """Return the pickled form; a scene's functions are pickled by their place in a module."""
        functions = (*self.laws, *(q.formula for q in self.symmetries),
                     *(c.function for c in self.constraints))  # fmt: skip
        return again(self, functions)

    def steps_for(self, step: Given) -> int:
        """Return the number of steps of this size in the scene's duration, rounded."""
        size = exact_rational(step, "step")
        if size <= 0:
            raise BadInput(f"step is {shown(step)}: give a positive number.")
        return max(1, math.floor(self.duration / size + Fraction(1, 2)))


def _of_attitude(group: LieGroup) -> tuple[Attitude, list[Fraction]]:
    """Return a group with its attitude as base, and e, row by row."""
    size = group.algebra.real.size
    identity = [Fraction(int(i == j)) for i in range(size) for j in range(size)]
    return Attitude(group.algebra, group.tau, rows=size), identity
