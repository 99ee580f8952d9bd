"""Conditions on a scheme before any run: known letters, a start, regularity."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import BadInput, at_line, line_of
from ..numbers import (
    Graph,
    NotComputed,
    NotSmooth,
    arithmetic,
    evaluate_matrix,
    exact,
    null_direction,
    numeric,
    random_point,
    shown,
    sympy,
    to_sympy,
)
from ..numbers.types import (
    Column,
    Exact,
    Expression,
    Expressions,
    Function,
    Letter,
    Numbers,
    SymbolicMatrix,
)
from ..rules import Discretisation
from ..scene import Scene
from .continuous import inverse_two_form, mass_matrix, momentum, two_form
from .discrete_lagrangian import DiscreteLagrangian
from .symbols import SceneSymbols

#: what a matrix is called, in a dictionary of several
Which = TypeVar("Which")


def check_letters(of: DiscreteLagrangian, rule: Discretisation) -> None:
    """Raise `BadInput` if L_d contains unknown symbols, not u, or not every stage."""
    s, both = of.s, named(of.s.name, rule)
    graph = of.graph
    symbols = graph.symbols([of.value])
    check_known(symbols - {*s.y, *s.stages}, s, rule)
    points = {z for block in of.moved for z in block.nodes if block.theta is not None}
    if not graph.symbols([of.value], points) & set(s.u):
        raise BadInput(
            f"{both}: the discrete Lagrangian does not depend on u, so FL is singular everywhere; "
            "it needs a kinetic term."
        )
    for number, column in enumerate(s.stage_columns):
        if not set(column) <= symbols:
            raise BadInput(
                f"{both}: the rule asks for {rule.stages} internal stages, but its discrete "
                f"Lagrangian does not depend on all of s[{number}]; use every stage, or ask for "
                "fewer with stages=."
            )


def check_known(symbols: set[Letter], s: SceneSymbols, rule: Discretisation) -> None:
    """Raise `BadInput` if one of the symbols of L_d is not among x, u and parameters."""
    if unknown := symbols - {*s.x, *s.u, *s.q}:
        s.refuse_unknown_of_lagrangian()
        raise BadInput(
            f"{named(s.name, rule)}: the discrete Lagrangian holds the unknown symbol "
            f"{min(map(str, unknown))}; write it with x, u, h, parameters."
        )


def named(scene: str, rule: Discretisation) -> str:
    """Return the scene with the rule, and the place of a user's rule."""
    return f"{at_line(rule.formula)}{scene} with {rule.name}"


def check_regular(equations: Any, scene: Scene, rule: Discretisation) -> None:
    """Raise `BadInput` if ∂E/∂w (FL, without stages) or ∂²l/∂ξ² is singular at two random points.

    The second is checked too: where it is singular, terms O(h²) of the potential can make FL
    regular, but there is no system on the dual that the map approximates. For a discrete Lagrangian
    without a continuous one only FL is checked.
    """
    s, w = equations.s, equations.w
    of_what = "(u, s); every velocity and every stage" if len(s.stages) else "u; every velocity"
    mass = {}
    if scene.has_lagrangian and not s.degenerate:
        mass["the mass matrix ∂²l/∂ξ²", "ξ; every velocity"] = mass_matrix(s)
    directions = singular(mass, s, s.x, w, scene)
    if mass and not directions and rule.nodes is not None and s.given is None:
        return  # as h → 0 ∂E/∂w of these stages is as regular as the mass matrix
    slope = equations.discrete.slope_of_rows
    directions = singular({("FL", of_what): slope}, s, s.x, w, scene, equations.graph) | directions
    for (name, of_what), direction in directions.items():
        other = ""
        if mass and next(iter(mass.values())).is_zero_matrix:
            other = " A Lagrangian linear in all velocities is given by one_form= and hamiltonian=."
        raise BadInput(
            f"{named(scene.name, rule)}: {name} is singular everywhere, in the direction "
            f"({shown(direction)}) of {of_what} needs its kinetic energy.{other}"
        )


