"""What the mutation study found, as a study's result: a case a fault, a case a valid rule, tables.

A fault is a control: something wrong on purpose, which has to be caught.
"""

from __future__ import annotations

import random
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from ..core.cluster import Cluster
from ..core.record import record
from ..core.store import Store
from .catalogue import everything
from .measuring import Result, measure, scene_for
from .valid import random_rule

SAMPLE = 12  # of so many faults of a site and rules of a kind one, unless all are asked for
RULES = 200
OUTCOMES = ("caught", "equivalent", "survives")
ABOUT = (
    "A fault is caught if a study fails, or if the bench refuses the object. Equivalent ones are "
    "proved, one by one, to be valid rules too; what survives makes the verdict fail."
)


def power(
    progress: Callable[[str, float], None],
    jobs: int | Cluster,
    *,
    thorough: bool = False,
    only: str = "",
    unit: int = 0,
    seed: int = 0,
    store: Store | None = None,
) -> dict[str, Any]:
    """The result of all faults and rules, of one in `SAMPLE`, or of those whose name holds `only`.

    unit: the faults alone, on scenes whose action is 10^unit times as large (random rules have
    terms of their own size). seed: of the faults' places, of the sample and of the random rules.
    What the store has is not measured again. There are no cases if no name holds `only`.
    """
    catalogue = everything(unit, seed)
    faults = [i for i, fault in enumerate(catalogue) if only in fault.name]
    rules = [] if unit else list(range(RULES * seed, RULES * (seed + 1)))
    rules = [number for number in rules if only in f"valid rule {rule_name(number)}"]
    if not (thorough or only):
        faults = sampled(faults, lambda i: catalogue[i].site.split(".")[0], seed)
        rules = sampled(rules, lambda number: random_rule(number).name.rpartition("-")[0], seed)
    words = [
        *(["--thorough"] if thorough else []),
        *(["--only", shlex.quote(only)] if only else []),
    ]
    same = [*(["--unit", str(unit)] if unit else []), *(["--seed", str(seed)] if seed else [])]
    found = measure(faults, rules, jobs, progress, store, unit, seed)
    note = "" if thorough or only else "A sample; discmech power --thorough takes all."
    return result(*found, " ".join(["discmech power", *words, *same]), note, same)


def sampled(numbers: Sequence[int], kind: Callable[[int], str], seed: int = 0) -> list[int]:
    """One in `SAMPLE` of each kind, at least one, chosen by the seed, in order."""
    kinds: dict[str, list[int]] = {}
    for number in numbers:
        kinds.setdefault(kind(number), []).append(number)
    generator = random.Random("discmech power" + (f" {seed}" if seed else ""))
    chosen = [generator.sample(n, -(-len(n) // SAMPLE)) for n in kinds.values()]
    return sorted(number for several in chosen for number in several)


def rule_name(seed: int) -> str:
    """How tables call a valid rule."""
    return f"{scene_for(seed)} {random_rule(seed).name}"


def result(
    faults: Sequence[Result],
    valid: Sequence[Result],
    command: str,
    note: str = "",
    same: Sequence[str] = (),
) -> dict[str, Any]:
    """The result of a study: verdict, counts, tables, and a case each with its command.

    same: the options that the command of every case has too.
    """
    outcomes = [outcome(fault) for fault in faults]
    survivors = [f["name"] for f in faults if outcome(f) == "survives"]
    alarms = [v["name"] for v in valid if v["caught"]]
    seconds = sum(one["seconds"] for one in (*faults, *valid))
    return {
        "schema": 1, "study": "power", "command": command,
        "verdict": "fail" if survivors or alarms else "pass",
        "record": record(seconds, {"faults": len(faults), "rules": len(valid)}),
        "notes": [note] if note else [],
        "faults": len(faults), "caught": outcomes.count("caught"),
        "equivalent": outcomes.count("equivalent"), "survivors": survivors,
        "rules": len(valid), "false_alarms": alarms, "seconds": seconds,
        "tables": [_by_site(faults), _by_study(faults, valid)],
        "cases": [*(_case(fault, same, True) for fault in faults),
                  *(_case(rule, same, False) for rule in valid)],
    }  # fmt: skip


def outcome(fault: Result) -> str:
    """One of `OUTCOMES`."""
    return "caught" if fault["caught"] else "equivalent" if fault["equivalent"] else "survives"


def _case(one: Result, same: Sequence[str], control: bool) -> dict[str, Any]:
    if control:
        said, wanted = outcome(one), "caught"
        missed = ", ".join(f"{k} {found['verdict']}" for k, found in one["found"].items())
        survives = f"no study says no, and no proof says that it is valid: {missed}."
        reason = {"caught": "", "equivalent": one["equivalent"], "survives": survives}[said]
    else:
        said, wanted = "alarm" if one["caught"] else "", "no alarm"
        reason = "; ".join(f"{k}: {one['found'][k]['reason']}" for k in one["caught"])
    kept = ("site", "what", "caught", "equivalent")
    return {
        "scene": one["scene"], "rule": one["rule"], "retraction": None, "digits": None,
        "verdict": "fail" if said in ("survives", "alarm") else "pass", "reason": reason,
        "control": control,
        "command": shlex.join(["discmech", "power", "--only", one["name"], *same]),
        "expected": {"wanted": wanted}, "measured": {key: one[key] for key in kept},
        "rows": [{"study": name, **found} for name, found in one["found"].items()],
        "seconds": one["seconds"], "measured_at": one["measured_at"],
    }  # fmt: skip


def _by_site(faults: Sequence[Result]) -> dict[str, Any]:
    counts: dict[str, Counter[str]] = {}
    for fault in faults:
        counts.setdefault(fault["site"].split(".")[0], Counter())[outcome(fault)] += 1
    total = sum(counts.values(), Counter())
    lines = [[name, *(str(found[word]) for word in OUTCOMES)]
             for name, found in [*counts.items(), ("all", total)]]  # fmt: skip
    return {"title": "Faults, by what they are in", "about": ABOUT,
            "heads": ["Site", "Caught", "Equivalent", "Survives"], "lines": lines}  # fmt: skip


def _by_study(faults: Sequence[Result], valid: Sequence[Result]) -> dict[str, Any]:
    """How many faults each study caught, how many it alone did, and how many it did not see."""
    ran = dict.fromkeys(name for one in (*faults, *valid) for name in one["found"])
    lines = []
    for name in sorted(ran):
        asked = [f for f in faults if name in f["found"] and outcome(f) == "caught"]
        caught = [f for f in asked if name in f["caught"]]
        alone = [f for f in caught if f["caught"] == [name]]
        alarms = [v for v in valid if name in v["caught"]]
        counts = (len(caught), len(alone), len(asked) - len(caught), len(alarms))
        lines.append([name, *map(str, counts)])
    about = "Of the faults that were caught; alone: no other study saw the fault."
    return {"title": "Faults, by the study that caught them", "about": about,
            "heads": ["Study, digits", "Caught", "Alone", "Not seen", "False alarms"],
            "lines": lines}  # fmt: skip
