"""The verdicts that a method asks for: a method that states claims is judged by these alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from discmech.integrators.rules import Claims, Discretisation

#: a word of keeps= that stands for every momentum map and Casimir of a scene
EVERY = "momentum"


def not_claimed(rule: Discretisation, what: str) -> str:
    """Return why a property is only measured, a sentence; "" if it is judged.

    what: "symplectic", "reversible", "energy", "volume". A method without stated claims is judged
    by all; a claim to be symplectic includes an energy that stays in its band, and volume.
    """
    claims = rule.claims
    if claims is None:
        return ""
    own: dict[str, Any] = {"symplectic": claims.symplectic, "reversible": claims.reversible}
    if own.get(what, what in claims.keeps) or (claims.symplectic and what in ("energy", "volume")):
        return ""
    said = f"to be {what}" if what in own else f"to keep the {what}"
    return f"{rule.name} does not claim {said}: measured only"


def claimed_names(rule: Discretisation, names: Iterable[str]) -> list[str]:
    """Return the names of those quantities that are judged."""
    claims = rule.claims
    if claims is None or EVERY in claims.keeps:
        return list(names)
    return [name for name in names if name in claims.keeps]


def claiming(rule: Discretisation, study: str) -> Discretisation:
    """Return the rule with the claim that a study judges, for an assertion of it."""
    claims = rule.claims
    if claims is None:
        return rule
    asserted: dict[str, dict[str, Any]] = {
        "symplecticity": {"symplectic": True},
        "reversibility": {"reversible": True},
        "energy": {"keeps": (*claims.keeps, "energy")},
        "momentum": {"keeps": (*claims.keeps, EVERY)},
    }
    return replace(rule, claims=Claims(**{**vars(claims), **asserted.get(study, {})}))
