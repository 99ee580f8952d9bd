"""How what was measured of lattices is shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..report import plot_convergence, plot_drift
from ..report.grouping import by_scene
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View, measured_column
from ..report.wording import NONE, Case, mapping, number, rows, scientific
from . import plot

TIME = (
    "Error in (x, μ) against the step: of Toda's chain against the soliton in closed form, of the "
    "others against their equations of motion solved by DOP853. The number beside a rule is its "
    "order; marks as in the figures of convergence."
)
SPACE = (
    "Error in (x, μ) at t = 4 against the spacing of the grid, against breather and kink of the "
    "sine-Gordon equation in closed form, with steps of an eighth of the spacing: central "
    "differences are of order 2, by whatever rule the time is stepped."
)
ENERGY = (
    "Relative energy error of lattices against time, drawn as that of scenes; of the beads above a "
    "table it is what the impacts take."
)
COST = (
    "Processor time of a site and step against the number of sites N, the least of some runs in "
    "turn, and the power of N with which a whole step grows (slope). Dashed: plain loops in C. "
    "Times are of this machine and are not judged."
)


def _orders(measured: dict[str, Any]) -> str:
    found = [(number(measured.get(k)), words)
             for k, words in (("order", "time"), ("space_order", "space"))]  # fmt: skip
    itself = " (against its own runs)" if measured.get("why_not") else ""
    return ", ".join(f"{words} {p:.3f}{itself if words == 'time' else ''}"
                     for p, words in found if p is not None) or NONE  # fmt: skip


def _drift(measured: dict[str, Any]) -> str:
    drifts = (measured.get("drift") or {}).items() if _whole(measured) else ()
    return ", ".join(f"{name} {scientific(value)}" for name, value in drifts) or NONE


def _whole(measured: dict[str, Any]) -> bool:
    """Whether it is a lattice's, not a control's."""
    return "energy" in measured


def _forms(measured: dict[str, Any]) -> str:
    names = [k for k in ("poisson", "patch") if measured.get(k) is not None]
    return ", ".join(f"{k} {scientific(measured[k])}" for k in names) or NONE


def _contact(measured: dict[str, Any]) -> str:
    worst = max(measured["contact"], key=lambda name: measured["contact"][name])
    defect, rise = scientific(measured["contact"][worst]), scientific(measured["rises"][0])
    return f"{measured['impacts']} impacts, {worst} {defect}, energy rises by {rise}"


def _wanted(expected: dict[str, Any]) -> str:
    if "laws" in expected:
        return f"laws of contact ≤ {scientific(expected['laws'])}"
    if "order" in expected:
        return f"order {expected['order']}, forms ≤ {scientific(expected['limit'])}"
    return f"≥ {scientific(expected.get('at_least'))}"


def _got(measured: dict[str, Any]) -> str:
    if "contact" in measured:
        return _contact(measured)
    if not _whole(measured):
        return _forms(measured)
    parts = (f"order {_orders(measured)}", _drift(measured), _forms(measured))
    return ", ".join(part for part in parts if part != NONE)


def _cost(case: Case) -> str:
    found = [row for row in rows(case) if row.get("kind") == "cost"]
    grows = mapping(case, "measured").get("grows")
    if not found or not grows:
        return NONE
    last = found[-1]
    in_c = f" (C {last['c']:.3g})" if last.get("c") else ""
    return f"{last['nanoseconds']:.3g}{in_c} at {last['sites']}, slope {grows['time']:.2f}"


def _memory(case: Case) -> str:
    found = [row for row in rows(case) if row.get("kind") == "cost"]
    return f"{found[-1]['bytes']:.0f}" if found else NONE


def _band(case: Case) -> str:
    return scientific((mapping(case, "measured").get("energy") or {}).get("band"))


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    own = by_scene([case for case in cases if not case.get("control")])

    def with_rows(kind: str) -> dict[str, list[Case]]:
        found = {scene: [plot.of_kind(case, kind) for case in of] for scene, of in own.items()}
        found = {scene: [case for case in of if rows(case)] for scene, of in found.items()}
        return {scene: of for scene, of in found.items() if of}

    def named(scene: str) -> str:
        return titles.get(scene, scene)

    in_time = [plot_convergence.panel(named(scene), of, known, "error")
               for scene, of in with_rows("time").items()]  # fmt: skip
    in_space = [plot_convergence.panel(named(scene), list(map(_in_space, of)), known, "error",
                                       "spacing of the grid")
                for scene, of in with_rows("space").items()]  # fmt: skip
    energies = [plot_drift.energy(named(scene), list(map(_of_energy, of)), known, 16)
                for scene, of in with_rows("run").items()]  # fmt: skip
    cost = [plot.cost(named(scene), of, known) for scene, of in with_rows("cost").items()]
    sheet = plot_convergence.SHEET
    return [
        Sketch("lattices-time", "Lattices: order in time", TIME, in_time, sheet, 16),
        Sketch("lattices-space", "Lattices: order in space", SPACE, in_space, sheet, 16),
        Sketch(
            "lattices-energy", "Lattices: energy", ENERGY, energies, plot_drift.ENERGY_SHEET, 16
        ),
        Sketch("lattices-cost", "Lattices: cost", COST, cost, plot.COST_SHEET, 16),
    ]


def _in_space(case: Case) -> Case:
    """With the order in space in the place of that in time."""
    measured, expected = mapping(case, "measured"), mapping(case, "expected")
    return {**case, "measured": {"order": measured.get("space_order")},
            "expected": {**expected, "order": expected.get("space_order")}}  # fmt: skip


def _of_energy(case: Case) -> Case:
    return {**case, "measured": mapping(case, "measured").get("energy") or {}}


VIEW = View(
    columns=[
        ("Order", lambda case: _orders(mapping(case, "measured"))),
        ("Energy band", _band),
        ("Contact", lambda case: _contact(m) if "contact" in (m := mapping(case, "measured"))
         else NONE),
        ("Drift", lambda case: _drift(mapping(case, "measured"))),
        measured_column("poisson", "Ω"), measured_column("patch", "Law on patches"),
        ("ns a site and step", _cost), ("Bytes a site", _memory),
    ],
    got=_got, wanted=_wanted, short=lambda m: _contact(m) if "contact" in m else _forms(m),
    sketches=_sketches,
)  # fmt: skip
