"""Up to which power of h a map is conjugate to a symplectic one, by a series of trees.

With Ω = Σ dx ∧ dμ, a map that is so to h^r by a B-series keeps Ω + Σ h^|τ| c_τ d(i_F(τ) Ω) to h^r
for some numbers c_τ of trees τ, and conversely (docs/proofs.md). These are linear equations for c.
They are evaluated in F_p at random states of random Hamiltonians, until one state more asks for
nothing new, and have a solution or none.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.expansions import series_function
from discmech.integrators.numbers import PrimeField, numeric_text

from .constants import Numbers
from .steps import Comparison, Gaps, Row

MOST_POWER = 8  # of h: trees of 7 nodes, of which there are 48
STATES = 200  # random ones at most, more than there are trees
MISSED = "each form that a series of trees makes of dx ∧ dμ"
Tree = tuple[Any, ...]


@cache
def trees(size: int) -> list[Tree]:
    """Return the rooted trees with so many nodes, each the sorted tuple of its subtrees."""
    return _forests(size - 1)


@cache
def _forests(size: int) -> list[tuple[Tree, ...]]:
    every = [tuple(sorted((tree, *rest))) for first in range(1, size + 1)
             for tree in trees(first) for rest in _forests(size - first)]  # fmt: skip
    return [*dict.fromkeys(every)] if size else [()]


def _size(tree: Tree) -> int:
    return 1 + sum(map(_size, tree))


class Differentials:
    """Elementary differentials F(τ) of the field of H at z + w, polynomials in w over F_p.

    F(τ) of k nodes is known up to |w|^(power − k + 1).
    """

    def __init__(self, c: Comparison, field: PrimeField, p: Row, z: Row, power: int) -> None:
        from flint import Ordering, nmod_mpoly_ctx

        s, n = c.s, len(c.s.x)
        names = tuple(f"w{i}" for i in range(2 * n))
        context = nmod_mpoly_ctx.get(names, modulus=field.p, ordering=Ordering.deglex)
        letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
        of = series_function(numeric_text(letters, [[s.hamiltonian], []]), field)
        at = [w + e.v for w, e in zip(context.gens(), z, strict=True)]
        H = of(at[:n], at[n:], [e.v for e in p])[0][0]
        speed, force = ([sign * H.derivative(i + first) for i in range(n)]
                        for first, sign in ((n, 1), (0, -1)))  # fmt: skip
        none = [0 * H] * n
        self._roots = [[*speed, *force], [*speed, *none], [*none, *force]]
        self._made, self._power = context.from_dict, power
        self._known: dict[tuple[Tree, int], list[Any]] = {}

    def of(self, tree: Tree, root: int) -> list[Any]:
        """Return F of a tree, whose nodes stand for (H_μ, −H_x) if the root is 0.

        They stand for (H_μ, 0) and (0, −H_x) in turn if it is 1 or 2: the first or the second.
        """
        if (tree, root) not in self._known:
            parts = [self.of(e, 3 - root if root else 0) for e in tree]
            degree = self._power - _size(tree) + 1
            entries = [self._along(e, parts, degree) for e in self._roots[root]]
            self._known[tree, root] = entries
        return self._known[tree, root]

    def _along(self, e: Any, fields: Sequence[list[Any]], degree: int) -> Any:
        """Return the derivative of a polynomial along fields, up to a degree."""
        total = e if not fields else 0 * e
        if fields and e != 0:
            for i, share in enumerate(fields[0]):
                if share != 0:
                    total += share * self._along(e.derivative(i), fields[1:], degree)
        kept = {powers: c for powers, c in total.to_dict().items() if sum(powers) <= degree}
        return self._made(kept)


def conjugate(
    halves: bool, c: Comparison, numbers: Numbers, draw: random.Random, power: int,
    kept: Sequence[bool] | None = None,
) -> Gaps:  # fmt: skip
    """Return 0 for the powers of h up to which there is a form that is kept, and 1 beyond.

    halves: True for trees with nodes of two kinds in turn, for T(μ) + V(x). Raises `CannotMeasure`
    for a power above `MOST_POWER`.
    """
    from flint import nmod_mat

    if power > MOST_POWER:
        raise CannotMeasure(f"it is looked at to h^{MOST_POWER} at most")

    rows, ranks = [list[list[int]]() for _ in range(power + 1)], list[tuple[int, ...]]()
    for _ in range(STATES):
        for row, more in zip(rows, _equations(halves, c, numbers, draw, power, kept), strict=True):
            row += more
        before, ranks, every = ranks, [], list[list[int]]()
        for row in rows:
            every += row
            left = [e[:-1] for e in every]
            ranks.append(tuple(nmod_mat(e, numbers.field.p).rank() for e in (left, every)))
        if ranks == before:
            return Gaps((MISSED,), [[numbers.field.number(b - a)] for a, b in ranks])
    raise CannotMeasure(f"the forms that trees make are not known after {STATES} states")


def _equations(
    halves: bool, c: Comparison, numbers: Numbers, draw: random.Random, power: int,
    kept: Sequence[bool] | None,
) -> Iterator[list[list[int]]]:  # fmt: skip
    """Yield, for each power of h, rows Σ c_τ a_τ + b of what is to vanish at a random state."""
    field = numbers.field
    p, _, at = c.drawn(numbers, draw, 1, kept)
    z, M = c.stepped(numbers, p, at, power, slopes=True)
    size, n = len(z), len(z) // 2

    def truncated(entries: Sequence[Any]) -> list[Any]:
        rows = Gaps.of((), entries, field, power).rows
        return [field.polynomial(list(e)) for e in zip(*rows, strict=True)]

    moved = truncated([a - b for a, b in zip(z, at[0], strict=True)])
    slopes = [truncated(column) for column in M.T]
    pairs = [*itertools.combinations(range(size), 2)]
    beyond = field.polynomial([*[0] * (power + 1), 1])  # products are taken up to h^power

    @cache
    def monomial(powers: tuple[int, ...]) -> Any:
        i = next((i for i, e in enumerate(powers) if e), None)
        if i is None:
            return field.polynomial([1])
        return monomial((*powers[:i], powers[i] - 1, *powers[i + 1 :])) * moved[i] % beyond

    def value(e: Any) -> Any:
        """Return a polynomial in w at the state after the step."""
        return sum((monomial(powers) * int(c) for powers, c in e.to_dict().items()),
                   field.polynomial([0]))  # fmt: skip

    def pulled(form: dict[tuple[int, int], Any]) -> list[Any]:
        """Return the entries of Mᵀ W M − (W at h = 0) of a two-form W along the step."""
        gaps = []
        for a, b in pairs:
            total = field.polynomial([-int(form[a, b][0])])
            for (i, j), e in form.items():
                turn = slopes[a][i] * slopes[b][j] - slopes[a][j] * slopes[b][i]
                total += e * turn % beyond
            gaps.append(total)
        return gaps

    one = field.polynomial([1])
    own = pulled({(i, j): one * (j == i + n) for i, j in pairs})
    columns, F = list[tuple[int, list[Any]]](), Differentials(c, field, p, at[0], power)
    for k in range(1, power):
        for tree, root in itertools.product(trees(k), (1, 2) if halves else (0,)):
            moves = F.of(tree, root)
            form = [*(-e for e in moves[n:]), *moves[:n]]  # i_F Ω
            slope = {(i, j): value(form[j].derivative(i) - form[i].derivative(j))
                     for i, j in pairs}  # fmt: skip
            columns.append((k, pulled(slope)))
    for k in range(power + 1):
        yield [[*(int(gaps[e][k - m]) if k >= m else 0 for m, gaps in columns), int(own[e][k])]
               for e in range(len(pairs))]  # fmt: skip
