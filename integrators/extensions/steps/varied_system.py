"""One step of a rule, with the physical time and the step density as two more entries of x.

The step h of a system is the first entry of q; here it stands for the share of ε that a step has.
Each h in the system is replaced by the effective step, h/(ζ + e D): ζ the density, D
the growth of the density in a step, e a last entry of q, which is not 0 only in the first substep.
So the kernels, the driver and all functions of a system stay the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...compiler import Step
from ...equations import SceneSymbols, vector_field
from ...errors import BadInput
from ...numbers import Node, jacobian, ratio, sympy
from ...numbers.types import Expression, Function, Letter

#: names of this room's letters, which no parameter of a scene can have: the physical time, the
#: density, and e, by which only the first substep changes the density
TIME, DENSITY, CONTROL = (f"sd{i}" for i in range(3))


def letter(name: str) -> Letter:
    """Return a real letter of that name."""
    return sympy.Symbol(name, real=True)


def with_columns(
    system: Step, columns: Sequence[Letter], increments: Sequence[Expression | Node]
) -> Step:
    """Return the system with more entries of x, which grow by increments in its letters."""
    more = tuple(letter(f"{c}_y") for c in columns)
    return replace(
        system,
        x=(*system.x, *columns),
        y=(*system.y, *more),
        increment=[*system.increment, *increments],
    )


def controlled(
    system: Step, s: SceneSymbols, sigma: Expression, way: str, leading: bool = True
) -> Step:
    """Return a system of equal steps with a step that follows σ, in the way reversible or naive.

    leading: whether the step changes the density; the later substeps of a composition take it as
    it is.
    """
    zeta, control = map(letter, (DENSITY, CONTROL))
    graph = system.nodes.graph
    h, before, may_change = graph.letters((system.q[0], zeta, control))
    # sizes that show a chart's edge do not depend on μ: they take the density before the step
    watched = tuple(
        (kind, e.xreplace({system.q[0]: system.q[0] / zeta})) for kind, e in system.extents
    )
    if leading:
        value = graph.hold(graph.read(sigma))
        # a negative value has no real root: a run with such a σ or density ends there
        root = graph.hold(graph.product([(value, ratio(1, 2))]))
        over = graph.product([(root, -2)])
        grows = over - before
        if way == "reversible":
            grows = graph.read(logarithmic_rate(s, sigma) * sigma) * over
        change = may_change * graph.hold(grows)
        after = graph.hold(graph.product([(before + change, ratio(1, 2))]))
        step = graph.hold(graph.product([(h, 1), (after, -2)]))
    else:
        change, step = graph.number(0), graph.hold(graph.product([(h, 1), (before, -1)]))
    result = replace(
        system.at({system.q[0]: step}), q=(*system.q, control), extents=watched, scaled=()
    )
    return with_columns(result, [letter(TIME), zeta], [step, change])


def logarithmic_rate(s: SceneSymbols, sigma: Expression) -> Expression:
    """Return G = −(dσ/dt)/σ along the motion, in x and μ.

    Raises `CannotMeasure` if ξ(x, μ) has no short closed form.
    """
    slope = jacobian([sigma], [*s.x, *s.mu])
    return -(slope * vector_field(s))[0] / sigma


def sigma_of(s: SceneSymbols, function: Function, bare: bool) -> Expression:
    """Return σ in the letters of a scene; bare: of x alone.

    Raises `BadInput` for another shape, for a σ that is not smooth, and for unknown letters.
    """
    what = "sigma"
    expression = s.call(function, what, s.position, s.mu, s.parameters)
    s.refuse_unknown(sympy.Matrix([expression]), {*s.x, *s.mu}, what, function, "x, mu and p")
    s.scalars([expression], what, function)
    pieces = expression.atoms(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside,
                              sympy.Piecewise, sympy.floor, sympy.ceiling)  # fmt: skip
    if any(e.free_symbols & {*s.x, *s.mu} for e in pieces):
        raise BadInput(
            f"{s.name}: sigma is not smooth: it holds {min(map(str, pieces), key=len)[:60]}, and "
            "no step has an order across a jump; write it without, as a root of squares or a sum "
            "of powers."
        )
    if bare and expression.free_symbols & {*s.mu}:
        raise BadInput(
            f'{s.name}: sigma depends on mu; with way="poincare" give a function of x and p '
            'alone, or take way="reversible".'
        )
    return expression
