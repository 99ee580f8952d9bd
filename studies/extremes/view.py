"""The page of extremes: how runs at the edge of a scene are shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..report.view import View
from ..report.wording import NONE, mapping, number, scientific

#: the words for an outcome of the data
WORDS = {"wrong, noticed": "wrong, and it shows", "wrong, silent": "wrong, and nothing shows it"}
SHOWS = {"smaller steps": "smaller steps end elsewhere", "energy": "the energy is off"}


def outcome(found: Mapping[str, Any]) -> str:
    """Return the outcome of a run at an extreme, and the sign of its failure."""
    said = _said(found)
    if number(found.get("error")) is not None:
        said += f", error {scientific(found['error'])}"
    if found.get("noticed") not in (None, "", "nothing") and not found.get("message"):
        said += f" ({SHOWS.get(str(found['noticed']), found['noticed'])})"
    return f"{said}: {found['message']}" if found.get("message") else said


def _said(found: Mapping[str, Any]) -> str:
    word = str(found.get("outcome") or NONE)
    return WORDS.get(word, word)


def _outcomes(measured: dict[str, Any]) -> str:
    return "; ".join(f"{part}: {outcome(measured[part])}" for part in measured)


def _short(measured: dict[str, Any]) -> str:
    """Return a short outcome such as "short steps: right; long steps: wrong, and it shows"."""
    steps = {"fine": "short steps", "coarse": "long steps"}
    return "; ".join(f"{steps.get(k, k)}: {_said(found)}" for k, found in measured.items())


VIEW = View(
    columns=[
        ("Extreme", lambda case: str(case.get("extreme") or NONE)),
        ("hω = 1/10", lambda case: outcome(mapping(mapping(case, "measured"), "fine"))),
        ("hω = 5", lambda case: outcome(mapping(mapping(case, "measured"), "coarse"))),
    ],
    got=_outcomes, wanted=lambda expected: "no wrong result without a sign", short=_short,
    line=lambda case: f"{case['extreme']}: {_short(mapping(case, 'measured'))}",
)  # fmt: skip
