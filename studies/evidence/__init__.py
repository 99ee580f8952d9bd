"""Evidence from single steps of a rule on a scene, from places that no method can know beforehand.

A run may hide the faults of a step: at its final time, on its symmetry planes, at t = 0, at steps
h·2⁻ᵏ. So every study combines its long run with this evidence: a pass needs both, and a fail names
the one that failed. The evidence is computed once for all studies, at 50 digits.
"""

from __future__ import annotations

import math
import random
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import Scheme
from discmech.integrators.groupoids import LieGroup
from discmech.integrators.numbers import mpmath
from discmech.integrators.rules import Discretisation

from ..core.case import scheme_of
from ..core.single_steps import Departure, EffectiveOrder, Floats
from .around import states_that_stand_out
from .effective import effective_order_of
from .floats import floats_of
from .grid import Floor, Grid
from .laws import Law, worst_departure
from .of_programs import order_of
from .order import GUARD, NEAR, LocalOrder, StepError, digits_for, step_errors, unknown
from .places import Place, is_linear, places_along, places_at, places_of, places_on, seed_of
from .scan import times_that_stand_out

__all__ = [
    "NEAR", "Evidence", "Floor", "Grid", "LocalOrder", "Place", "evidence_of",
]  # fmt: skip


class Evidence:
    """The evidence of one scheme; each part is computed when it is first asked for.

    seed: the seed from which places, times and steps are drawn; it follows from the content of
    scene and rule. Raises `ReferenceFailure` for a scene without continuous equations.
    """

    def __init__(self, scheme: Scheme) -> None:
        self.scheme = scheme
        self.seed = seed_of(scheme)
        self._departures: dict[Law, Departure] = {}

    @cached_property
    def places(self) -> list[Place]:
        """Return states on the motion and beside it, each with a time and a step.

        And those parts of the motion where a run of the rule is not smooth (`scan`), and of many
        states around it those from which short steps miss the order (`around`).
        """
        return self._places_of(self.scheme)

    def _places_of(self, scheme: Scheme) -> list[Place]:
        drawn = places_of(scheme, self.seed)
        drawn += places_at(scheme, times_that_stand_out(scheme)[0])
        return drawn + states_that_stand_out(scheme)[0]

    @cached_property
    def _places_of_whole(self) -> list[Place]:
        return self.places if self.whole is self.scheme else self._places_of(self.whole)

    @property
    def unscanned(self) -> str:
        """Return why no run looked for narrow parts of the motion; "" if one did."""
        return times_that_stand_out(self.scheme)[1]

    @property
    def around(self) -> tuple[int, tuple[float, ...]]:
        """Return from how many states around the motion short steps were made, and of which sizes.

        These are the least and the largest over the scene's step.
        """
        return states_that_stand_out(self.whole)[1:]

    @cached_property
    def whole(self) -> Scheme:
        """The scheme whose state is all that moves: on a group without a base also the attitude.

        A rule of a changed Lagrangian may move μ rightly, and turn the body wrongly.
        """
        scene, rule = self.scheme.scene, self.scheme.rule
        derived = rule.asks_lagrangian and scene.discrete_lagrangian is None
        if not (derived and isinstance(scene.groupoid, LieGroup)):
            return self.scheme
        return scheme_of(scene.with_attitude(), rule)

    @cached_property
    def order(self) -> LocalOrder:
        """Return the lowest order that a small step shows; without one, it holds the reason."""
        try:
            along = places_along(self.whole, self.seed)
            local = order_of(self.whole, self._places_of_whole, self.seed, along)
            return local if self.whole is self.scheme else _named(local)
        except reference.ReferenceFailure as failure:
            return unknown(" ".join(str(failure).split()))

    @cached_property
    def on_motion(self) -> LocalOrder:
        """Return the lowest order of a small step from states of the motion alone (`order`)."""
        try:
            return order_of(self.whole, places_on(self.whole, self.seed), self.seed, ())
        except reference.ReferenceFailure as failure:
            return unknown(" ".join(str(failure).split()))

    @cached_property
    def effective(self) -> EffectiveOrder:
        """Return the judgement whether the rule has the effective order that it declares."""
        return effective_order_of(self.scheme, self.places)

    def floats(self, wanted: float) -> tuple[Floats, LocalOrder | None]:
        """Return whether the rule's floats explain an order below the wanted one; `floats_of`."""
        floats, lower = floats_of(self, wanted)
        return floats, lower and (lower if self.whole is self.scheme else _named(lower))

    def with_rule(self, rule: Discretisation) -> Any:
        """Return the scheme of `whole` by another rule."""
        return Scheme(self.whole.scene, rule)

    def errors(self, place: Any, step: Fraction) -> list[StepError]:
        """Return the errors of a step of `whole` from a place, in all components."""
        whole, digits = self.whole, digits_for(self.whole.order or 2)
        around = reference.surroundings(whole.scene)
        (exact,) = around.after(place.x, place.u, place.t, [step], digits + GUARD)
        return step_errors(whole, place, whole.flow(step, digits), exact)

    @cached_property
    def linear(self) -> bool:
        """True if the continuous equations are linear, so that few order conditions count."""
        return not self.scheme.scene.in_numbers and is_linear(self.scheme.s)

    def departure(self, law: Law) -> Departure:
        """Return the largest departure of ordinary steps from a law, over the places.

        It is measured once for a law.
        """
        if law not in self._departures:
            drawn = random.Random(f"{self.seed} {law.name}")
            scheme, places = self.scheme, self.places
            if law.of_attitude:
                scheme, places = self.whole, self._places_of_whole
            places = places + (places_along(scheme, self.seed) if law.along else [])
            self._departures[law] = worst_departure(law, scheme, places, drawn)
        return self._departures[law]

    def rate(self, expected: int) -> float | None:
        """Return c of the errors c h^p per unit of time, relative to the state, p as expected.

        It comes from the components of that order at the places; None without any.
        """
        worst = 0.0
        for c in self.order.components:
            if c.order is not None and c.constant and abs(c.order - expected) <= NEAR:
                with mpmath.workdps(20):
                    size = mpmath.norm([*np.ravel(c.place.x), *np.ravel(c.place.mu)], 2)
                    worst = max(worst, float(c.constant / size)) if size else worst
        return worst or None


def _named(local: LocalOrder) -> LocalOrder:
    """Return the order with an entry of the attitude named so: it is x, row by row."""
    if not local.component.startswith("x"):
        return local
    size = math.isqrt(len(local.place.x)) if local.place else 1
    row, column = divmod(int(local.component[2:-1]), size)
    return replace(local, component=f"the attitude [{row}, {column}]")


@lru_cache(maxsize=256)
def evidence_of(scheme: Any) -> Evidence:
    """Return the evidence of a scheme, one object for all studies."""
    if not hasattr(scheme, "lattice"):
        return Evidence(scheme)
    from .of_lattices import LatticeEvidence

    return LatticeEvidence(scheme)
