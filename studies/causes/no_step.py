"""The cause of a step that moves the state also as h goes to 0, where it has to leave it."""

from __future__ import annotations

import numpy as np

from .first_terms import SEEN, Beginning, Told, factor, only

#: how far a part of a step may be from the part of the field at the step's start. The shortest step
#: is 1/512 of the time in which the motion is a short polynomial, and a second half is of a place
#: that is off by that share of the way, ten times over where the first half lacked its h: 1/50. It
#: stays far below the 1/2 that tells a half from a whole, and errs towards no name of the part.
SHARE = 0.05


def of_no_step(starts: list[Beginning], n: int) -> Told:
    """Return the cause of a step that moves the state by what does not sink with h."""
    return _exchanged(starts, n) or _without_h(starts, n) or (
        "no step",
        "a step moves the state also as h goes to 0, where it has to leave it as it is: look for a "
        "factor h that is missing, or for one too many of the state.",
    )  # fmt: skip


def _exchanged(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if a step is the same for every h, or gives p where q belongs."""
    if all(np.abs(a - e).max() <= SEEN * np.abs(e).max() for a, e in (b.moved for b in starts)):
        return "no step", (
            "a step moves the state by the same for every h: h is not used, or a step size of its "
            'own is; a map of one step size says so by @black_box(step="0.1").'
        )
    for name, sentence in _GIVEN.items():
        for k in range(2 if name in starts[0].misread else 0):
            ends = [(b, b.misread[name][k]) for b in starts]
            if all(np.abs(b.z + b.moved[1] - e).max() <= 0.1 * np.abs(b.z - e).max()
                   for b, e in ends):  # fmt: skip  # a short step moves the state by less
                return name, sentence
    return None


#: of what a step takes and what it gives, one is read in another way than the other
_GIVEN = {
    "q and p exchanged": "it gives (p, q) where (q, p) is asked for: exchange the two.",
    "velocities for momenta": "of what a step takes and gives one is a momentum and the other a "
    "velocity: both have to be momenta, or both velocities, as state= says.",
    "attitude transposed": "the attitude that a step gives is the transpose of the one that it "
    "takes: both have to lead from the body to space.",
    "momentum in space": "of the momenta that a step takes and gives one is in the body and the "
    "other in space: both have to be in the body.",
    "velocity in space": "of the angular velocities that a step takes and gives one is in the body "
    "and the other in space: both have to be in the body.",
    "quaternion with w last": "the quaternions that a step takes and gives have another order, "
    "(w, x, y, z) and (x, y, z, w): both have to be (w, x, y, z).",
}
_GIVEN["momenta for velocities"] = _GIVEN["velocities for momenta"]


def _without_h(starts: list[Beginning], n: int) -> Told | None:
    """Return the cause if one part of a step, or a half of it, moves the state without its h.

    A second half is of a place that the step has moved (see `SHARE`).
    """
    parts = (("the gradient of the potential", "kick", slice(n, None)),
             ("the motion of x", "drift", slice(0, n)))  # fmt: skip
    for name, word, part in parts:
        if not all(name in b.parts for b in starts):
            continue
        c = factor(starts, lambda b, s=part: only(b.moved[1], s),
                    lambda b, k=name, s=part: only(b.parts[k], s), same=SHARE)  # fmt: skip
        if c is not None and min(abs(c - 1), abs(c - 0.5)) < SHARE:
            of = "" if abs(c - 1) < SHARE else "a half of "
            return "no step", (
                f"h is missing in {of}the {word}: as h goes to 0 a step still moves "
                f"{'the momentum' if word == 'kick' else 'x'} by {c:.3g} of {name}, where it has "
                "to be h times that."
            )
    return None
