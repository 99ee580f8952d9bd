"""One case of a study, the choice of cases, and the verdict on a case."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from discmech.integrators import BadInput, Scheme, retractions, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import Scene, remembered

from . import words
from .family import DIGITS as OF_FAMILY
from .family import FAMILY
from .options import option_words
from .outcome import Measurement, Verdict, worst
from .parts import parts_of, usual_lattices, usual_rules
from .userfile import word_for_study

__all__ = [
    "Case", "Choice", "Measurement", "Progress", "Verdict", "family_cases", "in_chart",
    "lattice_cases", "plain_cases", "scheme_of", "silent", "worst",
]  # fmt: skip
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Choice:
    """The user's choice: scenes and rules (all if empty), precisions and steps."""

    scenes: tuple[Scene, ...] = ()
    rules: tuple[Discretisation, ...] = ()
    retractions: tuple[str, ...] = ()
    digits: tuple[int, ...] = ()
    steps: int | None = None
    own: tuple[tuple[str, Any], ...] = ()  # (name, value) of options of a study's own

    def asked(self, name: str, otherwise: Any = None) -> Any:
        """Return the value of a study's own option."""
        return dict(self.own).get(name, otherwise)

    @property
    def controls(self) -> tuple[str, ...]:
        """The chosen controls; all that a study has if empty."""
        return tuple(self.asked("control", ()))

    @property
    def thorough(self) -> bool:
        """True if run time does not matter."""
        return bool(self.asked("thorough", False))

    def pairs(self) -> Iterator[tuple[Scene, Discretisation]]:
        """Yield every scene with every rule, in the chosen retractions.

        A scene that gives its discrete Lagrangian itself is taken with that
        (`discretisations.own`): always if it was named, otherwise unless rules were chosen.
        """
        rules = self.rules or (*discretisations.BUILT_IN.values(), discretisations.own)
        for scene in self.scenes or scenes.all_scenes():
            if "sites" in parts_of(scene):  # its equations are those of a site and of a bond
                continue
            for chart in self.charts(scene):
                not_meant = [name for at, name in self.asked("not_meant", ()) if at == scene.name]
                apply = [r for r in rules if r.applies(chart) and r.name not in not_meant]
                if not apply and self.scenes and scene.discrete_lagrangian is not None:
                    apply = [discretisations.own]
                yield from ((chart, rule) for rule in apply)

    def unheeded(self) -> list[str]:
        """Return a sentence for each named scene that cannot use the chosen rules."""
        boxes = [getattr(rule, "own_scene", None) for rule in self.rules]  # each for its own map
        others = (s for s in self.scenes if not any(s is box for box in boxes))
        plain = [s for s in others if "sites" not in parts_of(s)]
        sentences = [said for s in plain for rule in self.rules if (said := rule.refusal(s))]
        for scene in plain if self.rules else ():
            rules = [
                rule.name for rule in self.rules
                if rule is not discretisations.own and rule.asks_lagrangian
            ]  # fmt: skip
            if scene.discrete_lagrangian is not None and rules:
                have = "has" if len(rules) == 1 else "have"
                sentences.append(
                    f"{scene.name} gives its discrete Lagrangian itself: "
                    f"{', '.join(rules)} {have} no part in it."
                )
        lattices = [s.name for s in self.scenes if "sites" in parts_of(s)]
        maps = [rule.name for rule in self.rules if not runs_on_lattices(rule)]
        if lattices and maps:
            sentences.append(
                f"{', '.join(lattices)}: lattices run by rules of values of L, not by one-step "
                f"maps or programs such as {', '.join(maps)}."
            )
        if lattices and self.digits and 16 not in self.digits:
            sentences.append(
                f"{', '.join(lattices)}: lattices are measured in double precision, --digits 16, "
                "and by the study of order in more digits, too."
            )
        return sentences

    def on_lattices(self, more: bool = False) -> Iterator[tuple[Any, Discretisation, int]]:
        """Yield every chosen lattice with every rule by which it runs, and the digits.

        more: True if digits beyond those of a double may be chosen.

        If rules are chosen and no scene, there are none: lattices have to be named, unless nothing
        is chosen. Raises `BadInput` if only lattices are chosen, which cannot run so.
        """
        named: list[Any] = [s for s in self.scenes if "sites" in parts_of(s)]
        usual = () if self.scenes or self.rules or self.retractions else usual_lattices()
        cases = [(lattice, rule, digits) for lattice in (*named, *usual)
                 for rule in self.rules or map(discretisations.get, usual_rules(lattice))
                 for digits in self.digits or (16,)
                 if runs_on_lattices(rule) and (digits == 16 or more)]  # fmt: skip
        if named and not cases and len(named) == len(self.scenes):
            raise BadInput(" ".join(self.unheeded()))
        yield from cases

    def charts(self, scene: Scene) -> list[Scene]:
        """Return the scene in each chosen retraction, or once as it is if it uses none."""
        if scene.groupoid.retraction is None or not self.retractions:
            return [scene]
        return [in_chart(scene, name) for name in dict.fromkeys(self.retractions)]


