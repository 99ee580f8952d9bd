"""Error against run time, steps and evaluations: every rule and its peers in one race per scene."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from discmech.integrators import retractions
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import Scene

from ..core.case import Case, Choice, Measurement, Progress, silent
from ..core.fingerprint import is_ours
from ..core.options import option_words
from ..core.result import StudyResult
from ..core.study import BY_TOLERANCE
from ..core.words import address_of
from ..evidence.measuring import single_steps
from . import STUDY

NAME = "work-precision"
NEEDS = "it needs a Lagrangian without constraints, and double precision."
DIGITS = (16,)
BUDGET, LONG_BUDGET, THOROUGH = 0.06, 0.2, 100  # seconds of timing per method; factor if thorough
#: scenes that race unless some are chosen: each kind of groupoid, two bodies, and stiff springs
RACED = ("pendulum", "kepler", "fpu", "rigid-body", "heavy-top", "rotor-body")
LONG = ("pendulum", "kepler", "heavy-top")  # scenes of the report's long race
PERIODS = 1000
#: beside the built-in rules: of fourth and of eighth order, on every groupoid
HIGH_ORDER = ("suzuki:trapezoidal", "kahan-li-8:trapezoidal")


class Race:
    """All methods on one scene, measured together when the first of them is needed.

    A method that was measured before does not run again. Those that were not are timed in turn with
    each other and with the peer that was the fastest at each accuracy.
    """

    def __init__(
        self, scene: Scene, rules: list[Discretisation], choice: Choice, periods: int | None
    ) -> None:
        from .peers import chosen, on

        self.scene, self.rules, self.choice, self.periods = scene, rules, choice, periods
        self.peers = on(scene, chosen(choice.asked("peer", ()))[0])
        self.progress: Progress = silent
        self.kept: dict[str, Measurement] = {}

    @property
    def compared(self) -> bool:
        """True for a race of `compare`, which ranks the methods themselves: they are timed in turn.

        Each method takes part once there.
        """
        return self.choice.asked("also_periods") is not None

    @property
    def methods(self) -> list[str]:
        """The names of all contestants; rules with stages also with steps chosen for tolerances."""
        ours = []
        for rule in self.rules:
            ours += [rule.name]
            ours += [rule.name + BY_TOLERANCE] if rule.stages and not self.compared else []
        return [*ours, *self.peers]

    @property
    def axes(self) -> tuple[str, str]:
        """(x, y) of the diagram; over long times y is the energy's error."""
        x, y = self.choice.asked("x"), self.choice.asked("y")
        return x or "seconds", y or ("error" if self.periods is None else "energy-max")

    @property
    def command(self) -> str:
        """The command of this race alone."""
        return self._command([*map(address_of, self.choice.rules)])

    @property
    def settings(self) -> str:
        """The words of the command without its rules; a ratio is to the best of its peers."""
        return self._command([])

    def _command(self, rules: list[str]) -> str:
        chart = self.scene.groupoid.retraction
        asked = dict(self.choice.own) | {"periods": self.periods}
        flags = {
            "--rule": rules, "--retraction": chart if chart in retractions.BUILT_IN else None,
            "--steps": self.choice.steps, **{o.flag: asked.get(o.name) for o in STUDY.options},
        }  # fmt: skip
        return shlex.join(["discmech", NAME, address_of(self.scene), *option_words(flags)])

    @cached_property
    def results(self) -> dict[str, dict[str, Any]]:
        """Return per method the result of `measure`."""
        from .contest import hold_race
        from .standings import fastest_peers

        usual = BUDGET if self.periods is None else LONG_BUDGET
        each = self.choice.asked("budget") or usual * (THOROUGH if self.choice.thorough else 1)
        fastest = fastest_peers(self.kept) if self.kept else self.peers
        wanted = [name for name in self.methods if name not in self.kept or name in fastest]
        return hold_race(
            self.scene, self.rules, self.peers, axes=self.axes, budget=each, periods=self.periods,
            wanted=wanted, first=self.choice.steps, progress=self.progress,
        )  # fmt: skip


@dataclass(frozen=True)
class Entry(Case):
    """One method of a race; its command is that of the race, in which alone it is timed."""

    race: Race = field(kw_only=True)
    method: str = field(kw_only=True)

    @property
    def label(self) -> str:
        """The rule's name, or the peer's."""
        return self.method

    @property
    def rests_on(self) -> Sequence[Discretisation]:
        """The rule itself, none for a peer; all rules for `compare`, whose races stay whole."""
        if self.race.compared:
            return self.race.rules
        return [r for r in self.race.rules if self.method in (r.name, r.name + BY_TOLERANCE)]

    @property
    def asked(self) -> str:
        """The settings of the race."""
        race = self.race
        return f"{race.command} {race.methods}" if race.compared else race.settings

    @property
    def command(self) -> str:
        """The command that repeats the race."""
        return self.race.command


