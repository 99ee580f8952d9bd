"""Each fault, and each valid rule, through the studies: what said no, and what did not.

A fault is a control: something wrong on purpose, which has to be caught.
"""

from __future__ import annotations

import os
import random
import shlex
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from tempfile import TemporaryDirectory
from typing import Any

from discmech.integrators import BadInput, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.studies import get
from discmech.studies.core.case import Case, Choice, Measurement, Progress, Verdict, silent
from discmech.studies.core.environment import environment
from discmech.studies.core.fingerprint import text_of_study
from discmech.studies.core.one_case import measured_fully
from discmech.studies.core.options import option_words
from discmech.studies.core.study import Study

from .catalogue import everything
from .equivalents import proof
from .faults import Fault, NoPlace, scene_of
from .results import complete as complete
from .sites import FaultyCase, faulty_scheme
from .valid import built_on, random_rule

NAME = "power"
NEEDS = "the name of no fault and of no rule holds these words."
#: (study, digits, steps): short runs, for schemes are many
STUDIES = (
    ("order", 16, 12), ("order", 50, 16), ("symplecticity", 16, 24), ("symplecticity", 50, 8),
    ("momentum", 16, 1000), ("momentum", 50, 20), ("energy", 16, 1500),
)  # fmt: skip
#: the scenes of the valid rules, in turn
SCENES = ("pendulum", "rigid-body", "kepler", "pendulum", "rigid-body", "heavy-top")
SAMPLE = 12  # of so many faults of a site and rules of a kind one, unless all are asked for
RULES = 200


@dataclass(frozen=True)
class Candidate(Case):
    """A fault, or a valid rule drawn by its seed, on a scene of the bench.

    fault, or the number of the rule. rules: the bench's own that it changes, or is built on.
    options: the words of its command.
    """

    fault: Fault | None = field(kw_only=True)
    number: int = field(kw_only=True, default=0)
    rules: tuple[Discretisation, ...] = field(kw_only=True)
    options: tuple[str, ...] = field(kw_only=True)

    @property
    def rests_on(self) -> tuple[Discretisation, ...]:
        """The bench's own rules that it changes, or is built on."""
        return self.rules

    @property
    def label(self) -> str:
        """The rule's name, with a fault in it or not."""
        return self.rule.name

    @property
    def name(self) -> str:
        """How tables call it."""
        return self.fault.name if self.fault else f"{self.scene.name} {self.rule.name}"

    @property
    def command(self) -> str:
        """What puts it through the studies again."""
        return shlex.join(["discmech", NAME, "--only", self.name, *self.options])


def cases(choice: Choice) -> list[Case]:
    """All faults and rules whose name holds `only`; else all if `thorough`, else one in `SAMPLE`.

    unit: the faults alone, on scenes whose action is 10^unit times as large (random rules have
    terms of their own size). seed: of the faults' places, of the sample and of the random rules.
    """
    unit, seed = choice.asked("unit", 0), choice.asked("seed", 0)
    options = tuple(option_words({f"--{e}": choice.asked(e) for e in ("unit", "seed")}))
    faults = [candidate(fault, options) for fault in everything(unit, seed)]
    numbers = () if unit else range(RULES * seed, RULES * (seed + 1))
    valid = [valid_rule(number, options) for number in numbers]
    if only := choice.asked("only", ""):
        faults = [case for case in faults if only in case.name]
        valid = [case for case in valid if only in f"valid rule {case.name}"]
    elif not choice.thorough:
        faults = sampled(faults, lambda case: str(case.control).split(".")[0], seed)
        valid = sampled(valid, lambda case: case.label.rpartition("-")[0], seed)
    return [*faults, *valid]


def candidate(fault: Fault, options: tuple[str, ...] = ()) -> Candidate:
    rule, scene = discretisations.get(fault.rule), scenes.get(fault.scene)
    return Candidate(NAME, scene, rule, 16, control=fault.site, fault=fault, rules=(rule,),
                     options=options)  # fmt: skip


def valid_rule(number: int, options: tuple[str, ...] = ()) -> Candidate:
    """The case of the valid rule that is drawn by that seed."""
    scene, rule = scenes.get(scene_for(number)), random_rule(number)
    return Candidate(NAME, scene, rule, 16, fault=None, number=number,
                     rules=tuple(built_on(rule)), options=options)  # fmt: skip


