"""Discretisations: rules that turn a Lagrangian into a discrete Lagrangian.

A rule is data: a formula written with the groupoid's target, its order, its source. The point at
fraction θ of a step is b(x, u; θh), so one formula serves every groupoid.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np

from ..errors import (
    BadInput,
    arguments_checked,
    brief_name,
    check_name,
    shown,
    signature_of,
    unknown,
)
from ..numbers.types import Column, Exact, Expression, Function, Given, Letter
from ..scene import Again, Scene, again
from .parameters import of_decorator, open_numbers, with_parameters
from .quadrature import Nodes

#: the Lagrangian and the groupoid as a rule gets them; equations/ has the classes of these names
LagrangianForRule: TypeAlias = Any
GroupoidForRule: TypeAlias = Any

#: name ↦ (kind, name in messages) of the groupoids on which a rule may exist
GROUPOIDS = {
    "pair": ("pair", "pair groupoids"),
    "lie_group": ("group", "Lie groups"),
    "group": ("group", "Lie groups"),
    "action": ("action", "action groupoids"),
    "product": ("product", "products of groupoids"),
    "LocalGroupoid": ("local", "local groupoids"),
}


@dataclass(frozen=True)
class Discretisation:
    """A rule L_d(x, u; h) = formula(L, G, x, u, h).

    `L(x, u)` is the Lagrangian (its parameters are `L.parameters`), `G` the groupoid, x and u sympy
    columns, h the step. `order` may be None: then it is only measured.

    With `stages` = k the rule is L_d(x, u, s; h) = formula(L, G, x, u, h, s), s a list of k columns
    m×1, and L_d(x, u; h) its stationary value in s. Newton starts at s = 0: let that be the
    straight path.
    """

    name: str
    formula: Function
    order: int | None = None
    source: str = ""
    stages: int = 0
    splits: bool = False  # True if it treats the scene's fast potential L.fast(x) separately
    #: names of `GROUPOIDS` on which it exists; all if empty
    groupoids: tuple[str, ...] = ()
    #: the nodes if L_d is that of a polynomial with as many Gauss nodes as its degree, or with one
    #: more Lobatto node: collocation
    nodes: Nodes | None = None
    #: the claims of its author: only these are judged; None: everything is judged
    claims: Claims | None = None
    #: the `Method` by which substeps are composed; None for a rule of one step
    method: ClassVar[Any] = None
    #: the order of its processed form χ⁻¹ Φ χ with maps χ near the identity; None if none is
    #: declared
    effective: int | None = None
    #: names of numbers that the formula leaves open (`studies.proof`)
    parameters: tuple[str, ...] = ()
    #: what it is, in words
    kind: ClassVar[str] = "discrete Lagrangian"
    #: True if its steps are formulas in values of a Lagrangian, and no other map
    asks_lagrangian: ClassVar[bool] = True
    #: True if its steps are formulas, which have derivatives and any number of digits
    is_formula: ClassVar[bool] = True
    #: True if its step is a function of the step size, which a composition chooses
    composes: ClassVar[bool] = True
    #: True if it consists of earlier runs, so that no further step can be made
    is_recorded: ClassVar[bool] = False

    @property
    def follows_motion(self) -> bool:
        """False for a map of one step alone, whose motion need not be that of a scene."""
        return True

    @property
    def repeats(self) -> bool:
        """True if a run is its step again and again, from (x, μ) alone: always for formulas."""
        return True

    @property
    def own_coordinates(self) -> bool:
        """True if its numbers are other ones than x and μ."""
        return False

    @property
    def long_run(self) -> int:
        """The number of steps of a long run in double precision."""
        return 10**6

    def step_for(self, size: Exact) -> Exact:
        """Return the step to take for one of that size: a map of one step alone has no other."""
        return size

    @property
    def of_step(self) -> Discretisation:
        """The rule of one step; for a composition, the rule of its substeps."""
        return self

    @property
    def digest(self) -> str:
        """The part of its key beside name and text of the formula.

        Raises `Opaque` for a program of which this is not known.
        """
        return ""

    def unmeasured(self, study: str) -> str:
        """Return a sentence that says why the study cannot measure it, or ""."""
        return ""

    def runs_at(self, digits: int) -> bool:
        """Return True if its steps can be made with that many digits: always for formulas."""
        return True

    def unit(self, digits: int) -> float:
        """Return the unit of round-off of its numbers at so many digits."""
        return 2.0**-53 if digits == 16 else 10.0**-digits

    @property
    def left_open(self) -> tuple[str, ...]:
        """The names of open numbers that have no default in the formula."""
        if not self.parameters:
            return ()
        known = inspect.signature(self.formula).parameters
        return tuple(e for e in self.parameters
                     if e not in known or known[e].default is inspect.Parameter.empty)  # fmt: skip

    def applies(self, scene: Scene) -> bool:
        """True if the scene has all that the rule needs; `own` needs a discrete Lagrangian."""
        function = scene.discrete_lagrangian
        if self.asks_lagrangian and (function is not None) != (self.formula is own.formula):
            return False
        return (scene.fast is not None or not self.splits) and not self.refusal(scene)

    def refusal(self, scene: Scene) -> str:
        """Return a sentence that says why the rule has no meaning for the scene, or ""."""
        if free := self.left_open:
            return (
                f"{self.name} leaves {', '.join(free)} open: `discmech prove` says for which "
                f"values it has which order; give a value, as in "
                f"FILE.py:{self.name}:{free[0]}=1/3, in --vary {free[0]}=0:1:11 "
                f"or in parameters={{{free[0]!r}: 1}}."
            )
        asked = ["a formula"] * self.is_formula
        if self.stages or self.splits:
            asked.append("points of a straight step")
        if refusal := scene.refusal_of(*asked, rule=self.name):
            return refusal
        of_value = self.asks_lagrangian and scene.hamiltonian is not None
        if of_value and (no_value := scene.without_lagrangian):
            return (
                f"{scene.name}: {no_value}, so {self.name} has nothing to discretise: take a "
                "one-step map such as implicit-midpoint or dual-gauss-2, or a black box."
            )
        kinds = scene.groupoid.kinds or (scene.groupoid.kind,)
        if not self.groupoids or any(GROUPOIDS[e][0] in kinds for e in self.groupoids):
            return ""
        where = " and ".join(GROUPOIDS[e][1] for e in self.groupoids)
        return (
            f"{self.name} exists on {where} only, so it is no method for {scene.name} "
            f"({scene.groupoid.name})."
        )

    def __reduce__(self) -> Again:
        """Return the pickled form; a rule's functions are pickled by their place in a module."""
        if (bound := getattr(self.formula, "bound", None)) is not None:
            return with_parameters, (*bound, self.name)
        return again(self, (self.formula, getattr(self, "base", None)))

    def __deepcopy__(self, memo: object) -> Discretisation:
        return self  # a rule is immutable

    def __call__(
        self, L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter,
        *s: list[Column],
    ) -> Expression:  # fmt: skip
        return self.formula(L, G, x, u, h, *s)


