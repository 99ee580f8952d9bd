"""The page of stability: how intervals and maps are shown."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from ..core.result import NONE
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from . import plot_linear, plot_maps
from .plot_maps import Case
from .records import FARTHEST, FARTHEST_OWN, Expected, Measured, Row, percent

TOLD = 3  # how many gaps are printed
LINEAR = (
    "The exact step of each rule on the harmonic oscillator. Left: its spectral radius; a "
    "symplectic step is stable while it is one, to the number beside the rule (a root of its "
    "trace, which is a rational function), and controls leave the circle at once. Right: the "
    "phase of a step while it is stable, beside the exact one (dotted); where it is a third or a "
    "quarter of a turn, nonlinear terms may resonate."
)
MAPS = (
    "What becomes of runs at each step size (across, times the fastest frequency) and each "
    "stiffness (upwards). Bounded: none of the others. Resonant: the energy band is over four "
    "times that at steps a tenth of a decade to both sides. Drifting: the energy's mean moves by "
    "more than half its band and a hundredth of its terms, also in a run eight times as long. "
    "Escaped: x leaves the region of the true motion by ten times its size. Newton failed: the "
    "equations of a step were not solved. Blown up: the energy error exceeds the energy's terms at "
    "the start, or the numbers are no longer finite."
)
SPRINGS = (
    "Fermi–Pasta–Ulam chain. Left: how far the energies of the three stiff springs, as running "
    "means, are from their true exchange; a run may be stable and still hand the energy on at "
    "the wrong pace. Middle: the same for stiffer springs, which take longer. Right: how far the "
    "springs' whole energy, an adiabatic invariant, moves over long times at a step of ten fast "
    "radians; dashed: 15 %. imex keeps it from ω = 100 on."
)


def _wanted(case: Case) -> str:
    expected = case.expected
    if expected.bounded_up_to is not None:
        loose, count = expected.escapes_not_judged, expected.of
        but = f"; escapes and resonances not judged in {loose} of {count} cells" if loose else ""
        return f"bounded at every hω tried up to {expected.bounded_up_to:.3g}{but}"
    if expected.bounded is not None:
        return "no bounded run"
    return "off the unit circle" if expected.off_circle else "as runs say, and symplectic"


def _got(case: Case) -> str:
    if not case.figures:
        return NONE
    return _got_linear(case.measured) if case.measured.classes is None else _got_map(case.measured)


def _got_linear(measured: Measured) -> str:
    if measured.off_circle is not None:
        return f"leaves the unit circle at hω = {measured.off_circle:g}"
    end = measured.stable_to
    to = f"at every hω up to {FARTHEST:g}" if end is None else f"to hω = {end:.6f}"
    gaps = [f"{a:.5g} to {b:.5g}" for a, b in measured.gaps]
    but = "; but with a slow force of a thousandth not at " + ", ".join(gaps[:TOLD])
    on_grid = "" if measured.proved else ", on a grid"
    return f"stable {to}{on_grid}{but if gaps else ''}"


def _got_map(measured: Measured) -> str:
    said = [", ".join(f"{count} {name}" for name, count in (measured.classes or {}).items())]
    if measured.equilibrium is not None:
        largest = max(1.0, *map(abs, measured.equilibrium))  # a smaller entry is round-off
        at = ", ".join(f"{e if abs(e) > 1e-12 * largest else 0:.4g}" for e in measured.equilibrium)
        end = measured.stable_to
        to = (f"at every hω tried, up to {FARTHEST_OWN:g}, where the search ended"
              if end is None else f"to hω = {end:.4f}")  # fmt: skip
        said.insert(0, f"at the equilibrium (x, μ) = ({at}), ω = {measured.frequency:.4g}, "
                       f"linearly stable {to}")  # fmt: skip
    ends = [end for end in (measured.limits or {}).values() if end is not None]
    if ends:
        low, high = min(ends), max(ends)
        span = f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
        said.append(f"bounded at every hω tried up to {span}")
    said += [f"{name} at hω = {z}" for z, name in (measured.between or {}).items()]
    for pairs, at, words in ((measured.exchange, "hω", "exchange wrong by"),
                             (measured.stiffer, "ω", "at hω = 5 wrong by"),
                             (measured.adiabatic, "ω", "invariant moves by")):  # fmt: skip
        if pairs:
            told = (f"{'failed' if v is None else percent(v)} ({at} = {k})"
                    for k, v in pairs.items())  # fmt: skip
            said.append(f"{words} {', '.join(told)}")
    return "; ".join(said)


def _short(case: Case) -> str:
    measured = case.measured
    if measured.off_circle is not None:
        return "not on the unit circle"
    if measured.classes is None and "stable_to" in case.figures and measured.stable_to is None:
        return f"at every hω up to {FARTHEST:g}"
    if classes := measured.classes:  # no single cell decides
        share = classes.get("bounded", 0) / (sum(classes.values()) or 1)
        return f"the motion stays bounded in {share:.0%} of the cells"
    return "at no hω" if measured.stable_to is None else f"to hω = {measured.stable_to:.3g}"


def _compared(case: Case) -> dict[str, Any]:
    """Return the oscillator's end by bisection, or the bounded share of a map, for comparisons.

    An edge of that share lies anywhere between two cells in step: half a cell each is uncertain. A
    method that leaves the unit circle has no interval.
    """
    measured = case.measured
    if measured.off_circle is not None:
        return {}
    if case.details.kind == "linear" and case.figures:
        return {"stable": FARTHEST if measured.stable_to is None else measured.stable_to}
    limits = [end for end in (measured.limits or {}).values() if end is not None]
    if not limits:
        return {}
    bounded = [(row.stiffness, row.outcome == "bounded") for row in case.rows if not row.between]
    edges = sum(a[0] == b[0] and a[1] != b[1] for a, b in itertools.pairwise(bounded))
    return {
        "stable": min(limits),
        "bounded": sum(inside for _, inside in bounded) / len(bounded),
        "bounded_spread": edges / 2 / len(bounded),
    }


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    linear = [case for case in cases if case.details.kind == "linear"]
    maps = [case for case in cases if case.details.kind == "map"]
    stiff = [case for case in maps if case.measured.exchange]
    panels, sheet = plot_maps.map_table(maps, titles)
    if panels:
        panels, sheet = plot_maps.with_legend(panels, sheet, maps)
    return [
        Sketch(
            "stability-linear", "Linear stability", LINEAR,
            [plot_linear.radius(linear, known), plot_linear.phase(linear, known)]
            if linear else [], plot_linear.LINEAR_SHEET,
        ),
        Sketch("stability-maps", "Stability maps", MAPS,
               panels, sheet),
        Sketch(
            "stability-fpu", "The stiff springs of fpu", SPRINGS,
            [plot_linear.springs(key, stiff, known) for key in plot_linear.SPRINGS]
            if stiff else [], plot_linear.EXCHANGE_SHEET,
        ),
    ]  # fmt: skip


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Part", lambda case: case.details.kind or NONE), ("Got", _got),
    ],
    got=_got, wanted=_wanted, short=_short, sketches=_sketches, compared=_compared,
)  # fmt: skip
