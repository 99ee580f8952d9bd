"""Each fault, and each valid rule, through the studies: what said no, and what did not.

A fault is a control: something wrong on purpose, which has to be caught.
"""

from __future__ import annotations

import os
import random
import shlex
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from tempfile import TemporaryDirectory
from typing import Any

from discmech.integrators import BadInput, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import Discretisation
from discmech.studies import get
from discmech.studies.core.case import Case, Choice, Progress, Verdict, silent
from discmech.studies.core.environment import environment
from discmech.studies.core.fingerprint import text_of_study
from discmech.studies.core.one_case import run_case

from . import STUDY
from .catalogue import everything
from .equivalents import proof
from .faults import Fault, NoPlace, scene_of
from .results import complete as complete
from .results import outcome
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
    options = tuple(word for option in STUDY.options if option.name in ("unit", "seed")
                    for word in option.words(choice.asked(option.name)))  # fmt: skip
    faults: list[Candidate] = []
    for fault in everything(unit, seed):
        rule = discretisations.get(fault.rule)
        faults.append(Candidate(
            NAME, scenes.get(fault.scene), rule, 16, control=fault.site, fault=fault,
            rules=(rule,), options=options,
        ))  # fmt: skip
    valid: list[Candidate] = []
    for number in () if unit else range(RULES * seed, RULES * (seed + 1)):
        scene, rule = scenes.get(scene_for(number)), random_rule(number)
        valid.append(Candidate(
            NAME, scene, rule, 16, fault=None, number=number, rules=tuple(built_on(rule)),
            options=options,
        ))  # fmt: skip
    if only := choice.asked("only", ""):
        faults = [case for case in faults if only in case.name]
        valid = [case for case in valid if only in f"valid rule {case.name}"]
    elif not choice.thorough:
        faults = sampled(faults, lambda case: str(case.control).split(".")[0], seed)
        valid = sampled(valid, lambda case: case.label.rpartition("-")[0], seed)
    return [*faults, *valid]


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
    """Rows {study, verdict, reason, seconds}; measured: {site, what, caught, equivalent}.

    `caught` names the studies that said no. They have their digits in the name; where the bench
    refuses the object, the only one is "refused". `equivalent` is the proof that a fault which
    nothing caught is none. Where there is no such fault, there are no rows.
    """
    assert isinstance(case, Candidate)
    site, what = "valid rule", case.rule.source
    with environment({"DISCMECH_CACHE": _own_cache().name}):
        if case.fault is None:
            found: dict[str, Any] | None = of_rule(case.number)
        else:
            site, what = case.fault.site, case.fault.what
            found = of_fault(case.fault)
    if found is None:
        return {"measured": {}, "rows": []}
    return {
        "measured": {"site": site, "what": what, "caught": found["caught"],
                     "equivalent": found["equivalent"]},
        "rows": [{"study": name, **said} for name, said in found["found"].items()],
    }  # fmt: skip


@cache
def _own_cache() -> TemporaryDirectory[str]:
    """Kernels of faulty schemes serve nobody again: they go with the process."""
    return TemporaryDirectory(prefix=f"discmech-cache-{os.getpid()}-power-")


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """A fault has to be caught, or proved to be none; of a valid rule no study may say no."""
    found, rows = measurement["measured"], measurement["rows"]
    if not found:
        return Verdict("pass", "there is no such fault.")
    if case.control is None:
        alarms = [row for row in rows if row["study"] in found["caught"]]
        reason = "; ".join(f"{row['study']}: {row['reason']}" for row in alarms)
        return Verdict("fail" if alarms else "pass", reason, {"wanted": "no alarm"})
    missed = ", ".join(f"{row['study']} {row['verdict']}" for row in rows)
    survives = f"no study says no, and no proof says that it is valid: {missed}."
    said = outcome(found)
    reason = {"caught": "", "equivalent": found["equivalent"], "survives": survives}[said]
    return Verdict("fail" if said == "survives" else "pass", reason, {"wanted": "caught"})


def of_fault(fault: Fault) -> dict[str, Any] | None:
    """{"found": {study: {"verdict", "reason", "seconds"}}, "caught", "equivalent"}; see `measure`.

    None where there is no such fault.
    """
    try:
        found = _studied(fault)
        caught = any(one["verdict"] == "fail" for one in found.values())
        return _told(found, "" if caught else proof(fault))
    except NoPlace:
        return None


def of_rule(seed: int) -> dict[str, Any]:
    """The same of a valid rule drawn at random: whatever is in `caught` is a false alarm."""
    scene, rule = scene_of(scene_for(seed)), random_rule(seed)
    return _told(_through_studies(Case("", scene, rule, 16)), "")


def _told(found: dict[str, Any], equivalent: str) -> dict[str, Any]:
    caught = [study for study, one in found.items() if one["verdict"] == "fail"]
    return {"found": found, "caught": caught, "equivalent": equivalent}


def _studied(fault: Fault) -> dict[str, Any]:
    try:
        scene = faulty_scheme(fault).scene
    except BadInput as refusal:
        return _refused(str(refusal))
    rule = discretisations.get(fault.rule)
    return _through_studies(FaultyCase("", scene, rule, 16, fault=fault))


def _refused(why: str) -> dict[str, Any]:
    return {"refused": {"verdict": "fail", "reason": why, "seconds": 0.0}}


def _through_studies(any_case: Case) -> dict[str, Any]:
    """Per study what it says, or "refused" alone."""
    found = {}
    for name, digits, steps in STUDIES:
        case = replace(any_case, study=name, digits=digits, steps=steps)
        if name == "momentum" and not case.scene.symmetries:
            continue
        begun = time.process_time()
        result = run_case(get(name), case, causes=False)  # whether it is seen is all that counts
        if result.get("unusable"):  # bad input, by which `verify` ends
            return _refused(result["reason"])
        found[f"{name} {digits}"] = {
            "verdict": result["verdict"], "reason": result["reason"],
            "seconds": time.process_time() - begun,
        }  # fmt: skip
    return found
