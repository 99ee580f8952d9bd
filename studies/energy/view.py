"""How energy errors are shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..report import plot_drift
from ..report.canvas import Panel
from ..report.grouping import figures_by_precision
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import (
    NONE,
    RESOLVED,
    Case,
    mapping,
    number,
    pairs,
    plus_minus,
    scientific,
)

ENERGY = (
    "Relative energy error against time: one strip a rule, its smallest and largest error on "
    "its left; dashed: zero. The widest band fills its strip; others are drawn on its scale, or "
    "magnified by the power of ten that their labels say. Of a long run the space between the "
    "smallest and the largest error of each short stretch is filled. A sound variational "
    "integrator fills a band that neither tilts nor widens; where the energy is kept exactly only "
    "the drift of round-off is left, and the band is a line."
)


def _wanted(expected: dict[str, Any]) -> str:
    if "not_demanded" in expected:
        return "only measured"
    if "balance_order" in expected:
        return f"energy less work: order ≥ {expected['balance_order']}"
    limit = number(expected.get("slope_limit"))
    return pairs(expected) if limit is None else f"slope or both edges ≤ {scientific(limit)}"


def _edges(measured: dict[str, Any]) -> str:
    return ", ".join(map(scientific, measured.get("edge_slopes") or ())) or NONE


def _band(measured: dict[str, Any]) -> str:
    """The band. A verdict is on drift alone: one that resolves nothing is called so beside it."""
    band = number(measured.get("band"))
    wide = band is not None and band > RESOLVED and "balance_order" not in measured
    return scientific(band) + (", unresolved" if wide else "")


def _slope(measured: dict[str, Any]) -> str:
    return plus_minus(measured.get("slope"), measured.get("slope_interval"))


def _got(measured: dict[str, Any]) -> str:
    if "balance_order" in measured:
        band = scientific(measured.get("band"))
        return f"energy less work: {band}, order {measured['balance_order']:.2f}"
    return f"band {_band(measured)}, slope {_slope(measured)}, of the edges {_edges(measured)}"


def _line(case: Case) -> str:
    """With the time that the run came to: one that seems to drift is made longer."""
    time = number(case.get("duration"))
    return _got(mapping(case, "measured")) + (f", to t = {time:g}" if time is not None else "")


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        return [plot_drift.energy(titles.get(scene, scene), own, known, digits)]

    sheet = plot_drift.ENERGY_SHEET
    return figures_by_precision("energy", "Energy error", ENERGY, cases, sheet, panels)


VIEW = View(
    columns=[
        ("Band", lambda case: _band(mapping(case, "measured"))),
        ("Slope", lambda case: _slope(mapping(case, "measured"))),
        ("Slopes of the edges", lambda case: _edges(mapping(case, "measured"))),
    ],
    got=_got, wanted=_wanted,
    short=lambda measured: f"band {_band(measured)}", line=_line,
    sketches=_sketches, compared=lambda case: {"band": case["measured"].get("band")},
)  # fmt: skip
