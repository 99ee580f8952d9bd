"""The page of contact: how measurements are shown."""

from __future__ import annotations

from typing import Any

from ..report.view import View
from ..report.wording import NONE, Case, mapping, scientific

MODES = ("stepped", "located")


def _worst(measured: dict[str, Any], name: str) -> Any:
    """Return the larger number of both modes, or of a control."""
    found = [mapping(measured, mode).get(name) for mode in MODES] + [measured.get(name)]
    return max((e for e in found if isinstance(e, (int, float))), default=None)


def _column(name: str, head: str) -> Any:
    return head, lambda case: scientific(_worst(mapping(case, "measured"), name))


def _got(measured: dict[str, Any]) -> str:
    names = ("penetration", "pull", "slip", "impact_energy", "jump")
    said = [f"{k.replace('_', ' ')} {scientific(_worst(measured, k))}" for k in names]
    if measured.get("order") is not None:
        said.append(f"impacts of order {measured['order']:.2f}")
    return ", ".join(said)


def _impacts(case: Case) -> str:
    counts = [mapping(mapping(case, "measured"), mode).get("impacts") for mode in MODES]
    return ", ".join(str(e) for e in counts if e is not None) or NONE


VIEW = View(
    columns=[
        ("Impacts, stepped and located", _impacts), _column("penetration", "Penetration"),
        _column("cone", "Cone"), _column("impact_energy", "Energy of impacts"),
        _column("jump", "Momentum of impacts"),
    ],
    got=_got, wanted=lambda expected: f"≤ {scientific(expected.get('limit'))}",
)  # fmt: skip
