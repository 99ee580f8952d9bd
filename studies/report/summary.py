"""The results in short: one per study, the headline, troubles, where and when they ran."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..core.study import counts, every_study
from .tables import COLOURS, file_name, got, print_trouble, rich_table, wanted
from .wording import (
    NONE,
    VERDICTS,
    Case,
    Result,
    case_name,
    caught,
    is_control,
    mapping,
    verdict,
    whys,
)

if TYPE_CHECKING:
    from rich.console import Console


def merged(results: Sequence[Result]) -> list[Result]:
    """Return one result per study, in the usual order, with the worst verdict within it.

    Each case records the command that it came from.
    """
    found: dict[str, Result] = {}
    for result in results:
        name = str(result.get("study") or "unnamed")
        whole = found.setdefault(name, {**result, "study": name, "cases": []})
        cases = result.get("cases") or []
        said = [verdict(thing) for thing in (whole, result, *filter(counts, cases))]
        whole["verdict"] = min(said, key=VERDICTS.index)
        whole["cases"] += [{**case, "study_command": result.get("command")} for case in cases]
    known = [name for name in every_study() if name in found]
    return [found[name] for name in [*known, *(n for n in found if n not in known)]]


def tally(cases: Sequence[Case]) -> dict[str, int]:
    """Return the number of cases with each verdict, and of controls that were caught."""
    sound = [verdict(case) for case in cases if counts(case) and not is_control(case)]
    wrong = [verdict(case) for case in cases if is_control(case) and caught(case) != "equivalent"]
    found = {name: sound.count(name) for name in VERDICTS}
    return found | {"cases": len(sound), "controls": len(wrong), "caught": wrong.count("pass")}


def headline(studies: Sequence[Result]) -> dict[str, str]:
    """Return the verdict of the whole report and a sentence for it."""
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
        parts.append(_some(count["fail"], count["cases"], "case", "fails", "fail"))
    if count["inconclusive"]:
        verbs = ("is inconclusive", "are inconclusive")
        few = f"{count['inconclusive']} {verbs[count['inconclusive'] > 1]}"
        parts.append(few if parts else _some(count["inconclusive"], count["cases"], "case", *verbs))
    if not parts and count["cases"]:
        parts.append(_some(count["cases"], count["cases"], "case", "passes", "pass"))
    if count["controls"]:
        verbs = ("was caught", "were caught")
        parts.append(_some(count["caught"], count["controls"], "control", *verbs))
    text = "; ".join(parts) + "."
    return {"verdict": worst, "text": text[0].upper() + text[1:]}


def print_summary(screen: Console, results: Sequence[Result]) -> None:
    """Print the verdict of each study in a line, then the cases that did not pass."""
    studies, lines = merged(results), []
    for study in studies:
        word, count = verdict(study), tally(study["cases"])
        caught_of = f"{count['caught']} of {count['controls']}" if count["controls"] else NONE
        numbers = [str(count[key]) for key in ("fail", "inconclusive", "pass")]
        lines.append([str(study["study"]), f"[{COLOURS[word]}]{word}[/]", *numbers, caught_of])
    said = headline(studies)
    right = ("Fail", "Inconclusive", "Pass", "Controls caught")
    heads = ("Study", "Verdict", *right)
    screen.print(rich_table(said["text"], heads, lines, COLOURS[said["verdict"]], right))
    for study in studies:
        ours = list(filter(counts, study["cases"]))
        print_trouble(screen, {**study, "cases": ours}, commands=True)


def _some(number: int, whole: int, noun: str, one: str, more: str) -> str:
    """Return a phrase such as the only case passes; 2 controls were caught; 1 of 9 cases fails."""
    if number == whole:
        return f"the only {noun} {one}" if whole == 1 else f"all {whole} {noun}s {more}"
    verb = one if number == 1 else more
    return f"{number or 'none'} of {whole} {noun}s {verb}" if whole > 1 else f"no {noun} {one}"


def trouble(studies: Sequence[Result]) -> list[dict[str, Any]]:
    """Return every failed, missed or inconclusive case of ours in all studies, failures first."""
    found = [
        (str(study["study"]), case)
        for study in studies
        for case in study["cases"]
        if counts(case) and verdict(case) != "pass"
    ]
    found.sort(key=lambda line: VERDICTS.index(verdict(line[1])))
    reasons = whys([case for _, case in found])
    return [
        {
            "study": study,
            "anchor": file_name(study),
            "name": case_name(case),
            "control": is_control(case),
            "verdict": verdict(case),
            "word": caught(case) if is_control(case) else verdict(case),
            "got": got(study, case),
            "wanted": wanted(study, case),
            "reason": reason,
            "command": str(case.get("command") or ""),
        }
        for (study, case), reason in zip(found, reasons, strict=True)
    ]


def machine(results: Sequence[Result]) -> list[tuple[str, str]]:
    """Return the common properties of the runs; if they differ, every value."""
    found: dict[str, list[str]] = {}
    for result in results:
        for key, value in (result.get("record") or {}).items():
            if key in ("settings", "seconds", "date"):
                continue
            word = {True: "yes", False: "no", None: "—"}.get(value, str(value))
            if word not in found.setdefault(str(key).replace("_", " "), []):
                found[str(key).replace("_", " ")].append(word)
    return [(key, " · ".join(values)) for key, values in found.items()]


def when(case: Case) -> str:
    """Return the date and the commit at which a case was measured."""
    made = mapping(case, "measured_at")
    date, commit = str(made.get("date") or ""), str(made.get("commit") or "")[:10]
    changed = "" if made.get("clean") else " with changes"
    return f"{date} at {commit}{changed}" if commit else date


def _dates(cases: Sequence[Case]) -> str:
    """Return the first and last date, with the commits."""
    dates = sorted({str(mapping(case, "measured_at").get("date") or "") for case in cases} - {""})
    commits = dict.fromkeys(when(case).partition(" at ")[2] for case in cases)
    at = ", ".join(filter(None, commits))
    return " to ".join(dict.fromkeys(dates[:1] + dates[-1:])) + (f" at {at}" if at else "")


def runs(results: Sequence[Result]) -> list[dict[str, str]]:
    """Return when each study ran, how long it took, and its settings."""
    found = []
    for result in results:
        record = result.get("record") or {}
        settings = (record.get("settings") or {}).items()
        seconds = record.get("seconds")
        found.append(
            {
                "study": str(result.get("study")),
                "command": str(result.get("command") or ""),
                "date": _dates(result.get("cases") or []) or str(record.get("date") or "—"),
                "seconds": f"{seconds:.1f}" if isinstance(seconds, int | float) else "—",
                "settings": ", ".join(f"{key} = {value}" for key, value in settings) or "—",
            }
        )
    return found
