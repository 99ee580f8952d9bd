"""Energy and the conserved quantities that a scene declares, along a computed solution.

A quantity whose time derivative along the equations is not zero at the tested states is no
invariant: it is named, and does not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy

from discmech.integrators.scene import short_numbers

from ..equations import Equations, parameter_values
from ..failures import ReferenceFailure
from .agreement import EXACT, Blocks, said


@dataclass(frozen=True)
class Invariants:
    """Functions of (x, v, mu, attitude) that the motion conserves, each with its absolute terms."""

    names: tuple[str, ...]
    function: Callable[..., list[tuple[Any, Any]]]
    rates: Callable[..., list[tuple[Any, Any]]]

    def digits(self, here: Blocks, start: Blocks, working: int) -> tuple[int, str]:
        """Return the digits to which all are conserved, and a sentence.

        A drift is measured relative to the quantity's sum of absolute terms, here or at the start.
        """
        worst, least = math.inf, ""
        kept: dict[str, None] = {}
        broken: dict[str, None] = {}
        with mpmath.workdps(working):
            pairs = zip(
                self.names, self._at(start), self._at(here), self._moving(here), strict=True
            )
            for name, (a, p), (b, q), moving in pairs:
                if moving:
                    broken[name] = None
                    continue
                kept[name] = None
                drift = abs(b - a)
                if drift:
                    digits = float(mpmath.log10(max(p, q) / drift))
                    if not digits >= worst:
                        worst, least = digits, name
        certain = EXACT if worst == math.inf else math.floor(max(0.0, worst))  # also of nan
        words = f"{_listed(kept)} kept {said(certain)}" if kept else "no invariant to compare"
        if least and len(kept) > 1:
            words += f" ({least} least)"
        if broken:
            words += (
                f"; {_listed(broken)}, which the scene declares, not conserved by its equations"
            )
        return certain, words

    def _at(self, blocks: Blocks) -> list[tuple[Any, Any]]:
        behind = *blocks.get("attitude", ()), *blocks.get("time", ())
        return self.function(*blocks["x"], *blocks["v"], *blocks["mu"], *behind)

    def _moving(self, blocks: Blocks) -> list[bool]:
        """Return for each True if its derivative is more than round-off."""
        behind = *blocks.get("attitude", ()), *blocks.get("time", ())
        rates = self.rates(*blocks["x"], *blocks["v"], *behind)
        return [abs(rate) > 1e-10 * scale for rate, scale in rates]


def _listed(names: Iterable[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def invariants_of(scene: Any, equations: Equations) -> Invariants:
    """Return the invariants of the scene; those of its attitude only if the equations have one."""
    n, m, size = equations.dim_x, equations.dim_u, equations.attitude_size
    count = len(equations.momentum)
    states = list(equations.states)
    x = sympy.Matrix(n, 1, states[:n])
    mu = sympy.Matrix(count, 1, lambda i, _: sympy.Symbol(f"mu{i}", real=True))
    names: list[str] = []
    values: list[Any] = []
    # otherwise the motion does not conserve it
    if not (equations.timed or equations.forced or equations.driven):
        names, values = ["energy"], [equations.energy]
    for quantity in getattr(scene, "symmetries", ()):
        if quantity.attitude and not size:
            continue
        if getattr(quantity, "of_step", False) or quantity.kind == "nonholonomic momentum":
            continue  # it belongs to a method, or has its own equation: no motion conserves it
        base = (
            sympy.Matrix(size, size, states[equations.block("attitude")])
            if quantity.attitude
            else x
        )
        try:
            with short_numbers(f"the conserved quantity {quantity.name}"):
                expression = sympy.sympify(quantity.at(base, mu, parameter_values(scene), None))
        except Exception as error:
            raise ReferenceFailure(
                f"the conserved quantity {quantity.name} of scene {scene.name} cannot be evaluated "
                f"on symbols ({type(error).__name__}: {error}); write it with sympy functions"
            ) from error
        entries = list(expression) if hasattr(expression, "shape") else [expression]
        names += [quantity.name] * len(entries)
        values += entries
    values = list(map(sympy.sympify, values))
    arguments = [*states[: n + m], *mu, *states[n + m :]]
    function = sympy.lambdify(arguments, [(value, _size(value)) for value in values], "mpmath")
    return Invariants(tuple(names), function, _rates(equations, mu, values))


def _size(e: Any) -> Any:
    """Return the sum of the absolute terms of an expression, as if it were expanded.

    An energy of 0 written as a product, (T - V) f, has the size of T f + V f, not 0.
    """
    if e.is_Add or e.is_Mul:
        return e.func(*map(_size, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return _size(e.base) ** e.exp
    return abs(e)


def _rates(equations: Equations, mu: Any, values: list[Any]) -> Any:
    """Return a function: state ↦ (dJ/dt, the absolute terms of the chain rule) of each quantity."""
    momentum = dict(zip(mu, equations.momentum, strict=True))
    speeds = [sympy.Symbol(f"rate_{state}", real=True) for state in equations.states]
    rows = []
    for value in values:
        plain = value.xreplace(momentum)
        terms = [plain.diff(z) * w for z, w in zip(equations.states, speeds, strict=True)]
        rows.append((sympy.Add(*terms), sum(map(abs, terms), sympy.S.Zero)))
    before = [*equations.assignments, *zip(speeds, equations.rates, strict=True)]
    return sympy.lambdify(equations.states, rows, "mpmath", cse=lambda e: (before, e))
