"""The first integrals that a scene declares, held against its motion from states that nobody chose.

One that the scene's own motion alone keeps, as on a symmetry plane, is none. No rule is asked to
keep it, so that nothing else would show this.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators import BadInput
from discmech.integrators.errors import DiscmechError
from discmech.integrators.scene import Opaque, reads
from discmech.reference import ReferenceFailure, many_motions

from ..systems.runs import with_terms
from .cloud import Cloud
from .laws import ROUNDINGS
from .places import places_of, sizes_of_motion

BESIDE = 12  # places beside the motion: they lie on constraints and on declared values
ROUNDING = 2.0**-53


@dataclass(frozen=True)
class _OfScene:
    """What a scene reads, and a scheme on it to draw states by: the answer is that of any rule."""

    read: str
    scheme: Any = field(compare=False)


def check_first_integrals(scheme: Any) -> None:
    """Raise `BadInput`, with a state and the rate there, for a first integral that is none.

    Those of the attitude, or of the step, are not asked, nor those of a scene without equations.
    """
    scene = getattr(scheme, "scene", None)  # a lattice has none
    if scene is None or not _asked(scene):
        return
    try:
        said = _said(_OfScene(reads(scene), scheme))
    except Opaque:
        said = _said.__wrapped__(_OfScene("", scheme))
    if said:
        raise BadInput(f"{scene.name}: {said}")


def _asked(scene: Any) -> list[Any]:
    return [q for q in scene.symmetries if getattr(q, "kind", "") == "first integral"
            and not (q.attitude or q.of_step)]  # fmt: skip


@lru_cache(maxsize=16)
def _said(of: _OfScene) -> str:
    if (motions := _motions(of.scheme)) is None:
        return ""
    told = (_broken(of.scheme, quantity, *motions) for quantity in _asked(of.scheme.scene))
    return next(filter(None, told), "")


def _motions(scheme: Any) -> tuple[Cloud, Any] | None:
    """Return places on the motion and beside it, and where it leads from there in a step."""
    scene = scheme.scene
    seed = hashlib.sha256(repr((scene.name, scene.x0, scene.mu0, scene.step)).encode()).digest()
    try:
        by = sizes_of_motion(scene)
        places = places_of(scheme, int.from_bytes(seed[:4]), BESIDE)
        z, v, t = (np.array([[float(e) for e in part] for part in parts]) for parts in zip(
            *[((*p.x, *p.mu), p.u, (p.t,)) for p in places], strict=True))  # fmt: skip
        v, spans = v[:, : len(by) - scheme.s.n], np.full(len(z), float(scene.step))
        ends = many_motions(scene).after(z[:, : scheme.s.n], v, t[:, 0], spans, by)
    except (ReferenceFailure, DiscmechError):
        return None
    return Cloud(scheme, z, v, t[:, 0], spans, spans > 0), ends


def _broken(scheme: Any, quantity: Any, cloud: Cloud, ends: Any) -> str:
    """Return where the motion does not keep a quantity; "" where it does from all states.

    A change counts beyond the round-off of the quantity's terms, and what the error of each entry
    of the motion's end, and its rounding, change the quantity by.
    """
    rows_of = with_terms(scheme, scheme.s.conserved(quantity), 16)
    end = np.hstack([ends.x, ends.mu])
    with np.errstate(all="ignore"):
        (before, terms), (after, later) = (rows_of(cloud.rows(z)) for z in (cloud.z, end))
        sizes = np.maximum(terms, later).max(axis=1)
        sizes = np.maximum(sizes, np.nanmedian(sizes))
        unsure = ends.error + ROUNDING * cloud.scale
        moved = sum(np.maximum(*(np.abs(rows_of(cloud.rows(end + way))[0] - after)
                                 for way in (-one, one))).max(axis=1)
                    for one in unsure.T[:, :, None] * np.eye(unsure.shape[1])[:, None])  # fmt: skip
        known = sizes * (ROUNDING + (ends.error / cloud.scale).max(axis=1)) + moved
        gaps = np.nan_to_num(np.abs(after - before).max(axis=1) / (ROUNDINGS * known))
    k = int(np.argmax(gaps))
    if gaps[k] <= 1:
        return ""
    i = int(np.argmax(np.abs((after - before)[k])))
    rate = (after - before)[k, i] / float(scheme.scene.step)
    return (
        f"{quantity.name} is declared a first integral, but the motion from {cloud.place(k)} "
        f"changes it by {rate:.3g} per unit of time, and there it is {before[k, i]:.3g}; "
        "declare what the motion keeps from every start, or leave it out."
    )
