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


def outcome(found: Found | None) -> str:
    """Return the outcome of a run at an extreme, and the sign of its failure."""
    if found is None:
        return NONE
    said = _said(found)
    if found.error is not None:
        said += f", error {scientific(found.error)}"
    if found.noticed not in (None, "", "nothing") and not found.message:
        said += f" ({SHOWS.get(str(found.noticed), found.noticed)})"
    return f"{said}: {found.message}" if found.message else said


def _said(found: Found) -> str:
    word = found.outcome or NONE
    return WORDS.get(word, word)


def _runs(case: Case) -> list[tuple[str, str, Found]]:
    parts = (("fine", "short steps"), ("coarse", "long steps"))
    found = [(name, words, getattr(case.measured, name)) for name, words in parts]
    return [run for run in found if run[2] is not None]


def _outcomes(case: Case) -> str:
    return "; ".join(f"{name}: {outcome(found)}" for name, _, found in _runs(case))


def _short(case: Case) -> str:
    """Return a short outcome such as "short steps: right; long steps: wrong, and it shows"."""
    return "; ".join(f"{words}: {_said(found)}" for _, words, found in _runs(case))


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
