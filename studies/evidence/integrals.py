"""The first integrals that a scene declares, held against its motion from states that nobody chose.

One that the scene's own motion alone keeps, as on a symmetry plane, is none. No rule is asked to
keep it, so that nothing else would show this.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import BadInput
from discmech.reference import ReferenceFailure, many_motions

from ..systems.runs import with_terms
from .cloud import Cloud
from .laws import ROUNDINGS
from .places import places_of, seed_in_numbers, sizes_of_motion

BESIDE = 12  # places beside the motion: they lie on constraints and on declared values
ROUNDING = 2.0**-53


def check_first_integrals(scheme: Any) -> None:
    """Raise `BadInput`, with a state and the rate there, for a first integral that is none.

    Those of the attitude, or of the step, are not asked, nor those of a scene without equations.
    """
    for quantity in getattr(getattr(scheme, "scene", None), "symmetries", ()):  # a lattice has none
        first = getattr(quantity, "kind", "") == "first integral"
        asked = first and not (quantity.attitude or quantity.of_step)
        if asked and (said := _broken(scheme, quantity)):
            raise BadInput(f"{scheme.scene.name}: {said}")


@lru_cache(maxsize=8)
def _motions(scheme: Any) -> tuple[Cloud, Any] | None:
    """Return places on the motion and beside it, and where it leads from there in a step."""
    scene = scheme.scene
    try:
        by = sizes_of_motion(scene)
        places = places_of(scheme, seed_in_numbers(scheme), BESIDE)
        z, v, t = (np.array([[float(e) for e in part] for part in parts]) for parts in zip(
            *[((*p.x, *p.mu), p.u, (p.t,)) for p in places], strict=True))  # fmt: skip
        v, spans = v[:, : len(by) - scheme.s.n], np.full(len(z), float(scene.step))
        ends = many_motions(scene).after(z[:, : scheme.s.n], v, t[:, 0], spans, by)
    except ReferenceFailure:
        return None
    return Cloud(scheme, z, v, t[:, 0], spans, spans > 0), ends


def _broken(scheme: Any, quantity: Any) -> str:
    """Return where the motion does not keep a quantity; "" where it does from all states.

    A change counts beyond the round-off of the quantity's terms, and of the motion's end.
    """
    if (motions := _motions(scheme)) is None:
        return ""
    cloud, ends = motions
    rows_of = with_terms(scheme, scheme.s.conserved(quantity), 16)
    with np.errstate(all="ignore"):
        (before, terms), (after, later) = (
            rows_of(cloud.rows(z)) for z in (cloud.z, np.hstack([ends.x, ends.mu]))
        )
        sizes = np.maximum(terms, later).max(axis=1)
        changes = (after - before) / np.maximum(sizes, np.nanmedian(sizes))[:, None]
        known = ROUNDINGS * (ROUNDING + (ends.error / cloud.scale).max(axis=1))
        gaps = np.nan_to_num(np.abs(changes).max(axis=1) / known)
    k = int(np.argmax(gaps))
    if gaps[k] <= 1:
        return ""
    i = int(np.argmax(np.abs(changes[k])))
    rate = (after - before)[k, i] / float(scheme.scene.step)
    return (
        f"{quantity.name} is declared a first integral, but the motion from {cloud.place(k)} "
        f"changes it by {rate:.3g} per unit of time, and there it is {before[k, i]:.3g}; "
        "declare what the motion keeps from every start, or leave it out."
    )
