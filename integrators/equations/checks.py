"""What a scheme must satisfy before anything is run: known letters, a start, regularity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..errors import BadInput, line_of
from ..numbers.evaluation import evaluate_matrix
from ..numbers.exact import exact, to_sympy
from ..numbers.identities import null_direction, random_point, shown
from ..numbers.lazy import sympy

if TYPE_CHECKING:
    from ..scene import Scene
    from .discrete_equations import DiscreteEquations


def check_letters(scheme: DiscreteEquations) -> None:
    """Raise `BadInput` if L_d holds unknown symbols, not u, or not every stage."""
    s, of = scheme.s, _named(scheme)
    L_d = scheme.at_points.discrete_lagrangian
    known = {*s.x, *s.u, *s.stages, *s.q, *(z for a in scheme.chain.given for z in a.z)}
    unknown = L_d.free_symbols - known
    if unknown:
        raise BadInput(
            f"{of}: the discrete Lagrangian holds the unknown symbol {min(map(str, unknown))}; "
            "write it with x, u, h, parameters."
        )
    used = scheme.chain.needed([L_d])
    held = [L_d, *(e for a in used if a.kind != "point" for e in a.value)]
    letters = set().union(*(e.free_symbols for e in held))
    if not letters & set(s.u):
        raise BadInput(
            f"{of}: the discrete Lagrangian does not depend on u, so FL is singular everywhere; "
            "it needs a kinetic term."
        )
    letters |= set().union(*(e.free_symbols for a in used for e in a.value))
    for number, column in enumerate(s.stage_columns):
        if not set(column) <= letters:
            raise BadInput(
                f"{of}: the rule asks for {scheme.rule.stages} internal stages, but its discrete "
                f"Lagrangian does not depend on all of s[{number}]; use every stage, or ask for "
                "fewer with stages=."
            )


def _named(scheme: DiscreteEquations) -> str:
    """The scene with the rule, and where a rule of the user's is."""
    place = line_of(scheme.rule.formula)
    return (f"{place}: " if place else "") + f"{scheme.scene.name} with {scheme.rule.name}"


def check_regular(scheme: DiscreteEquations) -> None:
    """Raise `BadInput` if ∂E/∂w (FL, without stages) or ∂²l/∂ξ² is singular at two random points.

    The second too: where it is singular, terms O(h²) of the potential can make FL regular, but
    there is no system on the dual that the map approximates. A discrete Lagrangian that stands for
    no continuous one is asked for FL only.
    """
    s = scheme.s
    of_what = "(u, s); every velocity and every stage" if len(s.stages) else "u; every velocity"
    asked = {("FL", of_what): scheme.at_points.slope}
    if scheme.scene.lagrangian is not None:
        from .continuous import mass_matrix

        asked["the mass matrix ∂²l/∂ξ²", "ξ; every velocity"] = mass_matrix(s)
    for seed in range(2):
        small = (*scheme.w, scheme.h)
        point = random_point([*s.x, *scheme.w, *s.q], small, seed) | s.constant_values(40)
        for p, value in zip(s.parameter_list, s.parameter_values, strict=True):
            point[p] = to_sympy(value)
        at = scheme.chain.values(point)
        found = {a: null_direction(evaluate_matrix(m.xreplace(at), 30)) for a, m in asked.items()}
        asked = {a: m for a, m in asked.items() if found[a] is not None}
    for name, of_what in asked:
        raise BadInput(
            f"{_named(scheme)}: {name} is singular everywhere, in the direction "
            f"({shown(found[name, of_what])}) of {of_what} needs its kinetic energy."
        )


def check_start(scheme: DiscreteEquations, scene: Scene) -> None:
    """Raise `BadInput` unless the start satisfies every constraint (as |Γ|² = 1), exactly."""
    s = scheme.s
    at = dict(zip([*s.x, *s.u], map(to_sympy, [*scene.x0, *scene.v0]), strict=True))
    for name, formula, wanted in _constraints(scheme, scene):
        if formula.free_symbols & set(s.mu):
            if scene.lagrangian is None:
                continue  # the start's momentum is only given with the run
            mu = _with_parameters(scheme, [s.lagrangian.diff(v) for v in s.u])
            formula = formula.xreplace(dict(zip(s.mu, mu, strict=True)))
        found = formula.xreplace(at)
        if sympy.simplify(found - wanted) != 0:
            raise BadInput(
                f"{scene.name}: {name} is {_beside(found, wanted)} at x0, but must be "
                f"{wanted}; change x0 (an exact value: fractions such as 2/7, 3/7, 6/7)."
            )


def check_momentum(scheme: DiscreteEquations, x: Any, mu: Any) -> None:
    """Raise `BadInput` unless (x, μ), numbers of any arithmetic, satisfy every constraint.

    They may come from a row of a run, so not exactly: up to 2⁻²⁶ of what a relative change of every
    entry by one would make, Σ |∂f/∂zᵢ zᵢ|.
    """
    s, scene = scheme.s, scheme.scene
    letters, numbers = [*s.x, *s.mu], [to_sympy(exact(e, "start")) for e in [*x, *mu]]
    at = dict(zip(letters, numbers, strict=True))
    for name, formula, wanted in _constraints(scheme, scene):
        found = formula.xreplace(at)
        size = sum(abs(formula.diff(z).xreplace(at) * value) for z, value in at.items())
        if abs(float(found - wanted)) > 2**-26 * float(size):
            raise BadInput(
                f"{scene.name}: {name} is {_beside(found, wanted)} at this start, but must be "
                f"{wanted}; change mu0, or x0."
            )


def _constraints(scheme: DiscreteEquations, scene: Scene) -> Iterator[tuple[str, Any, Any]]:
    """(name, formula in x and μ, its value) of the quantities with a value."""
    s = scheme.s
    for quantity in scene.symmetries:
        if quantity.value is not None:
            formula = s.scalar(quantity.formula(s.x, s.mu, s.parameters), quantity.name)
            wanted = to_sympy(exact(quantity.value, quantity.name))
            yield quantity.name, *_with_parameters(scheme, [formula]), wanted


def _with_parameters(scheme: DiscreteEquations, expressions: list[Any]) -> list[Any]:
    """The expressions with the parameters' exact values."""
    s = scheme.s
    values = dict(zip(s.parameter_list, map(to_sympy, s.parameter_values), strict=True))
    return [e.xreplace(values) for e in expressions]


def _beside(found: Any, wanted: Any) -> str:
    """A number, told apart from the one it should be."""
    difference = float(found - wanted)
    return f"{float(found):.6g}" if abs(difference) > 1e-4 else f"{wanted} {difference:+.2g}"
