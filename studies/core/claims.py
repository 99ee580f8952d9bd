"""The verdicts that a method asks for: a method that states claims is judged by these alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from discmech.integrators.rules import Claims, Discretisation

#: a word of keeps= that stands for every momentum map and Casimir of a scene
EVERY = "momentum"
#: words of keeps= for the energy: kept by each step to round-off, and without a drift in long runs
EXACTLY, BAND = "energy", "energy band"
#: the words of keeps= that are no names of a scene's quantities
WORDS = (EXACTLY, BAND, "volume", EVERY)


def not_claimed(rule: Discretisation, what: str) -> str:
    """Return why a property is only measured, a sentence; "" if it is judged.

    what: "symplectic", "reversible", "energy", "volume". A method without stated claims is judged
    by all; a claim to be symplectic includes an energy that stays in its band, and volume, and so
    does one to keep the energy itself.
    """
    claims = rule.claims
    if claims is None:
        return ""
    own: dict[str, Any] = {"symplectic": claims.symplectic, "reversible": claims.reversible}
    kept = what in claims.keeps or (what == EXACTLY and BAND in claims.keeps)
    if own.get(what, kept) or (claims.symplectic and what in ("energy", "volume")):
        return ""
    said = f"to be {what}" if what in own else f"to keep the {what}"
    return f"{rule.name} does not claim {said}: measured only"


def stated(rule: Discretisation) -> dict[str, str]:
    """Return word → "to be symplectic", of each claim of a rule but names of quantities."""
    said = {"order": f"to be of order {rule.order}"} if rule.order else {}
    if rule.effective:
        said["effective"] = f"to be of effective order {rule.effective}"
    claims = rule.claims or Claims()
    own = {"symplectic": claims.symplectic, "reversible": claims.reversible}
    said |= {word: f"to be {word}" for word, claimed in own.items() if claimed}
    kept = [word for word in (EXACTLY, BAND, "volume") if word in claims.keeps]
    return said | {word: f"to keep the {word}" for word in kept}


def keeps_volume(rule: Discretisation) -> bool:
    """Return True if each step is said to keep the volume of phase space, by that word."""
    return rule.claims is not None and "volume" in rule.claims.keeps


def keeps_energy(rule: Discretisation) -> bool:
    """Return True if each step is said to keep the energy.

    A symplectic step that kept it would be the motion itself but for the time (Ge and Marsden), so
    of one that claims both a band is meant.
    """
    claims = rule.claims
    return claims is not None and not claims.symplectic and EXACTLY in claims.keeps


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
        "energy": {"keeps": (*claims.keeps, BAND)},
        "momentum": {"keeps": (*claims.keeps, EVERY)},
    }
    return replace(rule, claims=Claims(**{**vars(claims), **asserted.get(study, {})}))