def singular(
    asked: Mapping[Which, SymbolicMatrix],
    s: SceneSymbols,
    state: Column,
    w: Column,
    scene: Scene,
    graph: Graph | None = None,
    alike: Sequence[dict[Letter, Letter]] = (),
) -> dict[Which, Column]:
    """Return {which: a direction that it maps to 0} of matrices that are singular at three points.

    They are matrices of sympy, or of nodes of the graph.

    Two are random, without units. In the unit of a scene they may be so far from its motion that
    the matrix has lost all its digits there, so the third has the sizes of the start
    (`start_sizes`). alike: entries of w that are rates, each with the entry of (x, μ) whose rate it
    is.
    """
    directions = dict.fromkeys(asked)
    for seed in range(3):
        point = random_point([*state, *w, *s.q], (*w, s.h), seed)
        if seed == 2:
            if not directions:
                break
            sizes = start_sizes(s, scene)
            time = to_sympy(scene.duration)
            for rates in alike:
                sizes |= {e: sizes[z] / time for e, z in rates.items()}
            point = {e: value * sizes.get(e, 1) for e, value in point.items()}
        point |= s.exact_parameters(scene)
        if graph or any(m.free_symbols & s.constants.keys() for m in asked.values()):
            point |= s.constant_values(40)
        try:
            values = {a: evaluate_matrix(asked[a], 30, point, graph) for a in directions}
        except NotComputed:  # a run reports this, with the function that has to be changed
            return {}
        directions = {a: null_direction(matrix) for a, matrix in values.items()}
        directions = {a: direction for a, direction in directions.items() if direction is not None}
    return directions


def start_sizes(s: SceneSymbols, scene: Scene) -> dict[Letter, Expression]:
    """Return the sizes of x, ξ, μ and h at the start of a scene, in its units, exact or of 30
    digits.

    An entry that is 0 gets the size of the others; a velocity 0 that of x over the duration; a
    momentum the Lagrangian's for these velocities.
    """
    time = to_sympy(scene.duration)

    def filled(values: Expressions, otherwise: Expression) -> list[Expression]:
        sizes = [abs(e) for e in values]
        largest = max(sizes, default=0) or otherwise
        return [e or largest for e in sizes]

    x = filled(list(map(to_sympy, scene.x0)), sympy.Integer(1))
    v = filled(list(map(to_sympy, scene.v0)), max(x, default=sympy.Integer(1)) / time)
    scales = dict(zip([*s.position, *s.u, s.h], [*x, *v, to_sympy(scene.step)], strict=True))
    scales |= {e: time for e in [*s.x] if e not in scales}
    mu: Expressions = [] if scene.mu0 is None else list(map(to_sympy, scene.mu0))
    if scene.lagrangian is not None and scene.mu0 is None:
        start = zip([*s.x], map(to_sympy, s.with_time(scene.x0)), strict=True)
        at = dict(start) | {e: scales[e] for e in s.u} | s.exact_parameters(scene)
        with suppress(NotComputed):
            mu = [e for e in evaluate_matrix(momentum(s), 30, at) if e.is_finite and e.is_real]
    if len(mu) != len(s.mu):
        mu = [sympy.Integer(1)] * len(s.mu)
    return scales | dict(zip(s.mu, filled(mu, sympy.Integer(1)), strict=True))


def check_start(s: SceneSymbols, scene: Scene) -> None:
    """Raise `BadInput` unless the start gives every quantity its value (as |Γ|² = 1), exactly.

    Also if the force or the Lagrangian is not a real number there.
    """
    check_force(s, scene)
    check_lagrangian(s, scene)
    if s.degenerate:
        check_two_form(s, scene)
    at = dict(zip([*s.position, *s.u], map(to_sympy, [*scene.x0, *scene.v0]), strict=True))
    for name, formula, wanted in _constraints(s, scene):
        if formula.free_symbols & set(s.mu):
            if scene.mu0 is not None:
                mu = list(map(to_sympy, scene.mu0))
            elif scene.lagrangian is None:
                continue  # the start's momentum is only given with the run
            else:
                mu = momentum(s).xreplace(s.exact_parameters(scene))
            formula = formula.xreplace(dict(zip(s.mu, mu, strict=True)))
        value = formula.xreplace(at)
        if sympy.simplify(value - wanted) != 0:
            raise BadInput(
                f"{scene.name}: {name} is {_compared(value, wanted)} at x0, but must be "
                f"{wanted}; change x0 (an exact value: fractions such as 2/7, 3/7, 6/7)."
            )


def _at_start(s: SceneSymbols, scene: Scene) -> dict[Letter, Exact]:
    """Return the values of x, the velocity and the parameters at the start."""
    numbers = map(to_sympy, [*s.with_time(scene.x0), *scene.v0])
    values = dict(zip([*s.x, *s.u], numbers, strict=True)) | s.exact_parameters(scene)
    mu = [] if scene.mu0 is None else map(to_sympy, scene.mu0)
    return values | dict(zip(s.mu, mu, strict=False))


