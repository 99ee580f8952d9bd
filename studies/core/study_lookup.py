"""Studies by the words of a command: the name of one of all, or FILE.py:NAME."""

from __future__ import annotations

from collections.abc import Sequence

from discmech.integrators import BadInput
from discmech.integrators.errors import unknown

from .lookup import in_file, of_file
from .study import Study, every_study
from .userfile import word_for_study


def study_called(word: str) -> Study:
    """The study of that name, or of FILE.py:NAME; raises `BadInput` for an unknown one."""
    file, name = in_file(word)
    if file is None:
        known = every_study()
        if word not in known:
            raise unknown("study", word, [n for n, s in known.items() if s.usual])
        return known[word]
    found = of_file(file, file.studies, name, "study")
    if len(found) > 1:
        names = ", ".join(s.name for s in found)
        raise BadInput(f"{word} has several studies ({names}): say {word}:{found[0].name}.")
    return found[0]


def words_for_studies(asked: Sequence[Study]) -> tuple[str, ...] | None:
    """The words for these studies in another process; None if one of them has none."""
    words = tuple(word_for_study(s.name) for s in asked)
    known = every_study()
    found = [study_called(word) if word != s.name or s.name in known else None
             for word, s in zip(words, asked, strict=True)]  # fmt: skip
    return words if all(a is b for a, b in zip(found, asked, strict=True)) else None
