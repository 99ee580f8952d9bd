"""Studies by the words of a command: the name of one of all, or FILE.py:NAME."""

from __future__ import annotations

import pickle

from discmech.integrators import BadInput
from discmech.integrators.errors import unknown

from .lookup import in_file, of_file
from .study import Study, every_study
from .userfile import word_for_study


def study_called(word: str) -> Study:
    """Return the study of that name, or of FILE.py:NAME; raises `BadInput` for an unknown one."""
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


def word_of(study: Study) -> str:
    """Return the word that finds the study in another process.

    Raises `pickle.PicklingError` for one that is in no file and in no package.
    """
    word = word_for_study(study.name)
    if (word == study.name and word not in every_study()) or study_called(word) is not study:
        raise pickle.PicklingError(
            f"the study {study.name} cannot go to another process: write it in a file."
        )
    return word