def check_force(s: SceneSymbols, scene: Scene) -> None:
    """Raise `BadInput` if a component of the force is not a real number at the start."""
    if not s.forced:
        return
    at = _at_start(s, scene)
    for i, (component, value) in enumerate(
        zip(s.force, evaluate_matrix(s.force, 30, at), strict=True)
    ):
        if value is sympy.nan or value.is_real is False:
            written = component.xreplace({s.x[-1]: sympy.Symbol("t")} if s.clocked else {})
            raise BadInput(
                f"{scene.name}: component {i} of the force, {written}, is no real number at x0, "
                "v0; begin elsewhere, or write it with functions that are real there."
            )


def check_lagrangian(s: SceneSymbols, scene: Scene) -> None:
    """Raise `BadInput` if the Lagrangian or the Hamiltonian is not a finite real number at x0."""
    if scene.lagrangian is None:
        return
    try:
        (value,) = evaluate_matrix(sympy.Matrix([s.phase_lagrangian]), 30, _at_start(s, scene))
    except NotComputed:  # a run reports this, with the function that has to be changed
        return
    if not (value.is_real and value.is_finite):
        has_hamiltonian = scene.hamiltonian is not None
        noun, start = ("Hamiltonian", "x0, mu0") if has_hamiltonian else ("Lagrangian", "x0, v0")
        raise BadInput(
            f"{scene.name}: its {noun} is no finite real number at "
            f"{'x0' if s.degenerate else start}; begin elsewhere, or give other parameters."
        )


def check_two_form(s: SceneSymbols, scene: Scene) -> None:
    """Raise `BadInput` if dϑ is singular everywhere, or at the start, or has no value there."""
    inverse_two_form(s)
    try:
        matrix = evaluate_matrix(two_form(s), 30, _at_start(s, scene))
    except NotComputed:  # a run reports this, with the function that has to be changed
        return
    if not all(e.is_real and e.is_finite for e in matrix):
        raise BadInput(
            f"{scene.name}: dϑ of its one-form is no finite real number at x0; begin elsewhere, or "
            "give other parameters."
        )
    if (direction := null_direction(matrix)) is not None:
        raise BadInput(
            f"{scene.name}: dϑ of its one-form is singular at x0, in the direction "
            f"({shown(direction)}), so no velocity follows from dϑ(·, ẋ) = dH; begin elsewhere."
        )


def check_momentum(s: SceneSymbols, scene: Scene, x: Numbers, mu: Numbers) -> None:
    """Raise `BadInput` unless (x, μ), numbers of any arithmetic, satisfy every constraint.

    They may come from a row of a run, so not exactly: up to 2⁻²⁶ of the effect of a relative change
    of every entry by one, Σ |∂f/∂zᵢ zᵢ|.
    """
    if all(gap <= 0 for gap in _gaps(s, scene)([float(e) for e in [*x, *mu]])):
        return  # round-off of this quick check does not matter
    start = [to_sympy(exact(e, "start")) for e in [*x, *mu]]
    at = dict(zip([*s.x, *s.mu], start, strict=True))
    for name, formula, wanted in _constraints(s, scene):
        value = formula.xreplace(at)
        size = sum(abs(formula.diff(z).xreplace(at) * number) for z, number in at.items())
        if abs(float(value - wanted)) > 2**-26 * float(size):
            raise BadInput(
                f"{scene.name}: {name} is {_compared(value, wanted)} at this start, but must be "
                f"{wanted}; change mu0, or x0."
            )


@lru_cache(maxsize=64)
def _gaps(s: SceneSymbols, scene: Scene) -> Callable[[list[float]], list[float]]:
    """Return |f − its value| − 2⁻²⁷ Σ |∂f/∂zᵢ zᵢ| of each constraint, a function of z = (x, μ)."""
    z = [*s.x, *s.mu]
    rows = [
        abs(formula - wanted) - sympy.Add(*[abs(formula.diff(e) * e) for e in z]) / 2**27
        for _, formula, wanted in _constraints(s, scene)
    ]
    return numeric({"z": z}, [rows], arithmetic(16))


