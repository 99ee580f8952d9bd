"""The cause by the second term of a step's error, e₂ in D(h) = e₁h + e₂h² + …, where e₁ is 0."""

from __future__ import annotations

import numpy as np

from ..core.case import Case
from ..evidence import NEAR, evidence_of
from .first_terms import Beginning, Told, factor, only

#: a coefficient of a low power of h below this share of the Taylor remainder comes from rounded
#: coefficients: wrong ones leave a twentieth of it, or more
FEW = 1e-2


def of_second(
    case: Case, starts: list[Beginning], n: int, finest: float | None = None
) -> Told | None:
    """Return the cause by e₂ as a part of z̈/2: values at a step's start, or half a step off."""
    wanted = case.order
    if wanted is None or wanted < 2:
        return None
    if _small(starts):
        if wanted > 2 and (share := _rounded_share(case, starts, finest)):
            return "few digits", (
                f"the error of a step begins with a low power of h, by {share:.1e} of what is "
                "usual for it: coefficients that should cancel it have too few digits."
            )
        return None if wanted == 2 or not _is_low(case, finest) else (
            "order conditions",
            f"the error of a step begins later than with h², and earlier than with h^{wanted + 1}: "
            "look at the coefficients, their signs, and the order of substeps.",
        )  # fmt: skip
    if starts[0].of_time.any():
        c = factor(starts, lambda b: b.second_error, lambda b: b.of_time)
        if c is not None and abs(c + 0.5) < 1e-2:
            return "time frozen", (
                "the time stands still within a step: stages ask for the field at the step's start."
            )
    blocks: list[float | None] = []
    for part in (slice(0, n), slice(n, None)):
        if not len(starts[0].z[part]):
            blocks.append(None)
            continue
        got = factor(starts, lambda b, s=part: only(b.second_error, s),
                      lambda b, s=part: only(b.second, s))  # fmt: skip
        quiet = all(bool((np.abs(b.second_error[part]) <= 1e-4 * np.abs(b.second[part]).max(
            initial=1e-300)).all()) for b in starts)  # fmt: skip
        blocks.append(0.0 if quiet else got)
    a, b = blocks
    if a is not None and b is not None and abs(a + b) < 1e-2 and abs(abs(a) - 0.5) < 1e-2:
        when = "late" if a > 0 else "early"
        return "stored half step", (
            f"it is a leapfrog whose momentum is half a step {when}: the momentum that is given is "
            "that of another time than x; begin and end with half a kick."
        )
    for own, other, what in ((b, a, "the force"), (a, b, "the velocity")):
        if own is not None and abs(own + 0.5) < 1e-2 and (other is None or abs(other) < 1e-2):
            return "stale " + what.removeprefix("the "), (
                f"{what} of the step's start is used for all of the step: ask for it again."
            )
    if a is not None and b is not None and abs(a - b) < 1e-2 and abs(a) > 1e-3:
        if abs(abs(a) - 0.5) < 1e-2:  # with velocities or a chart no step of `known_steps`
            end = "end (implicit Euler)" if a > 0 else "start (explicit Euler)"
            return "first order", f"it is a step along the field at its {end}."
        said = _of_square("x and mu", a).removesuffix(".")
        return "order conditions", f"{said}: look at the shares of its stages, which make it."
    for own, other, what in ((a, b, "x"), (b, a, "mu")):
        if own is None or abs(own) < 1e-2 or not (other is None or abs(other) < 1e-2):
            continue
        if abs(own + 1) < 1e-2:
            return "flipped sign", f"the term with h² of {what} has its sign flipped."
        return "factor", _of_square(what, own)
    order = evidence_of(case.scheme).order.order
    if order is not None and order < 1 - NEAR:
        return None  # the limit is another field, by less than can be seen here
    return "order conditions", (
        "the limit is the vector field, but the error of a step begins with h²: the conditions of "
        "order 2 are not met; look at the signs and shares of its terms, and the order of substeps."
    )


def _is_low(case: Case, finest: float | None) -> bool:
    """Return True if single steps, or else the finest runs, have a lower order than claimed."""
    order, wanted = evidence_of(case.scheme).order.order, case.order or 1
    if order is not None:
        return order < wanted - NEAR
    return finest is not None and finest < wanted - 0.5


def _of_square(what: str, share: float) -> str:
    """Return a phrase for an error that is this share of z̈ h²."""
    return f"the term with h² of {what} comes {1 + 2 * share:.4g} times in the step."


def _rounded_share(case: Case, starts: list[Beginning], finest: float | None) -> float | None:
    """Return the relative size of an error that begins with h² or h³ by rounding, or None.

    None also means that it does not begin so, or with the usual size. If single steps show no
    order, finest, the runs' own order, is used.
    """
    order = evidence_of(case.scheme).order.order
    if order is None:
        order = finest
    if order is None or not order < 3 - NEAR:
        return None
    low = order < 2 - NEAR
    pairs = [
        (b.second_error, b.second / 2) if low else (b.third_error, b.third / 6) for b in starts
    ]
    share = max(float(np.abs(e).max() / max(np.abs(d).max(), 1e-300)) for e, d in pairs)
    return share if share < FEW else None


def _small(starts: list[Beginning]) -> bool:
    """Return True if e₂ is negligible beside the second derivative of the motion."""
    return all(
        bool((np.abs(b.second_error) <= 1e-3 * max(np.abs(b.second).max(), 1e-300)).all())
        for b in starts
    )
