"""Common subexpressions by value numbering: a graph whose nodes are values, up to their signs.

Partial sums and products that occur in several expressions are found by the numbers of nodes.
sympy's `cse` builds new expressions for each of them, which takes longer than all other work on a
kernel's text.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable
from typing import Any

from .arithmetic import FUNCTIONS, refused
from .exact import refuse_long
from .lazy import sympy
from .registered import is_table
from .types import Expression, Expressions, Letter, Replacement

#: kinds of nodes; `details` of a leaf: its text; of a call: the expression, or a function's name
LEAF, SUM, PRODUCT, INVERSE, POWER, CALL = range(6)
MOST = 16  # the largest power that is a product; larger ones by the library's power
_CONSTANTS = {"pi": "PI", "E": "exp(R(1))", "I": "1j"}

#: a value: twice the number of its node, plus one for the opposite
Value = int


class AsWritten:
    """The way in which a graph reads expressions: unchanged."""

    def letter(self, e: Expression) -> Expression | None:
        """Return a letter, or its opposite, that stands for the whole of e, or None."""
        return None

    def terms(self, e: Expression) -> Expressions:
        """Return the terms of a sum."""
        return e.args

    def factors(self, e: Expression) -> Expressions:
        """Return the factors of a product, or () for another expression."""
        return e.args if e.is_Mul else ()


AS_WRITTEN = AsWritten()


class Renamed(AsWritten):
    """The way in which a graph reads expressions with other letters."""

    def __init__(self, names: Replacement) -> None:
        self.names = names

    def letter(self, e: Expression) -> Expression | None:
        """Return the letter that replaces a letter, or None."""
        return self.names.get(e)


class ExpressionGraph:
    """The values of expressions: `kinds`, `parts` (values) and `details` by node.

    letters: the symbols in them, by their names.
    """

    def __init__(self, reading: AsWritten = AS_WRITTEN) -> None:
        self.reading = reading
        self.letters: dict[str, Letter] = {}
        self.kinds: list[int] = []
        self.parts: list[list[Value]] = []
        self.details: list[Any] = []
        self._nodes: dict[Hashable, int] = {}
        self._known: dict[Expression, Value] = {}
        self._rational: dict[Value, Expression] = {}
        self._unknown: list[Expression] = []

    def values(self, expressions: Iterable[Expression]) -> list[Value]:
        """Add expressions with all their parts and return their values.

        Raises `BadInput` for a function that no arithmetic has.
        """
        found = list(map(self._value, expressions))
        if self._unknown:  # the shortest is the user's own, others are its derivatives
            raise refused(min(self._unknown, key=lambda e: len(str(e))))
        return found

    def _value(self, e: Expression) -> Value:
        if e not in self._known:
            self._known[e] = self._added(e)
        return self._known[e]

    def _added(self, e: Expression) -> Value:
        if (letter := self.reading.letter(e)) is not None:
            return self._letter(letter) if letter.is_Symbol else self._letter(-letter) + 1
        if e.is_Rational:
            refuse_long((int(e.p), int(e.q)), "what a step computes")
            p = abs(e.p)
            found = self._node(LEAF, (), str(p) if e.q == 1 else f"(R({p})/{e.q})")
            self._rational[found] = abs(e)
            return found + int(e.p < 0)
        if e.is_Add:
            return self._sum(map(self._value, self.reading.terms(e)))
        if factors := self.reading.factors(e):
            return self._product(map(self._value, factors))
        if e.is_Symbol:
            return self._letter(e)
        if e.is_Pow:
            return self._power(e.base, e.exp)
        if e.is_Float:
            return self._node(LEAF, (), f"R('{_decimal(abs(e))}')") + bool(e < 0)
        if e.is_NumberSymbol or e is sympy.I:
            return self._node(LEAF, (), _CONSTANTS.get(str(e), f"constant('{e}')"))
        known = hasattr(e, "written") or type(e).__name__ in FUNCTIONS or is_table(e)
        if not known or not all(isinstance(a, sympy.Expr) for a in e.args):  # a condition, say
            self._unknown.append(e)
            return self._node(LEAF, (), str(e))
        return self._node(CALL, map(self._value, e.args), e, e.func)

    def _letter(self, letter: Letter) -> Value:
        self.letters[str(letter)] = letter
        return self._node(LEAF, (), str(letter))

    def _node(
        self, kind: int, parts: Iterable[Value], detail: Any = None, key: Any = None
    ) -> Value:
        parts = list(parts)
        by = kind, key or detail, *(sorted(parts) if kind in (SUM, PRODUCT) else parts)
        if by not in self._nodes:
            self._nodes[by] = len(self.kinds)
            self.kinds.append(kind)
            self.parts.append(parts)
            self.details.append(detail)
        return 2 * self._nodes[by]

    def _sum(self, terms: Iterable[Value]) -> Value:
        """Return the value of a sum; a − b and b − a are one node: the first term is positive."""
        terms = list(terms)
        if known := self._rationals(terms):
            return self._value(sympy.Add(*known))
        minus = min(terms) % 2
        return self._node(SUM, (t ^ minus for t in terms)) + minus

    def _product(self, factors: Iterable[Value]) -> Value:
        factors = list(factors)
        if known := self._rationals(factors):
            return self._value(sympy.Mul(*known))
        minus = sum(f % 2 for f in factors) % 2
        counts = Counter(f & ~1 for f in factors if self.details[f >> 1] != "1")
        if len(counts) > 1:  # (a − b)(b − a) is a square, which sympy does not see
            parts = [f if n == 1 else self._node(PRODUCT, [f] * n) for f, n in counts.items()]
        else:
            parts = list(counts.elements()) or [factors[0] & ~1]
        return (self._node(PRODUCT, parts) if len(parts) > 1 else parts[0]) + minus

    def _power(self, base: Expression, exponent: Expression) -> Value:
        b = self._value(base)
        if exponent.is_Integer and exponent < 0 and (known := self._rationals([b])) and known[0]:
            return self._value(known[0] ** exponent)
        if not exponent.is_Rational:
            return self._node(POWER, (b, self._value(exponent)))
        whole, rest = divmod(abs(exponent), 1)
        if whole > MOST or rest not in (0, sympy.S.Half):
            size = self._node(POWER, (b, self._value(abs(exponent))))
        else:
            root = [self._node(CALL, [b], "sqrt")] if rest else []
            power = [self._product([b] * int(whole))] if whole else []
            size = self._product([*power, *root])
        return size if exponent > 0 else self._node(INVERSE, [size & ~1]) + size % 2

    def _rationals(self, values: list[Value]) -> list[Expression]:
        """Return the rational numbers of these values, or [] if one is not rational.

        sympy combines them exactly; in the kernel's text Python would round each.
        """
        if any(v & ~1 not in self._rational for v in values):
            return []
        return [-self._rational[v & ~1] if v % 2 else self._rational[v] for v in values]

    # -- common parts of sums and of products ----------------------------------------------------

    def share(self) -> None:
        """Give partial sums and products that occur in several a node of their own."""
        for kind, made in (SUM, self._sum), (PRODUCT, self._product):
            nodes = [i for i, k in enumerate(self.kinds) if k == kind]
            groups = {i: set(self.parts[i]) for i in sorted(nodes, key=lambda i: len(self.parts[i]))
                      if len(set(self.parts[i])) == len(self.parts[i])}  # fmt: skip
            for i, rest in _shared(groups, made):
                kept = [p for p in self.parts[i] if p in rest]
                self.parts[i] = [*sorted(rest.difference(kept)), *kept]

    def uses(self, roots: Iterable[Value]) -> Counter[int]:
        """Return how often each node is used by the roots and by the nodes that they need."""
        counts = Counter(r >> 1 for r in roots)
        pending = list(counts)
        while pending:
            parts = [p >> 1 for p in self.parts[pending.pop()]]
            pending += dict.fromkeys(p for p in parts if p not in counts)
            counts.update(parts)
        return counts


def _decimal(number: Expression) -> str:
    """Return all decimals of a Float's binary value; `str` would give only fifteen of 0.1."""
    from mpmath.libmp import to_str

    _, _, exponent, bits = number._mpf_
    return str(to_str(number._mpf_, bits + 3 * abs(exponent)))  # each bit is a decimal at most