def _constraints(s: SceneSymbols, scene: Scene) -> Iterator[tuple[str, Expression, Exact]]:
    """Yield (name, formula in x and μ, its value) of the quantities with a value."""
    for quantity in scene.symmetries:
        if quantity.value is not None:
            formula = s.call(quantity.formula, quantity.name, s.position, s.mu, s.parameters)
            wanted = to_sympy(exact(quantity.value, quantity.name))
            yield quantity.name, formula.xreplace(s.exact_parameters(scene)), wanted


def _compared(value: Exact, wanted: Exact) -> str:
    """Return a number with enough digits to differ from the one that it should be."""
    difference = float(value - wanted)
    return f"{float(value):.6g}" if abs(difference) > 1e-4 else f"{wanted} {difference:+.2g}"


# The source of a missing derivative: the Lagrangian, the force or the rule, and its line.


if TYPE_CHECKING:
    from ..scene import Scene
    from .symbols import SceneSymbols

#: possible causes in a line: one of the functions, or otherwise a power, which may be a root
_WORDS = (r"\b(sqrt|Abs|abs|Max|Min|sign|Heaviside|Piecewise)\b", r"\*\*")


@contextmanager
def blamed(scheme: Any) -> Iterator[None]:
    """Raise an uncomputable expression again, with the user's function that has to be changed."""
    try:
        yield
    except NotSmooth:
        raise _blame(scheme) from None
    except NotComputed as error:
        which = named(scheme.scene.name, scheme.equations.rule)
        raise BadInput(f"{which}: {error}") from None


def _blame(scheme: Any) -> BadInput:
    scene, rule = scheme.scene, scheme.equations.rule
    what, function = f"the rule {rule.name}", getattr(rule, "formula", None)
    if scene.force is not None and any(map(_breaks, scheme.s.force)):
        what, function = f"the force of {scene.name}", scene.force
    return _refusal(what, function)


def check_finite(scene: Scene, s: SceneSymbols) -> tuple[str, Expression]:
    """Raise `BadInput` if the Lagrangian (or Hamiltonian) is not finite and real.

    Returns its name, and the expression.
    """
    H = s.hamiltonian
    noun, value = ("Lagrangian", s.lagrangian) if H is None else ("Hamiltonian", H)
    s.scalars([value], f"its {noun}", scene.lagrangian)
    if s.degenerate:
        _ = s.one_form
    return noun, value


def check_smooth(scene: Scene, s: SceneSymbols) -> None:
    """Raise `BadInput` as `check_finite` does, and if the energy or the force is not smooth.

    It may not be made of pieces in x, u, μ or t: no rule has an order across a jump in the slope of
    its gradient.
    """
    noun, value = check_finite(scene, s)
    refuse_pieces([value], s, f"the {noun} of {scene.name}", scene.lagrangian)
    if s.degenerate:
        refuse_pieces(s.one_form, s, f"the one-form of {scene.name}", scene.one_form)
    refuse_pieces(s.force, s, f"the force of {scene.name}", scene.force)


def refuse_pieces(
    values: Iterable[Expression], s: SceneSymbols, what: str, function: Function | None
) -> None:
    """Raise `BadInput` if one of the values is made of pieces in x, u, μ or t."""
    if any(_breaks(e, {*s.x, *s.u, *s.mu}) for e in values):
        raise _refusal(what, function)


def _refusal(what: str, function: Function | None) -> BadInput:
    place = _line(function)
    return BadInput(
        (f"{place}: " if place else "")
        + f"{what} holds Abs (or Max, Min, Piecewise, a step), so that its gradient has no "
        "derivative everywhere: write it without; the root of a square is one too: sqrt(u**2) is "
        "Abs(u). A switch can be smooth, as (1 + tanh(x/w))/2."
    )


def _breaks(e: Expression, letters: set[Letter] | None = None) -> bool:
    """True if the expression is made of pieces, of functions of the letters if some are given."""
    pieces = e.atoms(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside, sympy.Piecewise)
    return any(letters is None or part.free_symbols & letters for part in pieces)


def _line(function: Function | None) -> str:
    """Return the first possible line of a user's function, or its start; "" for ours."""
    place = line_of(function)
    with suppress(OSError, TypeError):
        lines, first = inspect.getsourcelines(function)  # type: ignore[arg-type]
        for words in _WORDS:
            for k, text in enumerate(lines):
                if place and re.search(words, text):
                    return f"{place.rpartition(' ')[0]} {first + k}"
    return place
