"""Systems that a study does not judge, since they lack the part that it asks for."""

from __future__ import annotations

from .case import Choice
from .parts import parts_of, why_not
from .study import Study, judging


def apart(choice: Choice, study: Study | None = None) -> list[str]:
    """Return a sentence for each named system that a study leaves to others.

    study None: for each that not all studies judge. For a scene with equations a study itself names
    what else it needs.
    """
    asked = "equations" if study is None else study.asks_for
    return [
        f"{s.name} {why_not(s)}: it is judged by {judging(s)}, and not by "
        f"{'other studies' if study is None else study.name}."
        for s in choice.scenes if not {asked, "equations"} & parts_of(s)
    ]  # fmt: skip
