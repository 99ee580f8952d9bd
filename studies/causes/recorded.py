"""The cause of recorded rows that follow another motion: a part of the field comes c times."""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import scene_in_numbers
from discmech.integrators.numbers import arithmetic
from discmech.reference import ReferenceFailure

from ..core.case import Case
from ..core.outcome import named
from ..evidence.rows import errors_of_no_step
from .first_terms import factor_of, parts_of
from .one_step import all_by, said_of

#: largest difference of factors that count as one: a part of the field at a row's start stands for
#: its mean over the row, from which it differs by half its change there; rows that end a tenth of
#: the motion's length later make it a twentieth. Longer rows have no factor by this: it errs
#: towards no cause
SAME = 0.05
FEWEST = 4  # rows


def of_rows(case: Case) -> dict[str, Any] | None:
    """Return {"cause", "sentence", "evidence"} if one factor explains what does not sink with h."""
    scheme: Any = case.scheme
    try:
        columns = None if scheme.arrows is not None else errors_of_no_step(scheme)
    except ReferenceFailure:
        return None
    if columns is None or len(columns[0]) < FEWEST:
        return None
    times, states, errors = columns
    system = scene_in_numbers(scheme.s, scheme.scene, arithmetic(16))
    n = system.n
    terms = [parts_of(system, z, t) for z, t in zip(states, times, strict=True)]
    parts = {name: np.array([term[name] for term in terms]) for name in terms[0]}
    fields = np.array([np.concatenate(system.f(z[:n], z[n:], t))
                       for z, t in zip(states, times, strict=True)])  # fmt: skip
    span = np.concatenate([np.full(part.shape[1], np.abs(part).max(initial=0.0) or 1.0)
                           for part in (fields[:, :n], fields[:, n:])])  # fmt: skip
    for name, part in {"every step": fields, **parts}.items():
        c = factor_of((errors / span).ravel(), (part / span).ravel(), SAME, 0.0)
        if c is not None:
            c = float(f"{c:.2g}")  # by `SAME` no more digits are known
            cause, sentence = all_by(1 + c) if name == "every step" else said_of(name, 1 + c)
            return named(cause, sentence, {"factor": 1 + c, "rows": len(times)})
    return None
