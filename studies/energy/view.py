"""The page of energy: how errors are shown."""

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
    "Energy error, relative to the energy that moves (the largest kinetic energy of the motion), "
    "against time: one strip a rule, its smallest and largest error on its left; dashed: zero. "
    "The widest band fills its strip; others are drawn on its scale, or "
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
    if limit is None:
        return pairs(expected)
    return f"no drift: at most {scientific(limit)} per unit of time"


def _edges(measured: dict[str, Any]) -> str:
    return ", ".join(map(scientific, measured.get("edge_slopes") or ())) or NONE


def _band(measured: dict[str, Any]) -> str:
    """Return the band; the verdict is on drift alone, so a band that resolves nothing is marked."""
    band = number(measured.get("band"))
    wide = band is not None and band > RESOLVED and "balance_order" not in measured
    return scientific(band) + (" (too wide to be resolved)" if wide else "")


def _slope(measured: dict[str, Any]) -> str:
    return plus_minus(measured.get("slope"), measured.get("slope_interval"))


def _drift(measured: dict[str, Any]) -> str:
    """Return the drift of the energy to one side; a force's balance has none."""
    return scientific(measured.get("drift")) if "drift" in measured else NONE


def _got(measured: dict[str, Any]) -> str:
    if "balance_order" in measured:
        band, order = scientific(measured.get("band")), number(measured["balance_order"])
        said = "which does not sink with the step" if order is None else f"of order {order:.2f}"
        return f"energy less work is off by {band}, {said}"
    return f"a drift of {_drift(measured)} and an oscillation of {_band(measured)}"


def _short(measured: dict[str, Any]) -> str:
    """Return the oscillation; if the energy drifts by more than a tenth of it, the drift."""
    drift, band = number(measured.get("drift")), number(measured.get("band"))
    if drift is not None and band is not None and not abs(drift) <= RESOLVED * band:
        return f"drifts by {scientific(drift)}"
    return f"oscillates by {_band(measured)}"


def _line(case: Case) -> str:
    """Return the result with the duration of the run: one that seems to drift is made longer."""
    time = number(case.get("duration"))
    return _got(mapping(case, "measured")) + (f", to t = {time:g}" if time is not None else "")


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        return [plot_drift.energy(titles.get(scene, scene), own, known, digits)]

    sheet = plot_drift.ENERGY_SHEET
    return figures_by_precision("energy", "Energy error", ENERGY, cases, sheet, panels)


VIEW = View(
    columns=[
        ("Drift over the run", lambda case: _drift(mapping(case, "measured"))),
        ("Oscillation (band)", lambda case: _band(mapping(case, "measured"))),
        ("Slope", lambda case: _slope(mapping(case, "measured"))),
        ("Slopes of the edges", lambda case: _edges(mapping(case, "measured"))),
    ],
    got=_got, wanted=_wanted,
    short=_short, line=_line,
    sketches=_sketches, compared=lambda case: {"band": case["measured"].get("band")},
)  # fmt: skip
