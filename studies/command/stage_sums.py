"""The discrete Lagrangian of a rule with internal stages, as its author wrote it: a weighted sum.

h·l(x, s + u)/6 + 2·h·l(b(x, h·s/4 + h·u/2), u)/3 + h·l(y, −s + u)/6
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from discmech.integrators.equations import answers_of

DIGITS = 6  # digits of nodes and weights that are no fractions


class StageSum:
    """The terms of L_d with vectors as single letters; `letters` names these.

    l is the Lagrangian, b the target of a chart value, V the velocity of a curve of arrows.
    """

    def __init__(self, s: Any, of: Any) -> None:
        from sympy import Symbol

        self.s, self.of = s, of
        several = s.stage_columns
        names = ["u", *("s" if len(several) == 1 else f"s_{j + 1}" for j in range(len(several)))]
        self.blocks = [*zip(map(Symbol, names), (s.u, *several), strict=True)]
        self.letters = {letter: str(letter) for letter, _ in self.blocks}

    @property
    def terms(self) -> list[Any]:
        """One term for each value of the Lagrangian that the rule uses."""
        from sympy import Function

        n, value = len(self.s.x), Function("l")
        known = self.s.constant_values(DIGITS)
        terms = [
            weight * value(*self._point(call.args[:n]), *self._velocity(call.args[n:]))
            for weight, call in self.of.asked
        ]
        return [self.of.resolved(e).xreplace(known) for e in terms]

    def _point(self, entries: Sequence[Any]) -> list[Any]:
        from sympy import Function, Symbol

        if not entries:
            return []
        if tuple(entries) == tuple(self.s.x):
            return [Symbol("x")]
        rest = answers_of(entries, self.of.G.Target)
        if rest is None:
            return [*entries]
        n, h = len(entries), rest[-1]
        base, w = self._point(rest[:n]), self._vector(h * e for e in rest[n:-1])
        to_the_end = base == [Symbol("x")] and w == [self.s.h * self.blocks[0][0]]
        return [Symbol("y")] if to_the_end else [Function("b")(*base, *w)]

    def _velocity(self, entries: Sequence[Any]) -> list[Any]:
        from sympy import Function

        rest = answers_of(entries, self.of.G.Velocity)
        if rest is None:
            return self._vector(entries)
        n, m, h = len(self.s.x), len(self.s.u), rest[-1]
        w, slope = self._vector(h * e for e in rest[n : n + m]), self._vector(rest[n + m : -1])
        return [Function("V")(*self._point(rest[:n]), *w, *slope)]

    def _vector(self, entries: Any) -> list[Any]:
        """Return a combination of u and the stages as one expression, or else the entries."""
        from sympy import expand

        entries = [expand(e) for e in entries]
        first = [entries[0].coeff(column[0]) for _, column in self.blocks]
        for i, entry in enumerate(entries):
            combined = sum(c * column[i] for c, (_, column) in zip(first, self.blocks, strict=True))
            if expand(entry - combined) != 0:
                return entries
        return [sum(c * letter for c, (letter, _) in zip(first, self.blocks, strict=True))]
