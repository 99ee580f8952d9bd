"""Known facts of the lattices that come with discmech: closed forms, momenta, other sizes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.extensions.lattices import Lattice
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.scenes.linkages import linkage, rods
from discmech.reference.closed_forms.lattice_waves import (
    Field,
    sine_gordon_breather,
    sine_gordon_kink,
    toda_solitons,
)

from ..core.parts import is_built_in

SPACING = Fraction(1, 8)  # spacing of a field's coarsest grid


@dataclass(frozen=True)
class Known:
    """Known facts of a lattice.

    exact: (x, v) of its sites at a time, each (N,), in closed form: of the lattice, or of the field
    if `refined` makes the lattice of a spacing. sized: the lattice with about so many sites.
    steps: those of a long run, enough to show slow changes and few enough to end soon.
    """

    exact: Callable[[Lattice, float], Field] | None = None
    refined: Callable[[Fraction], Lattice] | None = None
    sized: Callable[[int], Lattice] | None = None
    steps: int = 10_000


def known_of(lattice: Lattice) -> Known:
    """Return the known facts of a lattice; a user's own has none."""
    return _KNOWN[lattice.name] if lattice.name in _KNOWN and is_built_in(lattice) else Known()


def _toda(lattice: Lattice, t: float) -> Field:
    return toda_solitons(np.arange(float(lattice.sites)), t, [1.0], [24.0])


def _on_grid(wave: Callable[[np.ndarray, float, float], Field], parameter: float) -> Any:
    return lambda lattice, t: wave(np.linspace(-20, 20, lattice.sites), t, parameter)


def _falling(chain: Lattice) -> Lattice:
    """Return a chain with steps of a quarter of the longest that are stable where it hangs.

    Its first link carries all others, and swings at a frequency up to 2√N.
    """
    return replace(chain, step=Fraction(1, 4 * math.isqrt(chain.sites)))


_KNOWN = {
    # the energy returns to the first mode after a time of some ten thousand
    "fput": Known(sized=lambda N: systems.fput(N, mode=max(1, N // 50)), steps=200_000),
    "toda": Known(_toda, steps=200_000),
    "rotors": Known(sized=systems.rotors, steps=100_000),
    "breather": Known(_on_grid(sine_gordon_breather, 0.6), refined=systems.breather),
    "breather-box": Known(
        _on_grid(sine_gordon_breather, 0.6), refined=lambda a: systems.breather(a, box=True)
    ),
    "kink": Known(_on_grid(sine_gordon_kink, 0.5), refined=systems.kink),
    "membrane": Known(sized=lambda N: systems.membrane(round(N**0.5), round(N**0.5)), steps=4_000),
    "bodies": Known(sized=systems.bodies),
    "beam": Known(sized=systems.beam),
    # its energy moves to short waves, and seems to drift in shorter runs
    "spaghetti": Known(sized=systems.spaghetti, steps=100_000),
    "rods": Known(sized=lambda N: _falling(rods(N - 1, 0))),
    "bead-chain": Known(sized=systems.bead_chain),
    "cradle": Known(),
    "links-spherical": Known(sized=lambda N: _falling(linkage(N - 1, rate=0))),
    "links-revolute": Known(sized=lambda N: _falling(linkage(N - 1, "revolute", 0))),
}