@arguments_checked
def discretisation(
    order: int | None = None,
    *,
    name: str | None = None,
    source: str = "",
    stages: int = 0,
    splits: bool = False,
    groupoids: str | Sequence[str] = (),
    effective: int | None = None,
    parameters: str | Sequence[str] | Mapping[str, Given] = (),
) -> Callable[[Function], Discretisation]:
    """Decorator: make a rule from a function (L, G, x, u, h), or (L, G, x, u, h, s) with stages.

    `splits`: True if the rule treats the scene's fast potential, L.fast(x), separately. groupoids:
    those on which it exists, names of `GROUPOIDS` such as "pair"; by default all. effective: the
    order of the processed rule (`studies.evidence.effective`), at least `order`. parameters: names
    of numbers that stay open, further arguments of the function or symbols of sympy in its result,
    or a dict of names and values: `prove` says for which values the rule has which order,
    `--vary w=0:1:11` runs it with several. Raises `BadInput` if the order is no
    positive whole number, stages no whole number from 0, a groupoid unknown, the effective order
    invalid, or the function has other arguments.
    """
    where = checked("discretisation", "rule", order, stages, groupoids)
    check_effective("rule", order, effective)
    wanted, free = "(L, G, x, u, h, s)" if stages else "(L, G, x, u, h)", open_numbers(parameters)

    def make(formula: Function) -> Discretisation:
        label, about = described("rule", formula, wanted, name, source, free)
        rule = Discretisation(label, formula, order, about, stages, splits, where,
                              effective=effective, parameters=tuple(free))  # fmt: skip
        return of_decorator(rule, free)

    return make


def check_rule(thing: object) -> None:
    """Raise `BadInput` unless it is a rule."""
    if isinstance(thing, Discretisation):
        return
    fix = "decorate the function with @discretisation(), or @one_step() if it is a map (s, z, h)"
    if isinstance(thing, str):
        fix = f'write discmech.integrators.rules.get("{thing}")'
    raise BadInput(f"{brief_name(thing)} is no rule: {fix}.")


