"""The results in short: one a study, the headline, what did not pass, where and when they ran."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from studies.rendering.tables import file_name
from studies.rendering.wording import (
    STUDIES,
    VERDICTS,
    Case,
    Result,
    case_name,
    caught,
    got,
    is_control,
    verdict,
    wanted,
)


def merged(results: Sequence[Result]) -> list[Result]:
    """One result a study, in the usual order, its verdict the worst that was said within it.

    Each case remembers the command it came from.
    """
    found: dict[str, Result] = {}
    for result in results:
        name = str(result.get("study") or "unnamed")
        whole = found.setdefault(name, {**result, "study": name, "cases": []})
        cases = result.get("cases") or []
        said = [verdict(thing) for thing in (whole, result, *cases)]
        whole["verdict"] = min(said, key=VERDICTS.index)
        whole["cases"] += [{**case, "study_command": result.get("command")} for case in cases]
    known = [name for name in STUDIES if name in found]
    return [found[name] for name in [*known, *(n for n in found if n not in known)]]


def tally(cases: Sequence[Case]) -> dict[str, int]:
    """How many cases have each verdict, and how many controls were caught."""
    sound = [verdict(case) for case in cases if not is_control(case)]
    wrong = [verdict(case) for case in cases if is_control(case)]
    counts = {name: sound.count(name) for name in VERDICTS}
    return counts | {"cases": len(sound), "controls": len(wrong), "caught": wrong.count("pass")}


def headline(studies: Sequence[Result]) -> dict[str, str]:
    """The verdict of the whole report and a sentence that says it."""
    count = tally([case for study in studies for case in study["cases"]])
    missed = count["controls"] - count["caught"]
    worst = min((verdict(study) for study in studies), key=VERDICTS.index, default="inconclusive")
    if count["fail"] or missed:
        worst = "fail"
    elif count["inconclusive"] or not count["cases"]:
        worst = min(worst, "inconclusive", key=VERDICTS.index)
    if not count["cases"] and not count["controls"]:
        return {"verdict": worst, "text": "Nothing was measured."}
    parts = []
    if count["fail"]:
        parts.append(f"{count['fail']} of {count['cases']} cases fail")
    if count["inconclusive"]:
        verb = "is" if count["inconclusive"] == 1 else "are"
        whole = "" if parts else f" of {count['cases']} cases"
        parts.append(f"{count['inconclusive']}{whole} {verb} inconclusive")
    if not parts and count["cases"]:
        parts.append(f"All {count['cases']} cases pass")
    if count["controls"]:
        every = "all " if not missed and count["controls"] > 1 else f"{count['caught']} of "
        parts.append(f"{every}{count['controls']} controls were caught")
    return {"verdict": worst, "text": "; ".join(parts) + "."}


def trouble(studies: Sequence[Result]) -> list[dict[str, Any]]:
    """Every failed, missed or inconclusive case of all studies, the failures first."""
    found = [
        {
            "study": study["study"],
            "anchor": file_name(str(study["study"])),
            "name": case_name(case),
            "control": is_control(case),
            "verdict": verdict(case),
            "word": caught(case) if is_control(case) else verdict(case),
            "got": got(str(study["study"]), case),
            "wanted": wanted(str(study["study"]), case),
            "reason": str(case.get("reason") or ""),
            "command": str(case.get("command") or ""),
        }
        for study in studies
        for case in study["cases"]
        if verdict(case) != "pass"
    ]
    return sorted(found, key=lambda line: VERDICTS.index(line["verdict"]))


def machine(results: Sequence[Result]) -> list[tuple[str, str]]:
    """What the runs have in common; where they differ, every value."""
    found: dict[str, list[str]] = {}
    for result in results:
        for key, value in (result.get("record") or {}).items():
            if key in ("settings", "seconds", "date"):
                continue
            word = {True: "yes", False: "no", None: "—"}.get(value, str(value))
            if word not in found.setdefault(str(key).replace("_", " "), []):
                found[str(key).replace("_", " ")].append(word)
    return [(key, " · ".join(values)) for key, values in found.items()]


def runs(results: Sequence[Result]) -> list[dict[str, str]]:
    """When each study ran, how long it took, and with which settings."""
    found = []
    for result in results:
        record = result.get("record") or {}
        settings = (record.get("settings") or {}).items()
        seconds = record.get("seconds")
        found.append(
            {
                "study": str(result.get("study")),
                "command": str(result.get("command") or ""),
                "date": str(record.get("date") or "—"),
                "seconds": f"{seconds:.1f}" if isinstance(seconds, int | float) else "—",
                "settings": ", ".join(f"{key} = {value}" for key, value in settings) or "—",
            }
        )
    return found
