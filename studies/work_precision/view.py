"""The page of races: how they are shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..core.records import AtMost, grouped
from ..core.result import NONE
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import duration, scientific
from . import plot
from .plot import Case
from .records import Measured, Row

WORK = (
    "Error against run time: the median of interleaved rounds, with its quartiles as a bar; a "
    "stroke at its end means outliers among the samples, which are kept. Rules of this bench have "
    "full lines, other people's integrators dashed ones; hollow marks are runs whose step was "
    "chosen for a tolerance. A line ends where the error no longer sinks, with an arrow where the "
    "budget cut it: more work would give more accuracy there. Rings: the fastest rule and the "
    "fastest other integrator change places. Dashed across: the error that rounding the start to "
    "double precision alone makes, the floor for everybody. A method that was timed later, "
    "beside the fastest peers alone, has its curve from that run."
)
ACCURACIES = (1e-4, 1e-8, 1e-12)
FEW = 3  # methods that are named as those of a run; more are counted
LONG_WORK = (
    "The same over many characteristic periods, where the energy is what counts: a method that "
    "is not symplectic pays for time as well as for accuracy."
)


def _span(case: Case) -> str:
    """Return the duration of a race in words."""
    periods, end = case.details.periods, case.details.duration
    return f"{periods} periods" if periods else f"T = {end:g}" if end else NONE


def _cost(accuracy: str, beside: bool = True) -> Callable[[Case], str]:
    """Return a function for the cost of an accuracy and, `beside` it, its ratio to the best
    peer's."""

    def text(case: Case) -> str:
        measured = case.measured
        value, ratio = measured.cost.get(accuracy), measured.ratio.get(accuracy)
        if value is None:
            return NONE
        words = duration(value) if measured.x == "seconds" else f"{value:.3g}"
        return words if ratio is None or not beside else f"{words} ({ratio:.2g}×)"

    return text


def _best(case: Case) -> str:
    """Return the smallest error, the number and cause of failed settings, and those left out."""
    causes = [row.cause for row in case.rows if row.cause]
    told = [f"{len(causes)} of {len(case.rows)} settings failed: {causes[-1]}"] if causes else []
    told += [f"cut: {case.measured.cut}"] if case.measured.cut else []
    told += _kept(case.rows)
    words = scientific(case.measured.best)
    return f"{words} ({'; '.join(told)})" if told else words


def _kept(settings: Sequence[Row]) -> list[str]:
    """Return the largest error over the tolerance, for steps chosen for a tolerance."""
    shares = [
        error / row.tolerance
        for row in settings
        if row.promised is not None
        and row.tolerance
        and (error := row.along("error-max")) is not None
    ]
    return [f"error at most {max(shares):.2g} of the tolerance"] if shares else []


def _timed(case: Case) -> str:
    """Return the run of a method: its date, and all methods of the run."""
    names = case.details.race.names
    date = (case.details.race.date or NONE).replace("T", " ").removesuffix("+00:00")
    return f"{date}, with {', '.join(names) if len(names) <= FEW else f'{len(names)} methods'}"


def _setup(case: Case) -> str:
    """Return the seconds to derive and compile, apart from every run."""
    seconds = case.measured.setup
    return NONE if seconds is None else duration(seconds)


def _compared(case: Case) -> dict[str, Any]:
    if case.details.periods is not None:
        return {}
    costs = case.figures.get("cost") or {}
    return {"costs": {float(a): seconds for a, seconds in costs.items() if seconds is not None}}


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    sketches = []
    titled = (("work", "Work and precision"), ("work-long", "Work and precision, long runs"))
    for long, (name, title) in enumerate(titled):
        timed = (case for case in cases if (case.details.periods is not None) == long)
        races = grouped(timed, lambda case: (str(case.scene), case.details.periods))
        panels = []
        for (scene, periods), own in races.items():
            over = f", {periods} periods" if long else ""
            panels.append(plot.panel(titles.get(scene, scene) + over, own, known))
        sketches.append(Sketch(name, title, LONG_WORK if long else WORK, panels, plot.SHEET))
    return sketches


def _line(case: Case) -> str:
    """Return the best of a race, with its duration if that is more than the scene's."""
    periods = case.details.periods
    return _got(case) + (f" over {periods} periods" if periods else "")


def _got(case: Case) -> str:
    return f"best {scientific(case.measured.best)}"


def _wanted(case: Case) -> str:
    return f"an error that falls with the work, or is ≤ {scientific(case.expected.limit)}"


VIEW = View(
    measured=Measured, expected=AtMost, row=Row,
    columns=[
        ("Over", _span),
        *((f"to {scientific(a)} (× best peer)", _cost(f"{a:.0e}")) for a in ACCURACIES),
        ("Best", _best),
        ("Compiling", _setup),
        ("Timed", _timed),
    ],
    got=_got, wanted=_wanted,
    paper=[(f"to {scientific(a)}", _cost(f"{a:.0e}", beside=False)) for a in ACCURACIES],
    line=_line, sketches=_sketches, compared=_compared,
)  # fmt: skip
