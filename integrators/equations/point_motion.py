"""How a point of the straight step moves, in letters: its derivatives are not written out."""

from __future__ import annotations

from ..groupoids import Motion
from ..numbers import symbols_of
from .chain_rule import Block, ChainRule, partials
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
    block.partials = partials(block.values, [s.x, s.u])
    swap = dict(zip(values, chain.add(block), strict=True))
    slope, right, more = (
        m.applyfunc(lambda e: swap.get(e, e)) for m in (motion.slope, motion.right, more)
    )
    return Motion(motion.anchor, slope, right, right + more)
