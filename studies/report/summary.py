"""The results in short: one per study, the headline, troubles, where and when they ran."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..core.outcome import VERDICTS, worst
from ..core.result import NONE, AnyResult, StudyResult
from ..core.study import every_study
from .tables import COLOURS, file_name, got, print_trouble, rich_table, wanted
from .wording import whys

if TYPE_CHECKING:
    from rich.console import Console


#: what a headline says of one case with a verdict, and of more
VERBS = {"fail": ("fails", "fail"), "inconclusive": ("is inconclusive", "are inconclusive"),
         "pass": ("passes", "pass"), "measured": ("is measured", "are measured")}  # fmt: skip


def merged(results: Sequence[StudyResult]) -> list[StudyResult]:
    """Return one result per study, in the usual order, with the worst verdict within it.

    Each case records the command that it came from.
    """
    studies: dict[str, StudyResult] = {}
    for result in results:
        cases = [replace(case, study_command=result.command) for case in result.cases]
        before = studies.get(result.study)
        said = [result.verdict, *(case.verdict for case in cases if case.counts)]
        if before is not None:
            result, cases = before, [*before.cases, *cases]
            said.append(before.verdict)
        studies[result.study] = replace(result, cases=cases, verdict=worst(said))
    known = [name for name in every_study() if name in studies]
    return [studies[name] for name in [*known, *(n for n in studies if n not in known)]]


def tally(cases: Sequence[AnyResult]) -> dict[str, int]:
    """Return the number of cases with each verdict, and of controls that were caught."""
    sound = [case.verdict for case in cases if case.counts and not case.control]
    wrong = [case.word for case in cases if case.control and case.word != "equivalent"]
    counts = {name: sound.count(name) for name in VERDICTS}
    return counts | {"cases": len(sound), "controls": len(wrong), "caught": wrong.count("caught")}


def headline(studies: Sequence[StudyResult]) -> dict[str, str]:
    """Return the verdict of the whole report and a sentence for it."""
    count = tally([case for study in studies for case in study.cases])
    missed = count["controls"] - count["caught"]
    said = [study.verdict for study in studies]
    said += ["fail"] * bool(count["fail"] or missed)
    said += ["inconclusive"] * bool(count["inconclusive"] or not count["cases"])
    if not count["cases"] and not count["controls"]:
        return {"verdict": worst(said), "text": "Nothing was measured."}
    parts = list[str]()
    for verdict, verbs in VERBS.items():
        if not count[verdict] or (verdict == "pass" and parts):
            continue
        few = f"{count[verdict]} {verbs[count[verdict] > 1]}"
        parts.append(few if parts else _some(count[verdict], count["cases"], "case", *verbs))
        parts[-1] += ", where no claim is judged" if verdict == "measured" else ""
    open_cases = count["fail"] or count["inconclusive"]
    if not open_cases and any(study.verdict == "inconclusive" for study in studies):
        parts.append("not all that the files define could be judged")
    if count["controls"]:
        verbs = ("was caught", "were caught")
        parts.append(_some(count["caught"], count["controls"], "control", *verbs))
    text = "; ".join(parts) + "."
    return {"verdict": worst(said), "text": text[0].upper() + text[1:]}


def print_summary(screen: Console, results: Sequence[StudyResult]) -> None:
    """Print the verdict of each study in a line, then the cases in trouble."""
    studies, lines = merged(results), []
    for study in studies:
        count = tally(study.cases)
        caught_of = f"{count['caught']} of {count['controls']}" if count["controls"] else NONE
        numbers = [str(count[key]) for key in VERDICTS]
        word = f"[{COLOURS[study.verdict]}]{study.verdict}[/]"
        lines.append([study.study, word, *numbers, caught_of])
    said = headline(studies)
    right = (*(word.capitalize() for word in VERDICTS), "Controls caught")
    heads = ("Study", "Verdict", *right)
    screen.print(rich_table(said["text"], heads, lines, COLOURS[said["verdict"]], right))
    for study in studies:
        print_trouble(screen, [case for case in study.cases if case.counts], commands=True)


def _some(number: int, whole: int, noun: str, one: str, more: str) -> str:
    """Return a phrase such as the only case passes; 2 controls were caught; 1 of 9 cases fails."""
    if number == whole:
        return f"the only {noun} {one}" if whole == 1 else f"all {whole} {noun}s {more}"
    verb = one if number == 1 else more
    return f"{number or 'none'} of {whole} {noun}s {verb}" if whole > 1 else f"no {noun} {one}"


def trouble(studies: Sequence[StudyResult]) -> list[dict[str, Any]]:
    """Return every failed, missed or inconclusive case of ours in all studies, failures first."""
    bad = [case for study in studies for case in study.cases if case.counts and case.is_trouble]
    bad.sort(key=lambda case: VERDICTS.index(case.verdict))
    return [
        {"study": case.study, "anchor": file_name(case.study), "name": case.name,
         "control": case.control, "verdict": case.verdict, "word": case.word, "got": got(case),
         "wanted": wanted(case), "reason": reason, "command": case.command}
        for case, reason in zip(bad, whys(bad), strict=True)
    ]  # fmt: skip


def machine(results: Sequence[StudyResult]) -> list[tuple[str, str]]:
    """Return the common properties of the runs; if they differ, every value."""
    properties: dict[str, dict[str, None]] = {}
    for result in results:
        for key, value in result.record.items():
            if key not in ("settings", "seconds", "date"):
                word = {True: "yes", False: "no", None: "—"}.get(value, str(value))
                properties.setdefault(str(key).replace("_", " "), {})[word] = None
    return [(key, " · ".join(values)) for key, values in properties.items()]


def when(case: AnyResult) -> str:
    """Return the date and the commit at which a case was measured."""
    made = case.measured_at
    commit = (made.commit or "")[:10]
    changed = "" if made.clean else " with changes"
    return f"{made.date or ''} at {commit}{changed}" if commit else made.date or ""


def _dates(cases: Sequence[AnyResult]) -> str:
    """Return the first and last date, with the commits."""
    dates = sorted({case.measured_at.date or "" for case in cases} - {""})
    commits = dict.fromkeys(when(case).partition(" at ")[2] for case in cases)
    at = ", ".join(filter(None, commits))
    return " to ".join(dict.fromkeys(dates[:1] + dates[-1:])) + (f" at {at}" if at else "")


def runs(results: Sequence[StudyResult]) -> list[dict[str, str]]:
    """Return when each study ran, how long it took, and its settings."""
    rows = []
    for result in results:
        settings = (result.record.get("settings") or {}).items()
        seconds = result.record.get("seconds")
        rows.append(
            {"study": result.study, "command": result.command,
             "date": _dates(result.cases) or str(result.record.get("date") or "—"),
             "seconds": "—" if seconds is None else f"{seconds:.1f}",
             "settings": ", ".join(f"{key} = {value}" for key, value in settings) or "—"}
        )  # fmt: skip
    return rows
