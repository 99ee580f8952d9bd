"""The page of extremes: how runs at the edge of a scene are shown."""

from __future__ import annotations

from ..core.result import NONE, Result
from ..report.view import View
from ..report.wording import scientific
from .records import Found, Measured

Case = Result[Measured, object, object]

#: the words for an outcome of the data
WORDS = {"wrong, noticed": "wrong, and it shows", "wrong, silent": "wrong, and nothing shows it"}
SHOWS = {"smaller steps": "smaller steps end elsewhere", "energy": "the energy is off"}


def outcome(record: Found | None) -> str:
    """Return the outcome of a run at an extreme, and the sign of its failure."""
    if record is None:
        return NONE
    said = _said(record)
    if record.error is not None:
        said += f", error {scientific(record.error)}"
    if record.noticed not in (None, "", "nothing") and not record.message:
        said += f" ({SHOWS.get(str(record.noticed), record.noticed)})"
    return f"{said}: {record.message}" if record.message else said


def _said(record: Found) -> str:
    word = record.outcome or NONE
    return WORDS.get(word, word)


def _runs(case: Case) -> list[tuple[str, str, Found]]:
    parts = (("fine", "short steps"), ("coarse", "long steps"))
    runs = [(name, words, getattr(case.measured, name)) for name, words in parts]
    return [run for run in runs if run[2] is not None]


def _outcomes(case: Case) -> str:
    return "; ".join(f"{name}: {outcome(record)}" for name, _, record in _runs(case))


def _short(case: Case) -> str:
    """Return a short outcome such as "short steps: right; long steps: wrong, and it shows"."""
    return "; ".join(f"{words}: {_said(record)}" for _, words, record in _runs(case))


VIEW = View(
    measured=Measured,
    columns=[
        ("Extreme", lambda case: case.details.extreme or NONE),
        ("hω = 1/10", lambda case: outcome(case.measured.fine)),
        ("hω = 5", lambda case: outcome(case.measured.coarse)),
    ],
    got=_outcomes, wanted=lambda case: "no wrong result without a sign", short=_short,
    line=lambda case: f"{case.details.extreme}: {_short(case)}",
)  # fmt: skip
