"""One step of a rule, with the physical time and the step density as two more entries of x.

The step h of a system is the first entry of q; here it stands for the share of ε that a step has.
Each h in the system is replaced by the letter of the effective step, h/(ζ + e D): ζ the density, D
the growth of the density in a step, e a last entry of q, which is not 0 only in the first substep.
So the kernels, the driver and all functions of a system stay the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from ..compiler import Step
from ..equations import SceneSymbols, vector_field
from ..errors import BadInput
from ..numbers import Definition, Function, jacobian, replaced, sympy
from ..numbers.types import Column, Expression, Letter, Replacement

#: names of this room's letters, which no parameter of a scene can have: the physical time, the
#: density, the effective step, the growth of the density, the roots of σ and of the new density,
#: and e, by which only the first substep changes the density
TIME, DENSITY, STEP, SIGMA, GROWTH, ROOT, AFTER, CONTROL = (f"sd{i}" for i in range(8))


def letter(name: str) -> Letter:
    """Return a real letter of that name."""
    return sympy.Symbol(name, real=True)


def with_columns(system: Step, columns: Sequence[Letter], increments: Sequence[Expression]) -> Step:
    """Return the system with more entries of x, which grow by increments in its letters."""
    more = tuple(letter(f"{c}_y") for c in columns)
    return replace(
        system,
        x=(*system.x, *columns),
        y=(*system.y, *more),
        increment=sympy.Matrix([*system.increment, *increments]),
    )


def controlled(
    system: Step, s: SceneSymbols, sigma: Expression, way: str, leading: bool = True
) -> Step:
    """Return a system of equal steps with a step that follows σ, in the way reversible or naive.

    leading: whether the step changes the density; the later substeps of a composition take it as
    it is.
    """
    h, zeta, step, value, root, control = (
        system.q[0], *map(letter, (DENSITY, STEP, SIGMA, ROOT, CONTROL))
    )  # fmt: skip
    growth, after = letter(GROWTH), letter(AFTER)
    grows = logarithmic_rate(s, sigma) * sigma / root**2 if way == "reversible" else (
        1 / root**2 - zeta
    )  # fmt: skip
    before = [
        Definition((value,), (sigma,)),
        # a negative value has no real root: a run with such a σ or density ends there
        Definition((root,), (sympy.sqrt(value),)),
        Definition((growth,), (grows,)),
        Definition((after,), (sympy.sqrt(zeta + control * growth),)),
        Definition((step,), (h / after**2,)),
    ]
    if not leading:
        before, growth = [Definition((step,), (h / zeta,))], sympy.Integer(0)
    # sizes that show a chart's edge do not depend on μ: they take the density before the step
    watched = tuple((kind, e.xreplace({h: h / zeta})) for kind, e in system.extents)
    inner = _in_letters(system, {h: step})
    found = replace(
        inner, q=(*system.q, control), definitions=(*before, *inner.definitions), extents=watched,
        scaled=(),
    )  # fmt: skip
    return with_columns(found, [letter(TIME), zeta], [step, control * growth])


def logarithmic_rate(s: SceneSymbols, sigma: Expression) -> Expression:
    """Return G = −(dσ/dt)/σ along the motion, in x and μ.

    Raises `CannotMeasure` if ξ(x, μ) has no short closed form.
    """
    slope = jacobian([sigma], [*s.x, *s.mu])
    return -(slope * vector_field(s))[0] / sigma


def _in_letters(system: Step, swap: Replacement) -> Step:
    """Return the system with letters replaced in all values that a step computes."""
    known: Replacement = {}

    def of(matrix: Column) -> Any:
        return sympy.Matrix(*matrix.shape, replaced(matrix, swap, known))

    functions: dict[Function, Function] = {}

    def defined(given: Iterable[Definition]) -> tuple[Definition, ...]:
        return tuple(
            replace(d, values=tuple(replaced(d.values, swap, known))) if d.function is None
            else replace(d, function=shared(d.function))
            for d in given
        )  # fmt: skip

    def shared(f: Function) -> Function:
        if f not in functions:
            results = tuple(replaced(f.results, swap, known))
            functions[f] = replace(f, results=results, definitions=defined(f.definitions))
        return functions[f]

    return replace(
        system, rows=of(system.rows), slope=of(system.slope), increment=of(system.increment),
        gain=of(system.gain), definitions=defined(system.definitions),
        wanted=tuple(replaced(system.wanted, swap, known)),
    )  # fmt: skip


def sigma_of(s: SceneSymbols, function: Any, bare: bool) -> Expression:
    """Return σ in the letters of a scene; bare: of x alone.

    Raises `BadInput` for another shape, for a σ that is not smooth, and for unknown letters.
    """
    what = "sigma"
    found = s.call(function, what, s.position, s.mu, s.parameters)
    s.refuse_unknown(sympy.Matrix([found]), {*s.x, *s.mu}, what, function, "x, mu and p")
    s.scalars([found], what, function)
    pieces = found.atoms(sympy.Abs, sympy.Max, sympy.Min, sympy.sign, sympy.Heaviside,
                         sympy.Piecewise, sympy.floor, sympy.ceiling)  # fmt: skip
    if any(e.free_symbols & {*s.x, *s.mu} for e in pieces):
        raise BadInput(
            f"{s.name}: sigma is not smooth: it holds {min(map(str, pieces), key=len)[:60]}, and "
            "no step has an order across a jump; write it without, as a root of squares or a sum "
            "of powers."
        )
    if bare and found.free_symbols & {*s.mu}:
        raise BadInput(
            f'{s.name}: sigma depends on mu; with way="poincare" give a function of x and p '
            'alone, or take way="reversible".'
        )
    return found