def runs_on_lattices(rule: Discretisation) -> bool:
    """True for rules of values of L, whose equations are sums over sites and bonds."""
    return rule.asks_lagrangian


@lru_cache(maxsize=256)
def in_chart(scene: Scene, retraction: str) -> Scene:
    """Return the scene with the retraction of that name, as one object, derived once."""
    return scene.with_retraction(retractions.get(retraction))


@remembered(maxsize=64)
def scheme_of(scene: Scene, rule: Discretisation) -> Scheme:
    """Return one scheme for all studies and precisions, so that everything is derived once."""
    return Scheme(scene, rule)


@dataclass(frozen=True)
class Case:
    """One measurement: a scene or lattice by a rule at a precision, or a control to be caught."""

    study: str
    scene: Scene
    rule: Discretisation
    digits: int
    steps: int | None = None
    control: str | None = None
    thorough: bool = False

    @cached_property
    def scheme(self) -> Scheme:
        """The scene discretised by the rule: by the functions as they are when it is first asked.

        A case lives as long as its study runs.
        """
        return self.scheme_on(self.scene)

    def __getstate__(self) -> dict[str, Any]:
        """Return what goes to another process, which discretises the scene itself."""
        return {name: value for name, value in vars(self).items() if name != "scheme"}

    def scheme_on(self, scene: Scene) -> Scheme:
        """Return the rule on another form of a scene, such as one with the attitude as base."""
        return scheme_of(scene, self.rule)

    @cached_property
    def order(self) -> int | None:
        """The order that the rule has on the scene (`Scheme.order`); None if the rule states none.

        It is derived from the equations unless it is known already.
        """
        return self.scheme.order

    @property
    def knows_order(self) -> bool:
        """True if the order was derived, or is known from an earlier run."""
        return "order" in vars(self)

    def know_order(self, order: int | None) -> None:
        """Take the order from an earlier run, so that nothing has to be derived to judge."""
        vars(self)["order"] = order

    @property
    def label(self) -> str:
        """The rule's name, or the control's."""
        return self.control or self.rule.name

    @property
    def rests_on(self) -> Sequence[Discretisation]:
        """The rules on which its numbers depend."""
        return (self.rule,)

    @property
    def asked(self) -> str:
        """The words of a command on which its numbers depend."""
        return self.command

    @property
    def repeatable(self) -> bool:
        """True if the words of `command` find this very scene and these very rules again."""
        return all(map(words.is_found, (self.scene, *(() if self.control else self.rests_on))))

    @property
    def command(self) -> str:
        """The command that repeats this case."""
        study = shlex.quote(word_for_study(self.study))
        parts = ["discmech", study, shlex.quote(words.address_of(self.scene))]
        if self.control is None:
            parts += ["--rule", shlex.quote(words.address_of(self.rule))]
        else:
            parts += ["--control", f'"{self.control}"']
        chart = self.scene.groupoid.retraction
        flags = {
            "--retraction": chart if chart in retractions.BUILT_IN else None,
            "--digits": self.digits, "--steps": self.steps, "--thorough": self.thorough,
        }  # fmt: skip
        return " ".join([*parts, *option_words(flags)])


def silent(label: str, fraction: float) -> None:
    """Ignore progress."""


def plain_cases(
    study: str, choice: Choice, default_digits: Sequence[int], thorough: bool = False
) -> list[Case]:
    """Return every chosen scene with every chosen rule at every precision.

    A choice with `few` pairs has precisions beyond a double's for these alone.
    """
    few = choice.asked("few")
    return [
        Case(study, scene, rule, digits, choice.steps, thorough=thorough)
        for digits in choice.digits or default_digits
        for scene, rule in choice.pairs()
        if rule.runs_at(digits) and (few is None or digits == 16 or (scene.name, rule.name) in few)
    ]


def lattice_cases(study: str, choice: Choice, more: bool = False) -> list[Case]:
    """Return every chosen lattice with every chosen rule, in double precision.

    more: True to measure in more digits, too, if they are chosen.
    """
    return [Case(study, lattice, rule, digits, choice.steps, thorough=choice.thorough)
            for lattice, rule, digits in choice.on_lattices(more)]  # fmt: skip


def family_cases(
    study: str, choice: Choice, steps: int, family: Mapping[str, Sequence[str]] = FAMILY
) -> list[Case]:
    """Return the family's cases in so many steps, unless scenes, rules or steps are chosen."""
    if choice.scenes or choice.rules or choice.steps or choice.retractions:
        return []
    if OF_FAMILY not in (choice.digits or (OF_FAMILY,)):
        return []
    return [
        Case(study, scenes.get(scene), discretisations.get(name), OF_FAMILY, steps)
        for scene, names in family.items()
        for name in names
    ]
