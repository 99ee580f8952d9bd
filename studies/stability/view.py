"""The page of stability: how intervals and maps are shown."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import NONE, Case, mapping, number
from . import plot_linear, plot_maps

FARTHEST = 1000.0  # largest hω of the linear part
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


def _wanted(expected: dict[str, Any]) -> str:
    if "bounded_up_to" in expected:
        loose, count = expected.get("escapes_not_judged"), expected.get("of")
        but = f"; escapes and resonances not judged in {loose} of {count} cells" if loose else ""
        return f"bounded at every hω tried up to {expected['bounded_up_to']:.3g}{but}"
    if "bounded" in expected:
        return "no bounded run"
    return "off the unit circle" if expected.get("off_circle") else "as runs say, and symplectic"


def _got(measured: dict[str, Any]) -> str:
    if "classes" not in measured:
        off, end = number(measured.get("off_circle")), number(measured.get("stable_to"))
        if off is not None:
            return f"leaves the unit circle at hω = {off:g}"
        to = f"at every hω up to {FARTHEST:g}" if end is None else f"to hω = {end:.6f}"
        gaps = [f"{a:.5g} to {b:.5g}" for a, b in measured.get("gaps") or ()]
        but = "; but with a slow force of a thousandth not at " + ", ".join(gaps[:TOLD])
        on_grid = "" if measured.get("proved", True) else ", on a grid"
        return f"stable {to}{on_grid}{but if gaps else ''}"
    said = [", ".join(f"{count} {name}" for name, count in measured["classes"].items())]
    if "equilibrium" in measured:
        largest = max(1.0, *map(abs, measured["equilibrium"]))  # a smaller entry is round-off
        at = ", ".join(
            f"{e if abs(e) > 1e-12 * largest else 0:.4g}" for e in measured["equilibrium"]
        )
        end = number(measured.get("stable_to"))
        to = "up to hω = 6" if end is None else f"to hω = {end:.4f}"
        said.insert(0, f"at the equilibrium (x, μ) = ({at}), ω = {measured['frequency']:.4g}, "
                       f"linearly stable {to}")  # fmt: skip
    ends = [e for e in map(number, (measured.get("limits") or {}).values()) if e is not None]
    if ends:
        low, high = min(ends), max(ends)
        span = f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
        said.append(f"bounded at every hω tried up to {span}")
    said += [f"{name} at hω = {z}" for z, name in (measured.get("between") or {}).items()]
    for name, words in (("exchange", "exchange wrong by"), ("stiffer", "at hω = 5 wrong by"),
                        ("adiabatic", "invariant moves by")):  # fmt: skip
        pairs = (measured.get(name) or {}).items()
        if pairs:
            at = "hω" if name == "exchange" else "ω"
            said.append(f"{words} " + ", ".join(f"{_share(v)} ({at} = {k})" for k, v in pairs))
    return "; ".join(said)


def _share(value: Any) -> str:
    """Return a share as `exchange.percent` does, or "failed"."""
    found = number(value)
    if found is None:
        return "failed"
    return f"{100 * found:.2g} %" if found < 0.1 else f"{100 * found:.0f} %"


def _short(measured: dict[str, Any]) -> str:
    if measured.get("off_circle") is not None:
        return "not on the unit circle"
    if "stable_to" in measured and measured["stable_to"] is None:
        return "at every hω"
    if classes := mapping(measured, "classes"):  # no single cell decides
        share = classes.get("bounded", 0) / (sum(classes.values()) or 1)
        return f"the motion stays bounded in {share:.0%} of the cells"
    end = number(measured.get("stable_to"))
    return "at no hω" if end is None else f"to hω = {end:.3g}"


def _compared(case: Case) -> dict[str, Any]:
    """Return the oscillator's end by bisection, or the bounded share of a map, for comparisons.

    An edge of that share lies anywhere between two cells in step: half a cell each is uncertain. A
    method that leaves the unit circle has no interval.
    """
    if case["measured"].get("off_circle") is not None:
        return {}
    if case.get("kind") == "linear" and case["measured"]:
        end = case["measured"]["stable_to"]
        return {"stable": FARTHEST if end is None else end}
    limits = [v for v in (case["measured"].get("limits") or {}).values() if v is not None]
    if not limits:
        return {}
    rows = [row for row in case["rows"] if not row.get("between")]
    bounded = [(row["stiffness"], row["class"] == "bounded") for row in rows]
    edges = sum(a[0] == b[0] and a[1] != b[1] for a, b in itertools.pairwise(bounded))
    return {
        "stable": min(limits),
        "bounded": sum(inside for _, inside in bounded) / len(bounded),
        "bounded_spread": edges / 2 / len(bounded),
    }


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    linear = [case for case in cases if case.get("kind") == "linear"]
    maps = [case for case in cases if case.get("kind") == "map"]
    stiff = [case for case in maps if mapping(case, "measured").get("exchange")]
    panels, sheet = plot_maps.map_table(maps, titles)
    return [
        Sketch(
            "stability-linear", "Linear stability", LINEAR,
            [plot_linear.radius(linear, known), plot_linear.phase(linear, known)]
            if linear else [], plot_linear.LINEAR_SHEET,
        ),
        Sketch("stability-maps", "Stability maps", MAPS,
               [*panels, plot_maps.legend(maps)] if panels else [], sheet),
        Sketch(
            "stability-fpu", "The stiff springs of fpu", SPRINGS,
            [plot_linear.springs(key, stiff, known) for key in plot_linear.SPRINGS]
            if stiff else [], plot_linear.EXCHANGE_SHEET,
        ),
    ]  # fmt: skip


VIEW = View(
    columns=[
        ("Part", lambda case: str(case.get("kind") or NONE)),
        ("Got", lambda case: _got(mapping(case, "measured")) if case.get("measured") else NONE),
    ],
    got=_got, wanted=_wanted, short=_short, sketches=_sketches, compared=_compared,
)  # fmt: skip