def cases(choice: Choice) -> list[Case]:
    """Return the methods of every scene's race: over its duration, or over `--periods` of its
    motion.

    If no scene is chosen, those of `RACED` run, some over a thousand periods as well; with the
    choice's `also_periods` (of `compare`) all scenes that keep their energy do, over as many.
    """
    if choice.digits and 16 not in choice.digits:
        return []
    charts: dict[tuple[str, str | None], tuple[Scene, list[Discretisation]]] = {}
    rules = choice.rules or (
        *discretisations.BUILT_IN.values(), *map(discretisations.get, HIGH_ORDER)
    )  # fmt: skip
    for scene, rule in replace(choice, rules=rules).pairs():
        if not choice.scenes and scene.name not in RACED:
            continue
        # peers integrate ẋ, μ̇ that are functions of (x, t, μ): they follow no constraints
        if scene.lagrangian is not None and not scene.all_constraints:
            chart = scene.name, scene.groupoid.retraction
            charts.setdefault(chart, (scene, []))[1].append(rule)
    races = [Race(*each, choice, choice.asked("periods")) for each in charts.values()]
    if also := choice.asked("also_periods"):  # there the energy's error counts
        races += [Race(scene, rules, choice, also) for scene, rules in charts.values()
                  if scene.force is None and not scene.timed]  # fmt: skip
    elif choice.asked("periods") is None and not choice.scenes:
        races += [Race(*charts[key], choice, PERIODS) for key in charts if key[0] in LONG]
    return [
        Entry(NAME, one.scene, one.rules[0], 16, choice.steps, race=one, method=method)
        for one in races
        for method in one.methods
    ]


def notes(choice: Choice) -> list[str]:
    """Return sentences on the whole study: which peers are absent, and where."""
    from .peers import BODIES, SPLIT, SYMBOLIC, chosen, on

    present, absent = chosen(choice.asked("peer", ()))
    left_out = [name for name in present if name in SYMBOLIC and name not in SPLIT]
    return [
        *absent,
        *(f"{scene.name} is left out: other people's integrators follow no constraints, and a race "
          "without them says little."
          for scene in choice.scenes if scene.all_constraints),
        *(f"{name} does not take part in {scene.name}: ξ(x, μ) has no short closed form."
          for scene in choice.scenes for name in left_out if name not in on(scene, left_out)),
        *(f"{name} takes part where L = T(v) − V(x)." for name in present if name in SPLIT),
        *(f"{name} takes part where bodies attract each other." for name in present
          if name in BODIES),
    ]  # fmt: skip


def together(case: Case) -> Race:
    """Return the race of a method: times of one race are compared, taken in turn."""
    assert isinstance(case, Entry)
    return case.race


def before_race(kept: Mapping[Case, Measurement]) -> None:
    """Let only those take part in a race whose measurements are not kept."""
    for case, measurement in kept.items():
        assert isinstance(case, Entry)
        if not case.race.compared:
            case.race.kept[case.method] = measurement


def complete(result: StudyResult) -> StudyResult:
    """Return the cases with what is read off the rows of all methods of their race."""
    from .standings import beside_each_other

    return replace(result, cases=beside_each_other(result.cases))


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return rows, one per setting.

    A row has {setting, step or tolerance, `ERRORS`, `WORK`, seconds_low, seconds_high
    (quartiles), samples, outliers, cause (of a failure)}, and the energy error's growth
    (`Yardstick.errors`). measured: {x, y, best, cost: {accuracy: work or None}, ratio: {accuracy:
    to the best peer}, cut: the settings that were left out, setup: seconds to derive and compile,
    spread: {accuracy: cost by the quartiles of the times}, dearest: work of the longest run,
    equal_time: see `standings.equal_time`, same_as: the rule whose rows these are, since it is the
    same method}; floor: {metric: error}; kind: rule or peer; duration; periods; local: of a
    rule that is not the bench's, its single steps.
    """
    assert isinstance(case, Entry)
    case.race.progress = progress
    record = case.race.results[case.method]
    own = [r for r in case.race.rules if case.method in (r.name, r.name + BY_TOLERANCE)]
    if not own or is_ours(own[0]):  # the orders of the bench's rules are proven
        return record
    return {**record, "local": single_steps(Case(NAME, case.scene, own[0], 16))}
