"""Systems that a study does not judge, since they lack the part that it asks for."""

from __future__ import annotations

from .case import Choice
from .parts import parts_of, why_not
from .records import grouped
from .study import Study, judging


def apart(choice: Choice, study: Study | None = None) -> list[str]:
    """Return a sentence for the named systems of each kind that a study leaves to others.

    study None: for those that not all studies judge. For a scene with equations a study itself
    names what else it needs.
    """
    asked = "equations" if study is None else study.asks_for
    left = [s for s in choice.scenes if not {asked, "equations"} & parts_of(s)]
    beyond = "other studies" if study is None else study.name
    said = list[str]()
    for (why, others), alike in grouped(left, lambda s: (why_not(s), judging(s))).items():
        judged = f"judged by {others}, and not by {beyond}"
        names = ", ".join(s.name for s in alike)
        said.append(
            f"{names} {why}: it is {judged}." if len(alike) == 1
            else f"{len(alike)} systems are {judged}, since each {why}: {names}."
        )  # fmt: skip
    return said
