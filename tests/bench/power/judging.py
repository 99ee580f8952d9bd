"""The judge of the bench: each fault is caught or proved to be none, no valid rule is refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from discmech.studies.core.case import Case, Measurement, Verdict
from discmech.studies.core.one_case import judged
from discmech.studies.core.outcome import Found, Row

from .measuring import Candidate, through, within
from .results import outcome


def judge(case: Case, measurement: Measurement) -> Verdict:
    """A fault has to be caught, or proved to be none; of a valid rule no study may say no.

    Rows {study, verdict, reason, seconds}; measured also {caught, equivalent}. `caught` names the
    studies that said no. They have their digits in the name; where the bench refuses the object,
    the only one is "refused".
    """
    if not measurement.measured:
        return Verdict("pass", "there is no such fault.")
    rows = told(case, measurement)
    measured: dict[str, Any] = {
        "caught": [row["study"] for row in rows if row["verdict"] == "fail"],
        "equivalent": measurement.get("equivalent", ""),
    }
    return replace(judge_told(case, measured, rows), measured=measured, rows=rows)


def judge_told(case: Case, found: Row, rows: Sequence[Row]) -> Verdict:
    """The verdict of what the studies said."""
    if case.control is None:
        alarms = [row for row in rows if row["study"] in found["caught"]]
        reason = "; ".join(f"{row['study']}: {row['reason']}" for row in alarms)
        return Verdict("fail" if alarms else "pass", reason, {"wanted": "no alarm"})
    missed = ", ".join(f"{row['study']} {row['verdict']}" for row in rows)
    survives = f"no study says no, and no proof says that it is valid: {missed}."
    said = outcome(found)
    reason = {"caught": "", "equivalent": found["equivalent"], "survives": survives}[said]
    return Verdict("fail" if said == "survives" else "pass", reason, {"wanted": "caught"})


def told(case: Case, measurement: Measurement) -> list[dict[str, Any]]:
    """What each study says, as a row."""
    if "refused" in measurement:
        reason = measurement["refused"]
        return [{"study": "refused", "verdict": "fail", "reason": reason, "seconds": 0.0}]
    assert isinstance(case, Candidate)
    rows = []
    for name, study, one in through(within(case)):
        if (kept := measurement["founds"].get(name)) is not None:
            found = Found.of_json(kept)
            said = judged(study, one, found)
            rows.append({"study": name, "verdict": said.verdict, "reason": said.reason,
                         "seconds": found.seconds})  # fmt: skip
    return rows
