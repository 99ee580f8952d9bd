"""Where a fault can be, and how what stands there is changed.

    rule                  L_d as the rule gives it, with the points as letters
    fraction, path        θ, or the chart value w, where a rule asks for b(x, w; θh)
    velocity, rate        ξ where it asks for L(x, ξ), dw/dθ where it asks for a velocity
    groupoid.NAME         a map of the groupoid: target, product, rho, L, R, increment, …
    retraction.NAME       a map of its retraction, in all that is derived from it
    equation.NAME         what a scheme derives: minus_at_points (F⁻), gain_at_points (F⁺ − F⁻), …
    force                 what a force adds to F⁻ and to F⁺, both at once
    constraint.NAME       rows or increment of a step under constraints
    coefficients          those of a composition
    solver                the text of the step's driver
    form.NAME             the forms that symplecticity is judged by: omega, poisson_tensor

Whatever depends on the site is derived anew from what was put there.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from discmech.integrators import BadInput, Scheme
from discmech.integrators import rules as discretisations
from discmech.integrators.numbers import first_violation, mpmath, sympy
from discmech.integrators.rules import Composition, Discretisation
from discmech.integrators.scene import Scene
from discmech.studies.core.case import Case

from .faults import Fault, NoPlace, scene_of
from .faulty_scheme import FaultyScheme

#: attributes of `Scheme.at_points` by their names in faults, which stay: a name is a fault's seed
EQUATIONS = {
    "minus_at_points": "minus",
    "plus_at_points": "plus",
    "gain_at_points": "gain",
    "slope_at_points": "slope",
    "stages_at_points": "stage_equations",
}
IN_RULE = ("rule", "fraction", "path", "velocity", "rate")


@lru_cache(maxsize=16)
def _sound(scene: str, rule: str, unit: int) -> Scheme:
    return Scheme(scene_of(scene, unit), discretisations.get(rule))


def sound_scheme(fault: Fault) -> Scheme:
    return _sound(fault.scene, fault.rule, fault.unit)


def _differs(scheme: Scheme, other: Scheme) -> bool:
    """Whether two schemes of a scene have different discrete Lagrangians."""
    small = [*scheme.u, *scheme.s.stages, scheme.h]
    difference = scheme.discrete_lagrangian - other.discrete_lagrangian
    return first_violation([difference], small) is not None


@lru_cache(maxsize=4)
def faulty_scheme(fault: Fault) -> Scheme:
    """The scheme with the fault in it.

    Raises `NoPlace` where there is nothing to change, `BadInput` where the bench refuses what was
    changed.
    """
    scene, rule = scene_of(fault.scene, fault.unit), discretisations.get(fault.rule)
    site, _, name = fault.site.partition(".")
    if site in IN_RULE:
        rule = _in_rule(fault, rule, site)
    elif site == "coefficients":
        assert isinstance(rule, Composition)
        rule = _in_composition(fault, rule)
    elif site == "groupoid":
        scene = replace(scene, groupoid=_in_groupoid(fault, scene.groupoid, name))
    elif site == "retraction":
        scene = replace(scene, groupoid=_in_retraction(fault, scene.groupoid, name))
    try:
        scheme = Scheme(scene, rule)
    except BadInput as refusal:
        if isinstance(refusal.__cause__, NoPlace):  # raised inside the rule's own function
            raise refusal.__cause__ from None
        raise
    if site in IN_RULE and not _differs(scheme, sound_scheme(fault)):
        raise NoPlace(f"{fault.name}: the discrete Lagrangian is the same.")
    maps = {}
    if site == "equation":
        derived = getattr(scheme.discrete, EQUATIONS[name])
        maps = {EQUATIONS[name]: fault.changed(derived, scheme.h)}
    if site == "force":
        maps = _in_force(fault, scheme)
    given: Any = scheme.equations
    if site == "constraint":
        changed = fault.operate(given, scheme.h)
        return FaultyScheme(scheme, _altered(given, **{name: changed}))
    equations = given.altered(fault.name, **maps)
    if site == "form":
        form = (name, lambda tensor: fault.operate(tensor, None))
        return FaultyScheme(scheme, equations, form=form)
    if site == "solver":
        return FaultyScheme(scheme, equations, edit=lambda text: fault.operate(text, None))
    return FaultyScheme(scheme, equations)


@dataclass(frozen=True)
class FaultyCase(Case):
    """A case of a study in whose scheme there is a fault."""

    fault: Fault | None = None

    def scheme_on(self, scene: Scene) -> Scheme:
        assert self.fault is not None and scene is self.scene
        return faulty_scheme(self.fault)


def _in_rule(fault: Fault, rule: Discretisation, site: str) -> Discretisation:
    """The rule with a slip in its value, or in the first question of its kind that has a place."""

    def formula(L: Any, G: Any, x: Any, u: Any, h: Any, *s: Any) -> Any:
        if site == "rule":
            return _in_value(fault, rule.formula(L, G, x, u, h, *s), L, G, h)
        asked = _Asked(fault, site, L, G)
        value = rule.formula(asked if site == "velocity" else L, asked, x, u, h, *s)
        if not asked.done:
            raise NoPlace(f"{fault.name}: the rule asks nothing of that kind.")
        return value

    return replace(rule, formula=formula)


def _in_value(fault: Fault, value: Any, L: Any, G: Any, h: Any) -> Any:
    """The value with the slip in what the rule computes: L written out, the points as letters."""
    value = value.xreplace({e: e.written_out() for e in value.atoms(L.Value, L.Fast)})
    answers = sorted(value.atoms(G.Target, G.Velocity), key=sympy.default_sort_key)
    letters = {e: sympy.Symbol(f"z_{i}", real=True) for i, e in enumerate(answers)}
    changed = fault.changed(sympy.Matrix([value.xreplace(letters)]), h)[0]
    return changed.xreplace({letter: e for e, letter in letters.items()})


class _Asked:
    """The groupoid and the Lagrangian as a rule sees them, with a slip in one question."""

    def __init__(self, fault: Fault, site: str, L: Any, G: Any) -> None:
        self.fault, self.site, self.seen_l, self.seen_g = fault, site, L, G
        self.done = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self.seen_l if self.site == "velocity" else self.seen_g, name)

    def _slip(self, site: str, value: Any) -> Any:
        if self.done or site != self.site:
            return value
        try:
            value = self.fault.changed(value, self.seen_g.s.h)
        except NoPlace:
            return value
        self.done = True
        return value

    def __call__(self, x: Any, xi: Any) -> Any:
        return self.seen_l(x, self._slip("velocity", xi))

    def target(self, x: Any, u: Any, h: Any) -> Any:
        u, h = self._slip("path", u), self._slip("fraction", sympy.Matrix([h]))[0]
        return self.seen_g.target(x, u, h)

    def velocity(self, x: Any, w: Any, dw: Any, h: Any) -> Any:
        """ξ of a curve."""
        return self.seen_g.velocity(x, w, self._slip("rate", dw), h)


def _in_composition(fault: Fault, rule: Composition) -> Composition:
    def halves(digits: int) -> list[Any]:
        with mpmath.workdps(digits + 10):
            given = rule.method.halves(digits)
            changed: list[Any] = fault.operate(given, None)
        if changed == given:
            raise NoPlace(f"{fault.name}: nothing is changed.")
        return changed

    return replace(rule, method=replace(rule.method, halves=halves))


def _in_force(fault: Fault, scheme: Scheme) -> dict[str, Any]:
    """The Legendre maps with a slip in what the force adds to them."""
    scene, maps, zero = scheme.scene, scheme.discrete, [0] * len(scheme.u)
    still = (lambda x, v, p, t: zero) if scene.timed else (lambda x, v, p: zero)
    free = Scheme(scene.with_values(force=still), scheme.rule).discrete
    minus, plus = fault.operate((maps.minus - free.minus, maps.plus - free.plus), scheme)
    minus, plus = free.minus + minus, free.plus + plus
    return {"minus": minus, "plus": plus, "gain": plus - minus}


#: what each map is a function of, by the names of the groupoid's symbols
MAPS = {
    "target": "xuh", "product": "xuvh", "rho": "xh", "L": "xuh", "R": "xuh",
    "increment": "xuh", "inverse_left": "xuh", "inversion": "xuh", "structure_functions": "xh",
}  # fmt: skip
#: of a retraction: functions of ξ, or of ξ and η
RETRACTION_MAPS = {"displacement": 1, "invariant_fields": 1, "inverse_left_field": 1, "product": 2}


def _in_groupoid(fault: Fault, given: Any, name: str) -> Any:
    """A copy of the groupoid with a slip in one of its maps."""
    letters = given.symbols
    arguments = [letters[a] for a in MAPS[name]]
    changed = _changed(fault, getattr(given, name)(*arguments), letters["h"])

    def map_(*values: Any) -> Any:
        at = dict(zip(MAPS[name], values, strict=True))
        return _each(changed, lambda part: given._at(part, **at))

    derived = {"_inversion": changed} if name == "inversion" else {}
    return _altered(given, by_user=True, **derived, **{name: map_})


def _in_retraction(fault: Fault, given: Any, name: str) -> Any:
    """A copy of the groupoid whose retraction has a slip in one of its maps."""
    tau, algebra = given.tau, given.algebra
    letters = [
        sympy.Matrix(sympy.symbols(f"{letter}_:{algebra.dim}", real=True))
        for letter in ("u", "v")[: RETRACTION_MAPS[name]]
    ]
    changed = _changed(fault, getattr(tau, name)(algebra, *letters), given.symbols["h"])

    def map_(_: Any, *values: Any) -> Any:
        pairs = [(s, e) for z, w in zip(letters, values, strict=True) for s, e in zip(z, w)]  # noqa: B905
        return _each(changed, lambda part: part.xreplace(dict(pairs)))

    own_name = f"{tau.name}, {fault.what}"  # by which nothing is kept on disk for another
    return _altered(given, by_user=True, tau=_altered(tau, name=own_name, **{name: map_}))


def _altered(given: Any, **members: Any) -> Any:
    """A copy with other members, which has derived nothing yet."""
    other = copy(given)
    for name in list(vars(other)):
        if isinstance(getattr(type(given), name, None), cached_property):
            delattr(other, name)
    for name, member in members.items():
        object.__setattr__(other, name, member)  # retractions are frozen
    return other


def _changed(fault: Fault, given: Any, h: Any) -> Any:
    """A matrix changed, or one of several: they stand below each other meanwhile."""
    if not isinstance(given, (list, tuple)):
        return fault.changed(given, h)
    whole = fault.changed(sympy.Matrix.vstack(*given), h)
    tops = [sum(m.rows for m in given[:i]) for i in range(len(given))]
    parts = [whole[top : top + m.rows, :] for top, m in zip(tops, given, strict=True)]
    return type(given)(parts)


def _each(value: Any, function: Callable[[Any], Any]) -> Any:
    several = isinstance(value, (list, tuple))
    return type(value)(map(function, value)) if several else function(value)
