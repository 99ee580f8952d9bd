"""What is said of all faults and valid rules together: counts, and tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from discmech.studies.core.result import AnyResult, StudyResult

OUTCOMES = ("caught", "equivalent", "survives")
ABOUT = (
    "A fault is caught if a study fails, or if the bench refuses the object. Equivalent ones are "
    "proved, one by one, to be valid rules too; what survives makes the verdict fail."
)


def complete(result: StudyResult) -> StudyResult:
    """Counts and tables; candidates for which there was no place are no cases."""
    cases = [case for case in result.cases if case.data or case.is_trouble]
    faults = [case for case in cases if case.control and case.data]
    valid = [case for case in cases if not case.control and case.data]
    outcomes = [outcome(fault.figures) for fault in faults]
    counts = {
        "faults": len(faults), "caught": outcomes.count("caught"),
        "equivalent": outcomes.count("equivalent"),
        "survivors": [_name(fault) for fault in faults if fault.verdict == "fail"],
        "rules": len(valid),
        "false_alarms": [_name(rule) for rule in valid if rule.verdict == "fail"],
        "seconds": sum(case.seconds for case in cases),
    }  # fmt: skip
    tables = [_by_site(faults), _by_study(faults, valid)]
    return replace(result, cases=cases, tables=tables, more=counts)


def outcome(measured: Mapping[str, Any]) -> str:
    """One of `OUTCOMES`."""
    found = "equivalent" if measured["equivalent"] else "survives"
    return "caught" if measured["caught"] else found


def _name(case: AnyResult) -> str:
    fault = f": {case.figures['site']}, {case.figures['what']}" if case.control else ""
    return f"{case.scene} {case.rule}{fault}"


def _by_site(faults: Sequence[AnyResult]) -> dict[str, Any]:
    counts: dict[str, Counter[str]] = {}
    for found in (fault.figures for fault in faults):
        counts.setdefault(found["site"].split(".")[0], Counter())[outcome(found)] += 1
    total = sum(counts.values(), Counter())
    lines = [[name, *(str(found[word]) for word in OUTCOMES)]
             for name, found in [*counts.items(), ("all", total)]]  # fmt: skip
    return {"title": "Faults, by what they are in", "about": ABOUT,
            "heads": ["Site", "Caught", "Equivalent", "Survives"], "lines": lines}  # fmt: skip


def _by_study(faults: Sequence[AnyResult], valid: Sequence[AnyResult]) -> dict[str, Any]:
    """How many faults each study caught, how many it alone did, and how many it did not see."""
    ran = dict.fromkeys(row["study"] for case in (*faults, *valid) for row in case.data)
    caught_by = [f.figures["caught"] for f in faults]
    lines = []
    for name in sorted(ran):
        asked = [by for f, by in zip(faults, caught_by, strict=True)
                 if by and any(row["study"] == name for row in f.data)]  # fmt: skip
        caught = [by for by in asked if name in by]
        alone = caught.count([name])
        alarms = [rule for rule in valid if name in rule.figures["caught"]]
        counts = (len(caught), alone, len(asked) - len(caught), len(alarms))
        lines.append([name, *map(str, counts)])
    about = "Of the faults that were caught; alone: no other study saw the fault."
    return {"title": "Faults, by the study that caught them", "about": about,
            "heads": ["Study, digits", "Caught", "Alone", "Not seen", "False alarms"],
            "lines": lines}  # fmt: skip
