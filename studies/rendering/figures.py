"""The figures of a report: which there are, their captions, the commands that reproduce them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from studies.rendering import plot_drift, plot_order, plot_stability, plot_symplecticity, plot_work
from studies.rendering.canvas import Drawing, Panel, Sheet, render
from studies.rendering.palette import Mark, marks
from studies.rendering.wording import Case, Result, is_control, mapping, rule_name

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
    panels = [
        plot_stability.stability_map(titles.get(str(c["scene"]), str(c["scene"])), c) for c in maps
    ]
    return [
        Sketch(
            "stability-linear", "Linear stability", LINEAR,
            [plot_stability.radius(linear, known), plot_stability.phase(linear, known)]
            if linear else [], plot_stability.LINEAR_SHEET,
        ),
        Sketch("stability-maps", "Stability maps", MAPS,
               [*panels, plot_stability.legend()] if panels else [], plot_stability.MAP_SHEET),
        Sketch(
            "stability-fpu", "The stiff springs of fpu", SPRINGS,
            [plot_stability.exchange(stiff, known), plot_stability.adiabatic(stiff, known)]
            if stiff else [], plot_stability.EXCHANGE_SHEET,
        ),
    ]  # fmt: skip


def _room(sheet: Sheet, cases: Sequence[Case]) -> Sheet:
    """A wider margin where names of rules carry their retraction."""
    more = 0.24 if any(case.get("retraction") == "exponential" for case in cases) else 0.0
    return replace(sheet, width=sheet.width + more, right=sheet.right + more)


def _caption(caption: str, digits: int, before: Sequence[Sketch]) -> str:
    return f"As above, with {digits} digits." if before else caption


CONVERGENCE = (
    "Error in (x, μ) at the end of the run against step size; the number beside a rule is the "
    "fitted order. Filled marks are in the fit. Hollow marks are left out because the error is "
    "not yet asymptotic there, crosses because round-off has taken over; a bar on the upper edge "
    "is a run that failed. The triangles show the slopes that are expected. Where curves coincide "
    "the line has the colours of all of them in turn and the marks lie within one another."
)
DEFECTS = (
    "Defect of the symplectic form under the pullback by the step (filled), and of the Poisson "
    "bracket under the map on the dual (hollow). A mark is the worst point of the trajectory, the "
    "line beside it goes to the median; zero is drawn at the left edge. Dashed: the limit that the "
    "verdict uses. Dotted: one unit of round-off."
)
CONTROLS = (
    "Controls: maps that are not symplectic, or are tested against a wrong bracket, and have to "
    "be caught above the upper dashed line. Where a Runge–Kutta method is followed to small steps "
    "its defect sinks below the limit of a sound scheme and into round-off (grey band): there it "
    "cannot be told from a symplectic one, so a verdict at small steps alone would prove nothing. "
    "Grey dots: the sound schemes of the scene."
)
DRIFT = (
    "Drift of each momentum map, relative to the sum of the absolute values of its terms, against "
    "the number of steps (the worst in each of many bins); beside a rule the worst of the whole "
    "run. Dotted: the random walk that round-off alone makes, ε√N. A line that rises faster than "
    "it is a systematic drift. Zero is drawn on the lower axis; a line in several colours is "
    "several curves that coincide."
)
ENERGY = (
    "Relative energy error against time: one strip a rule, each from its own smallest to its own "
    "largest error, which stand on its left; dashed: zero. Of a long run the space between the "
    "smallest and the largest error of each short stretch is filled. A sound variational "
    "integrator fills a band that neither tilts nor widens; where the energy is kept exactly only "
    "the drift of round-off is left, and the band is a line."
)

WORK = (
    "Error against run time: the median of interleaved rounds, with its quartiles as a bar; hollow "
    "marks had outliers among their samples, which are kept. Rules of this bench have full lines, "
    "other people's integrators dashed ones. A line ends where the error no longer sinks or where "
    "the next run would exceed the budget. Dashed across: the error that rounding the start to "
    "double precision alone makes, the floor for everybody."
)
LONG_WORK = (
    "The same over many characteristic periods, where the energy is what counts: a method that "
    "is not symplectic pays for time as well as for accuracy."
)

LINEAR = (
    "The exact step of each rule on the harmonic oscillator. Left: its spectral radius; a "
    "symplectic step is stable while it is one, to the number beside the rule (by root "
    "finding), and controls leave the circle at once. Right: the phase of a step while it is "
    "stable, beside the exact one (dotted); where it is a third or a quarter of a turn, "
    "nonlinear terms may resonate."
)
MAPS = (
    "What becomes of runs at each step size (across, times the fastest frequency) and each "
    "stiffness (upwards). Bounded: none of the others. Resonant: the energy band is over four "
    "times that at both neighbouring steps. Drifting: the energy's mean moves by more than half"
    " its band and a hundredth of its terms, also in a run eight times as long. Newton failed: "
    "the equations of a step were not solved. Blown up: the energy error exceeds the energy's "
    "terms at the start, or the numbers are no longer finite."
)
SPRINGS = (
    "Fermi–Pasta–Ulam chain. Left: how far the energies of the three stiff springs, as running "
    "means, are from their true exchange; a run may be stable and still hand the energy on at "
    "the wrong pace. Right: how far the springs' whole energy, an adiabatic invariant, moves "
    "over long times at a step of ten fast radians; dashed: 15 %. imex keeps it from ω = 100 on."
)

Sketcher = Callable[[Sequence[Case], dict[str, Mark], Titles], list[Sketch]]
SKETCHERS: dict[str, Sketcher] = {
    "order": _order,
    "symplecticity": _symplecticity,
    "momentum": _momentum,
    "energy": _energy,
    "work-precision": _work,
    "stability": _stability,
}
