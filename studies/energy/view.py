"""The page of energy: how errors are shown."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.outcome import OF_DRIFT
from ..core.result import NONE, Result
from ..report import plot_drift
from ..report.canvas import Panel
from ..report.grouping import figures_by_precision
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import RESOLVED, pairs, plus_minus, scientific
from .records import Expected, Measured, Row

Case = Result[Measured, Expected, Row]

ENERGY = (
    "Energy error, relative to the energy that moves (the largest kinetic energy of the motion), "
    "against time: one strip a rule, its smallest and largest error on its left; dashed: zero. "
    "The widest band fills its strip; others are drawn on its scale, or "
    "magnified by the power of ten that their labels say. Of a long run the space between the "
    "smallest and the largest error of each short stretch is filled. A sound variational "
    "integrator fills a band that neither tilts nor widens; where the energy is kept exactly only "
    "the drift of round-off is left, and the band is a line."
)


def _wanted(case: Case) -> str:
    expected = case.expected
    if expected.balance_order is not None:
        return f"energy less work: order ≥ {expected.balance_order}"
    if expected.slope_limit is None:
        return pairs(case.wanted)
    if (duration := case.details.duration) is None:
        return f"no drift: a slope of at most {scientific(expected.slope_limit)} per unit of time"
    return f"no drift: at most {scientific(expected.slope_limit * duration)} over the run"


def _edges(case: Case) -> str:
    return ", ".join(map(scientific, case.measured.edge_slopes or ())) or NONE


def _of_balance(case: Case) -> bool:
    """True if energy less work was measured, also where it does not sink."""
    return "balance_order" in case.figures


def _band(case: Case) -> str:
    """Return the band; the verdict is on drift alone, so a band that resolves nothing is marked."""
    band = case.measured.band
    wide = band is not None and band > RESOLVED and not _of_balance(case)
    return scientific(band) + (" (too wide to be resolved)" if wide else "")


def _slope(case: Case) -> str:
    return plus_minus(case.measured.slope, case.measured.slope_interval)


def _drift(case: Case) -> str:
    """Return the drift of the energy to one side; a force's balance has none."""
    return scientific(case.measured.drift)


def _end(case: Case) -> str:
    """Return the time of the end of the run, or a dash."""
    return NONE if case.details.duration is None else f"{case.details.duration:g}"


def _wanders(case: Case) -> float | None:
    """Return how far the edges of the band rise at most, if that is why a drift passes; or None."""
    measured, limit, duration = case.measured, case.expected.slope_limit, case.details.duration
    edges, drift = measured.edge_slopes, measured.drift
    if case.verdict != "pass" or not edges or limit is None or drift is None or not duration:
        return None
    most = max(map(abs, edges))
    return most * duration if most <= limit < abs(drift) / duration else None


def _got(case: Case) -> str:
    if _of_balance(case):
        order = case.measured.balance_order
        said = "which does not sink with the step" if order is None else f"of order {order:.2f}"
        return f"energy less work is off by {scientific(case.measured.band)}, {said}"
    said = f"a drift of {_drift(case)} and an oscillation of {_band(case)}"
    if (edges := _wanders(case)) is None:
        return said
    return f"{said}, whose edges rise by at most {scientific(edges)}: its mean wanders between them"


def _drifts(case: Case) -> bool:
    drift, band = case.measured.drift, case.measured.band
    if drift is None or band is None or _wanders(case) is not None:
        return case.why == OF_DRIFT and drift is not None
    return case.why == OF_DRIFT or not abs(drift) <= RESOLVED * band


def _short(case: Case) -> str:
    """Return the oscillation; the drift if it decides, or is more than a tenth of that."""
    if _drifts(case):
        return f"drifts by {_drift(case)}"
    return f"{'less its work, ' * _of_balance(case)}oscillates by {_band(case)}"


def _line(case: Case) -> str:
    """Return the result with the duration of the run: one that seems to drift is made longer."""
    end = case.details.duration
    return _got(case) + (f", to t = {end:g}" if end is not None else "")


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        return [plot_drift.energy(titles.get(scene, scene), own, known, digits, _drifts)]

    sheet = plot_drift.ENERGY_SHEET
    return figures_by_precision("energy", "Energy error", ENERGY, cases, sheet, panels)


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Drift over the run", _drift), ("Oscillation (band)", _band), ("Slope", _slope),
        ("Slopes of the edges", _edges), ("To t", _end),
    ],
    got=_got, wanted=_wanted, short=_short, line=_line,
    sketches=_sketches, compared=lambda case: {"band": case.figures.get("band")},
)  # fmt: skip
