"""The cause of recorded rows that follow another motion: whole turns, or a part of the field comes
c times.
"""

from __future__ import annotations

import math
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
from .turns import WHOLE, of_turns

#: largest difference of factors that count as one: a part of the field at a row's start stands for
#: its mean over the row, from which it differs by half its change there; rows that end a tenth of
#: the motion's length later make it a twentieth. Longer rows have no factor by this: it errs
#: towards no cause
SAME = 0.05
FEWEST = 4  # rows


def of_rows(case: Case) -> dict[str, Any] | None:
    """Return {"cause", "sentence", "evidence"} if rows jump by whole turns, or one factor explains
    what does not sink with h."""
    scheme: Any = case.scheme
    if scheme.arrows is not None:
        return None
    system = scene_in_numbers(scheme.s, scheme.scene, arithmetic(16))
    if (turned := _turns(scheme.runs[-1], system)) is not None:
        return turned
    try:
        columns = errors_of_no_step(scheme)
    except ReferenceFailure:
        return None
    if columns is None or len(columns[0]) < FEWEST:
        return None
    times, states, errors = columns
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


def _turns(run: Any, system: Any) -> dict[str, Any] | None:
    """Return the cause if coordinates of rows jump by whole turns and nothing else.

    The mean of both velocities is the way of a row but for its third power of the step.
    """
    t, x, mu = (np.asarray(each, dtype=float) for each in (run.t, run.x, run.mu))
    v = np.array([system.velocity(q, p, at) for q, p, at in zip(x, mu, t, strict=True)])
    if v.shape != x.shape:  # x is an attitude
        return None
    turns = (np.diff(x, axis=0) - np.diff(t)[:, None] * (v[1:] + v[:-1]) / 2) / (2 * math.pi)
    jumps = np.argwhere(np.round(turns))
    if not len(jumps) or np.abs(turns - np.round(turns)).max() > WHOLE:
        return None
    row = int(jumps[0, 0]) + 1
    told = of_turns(sorted(set(jumps[:, 1].tolist())), f", first at t = {t[row]:.4g},")
    return named(*told, {"row": row, "rows": len(jumps)})