def checked(
    decorator: str, what: str, order: object, stages: object, groupoids: str | Sequence[str]
) -> tuple[str, ...]:
    """Return the groupoids as a tuple; raises `BadInput` for invalid arguments of a decorator."""
    if callable(order):
        raise BadInput(f"write @{decorator}() with brackets, or @{decorator}(order=2).")
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order of a {what} is a whole number from 1, not {shown(order)}.")
    if type(stages) is not int or stages < 0:
        raise BadInput(
            f"the internal stages of a {what} are a whole number from 0, not {shown(stages)}."
        )
    where = (groupoids,) if isinstance(groupoids, str) else groupoids
    if not isinstance(where, list | tuple) or not all(isinstance(e, str) for e in where):
        raise BadInput(f"the groupoids of a {what} are {shown(groupoids)}: give a list of names.")
    where = tuple(where)
    for groupoid in where:
        if groupoid not in GROUPOIDS:
            raise unknown("groupoid", groupoid, GROUPOIDS)
    return where


def check_effective(what: str, order: int | None, effective: object) -> None:
    """Raise `BadInput` for an invalid effective order, or one without an order."""
    if effective is None:
        return
    if type(effective) is not int or effective < 1:
        raise BadInput(
            f"the effective order of a {what} is a whole number from 1, not {shown(effective)}."
        )
    if order is None:
        raise BadInput(
            f"a {what} of effective order {effective} has an order by itself too: give "
            f"order=2, or what it is, beside effective={effective}."
        )
    if effective < order:
        raise BadInput(
            f"the effective order {effective} of a {what} is below its order {order}: processing "
            "takes no order away; leave effective out, or give one from the order on."
        )


def described(
    what: str, formula: object, wanted: str, name: str | None, source: str,
    free: Iterable[str] = (),
) -> tuple[str, str]:  # fmt: skip
    """Return (name, source) of a function with the `wanted` arguments, or raise `BadInput`.

    free: names of open numbers, which may be further arguments.
    """
    if not callable(formula):
        raise BadInput(f"a {what} is a function {wanted}, not {shown(formula)}.")
    if not isinstance(name, str | None):
        raise BadInput(f"the name {shown(name)} of a {what} is no text.")
    signature, needed = signature_of(formula), wanted.count(",") + 1
    count = len(signature.parameters.keys() - {*free}) if signature else needed
    label = str(name or getattr(formula, "__name__", what).replace("_", "-"))
    if count != needed:
        words = {3: "three", 4: "four", 5: "five", 6: "six"}[needed]
        stages = "with stages " if words == "six" else ""
        raise BadInput(
            f"{what} {label}: the function takes {count} arguments, but a {what} "
            f"{stages}takes {words}: {wanted}."
        )
    check_name(what, label)
    return label, source or inspect.getdoc(formula) or ""


def _given(L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter) -> Expression:
    return L.discrete(x, u, h)


#: the discrete Lagrangian that the scene itself gives (`Scene.discrete_lagrangian`)
own = Discretisation("own", _given, source="the scene's")


# The claims of a method's author beside its order, which a verdict may contradict.


@dataclass(frozen=True)
class Claims:
    """Claims of a method: symplectic, reversible, and the names of conserved quantities.

    None and () claim nothing: the property is then measured and not judged. keeps: "energy",
    "volume", names of the scene's quantities.
    """

    symplectic: bool | None = None
    reversible: bool | None = None
    keeps: tuple[str, ...] = ()

    @classmethod
    def of(cls, who: str, order: int | None, symplectic: bool | None, reversible: bool | None,
           keeps: str | Sequence[str]) -> Claims:  # fmt: skip
        """Return the claims given to a decorator; raises `BadInput` for those of another kind.

        A method that is its own adjoint has an even order (Hairer, Lubich, Wanner II.3). order:
        None for a program, whose way back may be by reversed momenta, at any order.
        """
        for word, claim in (("symplectic", symplectic), ("reversible", reversible)):
            fit = claim is None or (isinstance(claim, int | np.bool_) and claim in (True, False))
            if not fit:  # an array has no truth value that could be compared
                raise BadInput(f"{who}({word}=...): {word} is True or False, not {shown(claim)}.")
        names = (keeps,) if isinstance(keeps, str) else keeps
        if not isinstance(names, list | tuple) or not all(isinstance(e, str) for e in names):
            raise BadInput(
                f"{who}(keeps={shown(keeps)}): give names such as "
                'keeps=("energy", "angular momentum").'
            )
        if reversible and isinstance(order, int) and order % 2:
            raise BadInput(
                f"{who}(order={order}, reversible=True): a method whose step back undoes a step "
                f"has an even order; say order={order + 1} if it has, or leave reversible out."
            )
        return cls(symplectic, reversible, tuple(names))
