"""Evidence from single steps of a rule on a scene, from places that no method can know beforehand.

A run may hide the faults of a step: at its final time, on its symmetry planes, at t = 0, at steps
h·2⁻ᵏ. So every study combines its long run with this evidence: a pass needs both, and a fail names
the one that failed. The evidence is computed once for all studies, at 50 digits.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

from discmech import reference
from discmech.integrators import Scheme

from .effective import EffectiveOrder, effective_order_of
from .floats import Floats, floats_of
from .form import FormEvidence, form_of
from .order import NEAR, LocalOrder, of_scheme, unknown
from .places import Place, is_linear, places_along, places_of, seed_of

__all__ = [
    "NEAR", "EffectiveOrder", "Evidence", "Floats", "FormEvidence", "LocalOrder", "Place",
    "evidence_of",
]  # fmt: skip


class Evidence:
    """The evidence of one scheme; each part is computed when it is first asked for.

    seed: the seed from which places, times and steps are drawn; it follows from the content of
    scene and rule. Raises `ReferenceFailure` for a scene without continuous equations.
    """

    def __init__(self, scheme: Scheme) -> None:
        self.scheme = scheme
        self.seed = seed_of(scheme)

    @cached_property
    def places(self) -> list[Place]:
        """Return states on the motion and beside it, each with a time and a step."""
        return places_of(self.scheme, self.seed)

    @cached_property
    def order(self) -> LocalOrder:
        """Return the lowest order that a small step shows; without one, it holds the reason."""
        try:
            along = places_along(self.scheme, self.seed)
            return of_scheme(self.scheme, self.places, self.seed, along)
        except reference.ReferenceFailure as failure:
            return unknown(" ".join(str(failure).split()))

    @cached_property
    def effective(self) -> EffectiveOrder:
        """Return the judgement whether the rule has the effective order that it declares."""
        return effective_order_of(self.scheme, self.places)

    def floats(self, wanted: float) -> Floats:
        """Return whether the rule's floats explain an order below the wanted one, and how."""
        return floats_of(self.scheme, self.order, wanted)

    @cached_property
    def linear(self) -> bool:
        """True if the continuous equations are linear, so that few order conditions count."""
        return is_linear(self.scheme.s)

    @cached_property
    def form(self) -> FormEvidence:
        """Return the defects of the form over the places, of ordinary steps."""
        return form_of(self.scheme, self.places, self.seed)


@lru_cache(maxsize=256)
def evidence_of(scheme: Scheme) -> Evidence:
    """Return the evidence of a scheme, one object for all studies."""
    return Evidence(scheme)