def _shared(groups: dict[int, set[Value]], made: Any) -> list[tuple[int, set[Value]]]:
    """Return [(node, its parts)] of the sums, or the products, whose parts change.

    groups: the parts of each, the shortest first. Each is compared with the longer ones, and the
    smallest common part becomes a node first. made: a function that adds a node for common parts.
    """
    owners: dict[Value, dict[int, None]] = {}
    for i, group in groups.items():
        for part in group:
            owners.setdefault(part, {})[i] = None
    changed: dict[int, None] = {}

    def replaced(i: int, common: set[Value], by: Value) -> None:
        for part in common:
            owners[part].pop(i, None)
        groups[i] = {*(groups[i] - common), by}
        owners.setdefault(by, {})[i] = None
        changed[i] = None

    for i in groups:
        for part in groups[i]:
            del owners[part][i]  # only later groups stay
        met = Counter(j for part in sorted(groups[i]) for j in owners[part])
        others = sorted((n, j) for j, n in met.items() if n > 1)
        for _, j in others:
            common = groups[i] & groups[j]
            if len(common) < 2:
                continue
            if common == groups[i]:
                by = 2 * i
            else:
                by = 2 * j if common == groups[j] else made(sorted(common))
                if by in groups[i]:  # a sum in a sum: as one of a set it would count once
                    continue
                groups[i] = {*(groups[i] - common), by}
                changed[i] = None
            for _, k in others:
                if k != by >> 1 and common <= groups[k] and by not in groups[k]:
                    replaced(k, common, by)
    return [(i, groups[i]) for i in changed]
