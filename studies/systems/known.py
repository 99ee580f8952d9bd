"""Known facts of the lattices that come with discmech: closed forms, momenta, other sizes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.lattices import Lattice, systems
from discmech.integrators.lattices.linkages import linkage, rods
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
    if `refined` makes the lattice of a spacing. momenta: name → the part of a site, a list of
    expressions of (x, μ, p), x as `on_site` has it. sized: the lattice with about so many sites.
    steps: those of a long run, enough to show slow changes and few enough to end soon.
    """

    exact: Callable[[Lattice, float], Field] | None = None
    momenta: Mapping[str, Callable[[Any, Any, Any], list[Any]]] = field(default_factory=dict)
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


def body_momentum(x: Any, mu: Any, p: Any) -> list[Any]:
    """Return the angular momentum in space of a body on SO(3)."""
    return [*x * mu]


def linear_momentum(x: Any, mu: Any, p: Any) -> list[Any]:
    """Return the linear momentum in space of a body on SE(3)."""
    return [*x[:3, :3] * mu[3:, :]]


def angular_momentum(x: Any, mu: Any, p: Any) -> list[Any]:
    """Return the angular momentum in space of a body on SE(3)."""
    R = x[:3, :3]
    return [*R * mu[:3, :] + x[:3, 3].cross(R * mu[3:, :])]


def about_the_vertical(x: Any, mu: Any, p: Any) -> list[Any]:
    """Return the angular momentum about e₃ through 0 of a mass in space or a body on SE(3)."""
    return [x[0] * mu[1] - x[1] * mu[0]] if len(mu) == 3 else angular_momentum(x, mu, p)[2:]


def _falling(chain: Lattice) -> Lattice:
    """Return a chain with steps of a quarter of the longest that are stable where it hangs.

    Its first link carries all others, and swings at a frequency up to 2√N.
    """
    return replace(chain, step=Fraction(1, 4 * math.isqrt(chain.sites)))


OF_A_BEAM = {"momentum": linear_momentum, "angular momentum": angular_momentum}
OF_A_PENDULUM = {"vertical angular momentum": about_the_vertical}
_KNOWN = {
    # the energy returns to the first mode after a time of some ten thousand
    "fput": Known(sized=lambda N: systems.fput(N, mode=max(1, N // 50)), steps=200_000),
    "toda": Known(_toda, {"total momentum": lambda x, mu, p: [mu[0]]}, steps=200_000),
    "rotors": Known(
        momenta={"total momentum": lambda x, mu, p: [mu[0]]}, sized=systems.rotors, steps=100_000
    ),
    "breather": Known(_on_grid(sine_gordon_breather, 0.6), refined=systems.breather),
    "breather-box": Known(
        _on_grid(sine_gordon_breather, 0.6), refined=lambda a: systems.breather(a, box=True)
    ),
    "kink": Known(_on_grid(sine_gordon_kink, 0.5), refined=systems.kink),
    "membrane": Known(sized=lambda N: systems.membrane(round(N**0.5), round(N**0.5)), steps=4_000),
    "bodies": Known(momenta={"angular momentum": body_momentum}, sized=systems.bodies),
    "beam": Known(momenta=OF_A_BEAM, sized=systems.beam),
    # its energy moves to short waves, and seems to drift in shorter runs
    "spaghetti": Known(momenta=OF_A_BEAM, sized=systems.spaghetti, steps=100_000),
    "rods": Known(momenta=OF_A_PENDULUM, sized=lambda N: _falling(rods(N - 1, 0))),
    "bead-chain": Known(sized=systems.bead_chain),
    # a joint at a point of the axis leaves a link free to spin about that axis
    "links-spherical": Known(
        momenta={**OF_A_PENDULUM, "spin": lambda x, mu, p: [mu[0]]},
        sized=lambda N: _falling(linkage(N - 1, rate=0)),
    ),
    "links-revolute": Known(sized=lambda N: _falling(linkage(N - 1, "revolute", 0))),
}
