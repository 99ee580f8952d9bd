"""Studies by the words of a command, and the words by which another process finds them."""

from __future__ import annotations

import pickle
from contextlib import suppress

from discmech.integrators import BadInput
from discmech.integrators.errors import unknown

from .lookup import Kind, only
from .study import Study, every_study
from .userfile import word_for_study


def _of_bench(word: str) -> Study:
    known = every_study()
    if word not in known:
        raise unknown("study", word, [name for name, study in known.items() if study.usual])
    return known[word]


STUDY = Kind("study", lambda file: file.studies, _of_bench)


def study_called(word: str) -> Study:
    """Return the study of that name, or of FILE.py:NAME; raises `BadInput` for an unknown one."""
    study: Study = only(STUDY, word)
    return study


def word_of_study(study: Study) -> str:
    """Return the word that finds the study in another process.

    Raises `pickle.PicklingError` for one that is in no file and in no package.
    """
    word = word_for_study(study.name)
    with suppress(BadInput):
        if study_called(word) is study:
            return word
    raise pickle.PicklingError(
        f"the study {study.name} cannot go to another process: write it in a file."
    )
