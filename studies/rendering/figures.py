"""The figures of a report: which there are, their captions, the commands that reproduce them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from discmech.studies.rendering import (
    plot_charts,
    plot_costs,
    plot_drift,
    plot_maps,
    plot_order,
    plot_reversibility,
    plot_stability,
    plot_symplecticity,
    plot_work,
)
from discmech.studies.rendering.canvas import Drawing, Panel, Sheet, render
from discmech.studies.rendering.captions import (
    CHARTS,
    CONTROLS,
    CONVERGENCE,
    COSTS,
    DEFECTS,
    DRIFT,
    ENERGY,
    LINEAR,
    LONG_WORK,
    MAPS,
    REVERSIBILITY,
    SPRINGS,
    WORK,
)
from discmech.studies.rendering.palette import Mark, marks
from discmech.studies.rendering.wording import (
    Case,
    Result,
    in_unusual_chart,
    is_control,
    mapping,
    rule_name,
)

Titles = Mapping[str, str]


@dataclass(frozen=True)
class Sketch:
    """A figure before it is drawn; `digits` where all of it has one precision."""

    name: str
    title: str
    caption: str
    panels: Sequence[Panel]
    sheet: Sheet
    digits: int | None = None


@dataclass(frozen=True)
class Plate:
    """A figure with what stands beside it."""

    name: str
    study: str
    title: str
    caption: str
    command: str
    drawing: Drawing


def plates(results: Sequence[Result], titles: Titles, library: dict[str, str]) -> list[Plate]:
    """Every figure that these results (one a study) allow.

    `library` collects the glyphs and markers that the inline panels refer to; the page has to
    hold them once.
    """
    rules = dict.fromkeys(rule_name(case) for result in results for case in result["cases"])
    known = marks(rules)
    found = []
    for result in results:
        study, cases = str(result["study"]), result["cases"]
        if study not in SKETCHERS:
            continue
        for sketch in SKETCHERS[study](cases, known, titles):
            if sketch.panels:
                drawing = render(sketch.panels, sketch.sheet, library)
                again = command(result, cases, sketch.digits)
                words = (sketch.title, sketch.caption, again)
                found.append(Plate(sketch.name, study, *words, drawing))
    return found


def precisions(cases: Sequence[Case]) -> dict[int, list[Case]]:
    """The cases of each number of digits, fewest digits first."""
    found: dict[int, list[Case]] = {}
    for case in cases:
        found.setdefault(int(case.get("digits") or 16), []).append(case)
    return dict(sorted(found.items()))


def command(result: Result, cases: Sequence[Case], digits: int | None) -> str:
    """The command that makes these numbers again."""
    same = [case for case in cases if digits is None or int(case.get("digits") or 16) == digits]
    own = next((case["study_command"] for case in same if case.get("study_command")), None)
    base = str(own or result.get("command") or f"discmech {result['study']}")
    return base if digits is None or "--digits" in base else f"{base} --digits {digits}"


def by_scene(cases: Sequence[Case]) -> dict[str, list[Case]]:
    """The cases of each scene, in the order in which they come."""
    found: dict[str, list[Case]] = {}
    for case in cases:
        found.setdefault(str(case.get("scene")), []).append(case)
    return found


def _order(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    found: list[Sketch] = []
    for digits, same in precisions(cases).items():
        panels = [
            plot_order.panel(titles.get(scene, scene), own, known)
            for scene, own in by_scene(same).items()
        ]
        name, title = f"order-{digits}", f"Convergence, {digits} digits"
        found.append(
            Sketch(
                name,
                title,
                _caption(CONVERGENCE, digits, found),
                panels,
                _room(plot_order.SHEET, same),
                digits,
            )
        )
    return found


def _symplecticity(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    sound = precisions([case for case in cases if not is_control(case)])
    panels = [
        plot_symplecticity.defects(f"{digits} digits", same, dict(titles), digits)
        for digits, same in sound.items()
    ]
    sheet = plot_symplecticity.sheet(max(sound.values(), key=len, default=[]))
    found = [Sketch("symplecticity", "Defects of every scheme", DEFECTS, panels, sheet)]
    panels = [
        plot_symplecticity.controls(
            titles.get(scene, scene), own, beside.get(scene, []), known, digits
        )
        for digits, same in precisions([case for case in cases if is_control(case)]).items()
        for beside in [by_scene(sound.get(digits, []))]
        for scene, own in by_scene(same).items()
    ]
    sheet = plot_symplecticity.CONTROL_SHEET
    return [*found, Sketch("controls", "Controls", CONTROLS, panels, sheet)]


def _momentum(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    found: list[Sketch] = []
    for digits, same in precisions(cases).items():
        panels = [
            plot_drift.drift(titles.get(scene, scene), name, own, known, digits)
            for scene, own in by_scene(same).items()
            for name in plot_drift.momenta(own)
        ]
        name, title = f"momentum-{digits}", f"Momentum drift, {digits} digits"
        found.append(
            Sketch(
                name,
                title,
                _caption(DRIFT, digits, found),
                panels,
                plot_drift.MOMENTUM_SHEET,
                digits,
            )
        )
    return found


def _reversibility(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    return [
        Sketch(
            f"reversibility-{digits}", f"Reversibility, {digits} digits", REVERSIBILITY,
            [plot_reversibility.panel(titles.get(scene, scene), own, known, digits)
             for scene, own in by_scene(same).items()],
            plot_reversibility.SHEET, digits,
        )
        for digits, same in precisions(cases).items()
    ]  # fmt: skip


def _energy(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    found: list[Sketch] = []
    for digits, same in precisions(cases).items():
        panels = [
            plot_drift.energy(titles.get(scene, scene), own, known, digits)
            for scene, own in by_scene(same).items()
        ]
        name, title = f"energy-{digits}", f"Energy error, {digits} digits"
        found.append(
            Sketch(
                name,
                title,
                _caption(ENERGY, digits, found),
                panels,
                plot_drift.ENERGY_SHEET,
                digits,
            )
        )
    return found


def _work(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    found = []
    titled = (("work", "Work and precision"), ("work-long", "Work and precision, long runs"))
    for long, (name, title) in enumerate(titled):
        races: dict[tuple[str, object], list[Case]] = {}
        for case in cases:
            if (case.get("periods") is not None) == long:
                races.setdefault((str(case.get("scene")), case.get("periods")), []).append(case)
        panels = [
            plot_work.panel(
                titles.get(scene, scene) + (f", {periods} periods" if long else ""), own, known
            )
            for (scene, periods), own in races.items()
        ]
        found.append(Sketch(name, title, LONG_WORK if long else WORK, panels, plot_work.SHEET))
    return found


def _stability(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    linear = [case for case in cases if case.get("kind") == "linear"]
    maps = [case for case in cases if case.get("kind") == "map"]
    stiff = [case for case in maps if mapping(case, "measured").get("exchange")]
    panels, sheet = plot_maps.map_table(maps, titles)
    return [
        Sketch(
            "stability-linear", "Linear stability", LINEAR,
            [plot_stability.radius(linear, known), plot_stability.phase(linear, known)]
            if linear else [], plot_stability.LINEAR_SHEET,
        ),
        Sketch("stability-maps", "Stability maps", MAPS,
               [*panels, plot_maps.legend()] if panels else [], sheet),
        Sketch(
            "stability-fpu", "The stiff springs of fpu", SPRINGS,
            [plot_stability.exchange(stiff, known), plot_stability.stiffer(stiff, known),
             plot_stability.adiabatic(stiff, known)]
            if stiff else [], plot_stability.EXCHANGE_SHEET,
        ),
    ]  # fmt: skip


def _charts(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    panels = [
        panel
        for case in cases
        for panel in plot_charts.panels(titles.get(str(case["scene"]), str(case["scene"])), case)
    ]
    return [Sketch("charts", "Steps of every size", CHARTS, panels, plot_charts.SHEET)]


def _references(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    panels = plot_costs.panels(cases)
    return [
        Sketch("reference-costs", "The cost of certain digits", COSTS, panels, plot_costs.SHEET)
    ]


def _room(sheet: Sheet, cases: Sequence[Case]) -> Sheet:
    """A wider margin where names of rules carry their retraction."""
    more = 0.24 if any(map(in_unusual_chart, cases)) else 0.0
    return replace(sheet, width=sheet.width + more, right=sheet.right + more)


def _caption(caption: str, digits: int, before: Sequence[Sketch]) -> str:
    return f"As above, with {digits} digits." if before else caption


Sketcher = Callable[[Sequence[Case], dict[str, Mark], Titles], list[Sketch]]
SKETCHERS: dict[str, Sketcher] = {
    "order": _order,
    "symplecticity": _symplecticity,
    "momentum": _momentum,
    "energy": _energy,
    "reversibility": _reversibility,
    "work-precision": _work,
    "stability": _stability,
    "charts": _charts,
    "references": _references,
}
