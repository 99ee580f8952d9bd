"""How a point of the straight step moves, in letters: its derivatives are not written out."""

from __future__ import annotations

import itertools

from ..groupoids import Motion
from ..numbers import slopes, symbols_of, sympy
from ..numbers.types import Column, Expression, Expressions, SymbolicMatrix
from .chain_rule import Block, ChainRule
from .covectors import times
from .symbols import SceneSymbols, column, vector


def lettered_motion(chain: ChainRule, motion: Motion, s: SceneSymbols) -> Motion:
    """The motion with letters of `chain` for its entries; itself where these hold h alone."""
    more = motion.left - motion.right
    entries = dict.fromkeys([*motion.slope, *motion.right, *more])
    values = [e for e in entries if e.free_symbols - set(s.q)]
    assert symbols_of(values) <= {*s.q, *s.x, *s.u}, "z belongs into the anchor of a motion"
    if not values:
        return motion
    block = Block(vector(f"d{len(chain.blocks)}", len(values)), column(values))
    swap = dict(zip(values, chain.add(block), strict=True))
    slope, right, more = (
        m.applyfunc(lambda e: swap.get(e, e)) for m in (motion.slope, motion.right, more)
    )
    return Motion(motion.anchor, slope, right, right + more)


def gradient_along(
    chain: ChainRule, point: Block, gradient: Column, name: str, forced: bool
) -> Column:
    """Letters for the gradient at a point along the k columns of its anchor, k×1; zeros stay.

    Where a force acts, what is given need be no gradient, and its derivative not symmetric.
    """
    assert point.motion is not None
    values = times(point.motion.anchor.T, gradient)
    block = Block(vector(name, len(values)), values, summed=True, frame=point.frame)
    if point.frame is not None and not forced:
        block.commutators = _commutators(point, gradient, block.letters)
    letters = chain.add(block)
    return column(e if value else 0 * e for e, value in zip(letters, values, strict=True))


def _commutators(point: Block, gradient: Column, along: Column) -> SymbolicMatrix:
    """⟨gradient, [A_a, A_i]⟩ in row i, column a < i, for the columns A of a point's anchor, k×k.

    along: letters of ⟨gradient, A_i⟩, of which those of an algebra are multiples.
    """
    assert point.motion is not None
    anchor, k = point.motion.anchor, point.motion.anchor.cols
    columns = [list(anchor.col(i)) for i in range(k)]
    derivatives = [slopes(c, point.letters) for c in columns]
    moved = [dict(zip(point.letters, c, strict=True)) for c in columns]
    result = sympy.zeros(k)
    for a, i in itertools.combinations(range(k), 2):
        field = [
            sympy.Add(*(e * moved[a][z] for z, e in ahead.items() if moved[a][z]))
            - sympy.Add(*(e * moved[i][z] for z, e in back.items() if moved[i][z]))
            for ahead, back in zip(derivatives[i], derivatives[a], strict=True)
        ]
        if any(field):
            ratios = (_ratio(field, c) for c in columns)
            found = (r * e for r, e in zip(ratios, along, strict=True) if r is not None)
            result[i, a] = next(found, gradient.dot(column(field)))
    return result


def _ratio(field: Expressions, of: Expressions) -> Expression | None:
    """What a field is of another, where it is a multiple of it."""
    pairs = [(e, f) for e, f in zip(field, of, strict=True) if e or f]
    if not pairs[0][1]:
        return None
    ratio = pairs[0][0] / pairs[0][1]
    return ratio if all(e == ratio * f for e, f in pairs) else None