def sampled(candidates: Sequence[Any], kind: Callable[[Any], str], seed: int = 0) -> list[Any]:
    """One in `SAMPLE` of each kind, at least one, chosen by the seed, in order."""
    kinds: dict[str, list[int]] = {}
    for number, candidate in enumerate(candidates):
        kinds.setdefault(kind(candidate), []).append(number)
    generator = random.Random("discmech power" + (f" {seed}" if seed else ""))
    chosen = [generator.sample(n, -(-len(n) // SAMPLE)) for n in kinds.values()]
    return [candidates[number] for number in sorted(n for several in chosen for n in several)]


def scene_for(seed: int) -> str:
    """The scene of a valid rule."""
    return SCENES[seed // 6 % len(SCENES)]


def together(case: Case) -> Case:
    """Itself: no scheme is shared with any other case."""
    return case


def notes(choice: Choice) -> list[str]:
    """Where these are not all."""
    all_of_them = choice.thorough or choice.asked("only")
    return [] if all_of_them else ["A sample; discmech power --thorough takes all."]


def depends_on(case: Case) -> str:
    """The studies that it goes through."""
    names = dict.fromkeys(name for name, *_ in STUDIES)
    return "".join(text_of_study(get(name)) for name in names)


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """measured: {site, what}; founds: what each study measures (`one_case.measured_fully`), by its
    name with its digits; refused: why the bench refuses the object, where it does.

    Where there is no such fault, measured is empty. What the studies say of it is told anew
    (`judging`), for their verdicts may change where nothing of this does.
    """
    assert isinstance(case, Candidate)
    site, what = "valid rule", case.rule.source
    if case.fault is not None:
        site, what = case.fault.site, case.fault.what
    try:
        with environment({"DISCMECH_CACHE": _own_cache().name}):
            found = _through_studies(case)
    except NoPlace:
        return {"measured": {}, "rows": []}
    return {"measured": {"site": site, "what": what}, "rows": [], **found}


def measure_more(case: Case, measurement: Measurement, said: Verdict) -> dict[str, Any]:
    """equivalent: the proof that a fault which nothing caught is none; "" where there is none."""
    assert isinstance(case, Candidate)
    with environment({"DISCMECH_CACHE": _own_cache().name}):
        return {} if case.fault is None else {"equivalent": proof(case.fault)}


@cache
def _own_cache() -> TemporaryDirectory[str]:
    """Kernels of faulty schemes serve nobody again: they go with the process."""
    return TemporaryDirectory(prefix=f"discmech-cache-{os.getpid()}-power-")


def within(case: Candidate, derived: bool = False) -> Case:
    """The case of no study yet whose scheme has the fault in it, or is of the valid rule.

    derived: with the scene that the faulty scheme has, which is derived for that. Raises `NoPlace`
    where there is nothing to change, `BadInput` where the bench refuses what was changed.
    """
    if case.fault is None:
        scene, rule = scene_of(scene_for(case.number)), random_rule(case.number)
        return Case("", scene, rule, 16)
    scene = scene_of(case.fault.scene, case.fault.unit)
    scene = faulty_scheme(case.fault).scene if derived else scene
    return FaultyCase("", scene, discretisations.get(case.fault.rule), 16, fault=case.fault)


def through(any_case: Case) -> Iterator[tuple[str, Study, Case]]:
    """(its name, the study, the case) of each study that it goes through."""
    for name, digits, steps in STUDIES:
        case = replace(any_case, study=name, digits=digits, steps=steps)
        if name != "momentum" or case.scene.symmetries:
            yield f"{name} {digits}", get(name), case


def _through_studies(candidate: Candidate) -> dict[str, Any]:
    """{"founds"} of all studies, or {"refused"} alone."""
    founds = {}
    try:
        any_case = within(candidate, derived=True)
    except BadInput as refusal:
        return {"refused": str(refusal)}
    for name, study, case in through(any_case):
        begun = time.process_time()
        found, verdict = measured_fully(study, case)
        if verdict.unusable:  # bad input, by which `verify` ends
            return {"refused": verdict.reason}
        founds[name] = replace(found, seconds=time.process_time() - begun).to_json()
    return {"founds": founds}
