"""The page of races: how they are shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import NONE, Case, duration, mapping, number, rows, scientific
from . import plot

WORK = (
    "Error against run time: the median of interleaved rounds, with its quartiles as a bar; hollow "
    "marks had outliers among their samples, which are kept. Rules of this bench have full lines, "
    "other people's integrators dashed ones. A line ends where the error no longer sinks or where "
    "the next run would exceed the budget. Dashed across: the error that rounding the start to "
    "double precision alone makes, the floor for everybody. A method that was timed later, "
    "beside the fastest peers alone, has its curve from that run."
)
FEW = 3  # methods that are named as those of a run; more are counted
LONG_WORK = (
    "The same over many characteristic periods, where the energy is what counts: a method that "
    "is not symplectic pays for time as well as for accuracy."
)


def _span(case: Case) -> str:
    """Return the duration of a race in words."""
    periods, end = case.get("periods"), number(case.get("duration"))
    return f"{periods} periods" if periods else f"T = {end:g}" if end else NONE


def _cost(accuracy: str) -> Callable[[Case], str]:
    """Return a function for the cost of an accuracy, and its ratio to the best peer's cost."""

    def text(case: Case) -> str:
        measured = mapping(case, "measured")
        value = number(mapping(measured, "cost").get(accuracy))
        if value is None:
            return NONE
        timed = measured.get("x") == "seconds"
        ratio = number(mapping(measured, "ratio").get(accuracy))
        words = duration(value) if timed else f"{value:.3g}"
        return words if ratio is None else f"{words} ({ratio:.2g}×)"

    return text


def _best(case: Case) -> str:
    """Return the smallest error, the number and cause of failed settings, and those left out."""
    measured = mapping(case, "measured")
    causes = [str(row["cause"]) for row in rows(case) if row.get("cause")]
    told = [f"{len(causes)} of {len(rows(case))} settings failed: {causes[-1]}"] if causes else []
    told += [f"cut: {measured['cut']}"] if measured.get("cut") else []
    told += _kept(rows(case))
    words = scientific(measured.get("best"))
    return f"{words} ({'; '.join(told)})" if told else words


def _kept(settings: Sequence[Case]) -> list[str]:
    """Return the largest error over the tolerance, for steps chosen for a tolerance."""
    shares = [
        row["error-max"] / row["tolerance"]
        for row in settings
        if "promised" in row and row["error-max"] is not None
    ]
    return [f"error at most {max(shares):.2g} of the tolerance"] if shares else []


def _timed(case: Case) -> str:
    """Return the run of a method: its date, and the methods that it was timed beside."""
    run = mapping(case, "race")
    beside = [name for name in run.get("with") or () if name != case.get("rule")]
    date = str(run.get("date") or NONE).replace("T", " ").removesuffix("+00:00")
    few = len(beside) <= FEW
    return f"{date}, beside {', '.join(beside) if few else f'{len(beside)} others'}"


def _setup(case: Case) -> str:
    """Return the seconds to derive and compile, apart from every run."""
    seconds = number(mapping(case, "measured").get("setup"))
    return NONE if seconds is None else duration(seconds)


def _compared(case: Case) -> dict[str, Any]:
    if case.get("periods") is not None:
        return {}
    costs = case["measured"].get("cost") or {}
    return {"costs": {float(a): seconds for a, seconds in costs.items() if seconds is not None}}


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    found = []
    titled = (("work", "Work and precision"), ("work-long", "Work and precision, long runs"))
    for long, (name, title) in enumerate(titled):
        races: dict[tuple[str, object], list[Case]] = {}
        for case in cases:
            if (case.get("periods") is not None) == long:
                races.setdefault((str(case.get("scene")), case.get("periods")), []).append(case)
        panels = []
        for (scene, periods), own in races.items():
            over = f", {periods} periods" if long else ""
            panels.append(plot.panel(titles.get(scene, scene) + over, own, known))
        found.append(Sketch(name, title, LONG_WORK if long else WORK, panels, plot.SHEET))
    return found


def _line(case: Case) -> str:
    """Return the best of a race, with its duration if that is more than the scene's."""
    periods = case.get("periods")
    return _got(mapping(case, "measured")) + (f" over {periods} periods" if periods else "")


def _got(measured: dict[str, Any]) -> str:
    return f"best {scientific(measured.get('best'))}"


def _wanted(expected: dict[str, Any]) -> str:
    return f"an error that falls with the work, or is ≤ {scientific(expected.get('limit'))}"


VIEW = View(
    columns=[
        ("Over", _span),
        *((f"to {scientific(a)} (× best peer)", _cost(f"{a:.0e}")) for a in (1e-4, 1e-8, 1e-12)),
        ("Best", _best),
        ("Compiling", _setup),
        ("Timed", _timed),
    ],
    got=_got, wanted=_wanted,
    line=_line, sketches=_sketches, compared=_compared,
)  # fmt: skip
